//! The events and results of a run, in their order.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use super::task::Task;
use crate::event::{DebugEvent, Event, ReferencesFused, Stage};
use crate::geometry::Pose;
use crate::history::History;
use crate::image::Degradation;
use crate::localize::{LocalizeObserver, QueryResult, References, StageTimes};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::trace::Record;

/// What a session is doing.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum RunState {
    /// Photos and clouds are being read.
    #[default]
    Loading,
    /// Events are coming in.
    Running,
    /// The estimator waits after the last event.
    Paused {
        /// The breakpoint that stopped it, if one did.
        breakpoint: Option<String>,
    },
    /// Everything requested is done.
    Finished,
    /// It was cancelled.
    Cancelled,
    /// It failed: bad data, or a bug.
    Broken(String),
}

impl RunState {
    /// The state of a method that has begun and has no result.
    pub fn of_what_has_begun(&self) -> &'static str {
        match self {
            Self::Loading | Self::Running => "at work",
            Self::Paused { .. } => "paused",
            Self::Finished | Self::Cancelled | Self::Broken(_) => "not finished",
        }
    }
}

/// The photos and clouds of a run.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The query and each of its references.
    pub problems: Vec<Problem>,
    /// The true pose of the query, if known. The estimators do not see it.
    pub truth: Option<Pose>,
}

/// The records of all parts of a run, one after the other, and their results.
///
/// A *cursor* is a position among the records. Queries at a cursor refer to the part of the record there.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// The parameters of the run.
    pub params: Params,
    /// The uncertainty radius \[m\].
    pub radius_m: f64,
    /// The seed of its random choices.
    pub seed: u64,
    /// The degradation of the query photo.
    pub degraded: Degradation,
    /// Its references, once they are chosen.
    pub chosen: Option<References>,
    /// Its photos and clouds, once they are read.
    pub loaded: Option<Arc<Loaded>>,
    pub(super) state: RunState,
    history: History,
    spans: Vec<Span>,
    stages: Vec<StageBar>,
    /// While references are chosen by appearance: the number of compared candidates, and of all.
    pub ranking: Option<[usize; 2]>,
    /// The search for remedies, while it runs.
    pub explaining: Option<Explaining>,
    /// The positions in `stages` of the open stages, outermost first.
    open: Vec<usize>,
}

/// A part of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// The choice of the references.
    Retrieval,
    /// One estimator on one reference, by the reference's position in the run.
    Reference(Method, usize),
    /// The fusion of an estimator's poses.
    Fusion(Method),
}

impl Part {
    /// Its estimator, if any.
    pub fn method(self) -> Option<Method> {
        match self {
            Self::Retrieval => None,
            Self::Reference(method, _) | Self::Fusion(method) => Some(method),
        }
    }

    /// Its reference, if any, by position in the run.
    pub fn reference(self) -> Option<usize> {
        match self {
            Self::Reference(_, reference) => Some(reference),
            Self::Retrieval | Self::Fusion(_) => None,
        }
    }
}

/// The progress of the search for remedies of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Explaining {
    /// The method of the wrong result.
    pub method: Method,
    /// Remedies tried so far.
    pub tried: usize,
    /// Remedies in total.
    pub remedies: usize,
    /// The start of the first one.
    pub since: Instant,
}

/// Such as `MI: what would have helped? 3 of 12 tried, 2 s, 6 s to go`.
impl fmt::Display for Explaining {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { method, tried, remedies, since } = self;
        let seconds = since.elapsed().as_secs_f64();
        let name = method.name().to_uppercase();
        write!(f, "{name}: what would have helped? {tried} of {remedies} tried, {seconds:.0} s")?;
        if *tried > 0 {
            let left = seconds / *tried as f64 * remedies.saturating_sub(*tried) as f64;
            write!(f, ", {left:.0} s to go")?;
        }
        Ok(())
    }
}

/// The records of one part of a run.
#[derive(Clone, Debug)]
pub struct Span {
    /// The part.
    pub part: Part,
    /// The positions of its records in the run.
    pub records: Range<usize>,
    /// Its result, once there is one.
    pub result: Option<QueryResult>,
    /// The times of its stages; `None` for a fusion, whose time is negligible.
    pub times: Option<StageTimes>,
}

