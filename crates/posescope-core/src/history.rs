//! For posescope's own crates: may change in any version.
//!
//! Keeps the events of a run.

use crate::event::{DebugEvent, Event};
use crate::trace::{Cancelled, Record, Sink};

/// All records of a run, in order.
#[derive(Clone, Debug, Default)]
pub struct History {
    records: Vec<Record>,
}

impl History {
    /// Adds a record behind the others.
    pub fn push(&mut self, record: Record) {
        self.records.push(record);
    }

    /// All records.
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// The events of one type with their positions, in order.
    pub fn all<E: DebugEvent + 'static>(&self) -> impl Iterator<Item = (usize, &E)> {
        self.records
            .iter()
            .enumerate()
            .filter_map(|(position, record)| Some((position, E::from_event(&record.event)?)))
    }

    /// The latest event of a type at or before `cursor`, a position in [`Self::records`].
    pub fn latest<E: DebugEvent + 'static>(&self, cursor: usize) -> Option<&E> {
        let end = self.records.len().min(cursor.saturating_add(1));
        self.records[..end].iter().rev().find_map(|record| E::from_event(&record.event))
    }

    /// The latest event of a type in the whole run.
    pub fn last<E: DebugEvent + 'static>(&self) -> Option<&E> {
        self.latest(usize::MAX)
    }

    /// The events, in order.
    pub fn events(&self) -> impl Iterator<Item = &Event> {
        self.records.iter().map(|record| &record.event)
    }
}

impl Sink for History {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        self.push(record.clone());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{ProjectedCloud, Stage, StageEnded};
    use crate::trace::Trace;

    #[test]
    fn the_latest_event_is_the_one_at_the_cursor_not_after_it() {
        let mut history = History::default();
        let mut trace = Trace::to(&mut history);
        for in_view in [1, 2, 3] {
            trace
                .stage(Stage::DepthLift, |trace| {
                    trace.emit(|| ProjectedCloud { points: 9, in_view })
                })
                .expect("not cancelled");
        }
        assert_eq!(history.latest::<ProjectedCloud>(0), None);
        assert_eq!(history.latest::<ProjectedCloud>(4).map(|e| e.in_view), Some(2));
        assert_eq!(history.last::<ProjectedCloud>().map(|e| e.in_view), Some(3));
        let ends: Vec<_> = history.all::<StageEnded>().map(|(at, _)| at).collect();
        assert_eq!(ends, [2, 5, 8]);
    }
}
