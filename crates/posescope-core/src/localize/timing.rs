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

    /// Several runs of one estimator, one after the other.
    pub fn sum<'a>(runs: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut stages: Vec<(String, Duration)> = Vec::new();
        let mut total: Option<(String, Duration)> = None;
        for (run, time) in runs.into_iter().filter_map(|run| {
            let (last, stages) = run.0.split_last()?;
            Some((stages, last))
        }) {
            for (name, time) in run {
                match stages.iter_mut().find(|(known, _)| known == name) {
                    Some((_, sum)) => *sum += *time,
                    None => stages.push((name.clone(), *time)),
                }
            }
            total.get_or_insert((time.0.clone(), Duration::ZERO)).1 += time.1;
        }
        stages.extend(total);
        Self(stages)
    }

    /// The stages of these runs as those inside another estimator.
    pub fn inside<'a>(outer: &str, runs: impl IntoIterator<Item = &'a Self>) -> Self {
        let (mut stages, mut total) = (Vec::new(), Duration::ZERO);
        for run in runs {
            total += run.total();
            let named = |(name, time): &(String, Duration)| (format!("{outer}.{name}"), *time);
            stages.extend(run.0.iter().map(named));
        }
        stages.push((outer.to_owned(), total));
        Self(stages)
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

/// A sink that measures stages.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn times(stages: &[(&str, u64)]) -> StageTimes {
        let stage = |(name, ms): &(&str, u64)| ((*name).to_owned(), Duration::from_millis(*ms));
        StageTimes(stages.iter().map(stage).collect())
    }

    #[test]
    fn sums_end_with_the_whole_even_where_one_run_stopped_early() {
        let short = times(&[("fb.detect", 2), ("fb", 3)]);
        let whole = times(&[("fb.detect", 4), ("fb.match", 5), ("fb", 10)]);
        let sum = StageTimes::sum([&short, &whole]);
        assert_eq!(sum.0, times(&[("fb.detect", 6), ("fb.match", 5), ("fb", 13)]).0);
        let inside = StageTimes::inside("hy", [&short]);
        assert_eq!(inside.0, times(&[("hy.fb.detect", 2), ("hy.fb", 3), ("hy", 3)]).0);
    }
}