/// One stage as a bar on the timeline.
#[derive(Clone, Debug, PartialEq)]
pub struct StageBar {
    /// The stage.
    pub stage: Stage,
    /// 1 for a whole estimator, one more for each stage around it.
    pub depth: usize,
    /// The positions of its records; up to the end of the run while it is open.
    pub records: Range<usize>,
    /// Whether it succeeded; `None` while it is open.
    pub succeeded: Option<bool>,
    /// Whether its result was cached from an earlier run.
    pub reused: bool,
}

impl Run {
    /// An empty run of a task.
    pub fn of(task: &Task) -> Self {
        Self {
            params: task.params.clone(),
            radius_m: task.radius_m(),
            seed: task.protocol.seed,
            degraded: task.protocol.degrade,
            ..Self::default()
        }
    }

    /// The settings in which two runs of a query may differ, one per line: changed parameters, and options.
    pub fn settings(&self) -> Vec<String> {
        let mut settings = self.params.changes();
        settings.push(format!("--radius {}", self.radius_m));
        settings.push(format!("--seed {}", self.seed));
        if !self.degraded.is_none() {
            settings.push(format!("--degrade {}", self.degraded));
        }
        settings
    }

    /// Tells an observer what happened, as if the run went on now. Nothing is computed again.
    pub fn replay(&self, observer: &mut dyn LocalizeObserver) {
        let Some(loaded) = self.loaded.as_deref() else { return };
        observer.begin_query(0, &loaded.problems, loaded.truth.as_ref());
        for span in self.spans() {
            match span.part {
                Part::Reference(method, reference) => observer.begin_method(reference, method),
                Part::Fusion(method) => observer.begin_fusion(method),
                Part::Retrieval => {}
            }
            for record in &self.records()[span.records.clone()] {
                if observer.accept(record).is_err() {
                    break;
                }
            }
            match (&span.result, &span.times) {
                (Some(result), Some(times)) => observer.end_method(result, times),
                (Some(result), None) => observer.end_fusion(result),
                (None, _) => {}
            }
        }
    }

    pub(super) fn begin(&mut self, part: Part) {
        let start = self.len();
        self.open.clear();
        self.spans.push(Span { part, records: start..start, result: None, times: None });
    }

    pub(super) fn push(&mut self, record: Record) {
        let at = self.len();
        match &record.event {
            Event::StageStarted(started) => {
                self.open.push(self.stages.len());
                self.stages.push(StageBar {
                    stage: started.stage,
                    depth: record.depth,
                    records: at..at + 1,
                    succeeded: None,
                    reused: false,
                });
            }
            Event::StageEnded(ended) => {
                if let Some(bar) = self.open.pop() {
                    let bar = &mut self.stages[bar];
                    bar.records.end = at + 1;
                    bar.succeeded = Some(ended.succeeded);
                    bar.reused = ended.reused;
                }
            }
            _ => {}
        }
        for &bar in &self.open {
            self.stages[bar].records.end = at + 1;
        }
        self.history.push(record);
        if let Some(span) = self.spans.last_mut() {
            span.records.end = at + 1;
        }
    }

    pub(super) fn end(&mut self, result: QueryResult, times: Option<StageTimes>) {
        if let Some(span) = self.spans.last_mut() {
            span.result = Some(result);
            span.times = times;
        }
    }

    pub(super) fn go_on_explaining(&mut self, method: Method, tried: usize, remedies: usize) {
        let begun = self.explaining.filter(|_| tried > 0);
        self.explaining = Some(Explaining {
            method,
            tried,
            remedies,
            since: begun.map_or_else(Instant::now, |begun| begun.since),
        });
    }

    /// Replaces a result by its explained version.
    pub(super) fn explain(&mut self, explained: QueryResult) {
        self.explaining = None;
        let is_same = |result: &QueryResult| {
            result.method == explained.method
                && result.fusion == explained.fusion
                && result.references == explained.references
        };
        let results = self.spans.iter_mut().filter_map(|span| span.result.as_mut());
        for result in results.filter(|result| is_same(result)) {
            *result = explained.clone();
        }
    }

    /// Number of records.
    pub fn len(&self) -> usize {
        self.history.records().len()
    }

