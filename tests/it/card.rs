//! The verdict bar, and what stays where it is around it.

use std::sync::Arc;

use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use posescope::app::{App, Results, SaveTarget, Setup};
use posescope::diagnosis::Grade;
use posescope::method::Method;
use posescope::scene::{self, Scene};
use posescope::session::{Job, Part};

use crate::walls_scene::GREY;
use crate::window::{
    app, finish, finished, is_said, press, results, run_until_idle, send, setup, setup_at, wait,
    window, window_with_results,
};

/// How many results the bar calls right.
fn right_ones(window: &Harness<'_, App>) -> usize {
    let cells = ["FB: ", "PM: ", "MI: ", "HY: "].into_iter();
    let is_right = |name: &&str| is_said(window, &format!("{name}● right"));
    cells.filter(is_right).count()
}

#[test]
fn the_bar_says_what_each_result_is_worth_and_the_sentence_why() {
    let window = finished(setup());
    for result in results(&window) {
        assert_eq!(result.grade, Grade::Right, "{}", result.method);
    }
    assert_eq!(right_ones(&window), 4);

    let mut grey = finished(setup_at(GREY));
    assert_eq!(right_ones(&grey), 0);
    for result in results(&grey) {
        send(&mut grey, |app| app.app_state_mut().show_outcome(Part::Reference(result.method, 0)));
        assert!(app(&grey).options.shows_why);
        let primary = result.diagnosis.first().expect("a verdict");
        let sentence = primary.text.split(". ").next().expect("a sentence");
        assert!(is_said(&grey, sentence), "{}", primary.text);
        assert!(is_said(&grey, &format!("{} why: ", result.method.label())));
    }
}

/// The window goes to the first method that is wrong, and shows why.
#[test]
fn a_run_that_ends_opens_at_the_cause() {
    let grey = finished(setup_at(GREY));
    let state = app(&grey);
    assert!(state.options.shows_why);
    let span = state.run().span_at(state.cursor()).expect("a part");
    assert_eq!(span.part, Part::Reference(Method::FB, 0));
    let right = finished(setup());
    assert!(!app(&right).options.shows_why);

    // A method that is right is passed over.
    let mut second = setup();
    second.task.protocol.methods = vec![Method::FB, Method::MI];
    second.task.protocol.right = "0.4m,5deg".parse().expect("a tolerance");
    for assignment in ["grid.coarse_step=3", "grid.fine_range=0.2"] {
        second.task.params.assign(assignment).expect("a parameter");
    }
    let second = finished(second);
    let grades = results(&second);
    let grades: Vec<Grade> = grades.iter().map(|result| result.grade).collect();
    assert_eq!(grades, [Grade::Right, Grade::Wrong]);
    let state = app(&second);
    assert!(state.options.shows_why);
    let span = state.run().span_at(state.cursor()).expect("a part");
    assert_eq!(span.part, Part::Reference(Method::MI, 0));
}

#[test]
fn nothing_moves_between_two_steps() {
    let mut window = finished(setup_at(GREY));
    let places = |window: &Harness<'_, App>| -> Vec<egui::Rect> {
        ["Step", "Truth", "Compare", "Search", "Step inside the stage", "Why", "FB: "]
            .map(|label| {
                let mut found = window.query_all_by_label_contains(label);
                found.next().unwrap_or_else(|| panic!("{label}")).rect()
            })
            .to_vec()
    };
    let at_end = places(&window);
    for action in ["To the first step", "Ten steps on", "To the last step"] {
        send(&mut window, |app| app.act(action));
        assert_eq!(places(&window), at_end, "{action}");
    }
}

#[test]
fn without_the_truth_the_bar_tells_no_error() {
    let mut window = finished(setup());
    let error = results(&window)[0].error.expect("the truth is known");
    let words = error.translation();
    assert!(is_said(&window, &words), "{words}");
    press(&mut window, Modifiers::NONE, Key::G);
    assert!(!is_said(&window, &words), "{words}");
    assert_eq!(right_ones(&window), 0);
}

