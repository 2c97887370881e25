//! KITTI raw data, synchronised and rectified: the folder of a drive with `image_00` … `image_03`,
//! `velodyne_points` and `oxts`, and the calibration files of its day one folder up.
//!
//! Poses come from the GPS/IMU packets, converted as in the devkit, in the frame of the rectified camera 0 at the
//! first packet. Scans are corrected for the motion during the sweep unless the argument ends with `:uncorrected`.

mod calibration;
mod oxts;
mod sweep;
mod timestamps;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::Point3;

use self::calibration::Calibration;
use self::oxts::Packet;
use self::sweep::Sweep;
use super::file_scene::{FileScene, Frame};
use super::folder::{folder_name, numbered, split_word, warn_without_poses};
use super::kitti_format::{Camera, Scans};
use super::recalibrated::Recalibrated;
use super::{Scene, SceneError, SceneFormat, photo_file};
use crate::geometry::Pose;

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "kitti-raw",
    about: "KITTI raw: a drive's folder DATE/DATE_drive_NNNN_sync, or one camera of it, …/image_02; \
            :uncorrected keeps the distortion of the scans by motion",
    recognizes: |argument| {
        let (path, _) = split_word(argument, &[UNCORRECTED]);
        let drive = Camera::of_path(path, &CAMERAS).folder;
        day_of(drive).join(calibration::CAMERAS).is_file()
            && CAMERAS.iter().any(|camera| drive.join(camera).is_dir())
    },
    open: |argument| {
        let (path, word) = split_word(argument, &[UNCORRECTED]);
        open(path, word.is_none())
    },
};

/// The word that turns off the correction of scans.
const UNCORRECTED: &str = "uncorrected";

/// The cameras in the order of preference: grey left, colour left, grey right, colour right.
const CAMERAS: [&str; 4] = ["image_00", "image_02", "image_01", "image_03"];

/// `calib_velo_to_cam.txt` with another rotation and translation.
pub(super) fn recalibrated(argument: &str, change: &Pose) -> Result<Recalibrated, SceneError> {
    let (path, _) = split_word(argument, &[UNCORRECTED]);
    let camera = Camera::of_path(path, &CAMERAS);
    calibration::recalibrated(&day_of(camera.folder), camera.name()?, change)
}

/// The folder of the day, with the calibration.
fn day_of(drive: &Path) -> PathBuf {
    match drive.canonicalize() {
        Ok(drive) => drive.parent().map(Path::to_owned).unwrap_or(drive),
        Err(_) => drive.join(".."),
    }
}

fn open(path: &Path, correct: bool) -> Result<Box<dyn Scene>, SceneError> {
    let camera = Camera::of_path(path, &CAMERAS);
    let (drive, images) = (camera.folder, camera.name()?);
    let photos = numbered::<usize>(&drive.join(images).join("data"), "png")?;
    let (Some(first), Some(&last)) = (photos.values().next(), photos.keys().next_back()) else {
        return Err(SceneError::expected(
            drive.join(images).join("data"),
            "images NNNNNNNNNN.png expected, none found",
        ));
    };
    let calibration = Calibration::read(&day_of(drive), images)?;
    let intrinsics = calibration.intrinsics;
    let (width, height) = photo_file::dimensions(first)?;
    if (width, height) != (intrinsics.width, intrinsics.height) {
        return Err(SceneError::expected(
            first,
            format!(
                "a rectified image of {}x{} pixels expected, {width}x{height} found; use a drive \
                 with a name that ends in _sync",
                intrinsics.width, intrinsics.height
            ),
        ));
    }
    let packets = oxts::read(&drive.join("oxts"))?;
    if packets.is_empty() {
        warn_without_poses(drive, "oxts packets");
    }
    let world_from_camera0 = oxts::world_from_camera0(&packets, &calibration.camera0_from_imu());
    let times = timestamps::read(&drive.join(images).join("timestamps.txt"), last)?;
    let folder = drive.join("velodyne_points");
    let (paths, sweeps) = scans(&folder, photos.keys(), &packets, correct)?;
    if sweeps.iter().any(Option::is_some) {
        log::info!(
            "{}: scans are corrected for the motion during the sweep; append `:{UNCORRECTED}` to the \
             path to turn this off",
            drive.display()
        );
    }
    let camera_from_velodyne = calibration.camera_from_camera0 * calibration.camera0_from_velodyne;
    let velodyne_from_imu = calibration.velodyne_from_imu;
    let into_camera = move |index: usize, point: Point3<f64>| {
        let sweep = sweeps[index].as_ref();
        let corrected = sweep.map(|sweep| sweep.corrected(&point, &velodyne_from_imu));
        camera_from_velodyne * corrected.unwrap_or(point)
    };
    let exist = paths.iter().map(|path| path.is_file()).collect();
    let scans = Scans { paths, exist, missing: None, into_camera: Box::new(into_camera) };
    let frames = photos.into_iter().map(|(number, photo)| Frame {
        world_from_camera: world_from_camera0
            .get(&number)
            .map(|pose| pose * calibration.camera_from_camera0.inverse()),
        time_s: times.get(number).copied().flatten(),
        ..Frame::new(photo, intrinsics)
    });
    let mut name = format!("kitti-raw/{}", folder_name(drive));
    if let Some(camera) = camera.wanted {
        name += &format!("/{camera}");
    }
    if !correct {
        name += &format!(":{UNCORRECTED}");
    }
    Ok(Box::new(FileScene::new(name, frames.collect(), scans)))
}

/// The scan of each frame, and the motion of the car during it if it must be corrected. The scan of a frame without
/// one is the folder.
fn scans<'a>(
    folder: &Path,
    frames: impl Iterator<Item = &'a usize>,
    packets: &BTreeMap<usize, Packet>,
    correct: bool,
) -> Result<(Vec<PathBuf>, Vec<Option<Sweep>>), SceneError> {
    let data = folder.join("data");
    let files: BTreeMap<usize, PathBuf> =
        if data.is_dir() { numbered(&data, "bin")? } else { BTreeMap::new() };
    let last = files.keys().next_back().copied().unwrap_or(0);
    let starts = timestamps::read(&folder.join("timestamps_start.txt"), last)?;
    let ends = timestamps::read(&folder.join("timestamps_end.txt"), last)?;
    let scan = |number: &usize| {
        let Some(path) = files.get(number) else {
            return (folder.to_owned(), None);
        };
        let duration_s = match (starts.get(*number), ends.get(*number)) {
            (Some(Some(start)), Some(Some(end))) => end - start,
            _ => sweep::USUAL_S,
        };
        let packet = packets.get(number).filter(|_| correct);
        (path.clone(), packet.map(|packet| Sweep::new(packet, duration_s)))
    };
    Ok(frames.map(scan).unzip())
}
