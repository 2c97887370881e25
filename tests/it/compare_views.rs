//! The views that hold one thing beside another: two poses, two runs, all results of a run.

use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use posescope::app::{App, KnownResults, Results, Tab, ViewName};
use posescope::diagnosis::Code;
use posescope::event::{Event, Stage};
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope::session::Part;

use crate::walls_scene::GREY;
use crate::window::{
    app, finished, is_said, press, results, run_until_idle, send, setup, window_with_results,
};

fn show(window: &mut Harness<'_, App>, view: ViewName) {
    window.state_mut().app_state_mut().show_alone(Some(view));
    window.run_steps(4);
}

#[test]
fn two_runs_are_one_table_of_what_became_different() {
    let mut window = finished(setup());
    let before = results(&window);
    press(&mut window, Modifiers::NONE, Key::P);
    send(&mut window, |app| app.app_state_mut().show_outcome(Part::Reference(Method::FB, 0)));
    send(&mut window, |app| app.app_state_mut().show_tab(Tab::Numbers));
    assert!(is_said(&window, "Both runs have the same settings."));

    send(&mut window, |app| app.app_state_mut().set_param("fb.ratio", "0.6"));
    run_until_idle(&mut window);
    send(&mut window, |app| app.app_state_mut().show_outcome(Part::Reference(Method::FB, 0)));
    let after = results(&window);
    let matches = |results: &[QueryResult]| results[0].counts.expect("of FB").with_depth;
    let (a, b) = (matches(&before), matches(&after));
    assert_ne!(a, b);
    assert!(is_said(&window, "fb.ratio=0.6"));
    for words in [a.to_string(), b.to_string()] {
        let mut said = window.query_all_by_label(&words);
        assert!(said.next().is_some(), "{words}");
    }
    // D leaves out what both runs agree on.
    let rows = |window: &Harness<'_, App>| {
        ["keypoints", "matches"].map(|field| window.query_by_label(field).is_some())
    };
    assert_eq!(rows(&window), [true, true]);
    press(&mut window, Modifiers::NONE, Key::D);
    assert_eq!(rows(&window), [false, true]);
    press(&mut window, Modifiers::NONE, Key::D);

    let degradation = "gamma=0.5".parse().expect("a degradation");
    send(&mut window, |app| app.app_state_mut().degrade(degradation));
    run_until_idle(&mut window);
    window.run_steps(3);
    assert!(is_said(&window, "--degrade gamma=0.5"));
}

/// A window over a run of three queries, as if its folder was opened.
fn over_a_run() -> Harness<'static, App> {
    let mut results = Results::new();
    for query in [1, 2, GREY] {
        let mut setup = setup();
        setup.query = query;
        let window = finished(setup);
        results.insert(query, crate::window::results(&window));
    }
    let mut window = window_with_results(setup(), results);
    run_until_idle(&mut window);
    window
}

#[test]
fn results_are_drawn_as_the_condition_chooses_them() {
    let mut window = over_a_run();
    show(&mut window, ViewName::Charts);
    // What has no error is not drawn.
    let known: Vec<QueryResult> = {
        let known = app(&window).results.values().flatten();
        known.cloned().collect()
    };
    let drawn = |wanted: &dyn Fn(&QueryResult) -> bool| {
        let with_error = known.iter().filter(|result| result.error.is_some());
        let count = with_error.filter(|result| wanted(result)).count();
        format!("{count} results: error over start")
    };
    assert!(known.iter().any(|result| result.error.is_none()));
    assert!(is_said(&window, &drawn(&|_| true)));
    window.get_by_label("Verdicts").click();
    window.run_steps(3);
    let of_method = known.iter().filter(|result| result.method == Method::MI);
    let all = of_method.clone().count();
    let right = of_method.filter(|result| result.diagnosis.is_empty()).count();
    assert!(is_said(&window, &format!("MI ok: {right} of {all}")));

    // By condition; a click shows the results of a number.
    window.get_by_label("by condition").click();
    window.run_steps(3);
    let is_it = |result: &QueryResult| result.method == Method::MI && result.diagnosis.is_empty();
    assert!(0 < right && right < all);
    let words = format!("MI ok, {}: {right} of {all}", known[0].scene);
    window.get_by_label(&words).click();
    window.run_steps(3);
    show(&mut window, ViewName::Charts);
    window.get_by_label("Scatter").click();
    window.run_steps(3);
    assert!(is_said(&window, &drawn(&is_it)));
    window.state_mut().app_state_mut().options.results_filter = String::new();

    window.get_by_label("Scatter").click();
    send(&mut window, |app| {
        app.app_state_mut().options.results_filter = "method = mi".to_owned();
    });
    assert!(is_said(&window, &drawn(&|result| result.method == Method::MI)));
    send(&mut window, |app| {
        app.app_state_mut().options.results_filter = "method = ".to_owned();
    });
    assert!(is_said(&window, "expected"));
}

