//! The window, driven through its keys and its accessibility tree.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Key, Modifiers, Role};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use posescope::app::{
    App, AppState, CompareMode, KnownResults, Results, SaveTarget, Setup, Tab, ViewName,
};
use posescope::diagnosis::Grade;
use posescope::event::{Event, Stage};
use posescope::geometry::Pose;
use posescope::localize::{Localizer, NoObserver, QueryResult, Request};
use posescope::method::Method;
use posescope::params::Params;
use posescope::run::Protocol;
use posescope::scene;
use posescope::scene::Scene;
use posescope::session::{Job, RunMode, RunState, Task};

use crate::binary::has;
use crate::small_sequence::SmallSequence;
use crate::walls_scene::{GREY, UNREADABLE, Walls};

/// The small world, waiting at its first step.
pub fn setup() -> Setup {
    let scene = Arc::new(Walls::new());
    let job = Job {
        task: Task {
            protocol: Protocol {
                references: Vec::new(),
                radii_m: vec![3.0],
                seed: 7,
                ..Protocol::default()
            },
            ..Task::of("walls")
        },
        references: scene.clone(),
        queries: scene,
        query: 1,
        chosen: vec![0].into(),
        index: Arc::default(),
        frames: Arc::default(),
    };
    let offered = vec![1, 2, GREY];
    Setup { job, offered, mode: RunMode::Paused, folder: std::env::temp_dir() }
}

/// The same at another query.
pub fn setup_at(query: usize) -> Setup {
    let mut setup = setup();
    setup.query = query;
    setup
}

/// The window without a graphics card: what it shows is not painted.
pub fn window(setup: Setup) -> Harness<'static, App> {
    window_with_results(setup, Results::new())
}

/// The window with results that are known before it is opened.
pub fn window_with_results(
    setup: Setup,
    results: impl Into<KnownResults>,
) -> Harness<'static, App> {
    let results = results.into();
    Harness::builder()
        .with_size([1500.0, 950.0])
        .build_eframe(|creation| App::new(creation, setup).with_results(results))
}

/// Draws frames until the worker needs somebody.
pub fn run_until_idle(window: &mut Harness<'_, App>) -> RunState {
    wait(window, |app| {
        let state = app.app_state();
        !state.is_opening() && !matches!(state.run_state(), RunState::Loading | RunState::Running)
    });
    window.step();
    app(window).run_state().clone()
}

/// The run comes to its end.
#[track_caller]
pub fn finish(window: &mut Harness<'_, App>) {
    // After a key, the run counts as paused until its next message arrives.
    wait(window, |app| *app.app_state().run_state() == RunState::Finished);
    assert_eq!(run_until_idle(window), RunState::Finished);
}

/// What the window knows.
pub fn app<'a>(window: &'a Harness<'_, App>) -> &'a AppState {
    window.state().app_state()
}

/// Does what a key or a view would do; it is drawn in the next frame or the one after it.
pub fn send(window: &mut Harness<'_, App>, command: impl FnOnce(&mut App)) {
    command(window.state_mut());
    window.run_steps(3);
}

/// Saves something in a file or takes it from there, and waits until that is done.
#[track_caller]
pub fn save(window: &mut Harness<'_, App>, target: SaveTarget, path: &Path) {
    send(window, |app| app.save(target, path.to_owned()));
    wait(window, |app| !app.app_state().is_working_out());
}

