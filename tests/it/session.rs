//! Driving an estimator: pause, step, break, cancel.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::time::{Duration, Instant};

use posescope::event::{Event, ReferencesFused, Stage, StageEnded, StageStarted};
use posescope::fusion::Fusion;
use posescope::localize::{
    LocalizeError, LocalizeObserver, Localizer, NoObserver, QueryResult, Request,
};
use posescope::method::Method;
use posescope::run::Protocol;
use posescope::session::{Breakpoints, Job, Part, RunMode, RunState, Session, Task};
use posescope::trace::{Cancelled, Record, Sink};

use crate::walls_scene::{GREY, UNREADABLE, Walls};

fn job(query: usize) -> Job {
    let scene = Arc::new(Walls::new());
    Job {
        references: scene.clone(),
        queries: scene,
        query,
        chosen: vec![0].into(),
        task: Task {
            protocol: Protocol {
                references: Vec::new(),
                radii_m: vec![3.0],
                seed: 7,
                ..Protocol::default()
            },
            ..Task::of("walls")
        },
        index: Arc::default(),
        frames: Arc::default(),
    }
}

fn start(job: Job, mode: RunMode, breakpoints: &[&str]) -> Session {
    let breakpoints = breakpoints.iter().map(|b| b.parse().expect("a breakpoint"));
    Session::start(job, mode, Breakpoints::new(breakpoints), || {})
}

