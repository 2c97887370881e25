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

/// Reads the good rows of `gps/ins.csv`: the INS in the world frame (north, east, down).
pub(super) fn read_ins(path: &Path) -> Result<Trajectory, SceneError> {
    let file = TextFile::read(path)?;
    let mut lines = file.lines();
    let header = lines.next().ok_or_else(|| file.error("a header expected, the file is empty"))?;
    let column = |name: &str| {
        let found = header.words().position(|word| word == name);
        found.ok_or_else(|| header.error(format!("a column `{name}` expected")))
    };
    let time = column("timestamp")?;
    let status = column("ins_status")?;
    let mut columns = [0; 6];
    let names = ["northing", "easting", "down", "roll", "pitch", "yaw"];
    for (place, name) in columns.iter_mut().zip(names) {
        *place = column(name)?;
    }
    let mut samples = Vec::new();
    for line in lines {
        let words: Vec<&str> = line.words().collect();
        if words.get(status) != Some(&GOOD) {
            continue;
        }
        let time = microseconds(&line, word(&line, &words, time)?)?;
        samples.push((time, transform_at(&line, &words, columns)?));
    }
    Ok(track(samples))
}

/// Reads `vo/vo.csv`: chains the motions of the vehicle from photo to photo.
pub(super) fn read_odometry(path: &Path) -> Result<Trajectory, SceneError> {
    let file = TextFile::read(path)?;
    let mut pose = Pose::identity();
    let mut samples: Vec<(u64, Pose)> = Vec::new();
    for line in file.lines().skip(1) {
        let words: Vec<&str> = line.words().collect();
        // Of the columns source and destination, the motion is from the second to the first.
        let at = microseconds(&line, word(&line, &words, 0)?)?;
        let from = microseconds(&line, word(&line, &words, 1)?)?;
        if samples.is_empty() {
            samples.push((from.min(at), pose));
        }
        pose *= transform_at(&line, &words, [2, 3, 4, 5, 6, 7])?;
        samples.push((at.max(from), pose));
    }
    Ok(track(samples))
}

/// The transform from the position, roll, pitch and yaw in these columns.
fn transform_at(line: &Line<'_>, words: &[&str], at: [usize; 6]) -> Result<Pose, SceneError> {
    let mut numbers = [0.0; 6];
    for (number, column) in numbers.iter_mut().zip(at) {
        *number = line.number(word(line, words, column)?)?;
    }
    let [x, y, z, roll, pitch, yaw] = numbers;
    Ok(transform([x, y, z], [roll, pitch, yaw]))
}

fn word<'a>(line: &Line<'_>, words: &[&'a str], column: usize) -> Result<&'a str, SceneError> {
    words.get(column).copied().ok_or_else(|| {
        line.error(format!("{} columns or more expected, {} found", column + 1, words.len()))
    })
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