/// Draws frames until something is the case.
pub fn wait(window: &mut Harness<'_, App>, is_so: impl Fn(&App) -> bool) {
    let begun = Instant::now();
    loop {
        window.step();
        if is_so(window.state()) {
            return;
        }
        assert!(begun.elapsed() < Duration::from_secs(600), "it hangs");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A window whose run is over.
pub fn finished(setup: Setup) -> Harness<'static, App> {
    let mut window = window(Setup { mode: RunMode::Running, ..setup });
    finish(&mut window);
    window
}

pub fn press(window: &mut Harness<'_, App>, modifiers: Modifiers, key: Key) {
    window.key_press_modifiers(modifiers, key);
    window.run_steps(2);
}

/// Gives an order by a key, and waits for what comes of it.
fn order(window: &mut Harness<'_, App>, modifiers: Modifiers, key: Key) -> Event {
    let before = app(window).run().len();
    press(window, modifiers, key);
    wait(window, |app| {
        app.app_state().run().len() > before
            || matches!(app.app_state().run_state(), RunState::Finished)
    });
    run_until_idle(window);
    let state = app(window);
    state.run().records()[state.cursor()].event.clone()
}

/// Whether some label of the window holds these words.
pub fn is_said(window: &Harness<'_, App>, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

fn stage(event: &Event) -> Option<(Stage, bool)> {
    match event {
        Event::StageStarted(started) => Some((started.stage, true)),
        Event::StageEnded(ended) => Some((ended.stage, false)),
        _ => None,
    }
}

pub fn results(window: &Harness<'_, App>) -> Vec<QueryResult> {
    app(window).run().results().cloned().collect()
}

/// The results of the same run without a window.
fn headless(params: &Params) -> Vec<QueryResult> {
    let scene = Walls::new();
    let mut results = Vec::new();
    let request =
        Request { radius_m: 3.0, references: vec![0].into(), fusions: Vec::new(), setting: None };
    Localizer::new(&scene, &scene, params, 7)
        .localize(0, 1, &[request], &Method::PAPER, &mut NoObserver, |result, _| {
            results.push(result);
            Ok::<(), posescope::localize::LocalizeError>(())
        })
        .expect("readable");
    results
}

#[test]
fn the_window_waits_at_the_first_step_and_steps_by_keys_and_buttons() {
    let mut window = window(setup());
    assert_eq!(run_until_idle(&mut window), RunState::Paused { breakpoint: None });
    assert_eq!(app(&window).run().len(), 1);
    window.get_by_label("Step").click();
    wait(&mut window, |app| app.app_state().run().len() == 2);
    run_until_idle(&mut window);
    let event = order(&mut window, Modifiers::NONE, Key::F10);
    assert_eq!(stage(&event), Some((Stage::Detect, false)));
    let event = order(&mut window, Modifiers::NONE, Key::ArrowRight);
    assert_eq!(stage(&event), Some((Stage::Match, true)));
    let event = order(&mut window, Modifiers::NONE, Key::I);
    assert!(matches!(event, Event::MatchesDecided(_)));
    let event = order(&mut window, Modifiers::SHIFT, Key::F11);
    assert_eq!(stage(&event), Some((Stage::Match, false)));
    order(&mut window, Modifiers::NONE, Key::F9);
    finish(&mut window);
    assert_eq!(results(&window), headless(&Params::default()));
}

#[test]
fn looking_back_computes_nothing_and_every_moment_can_be_drawn() {
    let mut window = finished(setup());
    let last = app(&window).run().len() - 1;
    for cursor in (0..=last).step_by(7).chain([last]) {
        send(&mut window, |app| app.app_state_mut().move_cursor(cursor));
        assert_eq!(app(&window).cursor(), cursor);
    }
    assert_eq!(app(&window).run().len(), last + 1);
    press(&mut window, Modifiers::NONE, Key::Home);
    assert_eq!(app(&window).cursor(), 0);
    press(&mut window, Modifiers::SHIFT, Key::ArrowRight);
    assert_eq!(app(&window).cursor(), 10);
    press(&mut window, Modifiers::NONE, Key::ArrowLeft);
    assert_eq!(app(&window).cursor(), 9);
    press(&mut window, Modifiers::NONE, Key::Num3);
    let state = app(&window);
    let span = state.run().span_at(state.cursor()).expect("in a span");
    assert_eq!(span.part.method(), Some(Method::MI));
}

#[test]
fn a_breakpoint_that_is_typed_stops_the_run_and_is_named() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    window.get_by_label("Break").click();
    window.run_steps(2);
    window.get_by_label("New breakpoint").focus();
    window.step();
    window.get_by_label("New breakpoint").type_text("mi.yaw_coarse");
    window.step();
    window.get_by_label("Add").click();
    window.run_steps(2);
    let breakpoints = &app(&window).setup.task.breakpoints;
    assert_eq!(breakpoints[0].to_string(), "mi.yaw_coarse");
    assert_eq!(breakpoints.len(), 1);
    press(&mut window, Modifiers::NONE, Key::F5);
    wait(&mut window, |app| app.app_state().run().len() > 10);
    let stopped = RunState::Paused { breakpoint: Some("mi.yaw_coarse".to_owned()) };
    assert_eq!(run_until_idle(&mut window), stopped);
    assert!(is_said(&window, "mi.yaw_coarse"));
}

#[test]
fn what_went_wrong_is_explained_at_a_key_and_no_longer_at_the_next() {
    let mut wrong = setup();
    wrong.task.protocol.methods = vec![Method::MI];
    wrong.task.protocol.right = "0.4m,5deg".parse().expect("a tolerance");
    for assignment in ["grid.coarse_step=3", "grid.fine_range=0.2"] {
        wrong.task.params.assign(assignment).expect("a parameter");
    }
    let mut window = window(wrong);
    run_until_idle(&mut window);
    press(&mut window, Modifiers::NONE, Key::F9);
    finish(&mut window);
    window.get_all_by_label("Try what would help").next().expect("it is offered").click();
    wait(&mut window, |app| app.app_state().setup.task.protocol.explain > 0);
    finish(&mut window);
    let explanation = |window: &Harness<'_, App>| {
        let run = app(window).run();
        let result = run.results().next().expect("a result");
        result.explanation.clone()
    };
    let helped = explanation(&window).expect("it went wrong");
    let words = helped.best().expect("something helped").args.join(" ");
    let words = words.replace("--set ", "").replace("--method ", "");
    assert!(is_said(&window, &format!("Try {words}")), "{words}");
    assert!(app(&window).run().explaining.is_none());
    let line = app(&window).setup.command_line();
    has(&line, "--explain 12");
    press(&mut window, Modifiers::NONE, Key::E);
    finish(&mut window);
    assert_eq!(explanation(&window), None);
}

