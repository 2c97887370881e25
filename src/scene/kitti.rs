//! KITTI odometry: `image_0|image_2`, `velodyne`, `calib.txt`, `times.txt`, and the poses in
//! `../../poses/NN.txt` or in `poses.txt` beside the images.

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3x4, Point3, Vector3};
use posescope_core::files;

use super::file_scene::{FileScene, Frame};
use super::folder::{folder_name, numbered, warn_without_poses};
use super::kitti_format::{
    Camera, Scans, in_camera0, labelled, optional, split_projection, with_labelled,
};
use super::lines::{self, TextFile};
use super::pose_text::{PoseLines, by_line};
use super::recalibrated::Recalibrated;
use super::{Scene, SceneError, SceneFormat, photo_file};
use crate::geometry::{Pose, matrix_from_pose};

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "kitti",
    about: "KITTI odometry: a folder sequences/NN, or one camera of it, sequences/NN/image_2",
    recognizes: |argument| {
        let camera = Camera::of_path(Path::new(argument), &CAMERAS);
        camera.folder.join(CALIBRATION).is_file()
    },
    open: |argument| open(Path::new(argument)),
};

/// The cameras in the order of preference.
const CAMERAS: [&str; 4] = ["image_0", "image_2", "image_1", "image_3"];
const CALIBRATION: &str = "calib.txt";

/// Opens the folder of a sequence, or of one of its cameras. Frame numbers may have gaps.
fn open(path: &Path) -> Result<Box<dyn Scene>, SceneError> {
    let camera = Camera::of_path(path, &CAMERAS);
    let (folder, images) = (camera.folder, camera.name()?);
    let photos = numbered::<usize>(&folder.join(images), "png")?;
    let Some((&last, _)) = photos.last_key_value() else {
        return Err(SceneError::expected(
            folder.join(images),
            "images NNNNNN.png expected, none found",
        ));
    };
    let (size, _) = photo_file::common_size(&photos.values().cloned().collect::<Vec<_>>())?;
    let calibration = TextFile::read(&folder.join(CALIBRATION))?;
    let label = images.replace("image_", "P");
    let projection = labelled(&calibration, &label)?;
    let (intrinsics, camera_from_camera0) = split_projection(&projection, size, &calibration)?;
    let camera_from_velodyne = optional::<12>(&calibration, "Tr")?
        .map(|matrix| moved(&Matrix3x4::from_row_slice(&matrix), &camera_from_camera0));

    let sequence = folder_name(folder);
    let poses = read_poses(folder, &sequence, last)?;
    let times_s = read_times(&folder.join("times.txt"), last)?;
    let scan = |photo: &PathBuf| match (camera_from_velodyne, photo.file_stem()) {
        (Some(_), Some(stem)) => folder.join("velodyne").join(stem).with_extension("bin"),
        _ => folder.join(CALIBRATION),
    };
    let none = "a line `Tr:` (camera 0 from Velodyne) expected in calib.txt, as in KITTI's archive \
                data_odometry_calib, none found";
    let matrix = camera_from_velodyne.unwrap_or_else(Matrix3x4::zeros);
    let paths: Vec<PathBuf> = photos.values().map(scan).collect();
    let scans = Scans {
        exist: paths.iter().map(|path| path.is_file()).collect(),
        paths,
        missing: camera_from_velodyne.is_none().then_some(none),
        into_camera: Box::new(move |_, point| Point3::from(matrix * point.to_homogeneous())),
    };
    let frames = photos.into_iter().map(|(number, photo)| Frame {
        world_from_camera: poses
            .as_ref()
            .and_then(|poses| poses.get(number))
            .map(|world_from_camera0| world_from_camera0 * camera_from_camera0.inverse()),
        time_s: times_s.get(number).copied(),
        ..Frame::new(photo, intrinsics)
    });
    let name = match camera.wanted {
        Some(camera) => format!("kitti/{sequence}/{camera}"),
        None => format!("kitti/{sequence}"),
    };
    Ok(Box::new(FileScene::new(name, frames.collect(), scans)))
}

/// `calib.txt` with another line `Tr`.
pub(super) fn recalibrated(argument: &str, change: &Pose) -> Result<Recalibrated, SceneError> {
    let camera = Camera::of_path(Path::new(argument), &CAMERAS);
    let (path, label) = (camera.folder.join(CALIBRATION), camera.name()?.replace("image_", "P"));
    let text = lines::read_text(&path, files::DESCRIPTION)?;
    let file = TextFile::from_text(&path.display().to_string(), &text);
    // The size does not matter for where the camera is.
    let size = (u32::MAX, u32::MAX);
    let (_, camera_from_camera0) = split_projection(&labelled(&file, &label)?, size, &file)?;
    let stated = Matrix3x4::from_row_slice(&labelled::<12>(&file, "Tr")?);
    let better = moved(&stated, &in_camera0(change, &camera_from_camera0));
    let text = with_labelled(&text, "Tr", better.transpose().as_slice());
    Ok(Recalibrated { path, text })
}

/// The camera from the Velodyne. `Tr` is not orthonormalised, although its rotation may have few digits.
fn moved(camera0_from_velodyne: &Matrix3x4<f64>, camera_from_camera0: &Pose) -> Matrix3x4<f64> {
    let translation = camera_from_camera0.translation.vector;
    let zero = Vector3::zeros();
    matrix_from_pose(camera_from_camera0).fixed_columns::<3>(0) * camera0_from_velodyne
        + Matrix3x4::from_columns(&[zero, zero, zero, translation])
}

/// Poses by frame number; `None` if the sequence has no pose file.
fn read_poses(folder: &Path, sequence: &str, last: usize) -> Result<Option<PoseLines>, SceneError> {
    let candidates =
        [folder.join("poses.txt"), folder.join("../../poses").join(format!("{sequence}.txt"))];
    let Some(path) = candidates.into_iter().find(|path| path.is_file()) else {
        warn_without_poses(folder, "pose file");
        return Ok(None);
    };
    let file = TextFile::read(&path)?;
    let poses = by_line(&file)?;
    expect_rows(&file, "poses", poses.count(), last)?;
    Ok(Some(poses))
}

/// Times by frame number \[s\]; empty if the sequence has no `times.txt`.
fn read_times(path: &Path, last: usize) -> Result<Vec<f64>, SceneError> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let file = TextFile::read(path)?;
    let times = file.lines().map(|line| line.number(line.text)).collect::<Result<Vec<_>, _>>()?;
    expect_rows(&file, "times", times.len(), last)?;
    Ok(times)
}

fn expect_rows(file: &TextFile, what: &str, found: usize, last: usize) -> Result<(), SceneError> {
    if found > last {
        return Ok(());
    }
    Err(file.error(format!(
        "{what} up to frame {last} (line {}) expected, {found} lines found",
        last + 1
    )))
}
