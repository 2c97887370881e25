//! The poses of a `scene.toml`, by name, by time or by line.

use std::path::Path;

use super::super::SceneError;
use super::super::frame_names::FrameNames;
use super::super::lines::TextFile;
use super::super::pose_text::{NamedPose, PoseFile, PoseLines, PoseText, TimedPoses};
use super::super::time_unit::{TimeUnit, time_of_name};
use super::super::trajectory::Trajectory;
use crate::geometry::Pose;

/// The pose and time of a photo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FramePoses {
    /// The pose as in the file.
    pub pose: Option<Pose>,
    /// When the photo was taken \[s\].
    pub time_s: Option<f64>,
}

/// The poses of photos.
#[derive(Default)]
pub(super) struct DescribedPoses {
    pub poses: Vec<FramePoses>,
    /// Whether the format of the file says that they are `camera_from_world`. They are inverted already then.
    pub is_inverted: bool,
    /// Whether the format says that they are those of a body that carries the camera.
    pub is_of_body: bool,
}

pub(super) fn read(path: &Path, photos: &[String]) -> Result<DescribedPoses, SceneError> {
    let file = TextFile::read(path)?;
    let PoseFile { poses, is_camera_from_world: is_inverted, is_of_body } =
        PoseFile::read(&file, &FrameNames::of("", photos))?;
    let poses = match poses {
        PoseText::Timed(poses) => by_time(&file, &poses, photos),
        PoseText::Lines(poses) => by_line(&file, &poses, photos),
        PoseText::Named(poses) => by_name(&file, &poses, photos),
    };
    Ok(DescribedPoses { poses: poses?, is_inverted, is_of_body })
}

/// Poses of photos by their names; photos that the file does not name have none.
fn by_name(
    file: &TextFile,
    named: &[NamedPose<'_>],
    photos: &[String],
) -> Result<Vec<FramePoses>, SceneError> {
    let found = FrameNames::of("", photos).find_all(named.iter().map(|one| one.name.as_str()));
    let mut poses = vec![FramePoses::default(); photos.len()];
    for (one, frame) in named.iter().zip(found) {
        if let Some(frame) = frame {
            poses[frame].pose = Some(one.world_from_camera);
        }
    }
    if poses.iter().all(|frame| frame.pose.is_none()) {
        let called = named.first().map_or("", |one| one.name.as_str());
        return Err(file.error(format!(
            "poses of photos with names like `{}` expected; the file has names like `{called}`",
            photos[0]
        )));
    }
    Ok(poses)
}

/// Poses of photos whose names are times. Where the file names no unit of its times, it is the one in which most fit.
fn by_time(
    file: &TextFile,
    TimedPoses { samples, unit }: &TimedPoses,
    photos: &[String],
) -> Result<Vec<FramePoses>, SceneError> {
    let in_unit = |unit: TimeUnit| {
        let samples = samples.iter().map(|(time, pose)| (unit.seconds(*time), *pose));
        let trajectory = Trajectory::in_seconds(samples.collect());
        let poses = photos.iter().map(|photo| {
            let time_s = time_of_name(photo);
            FramePoses { pose: time_s.and_then(|time| trajectory.at(time)), time_s }
        });
        poses.collect::<Vec<FramePoses>>()
    };
    let found = |poses: &[FramePoses]| poses.iter().filter(|frame| frame.pose.is_some()).count();
    let units = unit.map_or(TimeUnit::ALL.to_vec(), |unit| vec![unit]);
    let read = units.into_iter().map(|unit| (unit, in_unit(unit)));
    // The first of those that are equally good: seconds.
    let best = read.reduce(|a, b| if found(&b.1) > found(&a.1) { b } else { a });
    let (read_in, poses) = best.unwrap_or((TimeUnit::Second, Vec::new()));
    if found(&poses) == 0 {
        let times = samples.iter().map(|(time, _)| *time);
        let (first, last) =
            times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
        return Err(file.error(format!(
            "poses at the times in the photos' names expected, such as {}; the poses are between {first} and {last}. If \
             the names are no times, name the columns in a first line: name x y z qx qy qz qw",
            photos[0]
        )));
    }
    if unit.is_none() && read_in != TimeUnit::Second {
        log::warn!(
            "{}: the times are read as {}, in which {} photos have a pose",
            file.name(),
            read_in.symbol(),
            found(&poses)
        );
    }
    Ok(poses)
}

fn by_line(
    file: &TextFile,
    poses: &PoseLines,
    photos: &[String],
) -> Result<Vec<FramePoses>, SceneError> {
    let pose = |(index, name): (usize, &String)| {
        let line = poses.line_of_frame(index, photos.len(), name);
        if line.is_none() && poses.numbers().is_none() {
            return Err(file.error(format!(
                "one line per image expected ({}), or one per number from 0 at the end of their names; \
                 {} lines found, none for `{name}`",
                photos.len(),
                poses.count(),
            )));
        }
        Ok(FramePoses { pose: line.and_then(|line| poses.get(line)), time_s: None })
    };
    let posed = photos.iter().enumerate().map(pose).collect::<Result<Vec<_>, _>>()?;
    if let (true, Some((first, last))) =
        (posed.iter().all(|frame| frame.pose.is_none()), poses.numbers())
    {
        return Err(file.error(format!(
            "numbers at the end of the images' names expected, such as of `{}`; lines with numbers from {first} to \
             {last} found",
            photos[0]
        )));
    }
    Ok(posed)
}
