//! The storyboard and the canvas that follows it: stages by keys, proofs by clicks, and what hides with the truth.

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use posescope::app::App;
use posescope::method::Method;
use posescope::session::{Part, Span};

use crate::walls_scene::GREY;
use crate::window::{app, finish, finished, is_said, press, send, setup, setup_at, wait};

const MI: Part = Part::Reference(Method::MI, 0);

fn grey() -> Harness<'static, App> {
    finished(setup_at(GREY))
}

/// The last records of the stages right below a part of the run.
fn ends(window: &Harness<'_, App>, part: Part) -> Vec<usize> {
    let run = app(window).run();
    let span: &Span = run.span_of(part).expect("the method ran");
    let stages = run.stages().iter();
    let stages = stages.filter(|bar| bar.depth == 2 && span.records.contains(&bar.records.start));
    let mut ends: Vec<usize> = stages.map(|bar| bar.records.end - 1).collect();
    // What a method reports after its last stage belongs to that.
    *ends.last_mut().expect("a stage") = span.records.end - 1;
    ends
}

#[test]
fn the_arrows_go_from_stage_to_stage_and_from_the_last_to_the_cause() {
    let mut window = grey();
    send(&mut window, |app| app.app_state_mut().show_outcome(MI));
    let ends = ends(&window, MI);
    assert!(ends.len() > 1, "{ends:?}");
    assert!(app(&window).options.shows_why);
    for end in ends.iter().rev() {
        press(&mut window, Modifiers::NONE, Key::ArrowUp);
        assert_eq!(app(&window).cursor(), *end);
        assert!(!app(&window).options.shows_why);
    }
    for end in &ends[1..] {
        press(&mut window, Modifiers::NONE, Key::ArrowDown);
        assert_eq!(app(&window).cursor(), *end);
    }
    press(&mut window, Modifiers::NONE, Key::ArrowDown);
    assert!(app(&window).options.shows_why, "the cause comes last");
}

#[test]
fn a_lecture_shows_no_cause_and_inspect_shows_it_again() {
    let mut window = grey();
    send(&mut window, |app| app.app_state_mut().show_outcome(Part::Reference(Method::FB, 0)));
    assert!(is_said(&window, "0 and 146 keypoints"));
    press(&mut window, Modifiers::NONE, Key::F3);
    assert!(!app(&window).options.shows_why);
    assert!(is_said(&window, "The query has no keypoints"));
    press(&mut window, Modifiers::NONE, Key::F2);
    assert!(app(&window).options.shows_why);
    // At another step there is no cause to come back to.
    send(&mut window, |app| app.app_state_mut().move_cursor(1));
    press(&mut window, Modifiers::NONE, Key::F3);
    press(&mut window, Modifiers::NONE, Key::F2);
    assert!(!app(&window).options.shows_why);
}

#[test]
fn a_click_on_the_words_of_another_finding_opens_it() {
    let mut setup = setup();
    setup.task.params.assign("surf.max_keypoints=5").expect("a parameter");
    let mut window = finished(setup);
    let fb = Part::Reference(Method::FB, 0);
    send(&mut window, move |app| app.app_state_mut().show_outcome(fb));
    let run = app(&window).run();
    let result = run.span_of(fb).and_then(|span| span.result.clone()).expect("FB ran");
    let [_, other, ..] = result.diagnosis.as_slice() else {
        panic!("one finding: {:?}", result.diagnosis);
    };
    assert!(!is_said(&window, &other.text));
    let title = other.code.title();
    let title = format!("{}{}", title[..1].to_uppercase(), &title[1..]);
    window.get_by_label(&title).click();
    window.run_steps(10);
    assert!(is_said(&window, &other.text));
}

#[test]
fn remedies_are_tried_beside_the_picture_of_the_cause() {
    let mut window = grey();
    let part = Part::Reference(Method::PM, 0);
    send(&mut window, |app| app.app_state_mut().show_outcome(part));
    assert!(app(&window).options.shows_why);
    send(&mut window, |app| app.act("Try what would have helped"));
    finish(&mut window);
    let state = app(&window);
    assert!(state.options.shows_why);
    let here = state.run().span_at(state.cursor()).map(|span| span.part);
    assert_eq!(here, Some(part));
    // Nothing helps a photo without texture: the advice stays, and nothing speaks against the cause.
    assert!(is_said(&window, "What may help"));
    assert!(!is_said(&window, "The data may be wrong"));
}