#[test]
fn a_stray_key_of_lock_step_leaves_the_card_where_it_is() {
    let mut window = finished(setup());
    for key in [Key::Period, Key::Comma] {
        press(&mut window, Modifiers::NONE, key);
        assert_eq!(app(&window).options.lockstep, None);
        assert_eq!(right_ones(&window), 4, "{key:?}");
    }
    send(&mut window, |app| {
        app.app_state_mut().options.lockstep = Some(3);
    });
    press(&mut window, Modifiers::NONE, Key::Period);
    assert_eq!(app(&window).options.lockstep, Some(4));
}

#[test]
fn what_helped_is_tried_by_a_button_and_compared_with_the_run_before() {
    let mut wrong = setup();
    wrong.task.protocol.methods = vec![Method::MI];
    wrong.task.protocol.right = "0.4m,5deg".parse().expect("a tolerance");
    wrong.task.protocol.explain = 12;
    for assignment in ["grid.coarse_step=3", "grid.fine_range=0.2"] {
        wrong.task.params.assign(assignment).expect("a parameter");
    }
    let mut window = finished(wrong.clone());
    assert!(is_said(&window, "MI: ▲ wrong"));
    let explanation = results(&window)[0].explanation.clone();
    let helped = explanation.expect("it went wrong");
    let best = helped.best().expect("something helped").error;
    let errors = helped.helped.iter().map(|helped| helped.error);
    assert!(errors.into_iter().all(|error| error.translation_m >= best.translation_m));
    // What was changed by hand is set back first.
    assert!(
        helped.helped.len() > 1 && helped.helped[0].args.contains(&"grid.coarse_step=1".to_owned())
    );
    window.get_by_label_contains("Try ").click();
    wait(&mut window, |app| app.app_state().kept.is_some());
    finish(&mut window);
    let again = results(&window);
    assert!(again.iter().any(|result| result.error == Some(best)));
    assert!(is_said(&window, "● right"));
    let before = &app(&window).kept.as_ref().expect("kept").run;
    assert_eq!(before.params, wrong.task.params);
}

#[test]
fn the_first_screen_says_which_keys_to_press() {
    let mut waiting = window(setup());
    run_until_idle(&mut waiting);
    assert!(is_said(&waiting, "? lists all keys"));
    assert!(is_said(&waiting, "not run yet"));
    press(&mut waiting, Modifiers::NONE, Key::F1);
    for task in ["Run and step", "Queries", "Try another pose"] {
        assert!(is_said(&waiting, task), "{task}");
    }
}

/// Two drives of the built-in street.
fn night_against_snow() -> Setup {
    let open = |name: &str| -> Arc<dyn Scene> { scene::open(name, None).expect("built in").into() };
    let (references, queries) = (open("street:snow"), open("street:night"));
    let mut setup = setup();
    setup.offered = (0..queries.frames().len()).collect();
    setup.query = queries.find("450").expect("a frame");
    setup.chosen = vec![references.find("450").expect("a frame")].into();
    setup.job = Job { references, queries, ..setup.job };
    setup
}

#[test]
fn frames_of_two_scenes_are_told_apart_and_the_query_is_in_sight() {
    let mut window = window(night_against_snow());
    window.run_steps(4);
    assert!(is_said(&window, "street:night") && is_said(&window, "000450"));
    assert!(is_said(&window, "street:snow 000450"));
    let title = app(&window).setup.title();
    assert_eq!(title, "posescope: street:night 000450 ← street:snow 000450");
    // The list shows some rows only; that of the query is one of them, and so after a jump. Its rows are
    // buttons: a report that is there already says the same names.
    let is_listed = |window: &Harness<'_, App>, name: &str| {
        let row = window.query_by_role_and_label(egui::accesskit::Role::Button, name);
        row.is_some()
    };
    assert!(is_listed(&window, "000450") && !is_listed(&window, "000002"));
    window.state_mut().app_state_mut().select_query(2);
    window.run_steps(4);
    assert!(!is_listed(&window, "000450") && is_listed(&window, "000002"));
}

