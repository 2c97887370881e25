//! The application's state: the run, the cursor in it, the trial camera, what is switched on.

mod shown;

use std::cell::Cell;
use std::time::Duration;

use egui::TextureHandle;

use super::navigation::{Anchor, Navigation};
use super::opening::Opening;
use super::queries::Queries;
use super::run_pictures::RunPictures;
use super::scoring::{CostLine, DenseAsk, Scoring};
use super::selection::{BatchResults, KnownResults, Results};
use super::setup::Setup;
use super::shown::ShownReason;
use super::textures::Textures;
use super::view_options::{Arrangement, CompareMode, ViewOptions};
use super::worker::Worker;
use crate::event::Side;
use crate::geometry::Pose;
use crate::lesson::{Moment, SettingError};
use crate::localize::QueryResult;
use crate::run::Protocol;
use crate::session::{Breakpoints, Part, Run, RunMode, RunState, Session, Span};

/// Something to tell the person at the window.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// What to tell, in one line.
    pub text: String,
    /// Whether something went wrong.
    pub is_error: bool,
    /// When it goes by itself \[s of the window's clock\]; what went wrong stays longer.
    until_s: f64,
}

/// A run that was kept to be compared with.
pub struct KeptRun {
    /// The run as it was kept.
    pub run: Run,
    /// Where the cursor was.
    pub cursor: usize,
    pub(super) pictures: RunPictures,
}

/// The state of the application: everything that the views draw from.
pub struct AppState {
    /// What is run: scenes, query, references, parameters.
    pub setup: Setup,
    pub(super) session: Session,
    pub(super) ctx: egui::Context,
    pub(super) navigation: Navigation,
    /// Pictures of the present run.
    pictures: RunPictures,
    /// Whether the window goes to the cause as soon as the run ends.
    pub(super) opens_at_cause: bool,
    /// The run A, if one was kept.
    pub kept: Option<KeptRun>,
    /// What is switched on and selected.
    pub options: ViewOptions,
    /// The pose that was under the pointer when the last frame was drawn (`world_from_camera`).
    pub hovered: Option<Pose>,
    /// The pose under the pointer, set by the view that is pointed at while a frame is drawn.
    pub pointed_at: Cell<Option<Pose>>,
    /// The trial camera (`world_from_camera`).
    pub camera: Option<Pose>,
    /// Where the camera was before the last jump.
    pub(super) camera_before: Option<Pose>,
    /// What the costs say of poses that the run did not try.
    pub scoring: Scoring,
    /// The queries, what is known of them.
    pub queries: Queries,
    /// The latest notes, the newest last.
    pub notes: Vec<Note>,
    /// Pictures on the graphics card.
    pub textures: Textures,
    /// Results of the queries that were run, by query.
    pub results: BatchResults,
    /// The results that the window was opened with, which a restored session goes back to.
    first_results: Results,
    /// Records runs; its answers are notes.
    pub(super) recorder: Worker<Result<String, String>>,
    /// Opens other scenes.
    pub(super) opener: Worker<Opened>,
}

/// Scenes that were opened beside the window's thread, as setups.
pub(super) enum Opened {
    /// Those of a saved session, with its cursor and layout.
    Session(Result<(Setup, usize, Arrangement), String>),
    /// Those of a page of the lesson that localises this.
    Page(String, Result<Setup, SettingError>),
    /// Another scene, run or lesson.
    Other(Box<Result<Opening, String>>),
}

impl AppState {
    pub(super) fn new(setup: Setup, ctx: egui::Context) -> Self {
        let session = start(&setup, setup.mode, &ctx);
        Self {
            scoring: Scoring::new(&ctx),
            queries: Queries::new(ctx.clone()),
            session,
            pictures: RunPictures::new(&ctx),
            opens_at_cause: true,
            navigation: Navigation::default(),
            kept: None,
            options: ViewOptions {
                shows_queries: true,
                shows_inspector: true,
                shows_truth: true,
                ..ViewOptions::default()
            },
            hovered: None,
            pointed_at: Cell::default(),
            camera: None,
            camera_before: None,
            notes: Vec::new(),
            textures: Textures::default(),
            results: BatchResults::default(),
            first_results: Results::new(),
            recorder: Worker::new("recorder", &ctx),
            opener: Worker::new("opener", &ctx),
            setup,
            ctx,
        }
    }

