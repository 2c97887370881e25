//! Where the cursor is in the present run, and where it is to be once the run has come so far.

use std::ops::Range;

use crate::lesson::Moment;
use crate::session::{Part, Run};

/// The cursor in the present run.
pub(super) struct Navigation {
    /// Position among the records of the run.
    cursor: usize,
    /// Whether the cursor goes along with new records.
    follows: bool,
    /// Where the cursor is to be once the run has come so far.
    anchor: Option<Anchor>,
}

/// At the beginning of a run, and along with it.
impl Default for Navigation {
    fn default() -> Self {
        Self { cursor: 0, follows: true, anchor: None }
    }
}

impl Navigation {
    /// In a new run, towards a place.
    pub(super) fn towards(anchor: Anchor) -> Self {
        Self { follows: false, anchor: Some(anchor), ..Self::default() }
    }

    /// In this run, to a moment, as soon as the run has come so far.
    pub(super) fn seek(&mut self, moment: Moment, run: &Run, is_alive: bool) {
        *self = Self { cursor: self.cursor, ..Self::towards(Anchor::Moment(moment)) };
        self.on_records(run, is_alive);
    }

    /// In a new run, towards the place that the cursor has in `run`, in meaning.
    pub(super) fn towards_same(&self, run: &Run, is_alive: bool) -> Self {
        Self {
            follows: self.follows && is_alive,
            anchor: StagePosition::of(run, self.cursor).map(Anchor::Stage),
            ..Self::default()
        }
    }

    /// Whether the cursor goes along with new records.
    pub(super) fn follows(&self) -> bool {
        self.follows && self.anchor.is_none()
    }

    /// Position among the records of the run.
    pub(super) fn cursor(&self) -> usize {
        self.cursor
    }

    /// Moves the cursor to a record, or to the last one there is, and leaves it there.
    pub(super) fn move_to(&mut self, record: usize, run: &Run) {
        self.cursor = record.min(last_of(run));
        self.follows = false;
        self.anchor = None;
    }

    /// From here on the cursor goes along with new records.
    pub(super) fn follow(&mut self) {
        self.follows = true;
    }

    /// Moves the cursor after records have come in.
    pub(super) fn on_records(&mut self, run: &Run, is_alive: bool) {
        let found = self.anchor.as_ref().and_then(|anchor| anchor.find(run));
        if self.anchor.is_some() || self.follows {
            self.cursor = found.unwrap_or(last_of(run));
        }
        if found.is_some() || !is_alive {
            self.anchor = None;
        }
    }

    /// The place in another run that corresponds to the cursor in `run`.
    pub(super) fn counterpart(&self, run: &Run, other: &Run) -> Option<usize> {
        StagePosition::of(run, self.cursor)?.find(other)
    }
}

fn last_of(run: &Run) -> usize {
    run.len().saturating_sub(1)
}

/// A place in a run for the cursor, which can be found again in another run.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Anchor {
    /// The place by what the estimator was doing there.
    Stage(StagePosition),
    /// The place by the number of its record.
    Record(usize),
    /// The place by the moment of a lesson.
    Moment(Moment),
}

impl Anchor {
    fn find(&self, run: &Run) -> Option<usize> {
        match self {
            Self::Stage(position) => position.find(run),
            Self::Record(record) => (*record < run.len()).then_some(*record),
            Self::Moment(moment) => moment.find(run),
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
        let inside = |records: &Range<usize>| {
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
