//! The poses of a `scene.toml`, by name, by time or by line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use posescope_core::scene::stem as core_stem;

use super::super::SceneError;
use super::super::folder::stem;
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

pub(super) fn read(path: &Path, photos: &[PathBuf]) -> Result<Vec<FramePoses>, SceneError> {
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
    photos: &[PathBuf],
) -> Result<Vec<FramePoses>, SceneError> {
    let by_stem = named.iter().map(|one| (core_stem(&one.name), one.world_from_camera));
    let by_stem: BTreeMap<&str, Pose> = by_stem.collect();
    let poses = photos
        .iter()
        .map(|photo| FramePoses { pose: by_stem.get(stem(photo).as_str()).copied(), time_s: None });
    let poses: Vec<FramePoses> = poses.collect();
    if poses.iter().all(|frame| frame.pose.is_none()) {
        let called = named.first().map_or("", |one| one.name.as_str());
        return Err(file.error(format!(
            "poses of photos with names like `{}` expected; the file has names like `{called}`",
            stem(&photos[0])
        )));
    }
    Ok(poses)
}

/// Poses of photos whose names are times.
fn by_time(
    file: &TextFile,
    trajectory: Trajectory,
    photos: &[PathBuf],
) -> Result<Vec<FramePoses>, SceneError> {
    let poses = photos.iter().map(|photo| {
        let time_s = lines::numbers::<1>(&stem(photo)).ok().map(|[time]| time);
        FramePoses { pose: time_s.and_then(|time| trajectory.at(time)), time_s }
    });
    let poses: Vec<FramePoses> = poses.collect();
    if poses.iter().all(|frame| frame.pose.is_none()) {
        let (first, last) = trajectory.range().unwrap_or_default();
        return Err(file.error(format!(
            "poses at the times in the photos' names expected, such as {}; the poses are between {first} and {last}. If \
             the names are no times, name the columns in a first line: name x y z qx qy qz qw",
            stem(&photos[0])
        )));
    }
    Ok(poses)
}

fn by_line(
    file: &TextFile,
    poses: &PoseLines,
    photos: &[PathBuf],
) -> Result<Vec<FramePoses>, SceneError> {
    let pose = |(index, photo): (usize, &PathBuf)| {
        let name = stem(photo);
        let pose = poses.of_frame(index, photos.len(), &name);
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
