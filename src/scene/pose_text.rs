//! Text files of poses. The first line determines the format:
//!
//! - TUM: `time x y z qx qy qz qw`, camera to world, in any order;
//! - KITTI: twelve numbers of `[R|t]`, camera to world, a line per frame;
//! - visuallocalization.net: `name qw qx qy qz x y z`, world to camera;
//! - `images.txt` of a COLMAP model: world to camera;
//! - a header with the columns `name` or `time`, and `x y z qx qy qz qw`, in any order: camera to world.

use posescope_core::scene::trailing_number;

use super::SceneError;
use super::colmap::image_lines;
use super::frame_names::FrameNames;
use super::lines::{Line, NAMES, TextFile};
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
        if let Some(columns) = first.header() {
            return with_header(file, first, &columns);
        }
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
                Err(first.error(format!(
                    "TUM (8 numbers: time x y z qx qy qz qw), KITTI (12 numbers: a 3x4 matrix){named} \
                     expected; words found: {words}"
                )))
            }
        }
    }
}

/// The lines below a header that names the columns.
fn with_header<'a>(
    file: &'a TextFile,
    first: Line<'a>,
    columns: &[String],
) -> Result<PoseText<'a>, SceneError> {
    let find =
        |called: &[&str]| columns.iter().position(|column| called.contains(&column.as_str()));
    let numbers = [&["x", "tx"], &["y", "ty"], &["z", "tz"]].map(|called| find(called));
    let quaternion = ["qx", "qy", "qz", "qw"].map(|called| find(&[called]));
    let (name, time) = (find(NAMES), find(&["time", "timestamp"]));
    let ([Some(x), Some(y), Some(z)], [Some(qx), Some(qy), Some(qz), Some(qw)], Some(key)) =
        (numbers, quaternion, name.or(time))
    else {
        return Err(first.error(
            "a header with the columns `name` or `time`, and `x y z qx qy qz qw`, expected",
        ));
    };
    let poses = file.lines().skip(1).map(|line| {
        let words: Vec<&str> = line.words().collect();
        if words.len() != columns.len() {
            let (count, found) = (columns.len(), words.len());
            return Err(line.error(format!("{count} columns expected, {found} found")));
        }
        let number = |column: usize| line.number(words[column]);
        let position = [number(x)?, number(y)?, number(z)?];
        let pose = line.pose(position, [number(qx)?, number(qy)?, number(qz)?, number(qw)?])?;
        Ok(NamedPose { line, name: words[key].to_owned(), world_from_camera: pose })
    });
    let poses: Vec<NamedPose<'_>> = poses.collect::<Result<_, SceneError>>()?;
    if name.is_some() {
        return Ok(PoseText::Named(poses));
    }
    let timed =
        poses.iter().map(|pose| Ok((pose.line.number(&pose.name)?, pose.world_from_camera)));
    Ok(PoseText::Timed(timed.collect::<Result<_, SceneError>>()?))
}

/// Whether a line of eight words begins with a name instead of a time. If its first word is a number, the quaternion
/// decides; if both readings are possible, a frame of that name does.
fn is_named(line: Line<'_>, names: &FrameNames<'_>) -> bool {
    let name = line.words().next().unwrap_or_default();
    match (timed(line).is_ok(), named(line).is_ok()) {
        (true, true) => names.find_alone(name).is_some(),
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
        let by_name = || line_of(name)?.try_into().ok();
        self.get(if self.count() == frames { index } else { by_name()? })
    }
}

/// The line of a frame in a file with a line per number. Cameras of a rig share their numbers, so folders have none.
pub(super) fn line_of(name: &str) -> Option<u64> {
    trailing_number(name).filter(|_| !name.contains('/'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_names_the_columns() {
        let text = "image,qw,qx,qy,qz,x,y,z\nDSC_1.JPG,1,0,0,0,4,5,6\nDSC_2.JPG,0,0,1,0,7,8,9\n";
        let file = TextFile::from_text("poses.csv", text);
        let Ok(PoseText::Named(poses)) = PoseText::read(&file, None) else {
            panic!("no named poses");
        };
        assert_eq!(poses[1].name, "DSC_2.JPG");
        assert_eq!(poses[1].world_from_camera.translation.vector.as_slice(), [7.0, 8.0, 9.0]);
        assert_eq!(poses[1].world_from_camera.rotation.coords.as_slice(), [0.0, 1.0, 0.0, 0.0]);
        let timed = "x y z qx qy qz qw timestamp\n4 5 6 0 0 0 1 12.5\n";
        let file = TextFile::from_text("poses.txt", timed);
        let Ok(PoseText::Timed(samples)) = PoseText::read(&file, None) else {
            panic!("no timed poses");
        };
        assert_eq!(samples[0].0, 12.5);
        for (wrong, words) in [
            ("name,x,y,z\na,1,2,3\n", "`x y z qx qy qz qw`, expected"),
            ("name,x,y,z,qx,qy,qz,qw\na,1,2,3\n", "poses.txt:2: 8 columns expected, 4 found"),
        ] {
            let file = TextFile::from_text("poses.txt", wrong);
            let error = PoseText::read(&file, None).err().expect("wrong").to_string();
            assert!(error.contains(words), "{error}");
        }
    }

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