/// Walls whose photos nobody has the poses of.
struct Unmeasured {
    scene: Walls,
}

impl Scene for Unmeasured {
    posescope::inner_scene!(scene: name, frames, intrinsics, time_s, has_cloud, photo, cloud);

    fn pose(&self, _: usize) -> Option<Pose> {
        None
    }
}

#[test]
fn without_the_truth_its_button_is_off_and_a_key_that_needs_it_says_so() {
    let is_off = |window: &Harness<'_, App>| {
        let mut buttons = window.query_all_by_role_and_label(Role::Button, "Truth");
        buttons.next().expect("a button").accesskit_node().is_disabled()
    };
    let mut setup = setup();
    assert!(!is_off(&finished(setup.clone())));
    setup.queries = Arc::new(Unmeasured { scene: Walls::new() });
    let mut window = finished(setup);
    assert!(is_off(&window));
    press(&mut window, Modifiers::NONE, Key::E);
    assert!(is_said(&window, "is judged by the truth, which is not known here"));
    assert_eq!(app(&window).setup.task.protocol.explain, 0);
    assert!(results(&window).iter().all(|result| result.grade != Grade::Right));
}

#[test]
fn the_filter_takes_the_keyboard_once_and_lets_it_go() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    press(&mut window, Modifiers::NONE, Key::Slash);
    assert!(window.get_by_label("Filter parameters").is_focused());
    window.get_by_label("Filter queries").focus();
    window.run_steps(2);
    assert!(window.get_by_label("Filter queries").is_focused());
}

#[test]
fn a_wrong_breakpoint_is_refused_with_what_there_is() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    let wrong = vec!["inlers < 3".to_owned()];
    send(&mut window, |app| app.app_state_mut().set_breakpoints(wrong));
    assert!(is_said(&window, "`inlers` is not one of"));
}

