//! The poses of the vehicle: GPS/INS in the world frame, visual odometry relative to the start.

use std::path::Path;

use super::super::SceneError;
use super::super::lines::{Line, TextFile};
use super::super::trajectory::Trajectory;
use super::sdk::transform;
use crate::geometry::Pose;

/// The longest interval for interpolation \[µs\]: the INS measures every 20 ms, the stereo camera every 62 ms.
const LONGEST_GAP_US: f64 = 500_000.0;
/// Below this speed the car stands \[m/s\]; the noise of a standing INS is a tenth of it.
const STANDS_M_S: f64 = 0.5;
/// The status of reliable rows.
const GOOD: &str = "INS_SOLUTION_GOOD";

/// A trajectory of poses by time \[µs\].
fn track(samples: Vec<(u64, Pose)>) -> Trajectory {
    let samples = samples.into_iter().map(|(time, pose)| (time as f64, pose));
    Trajectory::new(samples.collect(), LONGEST_GAP_US, 0.0)
}

/// The times of the car's first motion and last stop \[µs\]; `None` if it never moves.
pub(super) fn first_and_last_motion(track: &Trajectory) -> Option<(f64, f64)> {
    /// Speeds are measured over at least this time \[µs\].
    const OVER_US: f64 = 900_000.0;
    let samples = track.samples();
    let later = |at: usize| {
        let mut after = samples[at..].iter();
        after.find(|(later, _)| later - samples[at].0 >= OVER_US)
    };
    let moves = |at: usize| {
        let (time, pose) = &samples[at];
        later(at).is_some_and(|(later, there)| {
            let way_m = (there.translation.vector - pose.translation.vector).norm();
            way_m / ((later - time) / super::PER_SECOND) > STANDS_M_S
        })
    };
    let first = (0..samples.len()).find(|&at| moves(at))?;
    let last = (first..samples.len()).rev().find(|&at| moves(at))?;
    Some((samples[first].0, later(last)?.0))
}

/// A table whose first line names its columns.
struct Table<'a> {
    header: Line<'a>,
    columns: Vec<&'a str>,
    rows: Vec<Line<'a>>,
}

impl<'a> Table<'a> {
    fn of(file: &'a TextFile) -> Result<Self, SceneError> {
        let mut rows = file.lines();
        let header = rows.next();
        let header = header.ok_or_else(|| file.error("a header expected, the file is empty"))?;
        Ok(Self { header, columns: header.fields(), rows: rows.collect() })
    }

    fn column(&self, name: &str) -> Result<usize, SceneError> {
        let found = self.columns.iter().position(|column| *column == name);
        found.ok_or_else(|| self.header.error(format!("a column `{name}` expected")))
    }

    fn places<const N: usize>(&self, names: [&str; N]) -> Result<[usize; N], SceneError> {
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            *place = self.column(name)?;
        }
        Ok(places)
    }

    /// The fields of each line, as many as the header has.
    fn rows(&self) -> impl Iterator<Item = Result<(Line<'a>, Vec<&'a str>), SceneError>> {
        self.rows.iter().map(|line| {
            let (fields, count) = (line.fields(), self.columns.len());
            if fields.len() != count {
                let found = fields.len();
                return Err(line.error(format!("{count} columns expected, {found} found")));
            }
            Ok((*line, fields))
        })
    }
}

/// Reads the good rows of `gps/ins.csv`: the INS in the world frame (north, east, down).
pub(super) fn read_ins(path: &Path) -> Result<Trajectory, SceneError> {
    let file = TextFile::read(path)?;
    let table = Table::of(&file)?;
    let [time, status] = table.places(["timestamp", "ins_status"])?;
    let columns = table.places(["northing", "easting", "down", "roll", "pitch", "yaw"])?;
    let mut samples = Vec::new();
    for row in table.rows() {
        let (line, words) = row?;
        if words[status] == GOOD {
            let time = microseconds(&line, words[time])?;
            samples.push((time, transform_at(&line, &words, columns)?));
        }
    }
    Ok(track(samples))
}

/// Reads `vo/vo.csv`: chains the motions of the vehicle from photo to photo.
pub(super) fn read_odometry(path: &Path) -> Result<Trajectory, SceneError> {
    let file = TextFile::read(path)?;
    let table = Table::of(&file)?;
    let times = table.places(["source_timestamp", "destination_timestamp"])?;
    let columns = table.places(["x", "y", "z", "roll", "pitch", "yaw"])?;
    let mut pose = Pose::identity();
    let mut samples: Vec<(u64, Pose)> = Vec::new();
    for row in table.rows() {
        let (line, words) = row?;
        // Of the columns source and destination, the motion is from the second to the first.
        let at = microseconds(&line, words[times[0]])?;
        let from = microseconds(&line, words[times[1]])?;
        if samples.is_empty() {
            samples.push((from.min(at), pose));
        }
        pose *= transform_at(&line, &words, columns)?;
        samples.push((at.max(from), pose));
    }
    Ok(track(samples))
}

/// The transform from the position, roll, pitch and yaw in these columns.
fn transform_at(line: &Line<'_>, words: &[&str], at: [usize; 6]) -> Result<Pose, SceneError> {
    let mut numbers = [0.0; 6];
    for (number, column) in numbers.iter_mut().zip(at) {
        *number = line.number(words[column])?;
    }
    let [x, y, z, roll, pitch, yaw] = numbers;
    Ok(transform([x, y, z], [roll, pitch, yaw]))
}

fn microseconds(line: &Line<'_>, word: &str) -> Result<u64, SceneError> {
    word.parse().map_err(|_| line.error("a timestamp in microseconds expected"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parked_head_and_tail_are_told_from_the_drive() {
        // A tenth of a second each: ten seconds parked, twenty at 5 m/s, ten parked.
        let sample = |tick: u64| {
            let way_m = 0.5 * tick.clamp(100, 300) as f64;
            (tick * 100_000, Pose::translation(way_m, 0.0, 0.0))
        };
        let drive = track((0..400).map(sample).collect());
        let (first, last) = first_and_last_motion(&drive).expect("it moves");
        assert!((9e6..=10e6).contains(&first), "{first}");
        assert!((30e6..=31e6).contains(&last), "{last}");
        let parked = track((0..90).map(sample).collect());
        assert!(first_and_last_motion(&parked).is_none());
    }

    #[test]
    fn between_two_times_that_are_close_the_pose_is_between_too() {
        let pose = |x: f64| Pose::translation(x, 0.0, 0.0);
        let track = super::track(vec![(0, pose(0.0)), (100, pose(1.0)), (900_000, pose(9.0))]);
        assert_eq!(track.at(25.0), Some(pose(0.25)));
        assert_eq!(track.at(100.0), Some(pose(1.0)));
        assert!(track.at(500.0).is_none() && track.at(1e6).is_none());
    }
}