/// Waits until the session needs somebody.
fn run_until_idle(session: &mut Session) -> RunState {
    let begun = Instant::now();
    loop {
        session.drain();
        match session.state() {
            RunState::Loading | RunState::Running => {}
            state => return state.clone(),
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "it hangs");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Gives an order and waits for what comes of it. The record where the run stands then.
fn order(session: &mut Session, mode: RunMode) -> Event {
    let before = session.run().len();
    session.set_mode(mode);
    loop {
        run_until_idle(session);
        if session.run().len() > before || !session.is_alive() {
            break;
        }
    }
    let last = session.run().records().last().expect("something was told");
    last.event.clone()
}

fn starts(event: &Event) -> Option<Stage> {
    match event {
        Event::StageStarted(StageStarted { stage }) => Some(*stage),
        _ => None,
    }
}

fn ends(event: &Event) -> Option<Stage> {
    match event {
        Event::StageEnded(StageEnded { stage, .. }) => Some(*stage),
        _ => None,
    }
}

fn results(session: &Session) -> Vec<QueryResult> {
    session.run().results().cloned().collect()
}

#[test]
fn a_session_waits_at_the_first_event_and_steps_into_over_and_out() {
    let mut session = start(job(1), RunMode::Paused, &[]);
    assert_eq!(run_until_idle(&mut session), RunState::Paused { breakpoint: None });
    assert_eq!(session.run().len(), 1);
    let first = &session.run().records()[0].event;
    assert_eq!(starts(first), Some(Stage::Estimator(Method::FB)));

    let event = order(&mut session, RunMode::StepInto);
    assert_eq!(starts(&event), Some(Stage::Detect));
    let event = order(&mut session, RunMode::StepOver);
    assert_eq!(ends(&event), Some(Stage::Detect));
    let event = order(&mut session, RunMode::StepOver);
    assert_eq!(starts(&event), Some(Stage::Match));
    let event = order(&mut session, RunMode::StepInto);
    assert!(matches!(event, Event::MatchesDecided(_)));
    // Inside of a stage, the step goes to its end.
    let event = order(&mut session, RunMode::StepOver);
    assert_eq!(ends(&event), Some(Stage::Match));
    let event = order(&mut session, RunMode::StepOut);
    assert_eq!(ends(&event), Some(Stage::Estimator(Method::FB)));
    assert_eq!(run_until_idle(&mut session), RunState::Paused { breakpoint: None });
}

#[test]
fn stepping_gives_the_results_of_running() {
    let mut run = start(job(1), RunMode::Running, &[]);
    assert_eq!(run_until_idle(&mut run), RunState::Finished);
    let mut stepped = start(job(1), RunMode::Paused, &[]);
    run_until_idle(&mut stepped);
    let steps = [RunMode::StepInto, RunMode::StepOver, RunMode::StepOut];
    for mode in steps.into_iter().cycle() {
        order(&mut stepped, mode);
        if !stepped.is_alive() {
            break;
        }
    }
    assert_eq!(results(&run).len(), 4);
    assert_eq!(results(&stepped), results(&run));
    assert_eq!(stepped.run().len(), run.run().len());
}

#[test]
fn a_breakpoint_stops_a_run_and_says_which_it_was() {
    let mut session = start(job(1), RunMode::Running, &["mi.yaw_coarse", "inliers < 1000"]);
    let stopped_by = |text: &str| RunState::Paused { breakpoint: Some(text.to_owned()) };
    assert_eq!(run_until_idle(&mut session), stopped_by("inliers < 1000"));
    let event = order(&mut session, RunMode::Running);
    assert_eq!(starts(&event).map(Stage::name), Some("yaw_coarse"));
    assert_eq!(session.state(), &stopped_by("mi.yaw_coarse"));
    session.set_breakpoints(Breakpoints::default());
    order(&mut session, RunMode::Running);
    assert_eq!(run_until_idle(&mut session), RunState::Finished);
}

#[test]
fn a_running_session_pauses_and_a_paused_one_stays() {
    // The worker holds still at its fifth message, in the middle of its run, until it is to pause.
    let (arrived, arrival) = mpsc::channel();
    let (release, released) = mpsc::channel::<()>();
    let (messages, released) = (AtomicUsize::new(0), Mutex::new(released));
    let wake = move || {
        if messages.fetch_add(1, Ordering::Relaxed) == 4 {
            arrived.send(()).expect("the test waits");
            let released = released.lock().expect("nobody else has it");
            released.recv().expect("the test lets it go");
        }
    };
    let mut session = Session::start(job(1), RunMode::Running, Breakpoints::default(), wake);
    arrival.recv().expect("the run has five messages");
    session.drain();
    assert_eq!(session.state(), &RunState::Running);
    session.set_mode(RunMode::Paused);
    release.send(()).expect("the worker waits");
    assert_eq!(run_until_idle(&mut session), RunState::Paused { breakpoint: None });
    let told = session.run().len();
    session.set_mode(RunMode::Paused);
    std::thread::sleep(Duration::from_millis(30));
    session.drain();
    assert_eq!(session.run().len(), told);
}

#[test]
fn a_paused_session_can_be_cancelled_and_a_dropped_one_ends() {
    let mut session = start(job(1), RunMode::Paused, &[]);
    run_until_idle(&mut session);
    session.cancel();
    while session.is_alive() {
        run_until_idle(&mut session);
        std::thread::yield_now();
        session.drain();
    }
    assert_eq!(session.state(), &RunState::Cancelled);

    let scene = Arc::new(Walls::new());
    let mut dropped = start(
        Job { references: scene.clone(), queries: scene.clone(), ..job(1) },
        RunMode::Paused,
        &[],
    );
    run_until_idle(&mut dropped);
    drop(dropped);
    let begun = Instant::now();
    // The worker's handles on the scene go with it.
    while Arc::strong_count(&scene) > 1 {
        assert!(begun.elapsed() < Duration::from_secs(20), "it lives on");
        std::thread::yield_now();
    }
}

/// Takes in what is told until something is the case.
fn wait(session: &mut Session, is_so: impl Fn(&Session) -> bool) {
    let begun = Instant::now();
    while !is_so(session) {
        assert!(begun.elapsed() < Duration::from_secs(120), "it hangs");
        std::thread::sleep(Duration::from_millis(1));
        session.drain();
    }
}

#[test]
fn a_session_pauses_and_stops_within_a_lattice() {
    let mut endless = job(1);
    endless.task.protocol.methods = vec![Method::PM];
    for change in ["grid.fine_range=5", "grid.fine_step=0.01"] {
        endless.task.params.assign(change).expect("a good value");
    }
    let mut session = start(endless, RunMode::Running, &[]);
    let in_the_lattice = |session: &Session| session.run().len() > 500;
    wait(&mut session, in_the_lattice);
    session.set_mode(RunMode::Paused);
    assert_eq!(run_until_idle(&mut session), RunState::Paused { breakpoint: None });
    let told = session.run().len();
    // A million hypotheses are to come, most of which were not even scored.
    assert!(told < 500_000, "{told}");
    session.set_mode(RunMode::Running);
    wait(&mut session, |session| session.run().len() > told);
    let begun = Instant::now();
    session.cancel();
    wait(&mut session, |session| !session.is_alive());
    assert_eq!(session.state(), &RunState::Cancelled);
    assert!(begun.elapsed() < Duration::from_secs(5));
}

#[test]
fn references_that_are_ranked_can_be_stopped_too() {
    let mut ranked = Job { chosen: Default::default(), ..job(1) };
    let selection = "matches:2".parse().expect("a selection");
    ranked.task.protocol.select(selection);
    let mut stopped = UntilStopped(Arc::new(AtomicBool::new(true)));
    let error = ranked.work(0, &mut stopped, |_| panic!("none was chosen"));
    assert!(error.expect_err("it was stopped").is_cancelled());
}

/// Stops a run whose flag is up.
struct UntilStopped(Arc<AtomicBool>);

impl Sink for UntilStopped {
    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }
    fn attend(&mut self) -> Result<(), Cancelled> {
        Err(Cancelled)
    }
}

impl LocalizeObserver for UntilStopped {
    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(Arc::clone(&self.0))
    }
}

