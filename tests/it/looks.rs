//! What every view looks like and says at several moments of one run: pictures of those whose point
//! is pixels, in both themes, and the words of the others.
//!
//! After a change that is meant, `UPDATE_SNAPSHOTS=1 INSTA_UPDATE=always cargo test looks` writes
//! them anew.

use egui::accesskit::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::NodeT as _;
use posescope::app::{App, Arrangement, Setup, ViewName, views};
use posescope::method::Method;
use posescope::session::{RunMode, RunState};

use crate::painted::{PaintedWindow, painted};
use crate::walls_scene::GREY;
use crate::window::{app, run_until_idle, send, setup, setup_at, wait};

/// The views whose point is pixels.
const PICTURES: [ViewName; 4] =
    [ViewName::Images, ViewName::Synthetic, ViewName::Space, ViewName::Surface];
/// Room of the window \[points\].
const SIZE: [f32; 2] = [760.0, 520.0];

/// Brings a view before all others and waits until it is complete.
fn show(window: &mut Harness<'_, App>, view: ViewName) {
    window.state_mut().app_state_mut().show_alone(Some(view));
    // What is in sight asks for its thumbnails.
    window.run_steps(2);
    wait(window, |app| !app.app_state().is_working_out());
    window.run_steps(4);
}

/// Goes through the moments of a run, and tells each with the views that have something to say then.
fn at_every_moment(
    window: &mut Harness<'_, App>,
    mut see: impl FnMut(&mut Harness<'_, App>, &str, &[ViewName]),
) {
    run_until_idle(window);
    see(window, "waiting", &[]);
    window.state_mut().act("Run to the next breakpoint");
    wait(window, |app| *app.app_state().run_state() == RunState::Finished);
    window.state_mut().app_state_mut().select_method(Method::FB);
    see(window, "features", &[]);
    window.state_mut().app_state_mut().select_method(Method::MI);
    see(window, "search", &[]);
    window.state_mut().act("Light or dark");
    see(window, "light", &[]);
    window.state_mut().app_state_mut().set_references(vec![0, 2]);
    let all = posescope::fusion::Fusion::all().collect();
    send(window, |app| app.app_state_mut().set_fusions(all));
    wait(window, |app| *app.app_state().run_state() == RunState::Finished);
    window.state_mut().act("To the last step");
    see(window, "fused", &[ViewName::References, ViewName::Fusion, ViewName::Space]);
}

/// The views of a moment that are seen: in pictures or in words.
fn seen(of: &[ViewName], in_pictures: bool) -> impl Iterator<Item = ViewName> {
    let wanted: Vec<ViewName> = ViewName::ALL
        .iter()
        .copied()
        .filter(|name| of.is_empty() || of.contains(name))
        .filter(|name| PICTURES.contains(name) == in_pictures)
        .collect();
    wanted.into_iter()
}

#[test]
fn every_picture_looks_as_it_did() {
    let Some(PaintedWindow { mut window, mut judge }) = painted(setup(), SIZE) else {
        return;
    };
    let mut unlike = Vec::new();
    at_every_moment(&mut window, |window, moment, of| {
        for view in seen(of, true) {
            show(window, view);
            let compared = judge.compare(window, &format!("{}-{moment}", view.word()));
            unlike.extend(compared.err());
        }
    });
    assert!(unlike.is_empty(), "{}", unlike.join("\n"));
}

/// Each layout with the outcome of a run, at every size and in both themes.
#[test]
fn every_layout_looks_as_it_did() {
    const SIZES: [[f32; 2]; 4] =
        [[1000.0, 640.0], [1280.0, 720.0], [1600.0, 1000.0], [2560.0, 1440.0]];
    const LAYOUTS: [(Arrangement, &str); 3] = [
        (Arrangement::Inspect, "inspect"),
        (Arrangement::Lecture, "lecture"),
        (Arrangement::Batch, "batch"),
    ];
    let setup = Setup { mode: RunMode::Running, ..setup_at(GREY) };
    let Some(PaintedWindow { mut window, mut judge }) = painted(setup, SIZES[0]) else {
        return;
    };
    wait(&mut window, |app| {
        let state = app.app_state();
        *state.run_state() == RunState::Finished && !state.is_working_out()
    });
    let mut unlike = Vec::new();
    for theme in ["dark", "light"] {
        for (layout, name) in LAYOUTS {
            send(&mut window, |app| app.arrange(layout));
            for size in SIZES {
                window.set_size(size.into());
                // What the size brings into sight asks for its pictures.
                window.run_steps(3);
                wait(&mut window, |app| !app.app_state().is_working_out());
                window.run_steps(4);
                let name = format!("{name}-{}x{}-{theme}", size[0], size[1]);
                unlike.extend(judge.compare(&mut window, &name).err());
            }
        }
        window.state_mut().act("Light or dark");
    }
    assert!(unlike.is_empty(), "{}", unlike.join("\n"));
}

/// One line for each thing of the maximised view that assistive technology is told of.
fn words(window: &Harness<'_, App>) -> String {
    let mut text = String::new();
    let nodes = window.root().children_recursive();
    let mut nodes = nodes.map(|node| node.accesskit_node());
    // The view comes last, behind the button that leads back to all of them.
    let back = nodes.find(|node| node.label().as_deref() == Some("All panels"));
    assert!(back.is_some(), "no view is alone");
    // A run of text repeats what it is part of.
    for node in nodes.filter(|node| node.role() != Role::TextRun) {
        let words = [node.label(), node.value()];
        let words: Vec<String> = words.into_iter().flatten().filter(|w| !w.is_empty()).collect();
        if words.is_empty() {
            continue;
        }
        text += &format!("{:?}: {}", node.role(), words.join(" = ").replace('\n', " / "));
        if let Some(toggled) = node.toggled() {
            text += &format!(" ({toggled:?})");
        }
        if node.is_selected() == Some(true) {
            text += " (selected)";
        }
        if node.is_disabled() {
            text += " (disabled)";
        }
        text.push('\n');
    }
    text
}

#[test]
fn every_view_says_what_it_said() {
    let mut window =
        Harness::builder().with_size(SIZE).build_eframe(|creation| App::new(creation, setup()));
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../snapshots");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    at_every_moment(&mut window, |window, moment, of| {
        // The theme says nothing.
        if moment == "light" {
            return;
        }
        for view in seen(of, false) {
            show(window, view);
            let said = words(window);
            settings.bind(|| insta::assert_snapshot!(format!("{}-{moment}", view.word()), said));
        }
    });
}

/// Without a run there is something to say too.
#[test]
fn every_view_bears_a_run_that_never_began() {
    let mut broken = setup();
    broken.chosen = vec![1].into();
    broken.mode = RunMode::Running;
    let mut window = crate::window::window(broken);
    run_until_idle(&mut window);
    for entry in views::ALL {
        send(&mut window, |app| app.app_state_mut().show_alone(Some(entry.name)));
    }
    assert!(app(&window).run().is_empty());
}
