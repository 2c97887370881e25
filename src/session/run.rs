//! What a run has told, in the order in which it was told.

use std::ops::Range;
use std::sync::Arc;

use super::job::Loaded;
use crate::evaluate::{QueryResult, StageTimes};
use crate::event::{DebugEvent, Event, Method, Stage};
use crate::history::History;
use crate::params::Params;
use crate::trace::Record;

/// The records of all estimators of a run, one after the other, and their results.
///
/// A *cursor* is a position among the records. What is asked at a cursor is answered for the
/// estimator that told the record there.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// The parameters it was made with.
    pub params: Params,
    /// Its photos and clouds, once they are read.
    pub loaded: Option<Arc<Loaded>>,
    history: History,
    spans: Vec<Span>,
    stages: Vec<StageBar>,
    /// Positions in `stages` of those that are open, the outermost first.
    open: Vec<usize>,
}

/// The part of a run that one estimator told about one reference.
#[derive(Clone, Debug)]
pub struct Span {
    /// The estimator.
    pub method: Method,
    /// Position of the reference among those of the run.
    pub reference: usize,
    /// Its records.
    pub records: Range<usize>,
    /// Its result, once there is one.
    pub result: Option<QueryResult>,
    /// How long its stages took.
    pub times: Option<StageTimes>,
}

/// One stage as a bar on the timeline.
#[derive(Clone, Debug, PartialEq)]
pub struct StageBar {
    /// Which.
    pub stage: Stage,
    /// 1 for a whole estimator, one more for each stage around it.
    pub depth: usize,
    /// From its first record to behind its last one; to the end of the run while it is open.
    pub records: Range<usize>,
    /// Whether it did what it was for; `None` while it is open.
    pub succeeded: Option<bool>,
    /// Whether its result was remembered from an earlier run.
    pub reused: bool,
}

impl Run {
    /// An empty run with these parameters.
    pub fn new(params: Params) -> Self {
        Self {
            params,
            ..Self::default()
        }
    }

    pub(super) fn begin(&mut self, method: Method, reference: usize) {
        let start = self.len();
        self.open.clear();
        self.spans.push(Span {
            method,
            reference,
            records: start..start,
            result: None,
            times: None,
        });
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

    pub(super) fn end(&mut self, result: QueryResult, times: StageTimes) {
        if let Some(span) = self.spans.last_mut() {
            span.result = Some(result);
            span.times = Some(times);
        }
    }

    /// Number of records.
    pub fn len(&self) -> usize {
        self.history.records().len()
    }

    /// Whether nothing was told yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All records.
    pub fn records(&self) -> &[Record] {
        self.history.records()
    }

    /// The parts of the estimators, in the order in which they ran.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// All stages, in the order in which they began.
    pub fn stages(&self) -> &[StageBar] {
        &self.stages
    }

    /// The part that the record at `cursor` belongs to.
    pub fn span_at(&self, cursor: usize) -> Option<&Span> {
        self.spans
            .iter()
            .find(|span| span.records.contains(&cursor))
    }

    /// The results so far, in order.
    pub fn results(&self) -> impl Iterator<Item = &QueryResult> {
        self.spans.iter().filter_map(|span| span.result.as_ref())
    }

    /// The stages around the record at `cursor`, the outermost first.
    pub fn stages_at(&self, cursor: usize) -> impl Iterator<Item = &StageBar> {
        self.stages
            .iter()
            .filter(move |bar| bar.records.contains(&cursor))
    }

    /// The latest event of a type at or before `cursor`, told by the estimator at the cursor.
    pub fn latest<E: DebugEvent + 'static>(&self, cursor: usize) -> Option<&E> {
        self.latest_in(self.span_at(cursor)?, cursor)
    }

    /// The latest event of a type in a span, at or before `cursor`.
    pub fn latest_in<E: DebugEvent + 'static>(&self, span: &Span, cursor: usize) -> Option<&E> {
        self.until(span, cursor)
            .iter()
            .rev()
            .find_map(|record| E::from_event(&record.event))
    }

    /// All events of a type that the estimator at the cursor has told up to there, with their
    /// positions.
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

    fn until(&self, span: &Span, cursor: usize) -> &[Record] {
        let end = span.records.end.min(cursor.saturating_add(1));
        &self.records()[span.records.start.min(end)..end]
    }
}
