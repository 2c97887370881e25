//! 7-Scenes: `frame-NNNNNN.color.png`, `.depth.png` and `.pose.txt` in the folders `seq-NN` of a
//! scene, all in one world frame.
//!
//! As distributed, the data contain no intrinsics, and depth images and poses are those of the depth camera. The
//! reader then uses the documented intrinsics of the depth camera, and for the colour camera the calibration of a
//! Kinect that is common in work on this data set. In a folder with `camera-intrinsics.txt`, a 3 × 3 matrix, depth
//! images are registered with the photos. 1000 is a metre in depth images, or the number in `depth_per_metre.txt`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Matrix3x4, Translation3, UnitQuaternion};

use super::depth_image::{DepthImages, unit_m};
use super::file_scene::{FileScene, Frame};
use super::folder::{entries, folder_name, split_word};
use super::lens::pinhole;
use super::lines::TextFile;
use super::{Scene, SceneError, SceneFormat, photo_file};
use crate::camera::Intrinsics;
use crate::geometry::{Pose, pose_from_matrix};

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "7scenes",
    about: "7-Scenes: a scene's folder with folders seq-NN (:train or :test selects a split), or one \
            folder seq-NN",
    recognizes: |argument| {
        let (folder, _) = split_word(argument, &SPLITS);
        is_sequence(folder) || subfolders(folder).iter().any(|(_, path)| is_sequence(path))
    },
    open: |argument| {
        let (folder, split) = split_word(argument, &SPLITS);
        open(folder, split)
    },
};

const SPLITS: [&str; 2] = ["train", "test"];

/// The depth of a value of 1 \[m\].
const UNIT_M: f64 = 0.001;
const COLOR: Intrinsics =
    Intrinsics { fx: 525.0, fy: 525.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };
/// The depth camera, as documented; both cameras have its principal point.
const DEPTH: Intrinsics = Intrinsics { fx: 585.0, fy: 585.0, ..COLOR };

/// The colour camera of a Kinect from its depth camera, rotation and translation \[m\]: the LIRIS calibration.
const COLOR_FROM_DEPTH: (Matrix3<f64>, [f64; 3]) = (
    Matrix3::new(
        0.99996518,
        0.00267651,
        -0.00790410, //
        -0.00274093,
        0.99996303,
        -0.00815045, //
        0.00788199,
        0.00817183,
        0.99993555,
    ),
    [-0.02555894, 0.00010110, 0.00203183],
);

fn open(folder: &Path, split: Option<&str>) -> Result<Box<dyn Scene>, SceneError> {
    let (name, photos) = listing(folder, split)?;
    let paths: Vec<PathBuf> = photos.iter().map(|(_, photo)| photo.clone()).collect();
    let (size, _) = photo_file::common_size(&paths)?;
    let cameras = Cameras::of(folder, size)?;
    let scene = if is_sequence(folder) { scene_of(folder) } else { folder_name(folder) };
    let mut frames = Vec::with_capacity(photos.len());
    let mut depths = Vec::with_capacity(photos.len());
    for (name, photo) in photos {
        let number = photo_number(&photo).unwrap_or_default();
        let sequence = photo.parent().unwrap_or(folder);
        let other_name = format!("{scene}/{}/frame-{number}", folder_name(sequence));
        let beside = |kind: &str| photo.with_file_name(format!("frame-{number}.{kind}"));
        depths.push(Some(beside("depth.png")).filter(|path| path.is_file()));
        frames.push(Frame {
            name,
            other_name: Some(other_name),
            world_from_camera: read_pose(&beside("pose.txt"))?
                .map(|world_from_posed| world_from_posed * cameras.camera_from_posed.inverse()),
            ..Frame::new(photo, cameras.photo)
        });
    }
    let has_no_pose = |frame: &&Frame| frame.world_from_camera.is_none();
    let unknown = frames.iter().filter(has_no_pose).count();
    if unknown > 0 {
        log::warn!(
            "{}: {unknown} of {} frames have no pose, so they cannot be references",
            folder.display(),
            frames.len()
        );
    }
    let clouds = DepthImages {
        images: depths,
        listed_in: folder.to_owned(),
        beside: cameras.depth,
        unit_m: unit_m(folder, UNIT_M)?,
    };
    Ok(Box::new(FileScene::new(name, frames, clouds)))
}

/// The name of the scene that a sequence belongs to.
fn scene_of(sequence: &Path) -> String {
    let sequence = sequence.canonicalize().unwrap_or_else(|_| sequence.to_owned());
    sequence.parent().map(folder_name).unwrap_or_default()
}

type NamedPhoto = (String, PathBuf);

/// The scene's name and its frames in order. Frames are named by number, or with several sequences by sequence and
/// number.
fn listing(folder: &Path, split: Option<&str>) -> Result<(String, Vec<NamedPhoto>), SceneError> {
    if is_sequence(folder) {
        let name = format!("7scenes/{}/{}", scene_of(folder), folder_name(folder));
        return Ok((name, frames_of(folder, "")?));
    }
    let mut sequences = subfolders(folder);
    let mut name = format!("7scenes/{}", folder_name(folder));
    if let Some(split) = split {
        let wanted = read_split(folder, split)?;
        sequences.retain(|(number, _)| wanted.contains(number));
        name += &format!(":{split}");
    }
    let mut files = Vec::new();
    for (number, path) in &sequences {
        let prefix = match sequences.len() {
            1 => String::new(),
            _ => format!("seq-{number:02}-"),
        };
        files.extend(frames_of(path, &prefix)?);
    }
    if files.is_empty() {
        return Err(SceneError::expected(
            folder,
            "folders seq-NN with images frame-NNNNNN.color.png expected, none found",
        ));
    }
    Ok((name, files))
}