#[test]
fn a_text_field_keeps_the_focus_after_enter_so_that_words_are_no_commands() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    window.get_by_label("Break").click();
    window.run_steps(2);
    window.get_by_label("New breakpoint").focus();
    window.step();
    window.get_by_label("New breakpoint").type_text("nonsense");
    press(&mut window, Modifiers::NONE, Key::Enter);
    window.run_steps(2);
    assert!(window.get_by_label("New breakpoint").is_focused());
    // Q would close the list of queries.
    let shows_queries = app(&window).options.shows_queries;
    press(&mut window, Modifiers::NONE, Key::Q);
    assert_eq!(app(&window).options.shows_queries, shows_queries);
    assert!(app(&window).setup.task.breakpoints.is_empty());
}

#[test]
fn a_small_window_shows_one_panel_beside_the_canvas_on_request() {
    let mut window = finished(setup());
    window.set_size(egui::vec2(1000.0, 640.0));
    window.run_steps(2);
    assert!(window.query_by_label("Filter queries").is_none());
    press(&mut window, Modifiers::NONE, Key::Q);
    window.run_steps(2);
    assert!(window.query_by_label("Filter queries").is_some());
    press(&mut window, Modifiers::NONE, Key::T);
    window.run_steps(2);
    assert!(window.query_by_label("Filter queries").is_none());
    assert!(window.query_by_label("Numbers").is_some());
    press(&mut window, Modifiers::NONE, Key::T);
    window.run_steps(2);
    assert!(window.query_by_label("Numbers").is_none());
}

#[test]
fn another_scene_is_opened_by_its_name_and_what_cannot_be_opened_is_said() {
    let opener: posescope::app::Opener = std::sync::Arc::new(|name| {
        let setup = match name {
            "elsewhere" => setup(),
            other => return Err(format!("{other} is no scene")),
        };
        let results = posescope::app::KnownResults::default();
        Ok(posescope::app::Opening { setup, results, lesson: None })
    });
    let mut window = finished(setup());
    send(&mut window, |app| app.open_named("elsewhere"));
    assert!(is_said(&window, "This window opens nothing else"));
    let mut window = Harness::builder()
        .with_size([1500.0, 950.0])
        .build_eframe(|creation| App::new(creation, setup()).with_opener(opener));
    press(&mut window, Modifiers::COMMAND, Key::O);
    let field = window.get_by_label("File");
    field.focus();
    window.step();
    send(&mut window, |app| app.open_named("nowhere"));
    wait(&mut window, |app| !app.app_state().is_opening());
    window.run_steps(2);
    assert!(is_said(&window, "nowhere is no scene"));
    send(&mut window, |app| app.arrange(posescope::app::Arrangement::Batch));
    send(&mut window, |app| app.open_named("elsewhere"));
    wait(&mut window, |app| app.app_state().options.layout == posescope::app::Arrangement::Inspect);
    run_until_idle(&mut window);
}

#[test]
fn the_camera_is_nudged_from_the_pose_that_is_shown() {
    let mut window = finished(setup());
    send(&mut window, |app| app.app_state_mut().select_method(Method::MI));
    let state = app(&window);
    let span = state.run().span_at(state.cursor()).expect("in a span");
    let result = span.result.as_ref().and_then(|result| result.pose.as_ref()?.to_pose());
    let shown = result.expect("a pose");
    press(&mut window, Modifiers::ALT, Key::ArrowUp);
    let camera = app(&window).camera.expect("a trial camera");
    let moved = (camera.translation.vector - shown.translation.vector).norm();
    assert!((moved - 0.2).abs() < 1e-9, "{moved}");
}

