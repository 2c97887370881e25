//! The application's state: the run, the cursor in it, the camera in hand, what is switched on.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::prober::{Probe, Prober};
use super::queries::Queries;
use super::setup::Setup;
use super::shown::ShownReason;
use super::textures::Textures;
use crate::geometry::Pose;
use crate::localize::QueryResult;
use crate::params::Params;
use crate::scene::FrameStore;
use crate::session::{Breakpoints, Part, Run, RunMode, RunState, Session};

/// Which of two runs is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareMode {
    /// The present run, B.
    #[default]
    Present,
    /// The run that was kept, A.
    Kept,
    /// Both, beside each other.
    SideBySide,
}

/// Something to tell the person at the window.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// What to tell, in one line.
    pub text: String,
    /// Whether something went wrong.
    pub is_error: bool,
}

/// A run that was kept to be compared with.
pub struct KeptRun {
    /// The run as it was kept.
    pub run: Run,
    /// Where the cursor was.
    pub cursor: usize,
}

/// Results by query.
pub type Results = BTreeMap<usize, Vec<QueryResult>>;

/// The state of the application: everything that the views draw from.
pub struct AppState {
    /// What is run: scenes, query, references, parameters.
    pub setup: Setup,
    /// The parameters of the setup, shared with the prober.
    pub(super) params: Arc<Params>,
    /// Frames of the setup's scenes, with what its runs have worked out about them.
    frames: Arc<FrameStore>,
    pub(super) session: Session,
    pub(super) ctx: egui::Context,
    /// Position among the records of the present run.
    pub cursor: usize,
    /// Whether the cursor goes along with new records.
    pub follows: bool,
    /// Where the cursor is to be once the new run has come so far.
    pub(super) anchor: Option<Anchor>,
    /// The run A, if one was kept.
    pub kept: Option<KeptRun>,
    /// Which of the runs is shown.
    pub compare_mode: CompareMode,
    /// Whether the ground truth is shown.
    pub shows_truth: bool,
    /// Whether only what differs is shown.
    pub only_differences: bool,
    /// Whether the picture blinks, and which of the two it shows now.
    pub blinking: bool,
    /// Whether the keyboard is wanted by the filter.
    pub wants_filter: bool,
    /// The query feature that is looked at.
    pub selected_feature: Option<usize>,
    /// The pose under the pointer (`world_from_camera`).
    pub hovered: Option<Pose>,
    /// The camera in hand (`world_from_camera`).
    pub camera: Option<Pose>,
    /// Where the camera was before the last jump.
    pub(super) camera_before: Option<Pose>,
    pub(super) prober: Prober,
    /// The queries, what is known of them.
    pub queries: Queries,
    /// The latest notes, the newest last.
    pub notes: Vec<Note>,
    /// Pictures on the graphics card.
    pub textures: Textures,
    /// Results of the queries that were run, by query.
    pub results: Results,
    /// The results that the window was opened with, which a restored session goes back to.
    first_results: Results,
}

/// A place in a run for the cursor, which can be found again in another run.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Anchor {
    /// The place by what the estimator was doing there.
    Stage(StagePosition),
    /// The place by the number of its record.
    Record(usize),
}

impl Anchor {
    fn find(&self, run: &Run) -> Option<usize> {
        match self {
            Self::Stage(position) => position.find(run),
            Self::Record(record) => (*record < run.len()).then_some(*record),
        }
    }
}

/// What an estimator was doing at a record.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StagePosition {
    part: Part,
    /// The stages around it, by name, the outermost first.
    stages: Vec<&'static str>,
    /// How many records into the innermost stage.
    records_in: usize,
    /// Whether it was the last record of the stage.
    is_end: bool,
}

impl StagePosition {
    fn of(run: &Run, cursor: usize) -> Option<Self> {
        let span = run.span_at(cursor)?;
        let stages: Vec<_> = run.stages_at(cursor).collect();
        let innermost = stages.last()?;
        Some(Self {
            part: span.part,
            stages: stages.iter().map(|bar| bar.stage.name()).collect(),
            records_in: cursor - innermost.records.start,
            is_end: cursor + 1 == innermost.records.end && innermost.succeeded.is_some(),
        })
    }