/// The numbers of the sequences in `TrainSplit.txt` or `TestSplit.txt`, whose lines are `sequenceN`.
fn read_split(folder: &Path, split: &str) -> Result<Vec<u32>, SceneError> {
    let file = match split {
        "train" => "TrainSplit.txt",
        _ => "TestSplit.txt",
    };
    TextFile::read(&folder.join(file))?
        .lines()
        .map(|line| {
            let number = line.text.strip_prefix("sequence").unwrap_or(line.text);
            number.trim().parse().map_err(|_| line.error("a line such as `sequence3` expected"))
        })
        .collect()
}

fn subfolders(folder: &Path) -> Vec<(u32, PathBuf)> {
    let entries = entries(folder).unwrap_or_default();
    let mut found: Vec<(u32, PathBuf)> = entries
        .into_iter()
        .filter_map(|path| {
            let number = file_name(&path)?.strip_prefix("seq-")?.parse().ok()?;
            path.is_dir().then_some((number, path))
        })
        .collect();
    found.sort();
    found
}

fn file_name(path: &Path) -> Option<&str> {
    path.file_name()?.to_str()
}

/// The number of a frame from its photo: `000025` for `frame-000025.color.png`.
fn photo_number(path: &Path) -> Option<&str> {
    const KINDS: [&str; 3] = ["color.png", "color.jpg", "color.jpeg"];
    let (number, kind) = file_name(path)?.strip_prefix("frame-")?.split_once('.')?;
    let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    (is_number && KINDS.contains(&kind)).then_some(number)
}

fn is_sequence(folder: &Path) -> bool {
    let entries = entries(folder).unwrap_or_default();
    entries.iter().any(|path| photo_number(path).is_some())
}

/// The frames of a sequence in the order of their numbers. If a photo exists in two formats, the last by name is used.
fn frames_of(folder: &Path, prefix: &str) -> Result<Vec<NamedPhoto>, SceneError> {
    let mut by_number = BTreeMap::new();
    for photo in entries(folder)? {
        if let Some(number) = photo_number(&photo) {
            let key = (number.len(), number.to_owned());
            by_number.insert(key, (format!("{prefix}{number}"), photo));
        }
    }
    Ok(by_number.into_values().collect())
}

/// Reads a 4 × 4 matrix, camera to world. `None` if there is no file, or if it contains NaN or infinity, which trackers
/// write when they lose the camera.
fn read_pose(path: &Path) -> Result<Option<Pose>, SceneError> {
    if !path.is_file() {
        return Ok(None);
    }
    let file = TextFile::read(path)?;
    let is_lost = |word: &str| word.parse().is_ok_and(|number: f64| !number.is_finite());
    if file.lines().any(|line| line.fields().into_iter().any(is_lost)) {
        return Ok(None);
    }
    let rows = file.rows::<4, 4>()?;
    if rows[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err(file.error(format!("the last row 0 0 0 1 expected, {:?} found", rows[3])));
    }
    let pose = pose_from_matrix(&Matrix3x4::from_fn(|row, column| rows[row][column]));
    pose.map(Some).map_err(|error| file.error(error.to_string()))
}

struct Cameras {
    photo: Intrinsics,
    /// The photos' camera from the camera of the poses.
    camera_from_posed: Pose,
    depth: Option<(Intrinsics, Pose)>,
}

impl Cameras {
    /// The cameras of a scene's or a sequence's folder.
    fn of(folder: &Path, (width, height): (u32, u32)) -> Result<Self, SceneError> {
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let file = [Some(folder.as_path()), folder.parent()]
            .into_iter()
            .flatten()
            .map(|folder| folder.join("camera-intrinsics.txt"))
            .find(|path| path.is_file());
        if let Some(path) = file {
            return Ok(Self {
                photo: read_intrinsics(&path, (width, height))?,
                camera_from_posed: Pose::identity(),
                depth: None,
            });
        }
        if (width, height) != (COLOR.width, COLOR.height) {
            return Err(SceneError::expected(
                folder.join("camera-intrinsics.txt"),
                format!(
                    "a file with a 3x3 matrix expected, since the images have {width}x{height} pixels and the \
                     default camera is for 640x480"
                ),
            ));
        }
        log::info!(
            "{}: no camera-intrinsics.txt; using the documented depth camera and the usual colour camera \
             of the data set",
            folder.display()
        );
        let camera_from_depth = Pose::from_parts(
            Translation3::from(COLOR_FROM_DEPTH.1),
            UnitQuaternion::from_matrix(&COLOR_FROM_DEPTH.0),
        );
        Ok(Self {
            photo: COLOR,
            camera_from_posed: camera_from_depth,
            depth: Some((DEPTH, camera_from_depth)),
        })
    }
}

fn read_intrinsics(path: &Path, size: (u32, u32)) -> Result<Intrinsics, SceneError> {
    let file = TextFile::read(path)?;
    let [[fx, skew, cx], [zero, fy, cy], last] = file.rows::<3, 3>()?;
    if skew != 0.0 || zero != 0.0 || last != [0.0, 0.0, 1.0] {
        return Err(file.error("a matrix fx 0 cx, 0 fy cy, 0 0 1 expected"));
    }
    pinhole([fx, fy, cx, cy], size).map_err(|why| file.error(why))
}