#[test]
fn changed_settings_stand_below_the_cause_with_their_defaults() {
    let mut changed = setup_at(GREY);
    changed.task.params.assign("pm.sigma=2").expect("a value");
    let window = finished(changed);
    for words in ["--radius 3 (default 15)", "pm.sigma=2 (default "] {
        assert!(is_said(&window, words), "{words}");
    }
}

#[test]
fn a_fused_pose_answers_for_its_references() {
    let mut fusing = setup_at(GREY);
    fusing.chosen = vec![0, 2].into();
    fusing.task.protocol.fusions = vec!["avg".parse().expect("a fusion")];
    let window = finished(fusing);
    let state = app(&window);
    let here = state.run().span_at(state.cursor()).map(|span| span.part);
    assert!(matches!(here, Some(Part::Fusion(_))), "{here:?}");
    assert!(state.options.shows_why);
}

#[test]
fn a_stage_is_shown_by_a_click_and_has_a_small_picture() {
    let mut window = finished(setup());
    wait(&mut window, |app| !app.app_state().is_working_out());
    window.run_steps(2);
    let stage = window.get_by_label_contains("MI coarse: coarse 0.");
    let cell = stage.rect();
    let is_picture = |clipped: &egui::epaint::ClippedShape| {
        let shape = &clipped.shape;
        let is_image = shape.texture_id() != egui::TextureId::default();
        is_image && cell.expand(1.0).contains_rect(shape.visual_bounding_rect())
    };
    let shapes = &window.output().shapes;
    assert!(shapes.iter().any(is_picture), "no picture in {cell:?}");
    stage.click();
    window.run_steps(3);
    let state = app(&window);
    let span = state.run().span_at(state.cursor()).expect("a part");
    assert_eq!(span.part, MI);
    assert!(is_said(&window, "Cost map"));
    press(&mut window, Modifiers::NONE, Key::V);
    window.run_steps(3);
    assert!(is_said(&window, "3-D view of"));
    press(&mut window, Modifiers::NONE, Key::V);
    window.run_steps(3);
    assert!(!is_said(&window, "3-D view of"));
}

#[test]
fn a_click_on_a_small_picture_of_a_proof_makes_it_large() {
    let mut window = grey();
    send(&mut window, |app| app.app_state_mut().show_outcome(MI));
    wait(&mut window, |app| !app.app_state().is_working_out());
    window.run_steps(2);
    let canvas = window.state().canvas();
    let pictures = |window: &Harness<'_, App>| -> Vec<(egui::Rect, String)> {
        let nodes = window.query_all_by_role(Role::Image);
        let nodes =
            nodes.map(|node| (node.rect(), node.accesskit_node().label().unwrap_or_default()));
        nodes.filter(|(rect, _)| canvas.contains_rect(*rect)).collect()
    };
    let before = pictures(&window);
    let (small, title) = before.last().expect("a small picture").clone();
    let first = before[0].1.clone();
    assert_ne!(first, title);
    window.get_by_role_and_label(Role::Image, &title).click();
    window.run_steps(3);
    let after = pictures(&window);
    assert_eq!(after[0].1, title);
    assert!(after[0].0.area() > small.area());
    assert!(after.iter().any(|(_, title)| *title == first));
}

#[test]
fn without_the_truth_the_last_picture_is_what_decided() {
    let mut window = finished(setup());
    assert!(!is_said(&window, "MI why: "), "a right pose needs no reason");
    assert!(is_said(&window, "MI: ● right"));
    press(&mut window, Modifiers::NONE, Key::G);
    window.run_steps(3);
    assert!(is_said(&window, "MI why: what decided"));
    for grade in ["● right", "▲ wrong"] {
        assert!(!is_said(&window, grade), "{grade}");
    }
    assert!(is_said(&window, "likely right"), "the confidence stands for the grade");
}
