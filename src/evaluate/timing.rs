//! How long each stage took. Kept apart from the results, which hold no clock.

use std::time::{Duration, Instant};

use serde::Serialize;
use serde::ser::SerializeMap as _;

use crate::event::{Event, KindSet, Stage};
use crate::trace::{Cancelled, Record, Sink};

/// Durations of the stages of one estimator's run, in the order in which they ended.
#[derive(Clone, Debug, Default)]
pub struct StageTimes(Vec<(String, Duration)>);

impl StageTimes {
    /// Names and durations; a stage inside another is named `outer.inner`.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Duration)> {
        self.0.iter().map(|(name, time)| (name.as_str(), *time))
    }

    /// The duration of the whole estimator: that of the stage that ended last.
    pub fn total(&self) -> Duration {
        self.0.last().map_or(Duration::ZERO, |(_, time)| *time)
    }
}

/// `stage: milliseconds`, rounded to microseconds.
impl Serialize for StageTimes {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, time) in &self.0 {
            map.serialize_entry(name, &(time.as_micros() as f64 / 1000.0))?;
        }
        map.end()
    }
}

/// A sink that measures stages and wants no other event.
#[derive(Debug, Default)]
pub struct StageTimings {
    open: Vec<(Stage, Instant)>,
    times: StageTimes,
}

impl StageTimings {
    /// What was measured.
    pub fn into_times(self) -> StageTimes {
        self.times
    }
}

impl Sink for StageTimings {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        match &record.event {
            Event::StageStarted(started) => self.open.push((started.stage, Instant::now())),
            Event::StageEnded(_) => {
                let path: Vec<&str> = self.open.iter().map(|(stage, _)| stage.name()).collect();
                let name = path.join(".");
                if let Some((_, since)) = self.open.pop() {
                    self.times.0.push((name, since.elapsed()));
                }
            }
            _ => {}
        }
        Ok(())
    }
}