#[test]
fn a_lecture_shows_nothing_of_what_is_still_to_come() {
    let mut window = finished(setup());
    press(&mut window, Modifiers::NONE, Key::F3);
    window.run_steps(3);
    send(&mut window, |app| app.app_state_mut().move_cursor(1));
    assert!(is_said(&window, "It finds points that stand out"), "the stage in one sentence");
    let known = app(&window).options.clone();
    assert!(known.hides_future && !known.shows_why);
    press(&mut window, Modifiers::NONE, Key::F2);
    window.run_steps(3);
    assert_eq!(right_ones(&window), 4);
}

#[test]
fn a_batch_is_filtered_sorted_and_opened() {
    let all = finished(setup());
    let grey = finished(setup_at(GREY));
    let known = [(1, results(&all)), (GREY, results(&grey))];
    let mut window = window_with_results(setup(), Results::from(known));
    press(&mut window, Modifiers::NONE, Key::F4);
    window.run_steps(3);
    assert!(is_said(&window, "8 of 8 results; wrong or without a pose: FB 1, PM 1, MI 1, HY 1"));
    let filter = |window: &mut Harness<'_, App>, text: &str| {
        let field = window.get_by_label("Where");
        field.focus();
        window.step();
        press(window, Modifiers::COMMAND, Key::A);
        window.get_by_label("Where").type_text(text);
        window.run_steps(3);
    };
    filter(&mut window, "method = mi and code = D5");
    assert!(is_said(&window, "1 of 8 results; wrong or without a pose: MI 1"));
    filter(&mut window, "method = = mi");
    assert!(is_said(&window, "a value expected"));
    filter(&mut window, "error >= 0");
    let known = [results(&all), results(&grey)].concat();
    let measured = known.iter().filter(|result| result.error.is_some()).count();
    assert!((4..8).contains(&measured));
    assert!(is_said(&window, &format!("{measured} of 8 results")));
}

#[test]
fn saving_asks_where_and_offers_a_name_that_says_what_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = finished(Setup { folder: folder.path().to_owned(), ..setup() });
    send(&mut window, |app| app.ask_where(SaveTarget::Recording));
    assert!(is_said(&window, "Save the recording"));
    press(&mut window, Modifiers::NONE, Key::Escape);
    assert!(!is_said(&window, "Save the recording"));
    let name = folder.path().join("walls-000001-000000.rrd");
    assert!(!name.exists(), "nobody said so");
    // A file that is there is replaced by a button that says so.
    for (content, does) in [(None, "Save it"), (Some("old"), "Replace the file")] {
        if let Some(content) = content {
            std::fs::write(&name, content).expect("writable");
        }
        send(&mut window, |app| app.ask_where(SaveTarget::Recording));
        assert!(is_said(&window, does), "{does}");
        press(&mut window, Modifiers::NONE, Key::Escape);
    }
    std::fs::remove_file(&name).expect("just written");

    send(&mut window, |app| app.ask_where(SaveTarget::Recording));
    // Keys belong to the field meanwhile: no view changes for them.
    press(&mut window, Modifiers::NONE, Key::Enter);
    wait(&mut window, |app| !app.app_state().is_working_out());
    assert!(name.exists());
    assert!(is_said(&window, "Recording: "));
}

#[test]
fn what_is_known_from_a_run_folder_is_told_before_the_query_is_run_again() {
    let grey = finished(setup_at(GREY));
    let known: Results = [(GREY, results(&grey))].into();
    let mut window = window_with_results(setup_at(GREY), known.clone());
    run_until_idle(&mut window);
    assert!(is_said(&window, "FB: paused") && is_said(&window, "MI: not run yet"));
    // The table says the cause in a phrase.
    press(&mut window, Modifiers::NONE, Key::F4);
    window.run_steps(3);
    let code = known[&GREY][0].diagnosis[0].code;
    assert!(is_said(&window, code.title()), "{}", code.title());
}
