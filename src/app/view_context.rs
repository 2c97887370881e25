//! What a view sees: a run at a cursor.

use std::sync::Arc;

use super::App;
use super::command::Queue;
use super::setup::Setup;
use super::shown::{ShownReason, ShownView};
use super::state::AppState;
use super::view_options::ViewOptions;
use crate::diagnosis::PoseConfidence;
use crate::estimator::{self, Entry};
use crate::event::{DebugEvent, MinimumAssessed, ReferencesFused, ViewRendered};
use crate::geometry::Pose;
use crate::localize::QueryResult;
use crate::method::Method;
use crate::problem::Problem;
use crate::session::{Part, Run, Span};

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
    /// All that is not of one run: queries, results, the trial camera, what is worked out beside a run.
    pub state: &'a AppState,
    commands: &'a Queue,
}

impl<'a> ViewContext<'a> {
    /// The run that is shown, at the cursor in it.
    pub(super) fn new(state: &'a AppState, commands: &'a Queue) -> Self {
        let (run, cursor) = (state.shown_run(), state.shown_cursor());
        Self { run, cursor, setup: &state.setup, options: &state.options, state, commands }
    }

    /// Says in the unit of the scene what words say in metres.
    pub(super) fn in_unit(&self, words: &str) -> String {
        self.setup.task.params.scale.unit().words(words)
    }

    /// A unit behind a number; metres of a model without metric scale are units.
    pub(super) fn suffix(&self, unit: &str) -> String {
        match (unit, self.setup.task.params.scale.is_metric()) {
            ("", _) => String::new(),
            ("m", false) => " units".to_owned(),
            ("°/m", false) => " °/unit".to_owned(),
            _ => format!(" {unit}"),
        }
    }

    /// The same at another position among the records of the run.
    pub(super) fn at(&self, cursor: usize) -> Self {
        Self { cursor, ..*self }
    }

    /// Whether the run that is shown is the present one, whose parameters can be changed.
    pub fn is_present(&self) -> bool {
        !self.state.is_showing_kept()
    }

    /// Asks for something to be done after this frame.
    pub fn send(&self, command: impl FnOnce(&mut App) + 'static) {
        self.commands.send(command);
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
        self.run.problem_at(self.cursor)
    }

    /// The true pose of the query, if it is known and shown.
    pub fn truth(&self) -> Option<&'a Pose> {
        self.run.truth().filter(|_| self.options.shows_truth)
    }

    /// Where the photos agree, if a second opinion contradicts the pose at whose end the cursor is.
    pub fn better_pose(&self) -> Option<Pose> {
        let result = self.state.outcome(self.span()?)?;
        result.opinion?.better?.to_pose()
    }

    /// The latest event of a type at or before the cursor, reported by the estimator there.
    pub fn latest<E: DebugEvent + 'static>(&self) -> Option<&'a E> {
        self.run.latest(self.cursor)
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

    /// The latest estimator of a kind that the one at the cursor has run inside itself, with its records and the cursor in
    /// them. The second part of a hybrid goes on where the first one ended, so a hybrid has none.
    pub fn inside(&self, is_one: impl Fn(Method) -> bool) -> Option<(Method, Span, usize)> {
        let span = self.span()?;
        if estimator::find(self.method()?)?.hybrid().is_some() {
            return None;
        }
        let latest = self.run.inner(span, self.cursor).filter(|(method, _)| is_one(*method)).last();
        latest.map(|(method, inner)| {
            let last = inner.records.end.saturating_sub(1);
            (method, inner, self.cursor.min(last))
        })
    }

    /// The latest event of a type that a method has reported: up to the cursor if the cursor is in its
    /// part, else in all of its part.
    pub fn latest_of<E: DebugEvent + 'static>(&self, method: Method) -> Option<&'a E> {
        let (span, cursor) = self.part_of(method)?;
        self.run.latest_in(span, cursor)
    }

    /// The direct method whose pictures are shown: that at the cursor, for the others that inside a
    /// hybrid, MI if the run has it.
    pub fn direct_method(&self) -> Method {
        let direct = self.setup.direct_methods();
        let here = self.method();
        let inside = here.and_then(estimator::find).and_then(Entry::hybrid);
        [here, inside.map(|parts| parts.second), Some(Method::MI)]
            .into_iter()
            .flatten()
            .chain(direct.first().copied())
            .find(|method| direct.contains(method))
            .unwrap_or(Method::MI)
    }

    /// Whether the cursor is in a hybrid that runs this method inside itself.
    pub fn is_inside_hybrid(&self, method: Method) -> bool {
        let here = self.method().and_then(estimator::find);
        here.and_then(|entry| entry.hybrid())
            .is_some_and(|parts| parts.first == method || parts.second == method)
    }

    /// The synthetic view to show for a direct method: under the pointer, of the trial camera, or
    /// the latest that the estimator rendered.
    pub fn shown(&self, method: Method) -> Option<ShownView> {
        if let Some((_, reason)) = self.state.looking_at()
            && let Some(probe) = self.state.scoring.probe()
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
        self.finished(method)?.pose.as_ref()?.to_pose()
    }

    /// How far the pose of [`estimate`](Self::estimate) can be trusted: a fused one as its own result says.
    pub fn confidence(&self, method: Method) -> Option<&'a PoseConfidence> {
        let span = self.span()?;
        if span.part == Part::Fusion(method) {
            let result = span.result.as_ref().filter(|_| self.state.is_finished_at_cursor(span));
            return result?.confidence.as_ref();
        }
        self.finished(method)?.confidence.as_ref()
    }

    /// The result of a method that has ended at the cursor.
    fn finished(&self, method: Method) -> Option<&'a QueryResult> {
        let (span, _) = self.part_of(method)?;
        let span = Some(span).filter(|span| self.state.is_finished_at_cursor(span))?;
        span.result.as_ref()
    }

    /// Costs of a direct method that a cost can be placed between: with shuffled pixels and at the
    /// truth.
    pub fn cost_bounds(&self, method: Method) -> CostBounds {
        let assessed = self.latest_of::<MinimumAssessed>(method);
        let report = self
            .part_of(method)
            .filter(|(span, _)| self.state.is_finished_at_cursor(span))
            .and_then(|(span, _)| span.result.as_ref()?.cost.as_ref());
        CostBounds {
            shuffled: assessed.and_then(|assessed| assessed.shuffled),
            best: assessed.map(|assessed| assessed.best),
            truth: report.and_then(|report| report.truth).filter(|_| self.options.shows_truth),
        }
    }
}

/// A widget with something to be done once it is clicked.
pub(crate) trait Sends {
    /// Sends a command if it was clicked, and returns whether it was.
    fn sends(&self, context: &ViewContext<'_>, command: impl FnOnce(&mut App) + 'static) -> bool;
}

impl Sends for egui::Response {
    fn sends(&self, context: &ViewContext<'_>, command: impl FnOnce(&mut App) + 'static) -> bool {
        if self.clicked() {
            context.send(command);
        }
        self.clicked()
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
