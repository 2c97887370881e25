//! Text files of poses. The first line determines the format:
//!
//! - TUM: `time x y z qx qy qz qw`, camera to world, in any order;
//! - KITTI: twelve numbers of `[R|t]`, camera to world, a line per frame;
//! - visuallocalization.net: `name qw qx qy qz x y z`, world to camera;
//! - `images.txt` of a COLMAP model: world to camera.

use posescope_core::scene::trailing_number;

use super::SceneError;
use super::colmap::image_lines;
use super::frame_names::FrameNames;
use super::lines::{Line, TextFile};
use crate::geometry::Pose;

/// The poses of a file, `world_from_camera`.
pub(super) enum PoseText<'a> {
    Timed(Vec<(f64, Pose)>),
    Lines(PoseLines),
    Named(Vec<NamedPose<'a>>),
}

/// A pose with the name of its image.
pub(super) struct NamedPose<'a> {
    pub line: Line<'a>,
    pub name: String,
    pub world_from_camera: Pose,
}

impl<'a> PoseText<'a> {
    /// Reads a file. Poses by name are only read if `names` are given to look them up.
    pub fn read(file: &'a TextFile, names: Option<&FrameNames<'_>>) -> Result<Self, SceneError> {
        let Some(first) = file.lines().next() else {
            return Err(file.error("poses expected, none found"));
        };
        let words = first.words().count();
        match (words, names) {
            (12, _) => Ok(Self::Lines(by_line(file)?)),
            (8, Some(names)) if is_named(first, names) => {
                let poses = file.lines().map(named);
                Ok(Self::Named(poses.collect::<Result<_, _>>()?))
            }
            (8, _) => Ok(Self::Timed(by_time(file)?)),
            (10.., Some(_)) => {
                let poses = image_lines(file).map(|(line, image)| {
                    let image = image?;
                    Ok(NamedPose {
                        line,
                        name: image.name,
                        world_from_camera: image.camera_from_world.inverse(),
                    })
                });
                Ok(Self::Named(poses.collect::<Result<_, SceneError>>()?))
            }
            (_, names) => {
                let named = match names {
                    Some(_) => ", `name qw qx qy qz x y z` or COLMAP's images.txt",
                    None => "",
                };
                let comma = match first.text.contains(',') {
                    true => "; separate them by spaces, without a header",
                    false => "",
                };
                Err(first.error(format!(
                    "TUM (8 numbers: time x y z qx qy qz qw), KITTI (12 numbers: a 3x4 matrix){named} \
                     expected; words found: {words}{comma}"
                )))
            }
        }
    }
}

/// Whether a line of eight words begins with a name instead of a time. If its first word is a number, the quaternion
/// decides; if both readings are possible, a frame of that name does.
fn is_named(line: Line<'_>, names: &FrameNames<'_>) -> bool {
    let name = line.words().next().unwrap_or_default();
    match (timed(line).is_ok(), named(line).is_ok()) {
        (true, true) => names.find_named(name).is_some(),
        (false, false) => line.number(name).is_err(),
        (_, is_named) => is_named,
    }
}

/// `name qw qx qy qz x y z`
fn named(line: Line<'_>) -> Result<NamedPose<'_>, SceneError> {
    let name = line.words().next().unwrap_or_default();
    let pose = line.text.strip_prefix(name).unwrap_or_default();
    let [qw, qx, qy, qz, x, y, z] = line.numbers_of(pose)?;
    Ok(NamedPose {
        line,
        name: name.to_owned(),
        world_from_camera: line.pose([x, y, z], [qx, qy, qz, qw])?.inverse(),
    })
}

fn timed(line: Line<'_>) -> Result<(f64, Pose), SceneError> {
    let [time, x, y, z, qx, qy, qz, qw] = line.numbers()?;
    Ok((time, line.pose([x, y, z], [qx, qy, qz, qw])?))
}

/// The poses of a TUM text with their times \[s\].
pub(super) fn by_time(file: &TextFile) -> Result<Vec<(f64, Pose)>, SceneError> {
    file.lines().map(timed).collect()
}

pub(super) fn by_line(file: &TextFile) -> Result<PoseLines, SceneError> {
    let poses = file.lines().map(|line| line.matrix_pose());
    Ok(PoseLines(poses.collect::<Result<_, _>>()?))
}

pub(super) struct PoseLines(Vec<Pose>);

impl PoseLines {
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The pose of a line, counted from 0.
    pub fn get(&self, line: usize) -> Option<Pose> {
        self.0.get(line).copied()
    }

    /// The pose of a frame. If there are as many lines as frames, lines are in the order of the frames. Otherwise
    /// the number at the end of the frame's name is the number of its line.
    pub fn of_frame(&self, index: usize, frames: usize, name: &str) -> Option<Pose> {
        let by_name = || trailing_number(name)?.try_into().ok();
        self.get(if self.count() == frames { index } else { by_name()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_in_the_order_of_the_frames_or_by_the_number_of_a_name() {
        let text: String = (0..3).map(|z| format!("1 0 0 0 0 1 0 0 0 0 1 {z}\n")).collect();
        let poses = by_line(&TextFile::from_text("poses.txt", &text)).expect("three poses");
        let way_m = |pose: Option<Pose>| pose.map(|pose| pose.translation.vector.z);
        assert_eq!(way_m(poses.of_frame(0, 3, "img2")), Some(0.0));
        assert_eq!(way_m(poses.of_frame(0, 2, "img2")), Some(2.0));
        assert_eq!(way_m(poses.of_frame(0, 2, "img7")), None);
        assert_eq!(way_m(poses.of_frame(0, 2, "img")), None);
    }
}
