//! Several sinks watching one run.

use crate::event::{Event, KindSet};
use crate::trace::{Cancelled, Record, Sink};

/// Passes each event to the sinks that want it, in their order.
pub struct Fanout<'a>(Vec<&'a mut dyn Sink>);

impl<'a> Fanout<'a> {
    /// A fanout to all of these sinks.
    pub fn new(sinks: Vec<&'a mut dyn Sink>) -> Self {
        Self(sinks)
    }
}

impl Sink for Fanout<'_> {
    fn wanted(&self) -> KindSet {
        self.0.iter().fold(KindSet::NONE, |all, sink| all.union(sink.wanted()))
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        let is_stage = matches!(record.event, Event::StageStarted(_) | Event::StageEnded(_));
        for sink in &mut self.0 {
            if is_stage || sink.wanted().contains(record.event.kind()) {
                sink.accept(record)?;
            }
        }
        Ok(())
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.0.iter_mut().try_for_each(|sink| sink.attend())
    }
}