    /// Takes results over that were known before the window was opened.
    pub(super) fn set_known_results(&mut self, results: KnownResults) {
        self.results.examined = results.examined;
        self.results.set(results.now.clone());
        self.first_results = results.now;
        self.set_results_before(results.before);
    }

    /// Takes over what the results of now are held against; without any, nothing.
    pub(super) fn set_results_before(&mut self, before: Option<Results>) {
        self.results.set_before(before);
        self.options.verdict_change = None;
    }

    /// The present run.
    pub fn run(&self) -> &Run {
        self.session.run()
    }

    /// Position among the records of the present run.
    pub fn cursor(&self) -> usize {
        self.navigation.cursor()
    }

    /// Whether a part of the run is finished at the cursor, or at the common step of the lock-step view. Without the
    /// option that hides the future, every part counts as finished.
    pub(super) fn is_finished_at_cursor(&self, span: &Span) -> bool {
        match self.options.lockstep {
            Some(step) => span.records.len() <= step + 1,
            None => !self.options.hides_future || span.records.end <= self.cursor() + 1,
        }
    }

    /// What the present run is doing.
    pub fn run_state(&self) -> &RunState {
        self.session.state()
    }

    /// The place in the kept run that corresponds to the cursor.
    pub(super) fn kept_cursor(&self) -> Option<usize> {
        let kept = self.kept.as_ref()?;
        let same = self.navigation.counterpart(self.run(), &kept.run);
        Some(same.unwrap_or(kept.cursor))
    }

    /// The pose that pictures and costs are wanted for, if it is not that of the cursor.
    pub fn looking_at(&self) -> Option<(Pose, ShownReason)> {
        self.hovered
            .map(|pose| (pose, ShownReason::Pointer))
            .or_else(|| self.camera.map(|pose| (pose, ShownReason::Camera)))
    }

    /// Whether the answer for the pose that is looked at is still worked out.
    pub fn is_probing(&self) -> bool {
        self.looking_at().is_some() && self.scoring.is_probing()
    }

    /// Lets notes go that were there long enough.
    fn forget_notes(&mut self) {
        let now_s = self.ctx.input(|input| input.time);
        let is_over = |note: &Note| note.until_s <= now_s;
        self.notes.retain(|note| !is_over(note));
        let next = self.notes.iter().map(|note| note.until_s);
        if let Some(next_s) = next.min_by(f64::total_cmp) {
            let rest = Duration::from_secs_f64(next_s - now_s);
            self.ctx.request_repaint_after(rest);
        }
    }

    /// Takes in the answers of the threads.
    pub(super) fn poll(&mut self) {
        self.forget_notes();
        let was_alive = self.session.is_alive();
        if self.session.drain() {
            if let Some(chosen) = self.session.run().chosen.as_ref()
                && *chosen != self.setup.chosen
            {
                self.setup.chosen = chosen.clone();
            }
            self.navigation.on_records(self.session.run(), self.session.is_alive());
            if was_alive && !self.session.is_alive() {
                self.on_run_end();
            }
        }
        for recorded in self.recorder.poll() {
            let said = recorded.unwrap_or_else(|| Err("internal error while recording".to_owned()));
            let is_error = said.is_err();
            self.note(said.unwrap_or_else(|why| why), is_error);
        }
        for (query, outcome) in self.queries.poll() {
            match outcome {
                Ok(results) => self.results.insert(query, results),
                Err(why) => self.note(why, true),
            }
        }
        if let Some((pose, _)) = self.looking_at()
            && let Some(problem) = self.run().problem_at(self.cursor()).cloned()
        {
            let methods = self.setup.direct_methods();
            self.scoring.ask(&problem, methods, &self.session.run().params, pose);
        }
        self.pictures.update(self.session.run(), self.options.shows_truth);
        if let Some(kept) = &mut self.kept {
            kept.pictures.update(&kept.run, self.options.shows_truth);
        }
        for why in self.scoring.poll() {
            self.note(why, true);
        }
    }

