//! What the window does beside what it is asked for: what it tells, how long, and what it leaves out.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use posescope::app::{ACTIONS, App, Arrangement, Opener, Tab};
use posescope::event::Event;
use posescope::geometry::Pose;
use posescope::lesson::Lesson;

use crate::window::{app, finished, is_said, press, run_until_idle, send, setup, wait, window};

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
    // After a minute nobody looks for it any more.
    window.run_steps(200);
    assert!(app(&window).notes.is_empty());
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

/// A window that only notes what it is asked to open.
fn noting() -> (Harness<'static, App>, Arc<Mutex<Vec<String>>>) {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let opener: Opener = {
        let asked = Arc::clone(&asked);
        Arc::new(move |name: &str| {
            asked.lock().expect("no panic").push(name.to_owned());
            Err("nothing is opened here".to_owned())
        })
    };
    let mut window = Harness::builder()
        .with_size([1500.0, 950.0])
        .build_eframe(|creation| App::new(creation, setup()).with_opener(opener));
    run_until_idle(&mut window);
    (window, asked)
}

#[test]
fn a_lesson_is_opened_from_the_menu() {
    let (mut window, asked) = noting();
    let lesson = Lesson::all().expect("our own").swap_remove(1);
    for label in ["Menu", "Open a lesson", &lesson.title] {
        window.get_by_label_contains(label).click();
        window.run_steps(3);
    }
    wait(&mut window, |app| !app.app_state().is_opening());
    assert_eq!(*asked.lock().expect("no panic"), [lesson.name]);
    assert!(!is_said(&window, &lesson.title), "the menu is closed");
}

/// A file that is dropped on a window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

#[test]
fn what_is_dropped_on_the_window_is_opened_and_a_report_stands_for_its_folder() {
    let (mut window, asked) = noting();
    for dropped in ["/data/street", "/data/run/report.html"] {
        window.input_mut().dropped_files.push(Arc::new(Dropped(dropped.into())));
        window.step();
        wait(&mut window, |app| !app.app_state().is_opening());
    }
    assert_eq!(*asked.lock().expect("no panic"), ["/data/street", "/data/run"]);
}

#[test]
fn a_double_click_opens_a_result_of_the_batch() {
    let mut window = finished(setup());
    send(&mut window, |app| app.act("Run all queries, or stop"));
    wait(&mut window, |app| app.app_state().results.len() == 3);
    press(&mut window, Modifiers::NONE, Key::F4);
    window.run_steps(2);
    assert_eq!(app(&window).options.layout, Arrangement::Batch);
    // Errors have their unit in the name of the column.
    assert!(is_said(&window, "error (m)"));
    let row = |window: &Harness<'_, App>| {
        window.query_all_by_label("000002").next().expect("a row").rect().center()
    };
    let at = row(&window);
    window.hover_at(at);
    window.run_steps(4);
    // Each event has a frame of a quarter of a second here.
    window.ctx.options_mut(|options| options.input_options.max_double_click_delay = 1.0);
    for _ in 0..2 {
        for pressed in [true, false] {
            window.event(egui::Event::PointerButton {
                pos: at,
                button: egui::PointerButton::Primary,
                pressed,
                modifiers: Modifiers::NONE,
            });
        }
        window.step();
    }
    window.run_steps(3);
    assert_eq!(app(&window).setup.query, 2);
    assert_eq!(app(&window).options.layout, Arrangement::Inspect);
}

#[test]
fn a_hypothesis_is_named_with_its_cost_beside_the_lowest_so_far() {
    let mut window = finished(setup());
    let records = app(&window).run().records();
    let is_worse = |event: &Event| matches!(event, Event::PoseScored(one) if !one.is_best);
    let at = records.iter().position(|record| is_worse(&record.event)).expect("a worse one");
    let Event::PoseScored(tried) = records[at].event.clone() else { panic!("a hypothesis") };
    send(&mut window, |app| app.app_state_mut().move_cursor(at));
    let words = match tried.score.cost {
        Some(cost) => format!("hypothesis {}: cost {cost:.4}", tried.evaluation),
        None => format!("hypothesis {}", tried.evaluation),
    };
    send(&mut window, |app| app.app_state_mut().show_tab(Tab::Log));
    for layout in [Arrangement::Inspect, Arrangement::Lecture] {
        send(&mut window, |app| app.arrange(layout));
        let said = window.query_all_by_label_contains(&words).next();
        assert!(said.is_some(), "{layout:?}: {words}");
        assert!(is_said(&window, "the lowest so far is"), "{layout:?}");
    }
}

#[test]
fn all_failures_are_explained_at_once_and_what_mends_most_is_named() {
    let mut window = finished(setup());
    send(&mut window, |app| app.act("Run all queries, or stop"));
    wait(&mut window, |app| app.app_state().results.len() == 3);
    press(&mut window, Modifiers::NONE, Key::F4);
    window.run_steps(2);
    window.get_by_label("Explain all failures").click();
    let is_explained = |app: &App| {
        let results = &app.app_state().results;
        let mut failed = results.values().flatten().filter(|one| one.grade.is_failure());
        app.app_state().queries.progress().is_none() && failed.all(|one| one.explanation.is_some())
    };
    wait(&mut window, is_explained);
    window.run_steps(3);
    let results = &app(&window).results;
    assert!(results.values().flatten().any(|one| one.explanation.is_some()));
    // What is right needs no explanation, and its results stay.
    assert_eq!(results.len(), 3);
    assert!(!is_said(&window, "Explain all failures"));
}
