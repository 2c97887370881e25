//! The 3-D view, driven through its accessibility tree and, where there is a graphics adapter, looked
//! at through its pixels.

use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use posescope::app::{App, Setup, ViewName};
use posescope::method::Method;
use posescope::session::{Part, RunMode};

use crate::painted::{PaintedWindow, painted};
use crate::window::{app, finished, run_until_idle, send, setup};

/// A window after its run, with the view in front.
fn after(setup: Setup) -> Harness<'static, App> {
    let mut window = finished(setup);
    send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Space)));
    window
}

/// The words of the picture.
fn headline(window: &Harness<'_, App>) -> String {
    label(window, "3-D view of")
}

fn label(window: &Harness<'_, App>, part: &str) -> String {
    let node = window.get_by_label_contains(part);
    node.accesskit_node().label().unwrap_or_default()
}

fn click(window: &mut Harness<'_, App>, name: &str) {
    window.get_by_label(name).click();
    window.run_steps(2);
}

fn drag(window: &mut Harness<'_, App>, from: egui::Pos2, by: egui::Vec2, held: egui::Modifiers) {
    let button = |pos, pressed| egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Primary,
        pressed,
        modifiers: held,
    };
    window.event(egui::Event::ModifiersChanged(held));
    window.hover_at(from);
    window.step();
    window.event(button(from, true));
    window.step();
    for share in [0.3, 0.6, 1.0] {
        window.hover_at(from + share * by);
        window.step();
    }
    window.event(button(from + by, false));
    window.event(egui::Event::ModifiersChanged(egui::Modifiers::NONE));
    window.run_steps(2);
}

#[test]
fn every_moment_of_a_run_is_drawn_and_the_cameras_come_one_by_one() {
    let mut window = after(setup());
    let run = app(&window).run().clone();
    let ends: Vec<usize> = run.spans().iter().map(|span| span.records.end - 1).collect();
    // Every hundredth record, and all around the ends of the estimators.
    let moments =
        (0..run.len()).filter(|at| at % 100 == 0 || ends.iter().any(|end| at.abs_diff(*end) <= 2));
    for cursor in moments {
        send(&mut window, |app| app.app_state_mut().move_cursor(cursor));
        assert!(headline(&window).contains("points"));
    }
    send(&mut window, |app| app.act("To the first step"));
    assert!(window.query_by_label_contains("FB: ").is_none(), "FB has no pose yet");
    send(&mut window, |app| app.app_state_mut().move_cursor(ends[0]));
    assert!(window.query_by_label_contains("FB: ").is_some());
}

#[test]
fn the_best_pose_so_far_is_that_of_the_method_at_the_cursor() {
    let mut setup = setup();
    let fb2: Method = "fb2".parse().expect("registered");
    setup.task.protocol.methods = vec![Method::FB, fb2];
    let mut window = after(setup);
    let part = app(&window).run().span_of(Part::Reference(fb2, 0)).expect("it ran");
    let records = part.records.clone();
    let mut has_best = |cursor| {
        send(&mut window, |app| app.app_state_mut().move_cursor(cursor));
        window.query_by_label_contains("FB2, best so far: ").is_some()
    };
    assert!(!has_best(records.start), "FB2 has tried nothing yet");
    assert!(has_best(records.end - 2));
}

#[test]
fn the_truth_hides_with_its_errors() {
    let mut window = after(setup());
    assert!(label(&window, "FB: ").contains("from the truth"));
    assert!(window.query_by_label_contains("Truth: ").is_some());
    send(&mut window, |app| app.act("Ground truth"));
    assert!(!label(&window, "FB: ").contains("from the truth"));
    assert!(window.query_by_label_contains("Truth: ").is_none());
}

/// Chooses an entry of the view's own menu.
fn choose(window: &mut Harness<'_, App>, name: &str) {
    click(window, "View");
    click(window, name);
    // Beside the menu: it closes.
    let pane = window.get_by_label_contains("3-D view of").rect();
    let corner = pane.left_bottom() + egui::vec2(pane.width() / 2.0, -4.0);
    window.drag_at(corner);
    window.step();
    window.drop_at(corner);
    window.run_steps(2);
}

#[test]
fn one_looks_through_a_camera_and_leaves_it_by_turning() {
    let mut window = after(setup());
    assert!(headline(&window).contains("A square is 0.5 m. Drag: turn"), "{}", headline(&window));
    choose(&mut window, "Through FB");
    assert!(headline(&window).contains("Through FB"));
    let pane = window.get_by_label_contains("3-D view of").rect();
    drag(&mut window, pane.center(), egui::vec2(30.0, 0.0), egui::Modifiers::NONE);
    assert!(headline(&window).contains("Drag: turn"));
    // A click on a label does the same.
    choose(&mut window, "Whole scene");
    window.get_by_label_contains("Truth: ").click();
    window.run_steps(2);
    assert!(headline(&window).contains("Through Truth"));
    send(&mut window, |app| app.act("Ground truth"));
    assert!(headline(&window).contains("Truth has no pose at this step"));
    choose(&mut window, "Whole scene");
    assert!(headline(&window).contains("Drag: turn"));
}

#[test]
fn shifting_takes_the_labels_along() {
    let mut window = after(setup());
    choose(&mut window, "From above");
    let place = |window: &Harness<'_, App>| window.get_by_label_contains("Reference: ").rect().min;
    let before = place(&window);
    let pane = window.get_by_label_contains("3-D view of").rect();
    let by = egui::vec2(25.0, 15.0);
    let corner = pane.min + 0.2 * pane.size();
    drag(&mut window, corner, by, egui::Modifiers::SHIFT);
    let moved = place(&window) - before;
    // The camera is nearer to the eye than the ground that the pointer holds.
    assert!(moved.x >= 20.0 && moved.y >= 12.0 && moved.length() < 60.0, "{moved}");
}

/// The window with its run over, drawn by any adapter there is; `None` without one.
fn drawn() -> Option<PaintedWindow> {
    let setup = Setup { mode: RunMode::Running, ..setup() };
    let mut painted = painted(setup, [1500.0, 950.0])?;
    run_until_idle(&mut painted.window);
    send(&mut painted.window, |app| app.app_state_mut().show_alone(Some(ViewName::Space)));
    Some(painted)
}

/// How many pixels of the 3-D view have nearly a colour.
fn count(window: &mut Harness<'_, App>, [r, g, b]: [u8; 3]) -> usize {
    let picture = window.render().expect("a picture");
    let pane = window.get_by_label_contains("3-D view of").rect();
    let is_near = |pixel: &image::Rgba<u8>| {
        let channels = pixel.0.iter().zip([r, g, b]);
        channels.map(|(a, b)| a.abs_diff(b)).all(|off| off < 12)
    };
    picture
        .enumerate_pixels()
        .filter(|(x, y, pixel)| {
            pane.contains(egui::pos2(*x as f32 + 0.5, *y as f32 + 0.5)) && is_near(pixel)
        })
        .count()
}

#[test]
fn the_truth_is_drawn_and_can_be_taken_away() {
    let Some(mut painted) = drawn() else { return };
    let window = &mut painted.window;
    const TRUTH: [u8; 3] = posescope::palette::TRUTH;
    let with_truth = count(window, TRUTH);
    assert!(with_truth > 50, "{with_truth} pixels of the truth");
    send(window, |app| app.act("Ground truth"));
    let without = count(window, TRUTH);
    assert!(without < with_truth / 2, "{without} of {with_truth}");
}