#[test]
fn a_changed_parameter_runs_again_only_what_depends_on_it_and_keeps_the_place() {
    let mut window = finished(setup());
    send(&mut window, |app| app.app_state_mut().select_method(Method::MI));
    window.state_mut().app_state_mut().set_param("grid.yaw_step", "2");
    window.step();
    finish(&mut window);
    let state = app(&window);
    let span = state.run().span_at(state.cursor()).expect("in a span");
    assert_eq!(span.part.method(), Some(Method::MI));
    assert_eq!(state.cursor() + 1, span.records.end);
    let reused = |name: &str| -> Vec<bool> {
        let bars = state.run().stages().iter();
        bars.filter(|bar| bar.stage.name() == name).map(|bar| bar.reused).collect()
    };
    assert_eq!(reused("detect"), [true, true]);
    assert!(reused("position_coarse").iter().all(|reused| *reused));
    // The hybrid is FB here, so that only PM and MI search.
    assert_eq!(reused("yaw_coarse"), [false, false]);
    let mut params = Params::default();
    params.assign("grid.yaw_step=2").expect("a good value");
    assert_eq!(results(&window), headless(&params));
}

#[test]
fn two_settings_are_compared_and_their_differences_marked() {
    let mut window = finished(setup());
    press(&mut window, Modifiers::NONE, Key::P);
    window.state_mut().app_state_mut().set_param("mi.bins", "8");
    window.step();
    run_until_idle(&mut window);
    send(&mut window, |app| app.app_state_mut().select_method(Method::MI));
    send(&mut window, |app| app.app_state_mut().show_tab(Tab::Numbers));
    assert!(is_said(&window, "mi.bins=8"));
    press(&mut window, Modifiers::NONE, Key::X);
    assert_eq!(app(&window).options.compare_mode, CompareMode::Kept);
    press(&mut window, Modifiers::NONE, Key::X);
    assert_eq!(app(&window).options.compare_mode, CompareMode::Present);
    window.state_mut().app_state_mut().show_view(ViewName::Parameters);
    press(&mut window, Modifiers::NONE, Key::D);
    assert!(window.query_all_by_label("bins").next().is_some());
    // What is equal in both is not listed.
    assert!(window.query_all_by_label("splat_px").next().is_none());
}

#[test]
fn the_next_failure_is_found_once_all_queries_were_run() {
    let mut window = finished(setup());
    press(&mut window, Modifiers::NONE, Key::N);
    assert_eq!(app(&window).setup.query, 1);
    send(&mut window, |app| app.act("Run all queries, or stop"));
    wait(&mut window, |app| app.app_state().results.len() == 3);
    press(&mut window, Modifiers::NONE, Key::N);
    assert_eq!(app(&window).setup.query, GREY);
    run_until_idle(&mut window);
    press(&mut window, Modifiers::NONE, Key::K);
    assert_eq!(app(&window).setup.query, 2);
}

#[test]
fn a_bar_filters_the_batch_whose_rows_and_failures_keys_go_through() {
    let mut window = finished(setup());
    send(&mut window, |app| app.act("Run all queries, or stop"));
    wait(&mut window, |app| app.app_state().results.len() == 3);
    press(&mut window, Modifiers::NONE, Key::F4);
    let click_bar = |window: &mut Harness<'_, App>| {
        window.query_all_by_label_contains("fb: ").next().expect("a bar").click();
        window.run_steps(3);
    };
    click_bar(&mut window);
    assert_eq!(app(&window).options.results_filter, "method = fb");
    let shown = |window: &Harness<'_, App>| {
        let row = app(window).options.selected_row.expect("a row");
        (row.query, app(window).results[&row.query][row.place].method)
    };
    for query in [1, 2, GREY, GREY] {
        press(&mut window, Modifiers::NONE, Key::ArrowDown);
        assert_eq!(shown(&window), (query, Method::FB));
    }
    press(&mut window, Modifiers::NONE, Key::ArrowUp);
    assert_eq!(shown(&window), (2, Method::FB));
    click_bar(&mut window);
    assert_eq!(app(&window).options.results_filter, "");
    // What the filter hides is no next failure.
    send(&mut window, |app| app.app_state_mut().options.results_filter = "grade = right".into());
    press(&mut window, Modifiers::NONE, Key::N);
    assert!(is_said(&window, "No result that the filter shows is known to be wrong"));
    assert_eq!(app(&window).setup.query, 2);
}

