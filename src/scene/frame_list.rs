//! `frames.jsonl`: a list of frames, as `posescope.record` of Python writes it while a localiser runs.
//!
//! The first line names the scene, and each further line is a frame:
//!
//! ```json
//! {"schema": "posescope.frames/1", "scene": "photo"}
//! {"name": "cam0/000003", "photo": "photos/cam0/000003.png", "camera": {"width": 640, "height": 480, "fx": 500,
//!  "fy": 500, "cx": 319.5, "cy": 239.5}, "pose": {"position_m": [0, 0, 0], "quaternion_xyzw": [0, 0, 0, 1]},
//!  "time_s": 1.5, "cloud": "clouds/000003.ply"}
//! ```
//!
//! `pose`, `time_s` and `cloud` may be missing. Clouds are in the camera's frame. Other fields are the writer's own. A last
//! line without an end is what a killed process left, and is skipped.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use posescope_core::files;
use posescope_core::text::{expect_name, json_message};
use serde::Deserialize;

use super::file_scene::{Clouds, FileScene, Frame};
use super::folder::{Bounds, within};
use super::{Lengths, Scene, SceneError, SceneFormat, cloud_file, lines};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// The name of the file.
pub const FRAME_LIST: &str = "frames.jsonl";

/// The version of the file format.
pub const FRAME_LIST_SCHEMA: &str = "posescope.frames/1";

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "frames",
    about: "frames that a running localiser recorded from Python: a frames.jsonl, or the folder with it",
    recognizes: |argument| file_of(Path::new(argument)).is_file(),
    open: |argument| open(&file_of(Path::new(argument))),
};

fn file_of(argument: &Path) -> PathBuf {
    if argument.file_name().is_some_and(|name| name == FRAME_LIST) {
        argument.to_owned()
    } else {
        argument.join(FRAME_LIST)
    }
}

#[derive(Deserialize)]
struct Header {
    schema: String,
    scene: String,
}

#[derive(Deserialize)]
struct ListedFrame {
    name: String,
    photo: String,
    camera: ListedCamera,
    pose: Option<ListedPose>,
    time_s: Option<f64>,
    cloud: Option<String>,
}

#[derive(Deserialize)]
struct ListedCamera {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

/// `world_from_camera`. A matrix would be rounded.
#[derive(Deserialize)]
struct ListedPose {
    position_m: [f64; 3],
    quaternion_xyzw: [f64; 4],
}

impl ListedPose {
    fn pose(&self) -> Result<Pose, String> {
        let [x, y, z, w] = self.quaternion_xyzw;
        let turn = Quaternion::new(w, x, y, z);
        let length = turn.norm();
        // Rounding changes the length slightly; more is no rotation.
        if !length.is_finite() || (length - 1.0).abs() > 0.02 {
            return Err(format!("a quaternion of length 1 expected, one of {length} found"));
        }
        if !self.position_m.iter().all(lines::is_near) {
            let farthest = lines::FARTHEST;
            return Err(format!("a position within {farthest:e} of 0 expected, another found"));
        }
        let is_exact = (length - 1.0).abs() < 1e-9;
        let turn = if is_exact {
            UnitQuaternion::new_unchecked(turn)
        } else {
            UnitQuaternion::new_normalize(turn)
        };
        Ok(Pose::from_parts(Translation3::from(self.position_m), turn))
    }
}

impl ListedFrame {
    fn frame(self, folder: &Path) -> Result<(Frame, Option<PathBuf>), String> {
        expect_name(&self.name)?;
        let ListedCamera { width, height, fx, fy, cx, cy } = self.camera;
        if ![fx, fy, cx, cy].into_iter().all(f64::is_finite) || fx <= 0.0 || fy <= 0.0 {
            return Err(format!(
                "finite numbers and focal lengths above 0 expected, {fx} {fy} {cx} {cy} found"
            ));
        }
        if width == 0 || height == 0 {
            return Err(format!("at least one pixel expected, {width}x{height} found"));
        }
        let intrinsics = Intrinsics { fx, fy, cx, cy, width, height };
        if let Some(time) = self.time_s.filter(|time| !time.is_finite()) {
            return Err(format!("a finite time expected, {time} found"));
        }
        let cloud = self.cloud.map(|cloud| within(folder, &cloud)).transpose()?;
        let frame = Frame {
            name: self.name,
            world_from_camera: self.pose.map(|pose| pose.pose()).transpose()?,
            time_s: self.time_s,
            ..Frame::new(within(folder, &self.photo)?, intrinsics)
        };
        Ok((frame, cloud))
    }
}

fn open(path: &Path) -> Result<Box<dyn Scene>, SceneError> {
    Bounds::Layout.check(path)?;
    let text = lines::read_text(path, files::TABLE)?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let mut numbered = text.split_inclusive('\n').zip(1..);
    let error = |line: usize, why: String| SceneError::line(path, line, why);
    let (first, _) = numbered
        .next()
        .ok_or_else(|| SceneError::expected(path, "a line with schema and scene expected"))?;
    let header: Header = serde_json::from_str(first).map_err(|why| error(1, json_message(&why)))?;
    if header.schema != FRAME_LIST_SCHEMA {
        let found = lines::excerpt(&header.schema);
        return Err(error(1, format!("schema {FRAME_LIST_SCHEMA} expected, {found} found")));
    }
    let (mut frames, mut clouds, mut names) = (Vec::new(), Vec::new(), BTreeSet::new());
    for (line, number) in numbered {
        let listed: ListedFrame = match serde_json::from_str(line) {
            Ok(listed) => listed,
            // A process was killed while it wrote this line.
            Err(_) if !line.ends_with('\n') => break,
            Err(why) => return Err(error(number, json_message(&why))),
        };
        let (frame, cloud) = listed.frame(folder).map_err(|why| error(number, why))?;
        if !names.insert(frame.name.clone()) {
            let name = lines::excerpt(&frame.name);
            return Err(error(
                number,
                format!("frames with different names expected, {name} is above"),
            ));
        }
        frames.push(frame);
        clouds.push(cloud);
    }
    if frames.is_empty() {
        return Err(SceneError::expected(path, "a line for each frame expected, none found"));
    }
    let scene = FileScene::new(header.scene, frames, ListedClouds(clouds));
    Ok(Box::new(scene.within(Bounds::Folder(folder.to_owned()))))
}

/// The cloud of each frame that has one.
struct ListedClouds(Vec<Option<PathBuf>>);

impl Clouds for ListedClouds {
    fn has(&self, index: usize) -> bool {
        self.0[index].is_some()
    }

    fn place<'a>(&'a self, index: usize, frame: &'a Frame) -> &'a Path {
        self.0[index].as_deref().unwrap_or(&frame.photo)
    }

    /// As of frames that Python holds: their scale is that of a street.
    fn lengths(&self) -> Lengths {
        Lengths::Street
    }

    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError> {
        let cloud = cloud_file::read(self.place(index, frame))?;
        Ok(Cloud { points: cloud.positions().map(|point| point.cast()).collect() })
    }
}
