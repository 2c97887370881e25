//! A progress bar on the terminal.

use indicatif::ProgressBar;

use crate::event::{Event, KindSet};
use crate::trace::{Cancelled, Record, Sink};

/// Shows the current stage of a run.
pub struct Progress {
    bar: ProgressBar,
    task: String,
    stages: Vec<&'static str>,
}

impl Progress {
    /// Shows stages on `bar` after `task`, the name of the query.
    pub fn new(bar: ProgressBar, task: String) -> Self {
        Self { bar, task, stages: Vec::new() }
    }
}

impl Sink for Progress {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        match &record.event {
            Event::StageStarted(started) => {
                self.stages.push(started.stage.name());
                let path = self.stages.join(" › ");
                self.bar.set_message(format!("{} {path}", self.task));
            }
            Event::StageEnded(_) => {
                self.stages.pop();
            }
            _ => {}
        }
        Ok(())
    }
}