#[test]
fn the_run_over_all_queries_and_a_run_with_old_settings_stop_soon() {
    let scene: Arc<dyn Scene> = Arc::new(Walls::new());
    let mut setup = setup();
    setup.references = Arc::clone(&scene);
    setup.queries = Arc::clone(&scene);
    setup.task.protocol.methods = vec![Method::PM];
    // A million hypotheses.
    for change in ["grid.fine_range=5", "grid.fine_step=0.01"] {
        setup.task.params.assign(change).expect("a good value");
    }
    let mut window = window(setup);
    run_until_idle(&mut window);
    wait(&mut window, |app| !app.app_state().queries.is_painting());
    std::thread::sleep(Duration::from_millis(100));
    // Every worker has its handles on the scene.
    let alone = Arc::strong_count(&scene);
    let is_alone = |_: &App| Arc::strong_count(&scene) <= alone;
    let mut stop_by = |command: &dyn Fn(&mut App)| {
        let begun = Instant::now();
        command(window.state_mut());
        window.step();
        // A note lasts for so many frames only.
        let is_told = is_said(&window, "its settings were changed");
        assert_eq!(app(&window).queries.progress(), None);
        wait(&mut window, is_alone);
        assert!(begun.elapsed() < Duration::from_secs(20));
        let running = Instant::now();
        while running.elapsed() < Duration::from_millis(200) {
            window.step();
        }
        window.state_mut().act("Run all queries, or stop");
        window.step();
        assert_eq!(app(&window).queries.progress(), Some((0, 3)));
        wait(&mut window, |app| !is_alone(app));
        is_told
    };
    // The first time there is nothing to stop but the session, which waits at its first event.
    assert!(!stop_by(&|app| app.app_state_mut().set_seed(8)));
    assert!(!stop_by(&|app| app.act("Run all queries, or stop")));
    stop_by(&|app| app.app_state_mut().set_param("grid.yaw_step", "2"));
    assert!(stop_by(&|app| app.app_state_mut().set_references(vec![2])));
}

#[test]
fn what_goes_wrong_is_said_and_the_window_lives_on() {
    let mut setup = setup();
    setup.offered.push(UNREADABLE);
    let mut window = finished(setup);
    window.state_mut().app_state_mut().select_query(UNREADABLE);
    window.step();
    assert!(matches!(run_until_idle(&mut window), RunState::Broken(_)));
    assert!(is_said(&window, "000004"));
    // Frame 1 has no cloud, and the scene of this test panics when it is asked for it.
    window.state_mut().app_state_mut().select_query(1);
    window.state_mut().app_state_mut().set_references(vec![1]);
    window.step();
    assert!(matches!(run_until_idle(&mut window), RunState::Broken(_)));
    assert!(is_said(&window, "internal error"));
    window.state_mut().app_state_mut().set_references(vec![0]);
    window.step();
    finish(&mut window);
}

#[test]
fn a_session_is_saved_and_restored() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.json");
    let mut window = finished(setup());
    window.state_mut().app_state_mut().set_param("fb.ratio", "0.8");
    window.step();
    run_until_idle(&mut window);
    window.state_mut().app_state_mut().move_cursor(40);
    window.state_mut().save(SaveTarget::Session, path.clone());
    window.step();
    window.state_mut().app_state_mut().reset_params();
    window.state_mut().app_state_mut().select_query(2);
    window.step();
    run_until_idle(&mut window);
    window.state_mut().save(SaveTarget::Restored, path.clone());
    window.step();
    run_until_idle(&mut window);
    let state = app(&window);
    assert_eq!(state.setup.query, 1);
    assert_eq!(state.setup.task.params.changes(), ["fb.ratio=0.8"]);
    assert_eq!(state.cursor(), 40);
    std::fs::write(&path, "{}").expect("writable");
    save(&mut window, SaveTarget::Restored, &path);
    assert!(is_said(&window, "session.json"));
}

