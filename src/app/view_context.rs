//! What a view sees: a run at a cursor.

use std::rc::Rc;
use std::sync::Arc;

use super::camera::NamedPose;
use super::command::{Command, Queue};
use super::lecture;
use super::queries::Queries;
use super::scoring::{CostAlong, DenseMap, Probe};
use super::selection::{ResultRow, Results, Wanted};
use super::setup::Setup;
use super::shown::{ShownReason, ShownView};
use super::state::AppState;
use super::textures::Textures;
use super::view_options::ViewOptions;
use crate::estimator::{self, Entry};
use crate::event::{DebugEvent, MinimumAssessed, ReferencesFused, Side, ViewRendered};
use crate::geometry::Pose;
use crate::localize::QueryResult;
use crate::measure::{ConditionError, Migration};
use crate::method::Method;
use crate::problem::Problem;
use crate::session::{Part, Run, RunState, Span};

/// A run at a cursor, and what else of the application's state a view draws from.
#[derive(Clone, Copy)]
pub struct ViewContext<'a> {
    /// The run that is shown: the present one, or A.
    pub run: &'a Run,
    /// Position among its records.
    pub cursor: usize,
    /// What is run: scenes, query, references, parameters.
    pub setup: &'a Setup,
    /// What is switched on and selected.
    pub options: &'a ViewOptions,
    /// Pictures on the graphics card.
    pub textures: &'a Textures,
    /// Thumbnails, and how far the run over all queries is.
    pub queries: &'a Queries,
    /// Results of the queries that were run, by query.
    pub results: &'a Results,
    state: &'a AppState,
    commands: &'a Queue,
}

impl<'a> ViewContext<'a> {
    fn new(run: &'a Run, cursor: usize, state: &'a AppState, commands: &'a Queue) -> Self {
        Self {
            run,
            cursor,
            setup: &state.setup,
            options: &state.options,
            textures: &state.textures,
            queries: &state.queries,
            results: &state.results,
            state,
            commands,
        }
    }

    /// The present run at the cursor.
    pub(super) fn present(state: &'a AppState, commands: &'a Queue) -> Self {
        Self::new(state.run(), state.cursor(), state, commands)
    }

    /// The same at another position among the records of the run.
    pub(super) fn at(&self, cursor: usize) -> Self {
        Self { cursor, ..*self }
    }

    /// What the part at the cursor told last, in words.
    pub(super) fn told(&self) -> Option<String> {
        lecture::latest(self.run, self.span()?, self.cursor)
    }

    /// The kept run at the place that corresponds to the cursor.
    pub(super) fn kept(state: &'a AppState, commands: &'a Queue) -> Option<Self> {
        let (kept, cursor) = (state.kept.as_ref()?, state.kept_cursor()?);
        Some(Self::new(&kept.run, cursor, state, commands))
    }

    /// Whether the run that is shown is the present one, whose parameters can be changed.
    pub fn is_present(&self) -> bool {
        std::ptr::eq(self.run, self.state.run())
    }