    /// The small picture of a frame, once it is made; asking for it has it made. The query at work comes first.
    pub(super) fn frame_picture(&self, side: Side, frame: usize) -> Option<TextureHandle> {
        let is_loading = *self.session.state() == RunState::Loading;
        self.queries.thumbnail(side, frame, (!is_loading).then_some(&self.setup))
    }

    /// Whether other scenes are being opened: those of a session, or of a page of the lesson.
    pub fn is_opening(&self) -> bool {
        self.opener.is_busy()
    }

    /// Opens other scenes beside the window's thread. What was to be opened before is not wanted any more.
    pub(super) fn open(&mut self, job: impl FnOnce() -> Opened + Send + 'static) {
        self.opener.forget();
        self.opener.ask(move |emit| {
            emit(job());
        });
    }

    /// Whether anything is still done beside a run: for what the views show, or for a file.
    pub fn is_working_out(&self) -> bool {
        self.is_probing()
            || self.recorder.is_busy()
            || self.is_opening()
            || self.scoring.is_tracing()
            || self.scoring.is_filling()
            || self.queries.is_painting()
            || self.pictures.is_busy()
            || self.kept.as_ref().is_some_and(|kept| kept.pictures.is_busy())
    }

    /// Has the cost along a line worked out for the problem at the cursor.
    pub(super) fn trace_line(&mut self, line: CostLine) {
        if let Some(problem) = self.run().problem_at(self.cursor()).cloned() {
            self.scoring.trace(&problem, &self.session.run().params, line);
        }
    }

    /// Has a dense map filled, as long as somebody looks at it.
    pub(super) fn fill_dense_map(&mut self, ask: DenseAsk) {
        let run = self.session.run();
        if let Some(problem) = run.problems().get(ask.reference) {
            self.scoring.fill(problem, &run.params, ask);
        }
    }

    /// Goes to the first method that is wrong or contradicted and shows why; where all are right, to the end of the first.
    /// The fused pose of a method answers for its references.
    fn go_to_cause(&mut self) {
        let run = self.session.run();
        let has_result = |part: Part| run.span_of(part).is_some_and(|span| span.result.is_some());
        let answers = |span: &&Span| match span.part {
            Part::Reference(method, _) => !has_result(Part::Fusion(method)),
            _ => true,
        };
        let results = run.spans().iter().filter(answers);
        let mut results = results.filter_map(|span| Some((span.part, span.result.as_ref()?)));
        let has_failed = |(_, result): &(Part, &QueryResult)| {
            result.shown(self.options.shows_truth).is_suspect()
        };
        let failed = results.clone().find(has_failed).map(|(part, _)| (part, true));
        let first = results.next().map(|(part, _)| (part, false));
        if let Some((part, why)) = failed.or(first) {
            self.show_part(part, why);
        }
    }

    /// Shows what a part of the run came to: why it failed, or its end.
    pub fn show_outcome(&mut self, part: Part) {
        self.show_part(part, self.needs_why(part));
    }

    /// Moves the cursor to the end of a part of the run, where `why` with the picture that proves its result.
    pub(super) fn show_part(&mut self, part: Part, why: bool) {
        let last = self.run().span_of(part).and_then(|span| span.records.end.checked_sub(1));
        match (last, part.method()) {
            (Some(last), _) => {
                self.move_cursor(last);
                self.options.shows_why = why;
            }
            (None, Some(method)) => {
                self.note(format!("{} has not begun yet", method.label()), false);
            }
            (None, None) => {}
        }
    }

    fn on_run_end(&mut self) {
        match self.session.state() {
            RunState::Finished => {
                let results = self.session.run().results().cloned().collect();
                self.results.insert(self.setup.query, results);
                if self.opens_at_cause && self.navigation.follows() {
                    self.go_to_cause();
                }
            }
            RunState::Broken(why) => self.note(why.clone(), true),
            _ => {}
        }
    }