    /// Whether there are no records yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All records.
    pub fn records(&self) -> &[Record] {
        self.history.records()
    }

    /// The parts of the run in order.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// All stages, in the order in which they began.
    pub fn stages(&self) -> &[StageBar] {
        &self.stages
    }

    /// The part of the record at `cursor`.
    pub fn span_at(&self, cursor: usize) -> Option<&Span> {
        self.spans.iter().find(|span| span.records.contains(&cursor))
    }

    /// The results so far, in order.
    pub fn results(&self) -> impl Iterator<Item = &QueryResult> {
        self.spans.iter().filter_map(|span| span.result.as_ref())
    }

    /// The stages around the record at `cursor`, outermost first.
    pub fn stages_at(&self, cursor: usize) -> impl Iterator<Item = &StageBar> {
        self.stages.iter().filter(move |bar| bar.records.contains(&cursor))
    }

    /// The estimators that the one of a part has run inside itself up to a cursor, in the order of their beginning, each
    /// with its records.
    pub fn inner(&self, span: &Span, cursor: usize) -> impl Iterator<Item = (Method, Span)> {
        let (part, own) = (span.part, span.records.clone());
        let begun = self
            .stages
            .iter()
            .filter(move |bar| own.contains(&bar.records.start) && bar.records.start <= cursor);
        begun.filter_map(move |bar| match bar.stage {
            Stage::Estimator(method) if part.method() != Some(method) => {
                let records = bar.records.clone();
                Some((method, Span { part, records, result: None, times: None }))
            }
            _ => None,
        })
    }

    /// The latest records of a part.
    pub fn span_of(&self, part: Part) -> Option<&Span> {
        self.spans.iter().rev().find(|span| span.part == part)
    }

    /// The query with each of its references; none before they are read.
    pub fn problems(&self) -> &[Problem] {
        self.loaded.as_deref().map_or(&[], |loaded| &loaded.problems)
    }

    /// The query with the reference to show at a cursor.
    pub fn problem_at(&self, cursor: usize) -> Option<&Problem> {
        self.problems().get(self.reference_at(cursor))
    }

    /// The true pose of the query, if it is known (`world_from_camera`).
    pub fn truth(&self) -> Option<&Pose> {
        self.loaded.as_deref()?.truth.as_ref()
    }

    /// The reference to show at a cursor, by position in the run: that of the part there, or in a fusion the one of the
    /// greatest weight.
    pub fn reference_at(&self, cursor: usize) -> usize {
        let span = self.span_at(cursor);
        if let Some(reference) = span.and_then(|span| span.part.reference()) {
            return reference;
        }
        let fused = span.and_then(|span| self.latest_in::<ReferencesFused>(span, cursor));
        let shares = fused.map_or(&[][..], |fused| &fused.shares);
        (0..shares.len())
            .rev()
            .max_by(|&a, &b| shares[a].weight.total_cmp(&shares[b].weight))
            .unwrap_or(0)
    }

    /// The latest event of a type at or before `cursor`, in the part at the cursor.
    pub fn latest<E: DebugEvent + 'static>(&self, cursor: usize) -> Option<&E> {
        self.latest_in(self.span_at(cursor)?, cursor)
    }

    /// The latest event of a type in a span, at or before `cursor`.
    pub fn latest_in<E: DebugEvent + 'static>(&self, span: &Span, cursor: usize) -> Option<&E> {
        self.until(span, cursor).iter().rev().find_map(|record| E::from_event(&record.event))
    }

    /// All events of a type up to `cursor` in the part there, with their positions.
    pub fn all_until<E: DebugEvent + 'static>(
        &self,
        cursor: usize,
    ) -> impl DoubleEndedIterator<Item = (usize, &E)> {
        let span = self.span_at(cursor);
        let start = span.map_or(0, |span| span.records.start);
        let records = span.map_or(&[][..], |span| self.until(span, cursor));
        records
            .iter()
            .enumerate()
            .filter_map(move |(at, record)| Some((start + at, E::from_event(&record.event)?)))
    }

    /// What a part has reported up to a cursor.
    pub fn until(&self, span: &Span, cursor: usize) -> &[Record] {
        let end = span.records.end.min(cursor.saturating_add(1));
        &self.records()[span.records.start.min(end)..end]
    }
}