#[test]
fn the_window_goes_on_while_a_session_is_opened() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.json");
    let mut window = finished(setup());
    save(&mut window, SaveTarget::Session, &path);
    // What was opened is taken when the next frame is drawn, and not before.
    window.state_mut().save(SaveTarget::Restored, path);
    window.state_mut().app_state_mut().select_query(2);
    assert!(app(&window).is_opening() && app(&window).setup.query == 2);
    finish(&mut window);
    assert_eq!(app(&window).setup.query, 1);
}

#[test]
fn a_restored_session_takes_no_frame_of_another_scene_for_its_own() {
    let sequence = SmallSequence::of(&[0, 1]);
    let folder = sequence.folder();
    let scene = folder.to_str().expect("a plain path");
    let path = sequence.path().join("session.json");
    let mut window = finished(setup());
    window.state_mut().save(SaveTarget::Session, path.clone());
    window.step();
    let saved = std::fs::read_to_string(&path).expect("saved");
    let elsewhere = saved.replace("\"walls\"", &format!("{scene:?}"));
    assert_ne!(saved, elsewhere);
    std::fs::write(&path, elsewhere).expect("writable");
    save(&mut window, SaveTarget::Restored, &path);
    finish(&mut window);
    let photo = scene::open(scene, None).and_then(|scene| scene.photo(1));
    let loaded = app(&window).run().loaded.clone();
    let problem = &loaded.expect("it ran").problems[0];
    assert_eq!(problem.query().photo().gray, photo.expect("readable").gray);
}

#[test]
fn what_is_wrong_in_a_session_is_told_with_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.json");
    let mut setup = setup();
    let protocol = &mut setup.task.protocol;
    protocol.select("matches:2".parse().expect("a choice"));
    protocol.fusions = vec!["avg".parse().expect("a fusion")];
    setup.task.params.assign("fb.ratio=0.75").expect("a value");
    setup.task.breakpoints = vec!["inliers < 3".parse().expect("a breakpoint")];
    let mut window = finished(setup);
    window.state_mut().save(SaveTarget::Session, path.clone());
    window.step();
    let good = std::fs::read_to_string(&path).expect("just saved");
    for (from, to, words) in [
        ("session/4", "session/1", "posescope.session/4 expected"),
        ("\"mi\"", "\"mo\"", "`mo` is no method"),
        ("\"avg\"", "\"mean\"", "`mean` is no fusion"),
        ("matches:2", "best:2", "`best:2` is no choice of references"),
        ("inliers <", "inlers <", "`inlers` is not one of"),
        ("fb]\\nratio", "fb]\\nratoi", "`fb.ratoi`"),
        ("\"radius\"", "\"radios\"", "unknown field `radios`"),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good);
        let at = bad.find(to).expect("replaced");
        let line = bad[..at].matches('\n').count() + 1;
        std::fs::write(&path, &bad).expect("writable");
        save(&mut window, SaveTarget::Restored, &path);
        // The schema is told without a line: it is about the whole file.
        let place = match from {
            "session/4" => "session.json: ".to_owned(),
            _ => format!("session.json:{line}: "),
        };
        let note = app(&window).notes.last().expect("it is said");
        let said = &note.text;
        assert!(said.contains(&place) && said.contains(words), "{said}");
        assert!(!said.contains('\n') && note.is_error, "{said}");
    }
}

#[test]
fn a_session_keeps_the_format_and_the_index() {
    let sequence = SmallSequence::of(&[0, 1]);
    let folder = sequence.folder();
    let name = folder.to_str().expect("a plain path");
    let open = |format| -> Arc<dyn Scene> { scene::open(name, format).expect("a scene").into() };
    let mut setup = setup();
    (setup.references, setup.queries) = (open(None), open(None));
    setup.offered = vec![0, 1];
    setup.task.scene = name.to_owned();
    setup.task.protocol.format = Some("kitti".to_owned());
    setup.task.protocol.index = vec!["an.index".into()];
    let path = sequence.path().join("session.json");
    let mut there = finished(setup);
    there.state_mut().save(SaveTarget::Session, path.clone());
    there.step();
    let mut here = finished(self::setup());
    here.state_mut().save(SaveTarget::Restored, path.clone());
    here.step();
    run_until_idle(&mut here);
    let restored = &here.state().app_state().setup;
    assert_eq!(restored.task, there.state().app_state().setup.task);
    let index = restored.index.file().and_then(|file| file.to_str());
    assert_eq!(index, Some("an.index"));
    // A format that does not fit is refused as it would be on the command line.
    let saved = std::fs::read_to_string(&path).expect("saved");
    std::fs::write(&path, saved.replace("\"kitti\"", "\"rosbag\"")).expect("writable");
    save(&mut here, SaveTarget::Restored, &path);
    assert!(is_said(&here, "rosbag"));
}