    /// The run that this one is compared with: A beside the present one, and the other way round.
    pub fn other_run(&self) -> Option<&'a Run> {
        let kept = &self.state.kept.as_ref()?.run;
        Some(if self.is_present() { kept } else { self.state.run() })
    }

    /// The colours of the theme.
    pub(super) fn visuals(&self) -> egui::Visuals {
        self.state.ctx.global_style().visuals.clone()
    }

    /// Asks for something to be done after this frame.
    pub fn send(&self, command: Command) {
        self.commands.send(command);
    }

    /// Whether a method is known to fail on a query.
    pub fn has_failed(&self, query: usize) -> bool {
        self.state.has_failed(query)
    }

    /// The camera in hand (`world_from_camera`).
    pub fn camera(&self) -> Option<Pose> {
        self.state.camera
    }

    /// The pose under the pointer (`world_from_camera`).
    pub fn hovered(&self) -> Option<Pose> {
        self.state.hovered
    }

    /// The results that are looked at, in the order of the queries: those that meet the condition that was
    /// typed, whose verdict became what was asked for.
    ///
    /// # Errors
    /// What is wrong with the condition.
    pub fn selected(&self) -> Result<Rc<[ResultRow]>, ConditionError> {
        let known = self.state.known();
        let wanted = Wanted {
            condition: self.options.results_filter.clone(),
            change: self.options.verdict_change.clone(),
            only_changed: self.options.only_differences && known.before.is_some(),
        };
        self.state.selection.rows(known, &wanted)
    }

    /// A result that is known.
    pub fn result(&self, row: ResultRow) -> Option<&'a QueryResult> {
        self.state.known().result(row)
    }

    /// Whether there are results A, which those of now are held against.
    pub fn has_results_before(&self) -> bool {
        self.state.known().before.is_some()
    }

    /// What the same method gave for the same query and setting in the results A.
    pub fn result_before(&self, row: ResultRow) -> Option<&'a QueryResult> {
        let known = self.state.known();
        known.before(row.query, known.result(row)?)
    }

    /// What became of the verdicts since the results A, also of those that stayed what they were.
    pub fn migrations(&self) -> Rc<[Migration]> {
        self.state.selection.migrations(self.state.known())
    }

    /// Grows with every change of the known results.
    pub fn results_version(&self) -> u64 {
        self.state.known().version
    }

    /// A pose that the present run's search knows by name (`world_from_camera`).
    pub fn named_pose(&self, name: NamedPose) -> Option<Pose> {
        self.state.named_pose(name)
    }

    /// The query or the reference of a problem, with its scene where there are two.
    pub fn frame_label(&self, side: Side, problem: &Problem) -> String {
        let name = match side {
            Side::Query => &problem.query.name,
            Side::Reference => &problem.reference.name,
        };
        self.setup.label_of(side, name)
    }

    /// The pose that pictures and costs are wanted for, if it is not that of the cursor.
    pub fn looking_at(&self) -> Option<(Pose, ShownReason)> {
        self.state.looking_at()
    }

    /// What is known about the pose that was asked for last.
    pub fn probe(&self) -> Option<&'a Probe> {
        self.state.probe()
    }

    /// What the present run is doing.
    pub fn run_state(&self) -> &'a RunState {
        self.state.run_state()
    }

    /// Whether the answer for the pose that is looked at is still worked out.
    pub fn is_probing(&self) -> bool {
        self.state.is_probing()
    }

    /// What is known of a method's cost along the line that was asked for last, of the present run.
    pub fn cost_along(&self, method: Method) -> Option<&'a CostAlong> {
        self.state.cost_along(method)
    }

    /// The dense map of a method that was asked for last, of the present run.
    pub fn dense_map(&self, method: Method) -> Option<&'a DenseMap> {
        self.state.dense_map(method)
    }

    /// The part of the run that the cursor is in.
    pub fn span(&self) -> Option<&'a Span> {
        self.run.span_at(self.cursor)
    }

    /// The estimator at the cursor.
    pub fn method(&self) -> Option<Method> {
        self.span().and_then(|span| span.part.method())
    }

    /// The reference that is looked at, by its position among those of the run.
    pub fn reference(&self) -> usize {
        self.run.reference_at(self.cursor)
    }

    /// The problem at the cursor.
    pub fn problem(&self) -> Option<&'a Problem> {
        let loaded = self.run.loaded.as_deref()?;
        loaded.problems.get(self.reference())
    }

    /// The true pose of the query, if it is known and shown.
    pub fn truth(&self) -> Option<&'a Pose> {
        if !self.options.shows_truth {
            return None;
        }
        self.run.loaded.as_deref()?.truth.as_ref()
    }

    /// The latest event of a type at or before the cursor, told by the estimator there.
    pub fn latest<E: DebugEvent + 'static>(&self) -> Option<&'a E> {
        self.run.latest(self.cursor)
    }

    /// All events of a type up to the cursor, told by the estimator there.
    pub fn all<E: DebugEvent + 'static>(&self) -> impl DoubleEndedIterator<Item = (usize, &'a E)> {
        self.run.all_until(self.cursor)
    }

    /// The part of an estimator on the reference that is looked at, and the cursor for it: its last
    /// record, or the cursor itself where it is the estimator at the cursor.
    pub fn part_of(&self, method: Method) -> Option<(&'a Span, usize)> {
        let part = Part::Reference(method, self.reference());
        if let Some(span) = self.span()
            && span.part == part
        {
            return Some((span, self.cursor));
        }
        let span = self.run.span_of(part)?;
        let last = span.records.end.checked_sub(1)?;
        let is_future = last > self.cursor;
        (!is_future || !self.options.hides_future).then_some((span, last))
    }

    /// The latest event of a type that a method has told: up to the cursor if the cursor is in its
    /// part, else in all of its part.
    pub fn latest_of<E: DebugEvent + 'static>(&self, method: Method) -> Option<&'a E> {
        let (span, cursor) = self.part_of(method)?;
        self.run.latest_in(span, cursor)
    }

    /// The methods whose cost can be looked at: those of this run that search one, those of the paper
    /// where there are none.
    pub fn direct_methods(&self) -> Vec<Method> {
        self.setup.direct_methods()
    }

    /// The direct method whose pictures are shown: that at the cursor, for the others that inside a
    /// hybrid, MI if the run has it.
    pub fn direct_method(&self) -> Method {
        let direct = self.direct_methods();
        let here = self.method();
        let inside = here.and_then(estimator::find).and_then(Entry::hybrid);
        [here, inside.map(|parts| parts.second), Some(Method::MI)]
            .into_iter()
            .flatten()
            .chain(direct.first().copied())
            .find(|method| direct.contains(method))
            .unwrap_or(Method::MI)
    }

    /// The method in whose part of the run the search of [`Self::direct_method`] is told: a hybrid,
    /// if the cursor is in one.
    pub fn searching_method(&self) -> Method {
        self.method()
            .filter(|&here| estimator::find(here).and_then(Entry::hybrid).is_some())
            .unwrap_or_else(|| self.direct_method())
    }

    /// Whether the cursor is in a hybrid that runs this method inside itself.
    pub fn is_inside_hybrid(&self, method: Method) -> bool {
        let here = self.method().and_then(estimator::find);
        here.and_then(|entry| entry.hybrid())
            .is_some_and(|parts| parts.first == method || parts.second == method)
    }

    /// The synthetic view to show for a direct method: under the pointer, of the camera in hand, or
    /// the latest that the estimator rendered.
    pub fn shown(&self, method: Method) -> Option<ShownView> {
        if let Some((_, reason)) = self.looking_at()
            && let Some(probe) = self.probe()
            && let Some((_, comparison)) = probe.comparisons.iter().find(|(of, _)| *of == method)
        {
            // While the answer for this pose is worked out the last one stays, under its own pose.
            return Some(ShownView {
                comparison: Arc::clone(comparison),
                pose: probe.pose,
                reason,
            });
        }
        // A hybrid's views are those of the direct method inside it. Where it kept the other's pose it
        // has none.
        let within_hybrid = if self.is_inside_hybrid(method) { self.latest() } else { None };
        let event: &ViewRendered = within_hybrid.or_else(|| self.latest_of(method))?;
        let problem = self.problem()?;
        Some(ShownView {
            comparison: Arc::clone(&event.comparison),
            pose: problem.world_from_query(&event.offset.reference_from_camera()),
            reason: ShownReason::Event(event.moment),
        })
    }

    /// The estimate of a method on the reference at the cursor, in a fusion of that method the fused
    /// one (`world_from_camera`).
    pub fn estimate(&self, method: Method) -> Option<Pose> {
        if self.span()?.part == Part::Fusion(method) {
            return self.latest::<ReferencesFused>()?.pose;
        }
        let (span, _) = self.part_of(method)?;
        let span = Some(span).filter(|span| self.state.has_come(span))?;
        span.result.as_ref()?.pose.as_ref()?.to_pose()
    }

    /// Costs of a direct method that a cost can be placed between: with shuffled pixels and at the
    /// truth.
    pub fn cost_bounds(&self, method: Method) -> CostBounds {
        let assessed = self.latest_of::<MinimumAssessed>(method);
        let report = self
            .part_of(method)
            .filter(|(span, _)| self.state.has_come(span))
            .and_then(|(span, _)| span.result.as_ref()?.cost.as_ref());
        CostBounds {
            shuffled: assessed.and_then(|assessed| assessed.shuffled),
            best: assessed.map(|assessed| assessed.best),
            truth: report.and_then(|report| report.truth).filter(|_| self.options.shows_truth),
        }
    }
}

/// What a cost can be compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CostBounds {
    /// Cost of images that have nothing to do with each other.
    pub shuffled: Option<f64>,
    /// Cost at the result of the search.
    pub best: Option<f64>,
    /// Cost at the true pose.
    pub truth: Option<f64>,
}
