//! The poses of a `scene.toml`, by name, by time or by line.

use std::path::Path;

use super::super::SceneError;
use super::super::frame_names::FrameNames;
use super::super::lines::{self, TextFile};
use super::super::pose_text::{NamedPose, PoseLines, PoseText};
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

pub(super) fn read(path: &Path, photos: &[String]) -> Result<Vec<FramePoses>, SceneError> {
    let file = TextFile::read(path)?;
    match PoseText::read(&file, None)? {
        PoseText::Timed(samples) => by_time(&file, Trajectory::in_seconds(samples), photos),
        PoseText::Lines(poses) => by_line(&file, &poses, photos),
        PoseText::Named(poses) => by_name(&file, &poses, photos),
    }
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

/// Poses of photos whose names are times.
fn by_time(
    file: &TextFile,
    trajectory: Trajectory,
    photos: &[String],
) -> Result<Vec<FramePoses>, SceneError> {
    let poses = photos.iter().map(|photo| {
        let time_s = lines::numbers::<1>(photo).ok().map(|[time]| time);
        FramePoses { pose: time_s.and_then(|time| trajectory.at(time)), time_s }
    });
    let poses: Vec<FramePoses> = poses.collect();
    if poses.iter().all(|frame| frame.pose.is_none()) {
        let (first, last) = trajectory.range().unwrap_or_default();
        return Err(file.error(format!(
            "poses at the times in the photos' names expected, such as {}; the poses are between {first} and {last}. If \
             the names are no times, name the columns in a first line: name x y z qx qy qz qw",
            photos[0]
        )));
    }
    Ok(poses)
}

fn by_line(
    file: &TextFile,
    poses: &PoseLines,
    photos: &[String],
) -> Result<Vec<FramePoses>, SceneError> {
    let pose = |(index, name): (usize, &String)| {
        let pose = poses.of_frame(index, photos.len(), name);
        let pose = pose.ok_or_else(|| {
            file.error(format!(
                "one line per image expected ({}), or one per number from 0 at the end of their names; \
                 {} lines found, none for `{name}`",
                photos.len(),
                poses.count(),
            ))
        })?;
        Ok(FramePoses { pose: Some(pose), time_s: None })
    };
    photos.iter().enumerate().map(pose).collect()
}
