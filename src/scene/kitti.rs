//! KITTI odometry: `image_0|image_2`, `velodyne`, `calib.txt`, `times.txt`, and the poses in
//! `../../poses/NN.txt` or in `poses.txt` beside the images.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3x4, Point3, Vector3};

use super::file_scene::folder_name;
use super::kitti_format::{read_scan, split_projection};
use super::lines::{numbers, read_text};
use super::{Entry, Scene, SceneError, photo_file};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::{Pose, matrix_from_pose, pose_from_matrix};
use crate::image::Photo;

pub(super) const ENTRY: Entry = Entry {
    name: "kitti",
    about: "KITTI odometry: a folder sequences/NN, or one camera of it, sequences/NN/image_2",
    recognizes: |argument| {
        split_camera(Path::new(argument))
            .0
            .join("calib.txt")
            .is_file()
    },
    open: |argument| Ok(Box::new(KittiOdometry::open(Path::new(argument))?)),
};

/// The cameras, in the order in which one is chosen when the folder has several.
const CAMERAS: [&str; 4] = ["image_0", "image_2", "image_1", "image_3"];

/// A sequence of the KITTI odometry benchmark. Frames may have gaps.
pub struct KittiOdometry {
    name: String,
    folder: PathBuf,
    camera: String,
    frames: Vec<String>,
    intrinsics: Intrinsics,
    /// The camera's frame from the rectified camera 0, which poses and `Tr` speak of.
    camera_from_camera0: Pose,
    camera0_from_velodyne: Option<Matrix3x4<f64>>,
    /// The poses by frame number.
    poses: Vec<Pose>,
    /// The times by frame number \[s\].
    times_s: Vec<f64>,
}

/// The sequence folder, and the camera if the path names one.
fn split_camera(path: &Path) -> (&Path, Option<&str>) {
    let last = path.file_name().and_then(|name| name.to_str());
    match (last, path.parent()) {
        (Some(name), Some(parent)) if CAMERAS.contains(&name) => (parent, Some(name)),
        _ => (path, None),
    }
}

impl KittiOdometry {
    /// Opens a sequence folder, or one of its image folders for that camera.
    ///
    /// # Errors
    /// [`SceneError`] with file, line and what was expected.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        let (folder, wanted_camera) = split_camera(path);
        let camera = match wanted_camera {
            Some(camera) => camera,
            None => CAMERAS
                .into_iter()
                .find(|camera| folder.join(camera).is_dir())
                .ok_or_else(|| {
                    SceneError::expected(
                        folder,
                        "an image folder expected (image_0, image_2, …), none found",
                    )
                })?,
        };
        let images = folder.join(camera);
        let frames = frame_names(&images)?;
        let size = photo_file::dimensions(&images.join(format!("{}.png", frames[0])))?;
        let calibration = Calibration::read(&folder.join("calib.txt"))?;
        let projection = calibration.projection(&camera.replace("image_", "P"))?;
        let (intrinsics, camera_from_camera0) =
            split_projection(&projection, size, &calibration.path)?;

        let sequence = folder_name(folder);
        let last_frame = frame_number(&frames[frames.len() - 1]);
        let poses = read_poses(folder, &sequence, last_frame)?;
        let times_s = read_times(&folder.join("times.txt"), last_frame)?;
        Ok(Self {
            name: match wanted_camera {
                Some(camera) => format!("kitti/{sequence}/{camera}"),
                None => format!("kitti/{sequence}"),
            },
            folder: folder.to_owned(),
            camera: camera.to_owned(),
            frames,
            intrinsics,
            camera_from_camera0,
            camera0_from_velodyne: calibration.matrix("Tr").copied(),
            poses,
            times_s,
        })
    }

    fn photo_path(&self, frame: usize) -> PathBuf {
        self.folder
            .join(&self.camera)
            .join(format!("{}.png", self.frames[frame]))
    }

    fn scan_path(&self, frame: usize) -> PathBuf {
        self.folder
            .join("velodyne")
            .join(format!("{}.bin", self.frames[frame]))
    }

    fn frames_with_cloud(&self) -> String {
        let with: Vec<&str> = (0..self.frames.len())
            .filter(|&frame| self.has_cloud(frame))
            .map(|frame| self.frames[frame].as_str())
            .collect();
        match with.as_slice() {
            [] => "no frame of this sequence has one".to_owned(),
            [only] => format!("frame {only} has one"),
            [first, .., last] => format!("{} frames have one: {first} … {last}", with.len()),
        }
    }
}

impl Scene for KittiOdometry {
    fn name(&self) -> &str {
        &self.name
    }

    fn frames(&self) -> &[String] {
        &self.frames
    }

    fn intrinsics(&self, _frame: usize) -> Intrinsics {
        self.intrinsics
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        let world_from_camera0 = self.poses.get(frame_number(&self.frames[frame]))?;
        Some(world_from_camera0 * self.camera_from_camera0.inverse())
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        self.times_s.get(frame_number(&self.frames[frame])).copied()
    }