    /// The same place in another run, if the run has come so far.
    fn find(&self, run: &Run) -> Option<usize> {
        let span = run.span_of(self.part)?;
        let inside = |records: &std::ops::Range<usize>| {
            span.records.start <= records.start && records.end <= span.records.end
        };
        let bar = run.stages().iter().find(|bar| {
            inside(&bar.records)
                && bar.depth == self.stages.len()
                && run
                    .stages_at(bar.records.start)
                    .map(|bar| bar.stage.name())
                    .eq(self.stages.iter().copied())
        });
        match bar {
            Some(bar) => {
                let last = bar.records.end - 1;
                let wanted = bar.records.start + self.records_in;
                match (bar.succeeded.is_some(), self.is_end) {
                    (true, true) => Some(last),
                    (true, false) => Some(wanted.min(last)),
                    (false, true) => None,
                    (false, false) => (wanted <= last).then_some(wanted),
                }
            }
            // The stage is not part of this run: the estimator stopped before it.
            None => span.result.as_ref().map(|_| span.records.end - 1),
        }
    }
}

impl AppState {
    pub(super) fn new(setup: Setup, ctx: egui::Context) -> Self {
        let params = Arc::new(setup.task.params.clone());
        let frames = Arc::default();
        let session = start(&setup, setup.mode, &frames, &ctx);
        Self {
            params,
            prober: Prober::new(ctx.clone()),
            queries: Queries::new(ctx.clone()),
            frames,
            session,
            ctx,
            cursor: 0,
            follows: true,
            anchor: None,
            kept: None,
            compare_mode: CompareMode::default(),
            shows_truth: true,
            only_differences: false,
            blinking: false,
            wants_filter: false,
            selected_feature: None,
            hovered: None,
            camera: None,
            camera_before: None,
            notes: Vec::new(),
            textures: Textures::default(),
            results: Results::new(),
            first_results: Results::new(),
            setup,
        }
    }

    /// Takes results over that were known before the window was opened.
    pub(super) fn know_results(&mut self, results: Results) {
        self.results.clone_from(&results);
        self.first_results = results;
    }

    /// The present run.
    pub fn run(&self) -> &Run {
        self.session.run()
    }

    /// What the present run is doing.
    pub fn run_state(&self) -> &RunState {
        self.session.state()
    }

    /// The place in the kept run that corresponds to the cursor.
    pub(super) fn kept_cursor(&self) -> Option<usize> {
        let kept = self.kept.as_ref()?;
        let same = StagePosition::of(self.run(), self.cursor).and_then(|here| here.find(&kept.run));
        Some(same.unwrap_or(kept.cursor))
    }

    /// The pose that pictures and costs are wanted for, if it is not that of the cursor.
    pub fn looking_at(&self) -> Option<(Pose, ShownReason)> {
        self.hovered
            .map(|pose| (pose, ShownReason::Pointer))
            .or_else(|| self.camera.map(|pose| (pose, ShownReason::Camera)))
    }

    /// What is known about the pose that was asked for last.
    pub fn probe(&self) -> Option<&Probe> {
        self.prober.latest()
    }

    /// Whether the answer for the pose that is looked at is still worked out.
    pub fn is_probing(&self) -> bool {
        self.looking_at().is_some() && self.prober.is_busy()
    }

