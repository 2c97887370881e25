//! The poses of a described scene, by time or by line.

use std::path::{Path, PathBuf};

use super::super::SceneError;
use super::super::folder::stem;
use super::super::lines::{self, TextFile};
use super::super::pose_text::{PoseLines, PoseText};
use super::super::trajectory::Trajectory;
use crate::geometry::Pose;

/// What the file says of a photo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FramePoses {
    /// As the file has it.
    pub pose: Option<Pose>,
    /// When the photo was taken \[s\].
    pub time_s: Option<f64>,
}

pub(super) fn read(path: &Path, photos: &[PathBuf]) -> Result<Vec<FramePoses>, SceneError> {
    let file = TextFile::read(path)?;
    match PoseText::read(&file, None)? {
        PoseText::Timed(samples) => by_time(&file, Trajectory::in_seconds(samples), photos),
        PoseText::Lines(poses) => by_line(&file, &poses, photos),
        PoseText::Named(_) => Err(file.error("poses by time or by line expected")),
    }
}

/// A photo is called by its time.
fn by_time(
    file: &TextFile,
    trajectory: Trajectory,
    photos: &[PathBuf],
) -> Result<Vec<FramePoses>, SceneError> {
    let poses = photos.iter().map(|photo| {
        let time_s = lines::numbers::<1>(&stem(photo)).ok().map(|[time]| time);
        FramePoses {
            pose: time_s.and_then(|time| trajectory.at(time)),
            time_s,
        }
    });
    let poses: Vec<FramePoses> = poses.collect();
    if poses.iter().all(|frame| frame.pose.is_none()) {
        let (first, last) = trajectory.range().unwrap_or_default();
        return Err(file.error(format!(
            "poses at the times that the images are called by expected, such as {}; these are \
             between {first} and {last}",
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
                "a line for each of {} images expected, or for each number from 0 that their \
                 names end with; {} lines found, none for `{name}`",
                photos.len(),
                poses.count(),
            ))
        })?;
        Ok(FramePoses {
            pose: Some(pose),
            time_s: None,
        })
    };
    photos.iter().enumerate().map(pose).collect()
}