#[test]
fn the_run_is_saved_as_a_recording_and_its_command_line_is_copied() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rrd");
    let mut window = finished(setup());
    window.state_mut().save(SaveTarget::Recording, path.clone());
    assert!(app(&window).is_working_out(), "the window does not wait");
    wait(&mut window, |app| !app.app_state().is_working_out());
    assert!(is_said(&window, "Recording: "));
    let size = path.metadata().expect("written").len();
    assert!(size > 10_000);
    // A recording that is begun is whole when the window has closed.
    let last = folder.path().join("last.rrd");
    window.state_mut().save(SaveTarget::Recording, last.clone());
    eframe::App::on_exit(window.state_mut());
    // Times of writing differ.
    assert!(last.metadata().expect("written").len().abs_diff(size) < size / 100);
    assert_eq!(
        app(&window).setup.command_line(),
        "posescope run walls --query 000001 --radius 3 --reference 000000 --right 1m,5deg --seed 7"
    );
}

#[test]
fn the_command_line_names_format_prior_and_breakpoints() {
    let mut setup = setup();
    setup.task.protocol.format = Some("kitti".to_owned());
    setup.task.protocol.prior_m = Some(5.0);
    setup.task.breakpoints = vec!["inliers < 3".parse().expect("a breakpoint")];
    assert_eq!(
        setup.command_line(),
        "posescope run walls --query 000001 --format kitti --prior 5 --radius 3 --reference 000000 --right 1m,5deg --seed 7 \
         --break 'inliers < 3'"
    );
    // References that are still to be chosen are chosen in the same way.
    let choice = "nearest:2".parse().expect("a choice");
    setup.task.protocol.select(choice);
    setup.chosen = Vec::new().into();
    let command = setup.command_line();
    has(&command, "--reference nearest:2 ");
}

#[test]
fn the_camera_in_hand_has_costs_of_its_own() {
    let mut window = finished(setup());
    press(&mut window, Modifiers::NONE, Key::Num9);
    let truth = Walls::new().pose(1).expect("known");
    assert_eq!(app(&window).camera, Some(truth));
    wait(&mut window, |app| !app.app_state().is_probing());
    let state = app(&window);
    let probe = state.scoring.probe().expect("answered");
    for (method, comparison) in &probe.comparisons {
        let results = results(&window);
        let result = results.iter().find(|result| result.method == *method);
        let report = result.and_then(|result| result.cost.as_ref()).expect("a cost");
        assert_eq!(comparison.score.cost, report.truth);
    }
    press(&mut window, Modifiers::ALT, Key::ArrowUp);
    let moved = app(&window).camera.expect("in hand");
    assert!((moved.translation.z - truth.translation.z - 0.2).abs() < 1e-9);
    press(&mut window, Modifiers::NONE, Key::Escape);
    assert_eq!(app(&window).camera, None);
}

/// Whatever is registered is shown as the paper's methods are, in glyphs that the fonts have.
#[test]
fn a_method_beyond_the_paper_has_its_place_in_every_view() {
    let mut asked = setup();
    asked.task.protocol.methods = vec!["nid".parse().expect("is registered"), Method::FB];
    let mut window = finished(asked);
    for view in posescope::app::views::ALL {
        send(&mut window, |app| app.app_state_mut().show_alone(Some(view.name)));
    }
    send(&mut window, |app| app.app_state_mut().show_alone(None));
    assert!(is_said(&window, "NID"));
}