#[test]
fn a_result_is_opened_at_the_step_that_decided_it() {
    let mut window = over_a_run();
    let failed = |window: &Harness<'_, App>, code: Code| {
        let known = &app(window).results[&GREY];
        known
            .iter()
            .position(|result| result.diagnosis.first().is_some_and(|finding| finding.code == code))
    };
    let result = failed(&window, Code::R2).expect("a grey photo has no features");
    send(&mut window, |app| app.app_state_mut().open_result(GREY, result));
    run_until_idle(&mut window);
    let state = app(&window);
    assert_eq!(state.setup.query, GREY);
    let Event::StageEnded(ended) = &state.run().records()[state.cursor()].event else {
        panic!("not the end of a stage");
    };
    assert_eq!(ended.stage, Stage::Detect);

    // The next failure leads there too.
    let mut window = over_a_run();
    press(&mut window, Modifiers::NONE, Key::N);
    run_until_idle(&mut window);
    let state = app(&window);
    assert_eq!(state.setup.query, GREY);
    let first = &state.results[&GREY][0].diagnosis[0];
    assert_eq!(first.code, Code::R2);
    let Event::StageEnded(ended) = &state.run().records()[state.cursor()].event else {
        panic!("not the end of a stage");
    };
    assert_eq!(ended.stage, Stage::Detect);
}

/// The results of three queries, held against the same with other verdicts at one of them.
fn over_two_runs() -> (Harness<'static, App>, Results, Results) {
    let mut now = Results::new();
    for query in [1, 2, GREY] {
        let mut setup = setup();
        setup.query = query;
        let window = finished(setup);
        now.insert(query, crate::window::results(&window));
    }
    // What the grey photo is told of becomes what the first is told of, for MI alone.
    let mut before = now.clone();
    let told = now[&GREY].iter().find(|one| one.method == Method::MI);
    let told = told.expect("asked for").diagnosis.clone();
    assert!(!told.is_empty());
    let other = before.get_mut(&1).expect("known").iter_mut();
    for result in other.filter(|one| one.method == Method::MI) {
        assert!(result.diagnosis.is_empty());
        result.diagnosis.clone_from(&told);
    }
    let known =
        KnownResults { now: now.clone(), before: Some(before.clone()), ..KnownResults::default() };
    let mut window = crate::window::window_with_results(setup(), known);
    run_until_idle(&mut window);
    (window, before, now)
}

#[test]
fn verdicts_that_became_others_are_a_matrix_and_a_click_shows_their_queries() {
    let (mut window, before, now) = over_two_runs();
    press(&mut window, Modifiers::NONE, Key::F4);
    since_a(&mut window);
    let code = before[&1].iter().find(|one| one.method == Method::MI).expect("asked for").diagnosis
        [0]
    .code;
    let results: usize = now.values().map(Vec::len).sum();
    let words = format!("1 of {results} verdicts changed: MI {code} → ok 1");
    assert!(is_said(&window, &words), "{words}");
    // As `posescope compare` counts it.
    let rows =
        |results: &Results| -> Vec<QueryResult> { results.values().flatten().cloned().collect() };
    let compared = posescope::measure::RunComparison::of(
        &rows(&before),
        &rows(&now),
        &posescope::measure::RunComparison::TOLERANCE,
    );
    assert_eq!(compared.migrations.len(), 1);
    let [only] = compared.migrations.as_slice() else {
        panic!("one change");
    };
    assert_eq!(
        format!("{} {} {} {}", only.method, only.before, only.after, only.count),
        format!("mi {code} ok 1")
    );

    window.get_by_label(&format!("MI {code} → ok: 1")).click();
    window.run_steps(4);
    send(&mut window, |app| app.app_state_mut().show_alone(None));
    assert!(is_said(&window, &format!("1 of {results} results")));
    assert!(is_said(&window, "wrong or without a pose: MI 0"));
    // The same among a condition, and away again.
    let label = format!("MI {code} → ok ×");
    window.get_all_by_label(&label).next().expect("a filter").click();
    window.run_steps(4);
    assert!(is_said(&window, &format!("{results} of {results} results")));
    press(&mut window, Modifiers::NONE, Key::D);
    window.run_steps(3);
    assert!(is_said(&window, &format!("1 of {results} results")));
}

/// Shows the matrix of the verdicts since the results A.
fn since_a(window: &mut Harness<'_, App>) {
    show(window, ViewName::Charts);
    for name in ["Verdicts", "since A"] {
        window.get_by_label(name).click();
        window.run_steps(3);
    }
}

#[test]
fn results_are_kept_and_those_that_follow_are_held_against_them() {
    let mut window = over_a_run();
    since_a(&mut window);
    assert!(is_said(&window, "Nothing to compare with"));
    show(&mut window, ViewName::Batch);
    window.get_by_label("Keep results as A").click();
    window.run_steps(3);
    since_a(&mut window);
    assert!(is_said(&window, "None of 12 verdicts changed"));
    // Nothing is right any more within a hair.
    send(&mut window, |app| app.app_state_mut().set_param("grid.coarse_step", "3"));
    run_until_idle(&mut window);
    show(&mut window, ViewName::Batch);
    window.get_by_label("Forget A").click();
    window.run_steps(3);
    since_a(&mut window);
    assert!(is_said(&window, "Nothing to compare with"));
}

#[test]
fn recall_says_how_many_are_right_within_the_tolerance_of_the_run() {
    let mut window = over_a_run();
    show(&mut window, ViewName::Charts);
    window.get_by_label("Recall").click();
    window.run_steps(3);
    let state = app(&window);
    let right = state.setup.task.protocol.right;
    let of_mi: Vec<&QueryResult> =
        state.results.values().flatten().filter(|result| result.method == Method::MI).collect();
    let within = of_mi.iter().filter(|result| {
        result.error.is_some_and(|error| {
            error.translation_m <= right.translation_m && error.rotation_deg <= right.rotation_deg
        })
    });
    let share = 100.0 * within.count() as f64 / of_mi.len() as f64;
    assert!(share > 0.0 && share < 100.0);
    let words = format!("MI {share:.1} %");
    assert!(is_said(&window, &words), "{words}");
}
