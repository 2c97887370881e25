//! What every view looks like: pictures of each at several moments of one run, in both themes.
//!
//! After a change that is meant, `UPDATE_SNAPSHOTS=1 cargo test looks` writes them anew.

use egui_kittest::{Harness, SnapshotOptions, SnapshotResults};
use posescope::app::{App, Command, Setup, views};
use posescope::event::Method;
use posescope::session::{RunMode, State};

use crate::window::{has_adapter, settle, setup, wait};

/// A window that is painted, or `None` where there is nothing to paint with.
fn painted(setup: Setup) -> Option<Harness<'static, App>> {
    if !has_adapter() {
        return None;
    }
    Some(
        Harness::builder()
            .with_size([760.0, 520.0])
            .wgpu()
            .build_eframe(|creation| App::new(creation, setup)),
    )
}

#[test]
fn every_view_looks_as_it_did() {
    let Some(mut window) = painted(setup()) else {
        return;
    };
    settle(&mut window);
    // Glyph edges and points differ by little from one rasterizer to the next.
    let options = SnapshotOptions::new().threshold(2.0).max_failed_pixels(900);
    let mut results = SnapshotResults::new();
    let mut shoot = |window: &mut Harness<'_, App>, moment: &str, of: &[&str]| {
        let is_wanted = |entry: &&views::Entry| of.is_empty() || of.contains(&entry.name);
        for entry in views::ALL.iter().filter(is_wanted) {
            window.state_mut().send(Command::Maximize(Some(entry.name)));
            // What is in sight asks for its thumbnails.
            window.run_steps(2);
            wait(window, |app| {
                !app.desk().is_probing() && !app.desk().queries.is_painting()
            });
            window.run_steps(4);
            let name = format!("{}-{moment}", entry.name);
            results.add(window.try_snapshot_options(name, &options));
        }
    };
    shoot(&mut window, "waiting", &[]);
    window.state_mut().send(Command::Run);
    wait(&mut window, |app| *app.desk().state() == State::Finished);
    window
        .state_mut()
        .send(Command::SelectMethod(Method::Feature));
    shoot(&mut window, "features", &[]);
    window
        .state_mut()
        .send(Command::SelectMethod(Method::MutualInformation));
    shoot(&mut window, "search", &[]);
    window.state_mut().send(Command::SwitchTheme);
    shoot(&mut window, "light", &[]);
    window.state_mut().send(Command::SetReferences(vec![0, 2]));
    let all = posescope::fusion::ALL.iter().collect();
    window.state_mut().send(Command::SetFusions(all));
    window.run_steps(2);
    wait(&mut window, |app| *app.desk().state() == State::Finished);
    window.state_mut().send(Command::Last);
    shoot(
        &mut window,
        "fused",
        &["references", "fusion", "report", "space"],
    );
    results.unwrap();
}

/// Without a run there is something to say too.
#[test]
fn every_view_bears_a_run_that_never_began() {
    let mut broken = setup();
    broken.chosen = vec![1].into();
    broken.mode = RunMode::Running;
    let mut window = crate::window::window(broken);
    settle(&mut window);
    for entry in views::ALL {
        window.state_mut().send(Command::Maximize(Some(entry.name)));
        window.run_steps(3);
    }
    assert!(window.state().desk().run().is_empty());
}
