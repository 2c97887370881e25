//! The poses of a described scene, in one of two texts, told apart by how many numbers a line has.

use std::path::{Path, PathBuf};

use super::super::SceneError;
use super::super::folder::stem;
use super::super::lines::{self, TextFile};
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

/// The poses of the photos.
pub(super) fn read(path: &Path, photos: &[PathBuf]) -> Result<Vec<FramePoses>, SceneError> {
    let file = TextFile::read(path)?;
    let numbers = file.lines().next().map_or(0, |line| line.words().count());
    match numbers {
        8 => by_time(path, &file, photos),
        12 => by_line(&file, photos),
        _ => Err(file.error(format!(
            "lines of 8 numbers (TUM: time tx ty tz qx qy qz qw) or 12 (KITTI: a 3x4 matrix) \
             expected, {numbers} found"
        ))),
    }
}

/// TUM: a photo is called by its time.
fn by_time(
    path: &Path,
    file: &TextFile,
    photos: &[PathBuf],
) -> Result<Vec<FramePoses>, SceneError> {
    let trajectory = Trajectory::read(path)?;
    let poses: Vec<FramePoses> = photos
        .iter()
        .map(|photo| {
            let time_s = lines::numbers::<1>(&stem(photo)).ok().map(|[time]| time);
            FramePoses {
                pose: time_s.and_then(|time| trajectory.at(time)),
                time_s,
            }
        })
        .collect();
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

/// KITTI: a line for each photo in order; or, where there are more lines, a line for each number that
/// a photo's name may end with, from 0.
fn by_line(file: &TextFile, photos: &[PathBuf]) -> Result<Vec<FramePoses>, SceneError> {
    let poses = file
        .lines()
        .map(|line| line.matrix_pose())
        .collect::<Result<Vec<_>, _>>()?;
    let line_of = |index: usize, photo: &Path| -> Option<usize> {
        if poses.len() == photos.len() {
            return Some(index);
        }
        let name = stem(photo);
        let digits = name.rfind(|c: char| !c.is_ascii_digit());
        name[digits.map_or(0, |at| at + 1)..].parse().ok()
    };
    let mut frames = Vec::with_capacity(photos.len());
    for (index, photo) in photos.iter().enumerate() {
        let pose = line_of(index, photo).and_then(|line| poses.get(line));
        let pose = pose.ok_or_else(|| {
            file.error(format!(
                "a line for each of {} images expected, or for each number from 0 that their \
                 names end with; {} lines found, none for `{}`",
                photos.len(),
                poses.len(),
                stem(photo)
            ))
        })?;
        frames.push(FramePoses {
            pose: Some(*pose),
            time_s: None,
        });
    }
    Ok(frames)
}