    /// Takes in what the threads have to say.
    pub(super) fn poll(&mut self) {
        let was_alive = self.session.is_alive();
        if self.session.drain() {
            if let Some(chosen) = self.session.chosen()
                && *chosen != self.setup.chosen
            {
                self.setup.chosen = chosen.clone();
            }
            let last = self.session.run().len().saturating_sub(1);
            if let Some(anchor) = &self.anchor {
                match anchor.find(self.session.run()) {
                    Some(at) => {
                        self.cursor = at;
                        self.anchor = None;
                    }
                    None if !self.session.is_alive() => {
                        self.cursor = last;
                        self.anchor = None;
                    }
                    None => self.cursor = last,
                }
            } else if self.follows {
                self.cursor = last;
            }
            if was_alive && !self.session.is_alive() {
                self.on_run_end();
            }
        }
        if let Err(why) = self.prober.poll() {
            self.note(why, true);
        }
        for (query, outcome) in self.queries.poll() {
            match outcome {
                Ok(results) => {
                    self.results.insert(query, results);
                }
                Err(why) => self.note(why, true),
            }
        }
        // The query at work comes first.
        if *self.session.state() != RunState::Loading {
            self.queries.paint_thumbnails(&self.setup);
        }
        if let Some((pose, _)) = self.looking_at()
            && let Some(problem) = self.problem().cloned()
        {
            let methods = self.setup.direct_methods();
            self.prober.ask(&problem, &methods, &self.params, pose);
        }
    }

    fn problem(&self) -> Option<&crate::problem::Problem> {
        let loaded = self.run().loaded.as_deref()?;
        loaded.problems.get(self.run().reference_at(self.cursor))
    }

    fn on_run_end(&mut self) {
        match self.session.state() {
            RunState::Finished => {
                let results = self.session.run().results().cloned().collect();
                self.results.insert(self.setup.query, results);
            }
            RunState::Broken(why) => self.note(why.clone(), true),
            _ => {}
        }
    }

    /// Tells the person at the window.
    pub fn note(&mut self, text: impl Into<String>, is_error: bool) {
        const KEPT: usize = 5;
        self.notes.push(Note {
            text: text.into(),
            is_error,
        });
        let surplus = self.notes.len().saturating_sub(KEPT);
        self.notes.drain(..surplus);
    }

    /// Another query, or other references: everything begins anew.
    pub(super) fn start_run(&mut self, mode: RunMode) {
        // The run before would go on beside the new one.
        self.session.cancel();
        self.session = start(&self.setup, mode, &self.frames, &self.ctx);
        self.cursor = 0;
        self.follows = true;
        self.anchor = None;
        self.hovered = None;
        self.selected_feature = None;
        self.prober.forget();
    }

    /// What all queries were run with holds no longer.
    pub(super) fn stop_queries(&mut self) {
        if self.queries.stop_all() {
            self.note(
                "The run over all queries has stopped: its settings were changed",
                false,
            );
        }
    }

    /// Another setup altogether; the cursor goes to a record as soon as the run has come so far.
    pub(super) fn restore(&mut self, setup: Setup, cursor: usize) {
        self.results = self.first_results.clone();
        self.queries = Queries::new(self.ctx.clone());
        self.setup = setup;
        self.params = Arc::new(self.setup.task.params.clone());
        self.kept = None;
        self.compare_mode = CompareMode::default();
        // The scenes are others, even where they have the same names.
        self.frames = Arc::default();
        self.start_run(RunMode::Running);
        self.follows = false;
        self.anchor = Some(Anchor::Record(cursor));
    }

    /// Other settings for the same query: what does not depend on them is reused, and the cursor
    /// stays where it was, in meaning.
    pub(super) fn restart_run(&mut self) {
        self.stop_queries();
        let anchor = StagePosition::of(self.run(), self.cursor).map(Anchor::Stage);
        let follows = self.follows && self.session.is_alive();
        self.params = Arc::new(self.setup.task.params.clone());
        self.start_run(RunMode::Running);
        self.follows = follows;
        self.anchor = anchor;
    }
}

fn start(setup: &Setup, mode: RunMode, frames: &Arc<FrameStore>, ctx: &egui::Context) -> Session {
    let ctx = ctx.clone();
    Session::start(
        setup.job(frames),
        mode,
        Breakpoints::new(setup.task.breakpoints.iter().cloned()),
        move || ctx.request_repaint(),
    )
}