    fn has_cloud(&self, frame: usize) -> bool {
        self.camera0_from_velodyne.is_some() && self.scan_path(frame).is_file()
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        photo_file::read(&self.photo_path(frame), &self.intrinsics(frame))
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let path = self.scan_path(frame);
        let Some(camera0_from_velodyne) = self.camera0_from_velodyne else {
            return Err(SceneError::expected(
                self.folder.join("calib.txt"),
                "a line `Tr:` expected (camera 0 from Velodyne), none found; \
                           without it no frame can be a reference",
            ));
        };
        if !path.is_file() {
            return Err(SceneError::NoCloud {
                frame: self.frames[frame].clone(),
                hint: self.frames_with_cloud(),
                path,
            });
        }
        let camera_from_velodyne = matrix_from_pose(&self.camera_from_camera0)
            .fixed_columns::<3>(0)
            * camera0_from_velodyne
            + Matrix3x4::from_columns(&[
                Vector3::zeros(),
                Vector3::zeros(),
                Vector3::zeros(),
                self.camera_from_camera0.translation.vector,
            ]);
        read_scan(&path, |point| {
            Point3::from(camera_from_velodyne * point.to_homogeneous())
        })
    }

    /// With the sizes of the files: photos of the same size in bytes are hardly ever different ones,
    /// and times change when data are copied.
    fn fingerprint(&self) -> u64 {
        let size = |frame| std::fs::metadata(self.photo_path(frame)).map_or(0, |file| file.len());
        let sizes = (0..self.frames.len()).map(size);
        let bytes: Vec<u8> = sizes.flat_map(u64::to_le_bytes).collect();
        posescope_core::scene::fingerprint(self, &bytes)
    }
}

/// Frame names are numbers; the listing made sure.
fn frame_number(name: &str) -> usize {
    name.parse().unwrap_or(usize::MAX)
}

/// Names of the PNG files whose name is a number, in numeric order.
fn frame_names(images: &Path) -> Result<Vec<String>, SceneError> {
    let io = SceneError::io(images);
    let mut by_number = BTreeMap::new();
    for entry in std::fs::read_dir(images).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let is_png = path.extension().is_some_and(|extension| extension == "png");
        if let Some(stem) = path.file_stem().and_then(|stem| stem.to_str())
            && let Ok(number) = stem.parse::<usize>()
            && is_png
        {
            by_number.insert(number, stem.to_owned());
        }
    }
    if by_number.is_empty() {
        return Err(SceneError::expected(
            images,
            "images NNNNNN.png expected, none found",
        ));
    }
    Ok(by_number.into_values().collect())
}

/// The matrices of `calib.txt`, by label.
struct Calibration {
    path: PathBuf,
    matrices: BTreeMap<String, Matrix3x4<f64>>,
}

impl Calibration {
    fn read(path: &Path) -> Result<Self, SceneError> {
        let mut matrices = BTreeMap::new();
        for (index, line) in read_text(path)?.lines().enumerate() {
            let Some((label, numbers)) = line.split_once(':') else {
                continue;
            };
            let matrix = parse_matrix(numbers)
                .map_err(|expected| SceneError::line(path, index + 1, expected))?;
            matrices.insert(label.trim().to_owned(), matrix);
        }
        Ok(Self {
            path: path.to_owned(),
            matrices,
        })
    }

    fn matrix(&self, label: &str) -> Option<&Matrix3x4<f64>> {
        self.matrices.get(label)
    }

    fn projection(&self, label: &str) -> Result<Matrix3x4<f64>, SceneError> {
        self.matrix(label).copied().ok_or_else(|| {
            SceneError::expected(
                &self.path,
                format!("a line `{label}:` expected (projection matrix), none found"),
            )
        })
    }
}

/// Poses by frame number; none where the sequence has no pose file.
fn read_poses(folder: &Path, sequence: &str, last: usize) -> Result<Vec<Pose>, SceneError> {
    let candidates = [
        folder.join("poses.txt"),
        folder.join("../../poses").join(format!("{sequence}.txt")),
    ];
    let Some(path) = candidates.into_iter().find(|path| path.is_file()) else {
        log::warn!(
            "{}: no pose file, so no frame can be a reference and nothing has an error",
            folder.display()
        );
        return Ok(Vec::new());
    };
    let mut poses = Vec::new();
    for (index, line) in read_text(&path)?.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        let pose = parse_matrix(line)
            .and_then(|matrix| pose_from_matrix(&matrix).map_err(|error| error.to_string()))
            .map_err(|expected| SceneError::line(&path, index + 1, expected))?;
        poses.push(pose);
    }
    expect_rows(poses.len(), last, &path, "poses")?;
    Ok(poses)
}

/// Times by frame number \[s\]; none where the sequence has no `times.txt`.
fn read_times(path: &Path, last: usize) -> Result<Vec<f64>, SceneError> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let mut times = Vec::new();
    for (index, line) in read_text(path)?.lines().enumerate() {
        let time = line.trim().parse().map_err(|_| {
            SceneError::line(
                path,
                index + 1,
                format!("a time in seconds expected, `{}` found", line.trim()),
            )
        })?;
        times.push(time);
    }
    expect_rows(times.len(), last, path, "times")?;
    Ok(times)
}

fn expect_rows(found: usize, last: usize, path: &Path, what: &str) -> Result<(), SceneError> {
    if found > last {
        return Ok(());
    }
    Err(SceneError::expected(
        path,
        format!(
            "{what} up to frame {last} expected (line {}), {found} lines found",
            last + 1
        ),
    ))
}

/// Twelve numbers, row by row.
fn parse_matrix(text: &str) -> Result<Matrix3x4<f64>, String> {
    numbers::<12>(text).map(|numbers| Matrix3x4::from_row_slice(&numbers))
}