    /// Tells the person at the window.
    pub fn note(&mut self, text: impl Into<String>, is_error: bool) {
        const KEPT: usize = 5;
        /// Long enough to read two lines \[s\].
        const LASTING_S: f64 = 10.0;
        /// An error stays longer, so that a user who looked elsewhere finds it \[s\].
        const ERROR_S: f64 = 60.0;
        let now_s = self.ctx.input(|input| input.time);
        self.notes.push(Note {
            text: text.into(),
            is_error,
            until_s: now_s + if is_error { ERROR_S } else { LASTING_S },
        });
        let surplus = self.notes.len().saturating_sub(KEPT);
        self.notes.drain(..surplus);
    }

    /// Takes a note away.
    pub(super) fn dismiss(&mut self, index: usize) {
        if index < self.notes.len() {
            self.notes.remove(index);
        }
    }

    /// Another query, or other references: everything begins anew.
    pub(super) fn start_run(&mut self, mode: RunMode) {
        // The run before would go on beside the new one.
        self.session.cancel();
        self.session = start(&self.setup, mode, &self.ctx);
        self.navigation = Navigation::default();
        self.hovered = None;
        self.options.selected_feature = None;
        self.pictures.forget();
        self.options.shows_why = false;
        self.opens_at_cause = mode == RunMode::Running;
        self.scoring.forget();
    }

    /// Explains the results that are wrong, or no longer; what was computed is at hand.
    pub(super) fn switch_explaining(&mut self) {
        if self.run().loaded.is_some() && self.run().truth().is_none() {
            let words = "What would help is judged by the truth, which is not known here; the inspector says how far the pose \
                         can be trusted";
            self.note(words, false);
            return;
        }
        let explain = &mut self.setup.task.protocol.explain;
        *explain = match *explain {
            0 => Protocol::EXPLAINING_RUNS,
            _ => 0,
        };
        let is_over = *explain == 0;
        let shows_why = self.options.shows_why;
        self.restart_run();
        // The estimates are at hand: the picture of the cause stays, and only the remedies are new.
        self.options.shows_why = shows_why;
        // What is tried, the button says.
        if is_over {
            self.note("Remedies are no longer tried", false);
        }
    }

    /// What all queries were run with holds no longer.
    pub(super) fn stop_queries(&mut self) {
        if self.queries.stop_all() {
            self.note("The run over all queries has stopped: its settings were changed", false);
        }
    }

    /// Another setup altogether; the cursor goes to a record as soon as the run has come so far.
    pub(super) fn restore(&mut self, setup: Setup, cursor: usize) {
        self.queries = Queries::new(self.ctx.clone());
        self.change_setup(setup, Navigation::towards(Anchor::Record(cursor)));
        self.results.set(self.first_results.clone());
    }

    /// Another setup whose scenes are partly those of this one; the cursor goes where `navigation` says.
    pub(super) fn change_setup(&mut self, setup: Setup, navigation: Navigation) {
        self.stop_queries();
        self.results.set(Results::new());
        self.set_results_before(None);
        self.setup = setup;
        self.kept = None;
        self.options.compare_mode = CompareMode::default();
        self.camera = None;
        self.start_run(RunMode::Running);
        self.navigation = navigation;
    }

    /// Takes the cursor to a moment of the present run, as soon as the run has come so far.
    pub(super) fn seek(&mut self, moment: Moment) {
        let is_alive = self.session.is_alive();
        self.navigation.seek(moment, self.session.run(), is_alive);
    }

    /// Other settings for the same query: what does not depend on them is reused, and the cursor
    /// stays where it was, in meaning.
    pub(super) fn restart_run(&mut self) {
        self.stop_queries();
        let is_alive = self.session.is_alive();
        let navigation = self.navigation.towards_same(self.run(), is_alive);
        self.start_run(RunMode::Running);
        self.navigation = navigation;
    }
}

fn start(setup: &Setup, mode: RunMode, ctx: &egui::Context) -> Session {
    let ctx = ctx.clone();
    let breakpoints = Breakpoints::new(setup.task.breakpoints.iter().cloned());
    Session::start(setup.job.clone(), mode, breakpoints, move || ctx.request_repaint())
}