#[test]
fn bad_data_is_said_and_a_hopeless_query_is_a_result() {
    let mut session = start(job(UNREADABLE), RunMode::Running, &[]);
    match run_until_idle(&mut session) {
        RunState::Broken(why) => assert!(why.contains("000004"), "{why}"),
        other => panic!("{other:?}"),
    }
    let mut session = start(job(GREY), RunMode::Running, &[]);
    assert_eq!(run_until_idle(&mut session), RunState::Finished);
    let results = results(&session);
    assert_eq!(results.len(), 4);
    assert!(results[0].pose.is_none() && results[0].reason.is_some());
}

#[test]
fn a_fault_in_the_worker_is_a_state_of_the_session() {
    let mut broken = job(1);
    // This frame has no cloud; the scene of this test panics when asked for one all the same.
    broken.chosen = vec![1].into();
    let mut session = start(broken, RunMode::Running, &[]);
    match run_until_idle(&mut session) {
        RunState::Broken(why) => assert!(why.contains("internal error"), "{why}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_second_run_on_frames_at_hand_reuses_what_it_can() {
    let mut again = job(1);
    let mut first = start(again.clone(), RunMode::Running, &[]);
    run_until_idle(&mut first);
    let params = &mut again.task.params;
    params.assign("fb.ratio=0.7").expect("a good value");
    let mut second = start(again, RunMode::Running, &[]);
    run_until_idle(&mut second);
    let reused: Vec<_> = second
        .run()
        .stages()
        .iter()
        .filter(|bar| bar.depth == 2 && bar.reused)
        .map(|bar| bar.stage.name())
        .collect();
    let direct = ["color", "position_coarse", "position_fine", "yaw_coarse", "yaw_fine"];
    // FB detects nothing anew; PM and MI have all but their assessment.
    assert_eq!(reused[0], "detect");
    assert_eq!(reused[1..6], direct);
    assert_eq!(reused[6..11], direct);
}

#[test]
fn several_references_are_fused_as_without_a_session() {
    let mut several = Job { chosen: vec![0, 2].into(), ..job(1) };
    several.task.protocol.fusions = Fusion::all().collect();
    let task = several.task.clone();
    let mut expected = Vec::new();
    let scene = Walls::new();
    let localizer = Localizer::new(&scene, &scene, &task.params, task.protocol.seed);
    let request = Request {
        radius_m: task.radius_m(),
        references: several.chosen.clone(),
        fusions: task.protocol.fusions.clone(),
        setting: None,
    };
    let keep = |result, _| {
        expected.push(result);
        Ok::<(), LocalizeError>(())
    };
    localizer
        .localize(0, 1, &[request], &task.protocol.methods, &mut NoObserver, keep)
        .expect("good data");

    let mut session = start(several, RunMode::Running, &["fusion"]);
    let at_fusion = RunState::Paused { breakpoint: Some("fusion".to_owned()) };
    assert_eq!(run_until_idle(&mut session), at_fusion);
    session.set_breakpoints(Breakpoints::default());
    order(&mut session, RunMode::Running);
    assert_eq!(run_until_idle(&mut session), RunState::Finished);
    let (fused, alone): (Vec<_>, Vec<_>) =
        results(&session).into_iter().partition(|result| result.fusion.is_some());
    assert_eq!(fused, expected);
    assert_eq!(alone.len(), 4 * 2);
    let run = session.run();
    let parts: Vec<Part> = run.spans().iter().map(|span| span.part).collect();
    let first = [0, 1].map(|reference| Part::Reference(Method::FB, reference));
    assert_eq!(parts[..2], first);
    assert_eq!(parts[2..6], [Part::Fusion(Method::FB); 4]);
    for span in run.spans() {
        let fused = run.latest_in::<ReferencesFused>(span, span.records.end);
        assert_eq!(fused.is_some(), matches!(span.part, Part::Fusion(_)));
    }
}
