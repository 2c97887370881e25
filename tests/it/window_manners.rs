//! What the window does beside what it is asked for: what it tells, how long, and what it leaves out.

use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use posescope::app::{ACTIONS, App};
use posescope::geometry::Pose;

use crate::window::{app, is_said, press, run_until_idle, send, setup, wait, window};

/// On most keyboards a question mark is a key with Shift and a text at once.
#[test]
fn the_list_of_keys_opens_with_a_question_mark_and_closes_with_escape() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    let is_open = |window: &Harness<'_, App>| is_said(window, "Run or pause");
    assert!(!is_open(&window));
    window.event(egui::Event::Key {
        key: Key::Questionmark,
        physical_key: Some(Key::Slash),
        pressed: true,
        repeat: false,
        modifiers: Modifiers::SHIFT,
    });
    window.event(egui::Event::Text("?".to_owned()));
    window.run_steps(4);
    assert!(is_open(&window));
    press(&mut window, Modifiers::NONE, Key::Escape);
    window.run_steps(4);
    assert!(!is_open(&window));
}

/// All keys of the window are seen at once where it is as high as it is first.
#[test]
fn the_list_of_keys_is_seen_whole() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    window.state_mut().act("All keys");
    window.run_steps(4);
    let seen = window.ctx.content_rect();
    for shortcut in ACTIONS.iter().filter(|action| !action.keys.is_empty()) {
        let words = window.query_all_by_label_contains(shortcut.text);
        let rects: Vec<_> = words.map(|node| node.rect()).collect();
        assert!(!rects.is_empty(), "{}", shortcut.text);
        assert!(
            rects.iter().any(|rect| seen.contains_rect(*rect)),
            "{} at {rects:?}",
            shortcut.text
        );
    }
}

#[test]
fn a_menu_closes_with_escape_and_the_camera_stays() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    let pose = Pose::identity();
    send(&mut window, |app| {
        app.app_state_mut().camera = Some(pose);
    });
    window.get_by_label("Menu").click();
    window.run_steps(2);
    assert!(is_said(&window, "Window and files"));
    press(&mut window, Modifiers::NONE, Key::Escape);
    window.run_steps(2);
    assert!(!is_said(&window, "Window and files"));
    assert_eq!(app(&window).camera, Some(pose));
    press(&mut window, Modifiers::NONE, Key::Escape);
    window.run_steps(2);
    assert_eq!(app(&window).camera, None);
}

#[test]
fn what_is_told_goes_by_itself_and_what_went_wrong_stays() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    press(&mut window, Modifiers::NONE, Key::Num3);
    window.run_steps(3);
    assert!(is_said(&window, "MI has not begun yet"));
    // The bar does not say that anything works while the run is paused.
    assert!(!is_said(&window, "at work"));
    window.state_mut().app_state_mut().set_breakpoints(vec!["nonsense".to_owned()]);
    // A step is a quarter of a second.
    window.run_steps(60);
    assert!(!is_said(&window, "MI has not begun yet"));
    let notes = &app(&window).notes;
    assert!(notes.len() == 1 && notes[0].is_error);
}

/// A reference that was named for one query is one of all queries too.
#[test]
fn no_query_of_all_is_localised_against_itself() {
    let mut setup = setup();
    setup.offered = vec![0, 1];
    let reference = setup.chosen.frames[0];
    assert_eq!(reference, 0);
    let mut window = window(setup);
    run_until_idle(&mut window);
    window.state_mut().act("Run all queries, or stop");
    wait(&mut window, |app| {
        app.app_state().queries.progress().is_none() && !app.app_state().results.is_empty()
    });
    let results = &app(&window).results;
    assert!(!results.contains_key(&reference), "{:?}", results.keys());
    assert!(is_said(&window, "no reference is chosen for query 000000"));
}

#[test]
fn any_action_is_found_by_its_words_and_done_with_enter() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    press(&mut window, Modifiers::COMMAND, Key::K);
    window.run_steps(3);
    window.get_by_label("Search for an action").type_text("ground truth");
    window.run_steps(3);
    press(&mut window, Modifiers::NONE, Key::Enter);
    window.run_steps(3);
    assert!(!app(&window).options.shows_truth);
    assert!(!is_said(&window, "Search for an action"));
}
