//! KITTI raw data, synchronised and rectified: the folder of a drive with `image_00` … `image_03`,
//! `velodyne_points` and `oxts`, and the calibration files of its day one folder up.
//!
//! Poses are those of the GPS/IMU, as the devkit makes them of its packets, in the frame of the
//! rectified camera 0 at the first packet. Scans are corrected for the motion during the sweep unless
//! the argument ends with `:uncorrected`.

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
use super::argument::split_word;
use super::file_scene::{Clouds, FileScene, Frame, folder_name};
use super::kitti_format::{read_scan, split_projection};
use super::{Entry, Scene, SceneError, photo_file};
use crate::cloud::Cloud;
use crate::geometry::Pose;

pub(super) const ENTRY: Entry = Entry {
    name: "kitti-raw",
    about: "KITTI raw: a drive's folder DATE/DATE_drive_NNNN_sync, or one camera of it, …/image_02; \
            with :uncorrected scans keep the distortion of the sweep",
    recognizes: |argument| {
        let (path, _) = split_word(argument, &[UNCORRECTED]);
        let (drive, _) = split_camera(path);
        day_of(&drive).join(calibration::CAMERAS).is_file()
            && CAMERAS.iter().any(|camera| drive.join(camera).is_dir())
    },
    open: |argument| {
        let (path, word) = split_word(argument, &[UNCORRECTED]);
        open(path, word.is_none())
    },
};

/// Leaves the scans as they are.
const UNCORRECTED: &str = "uncorrected";

/// The cameras, in the order in which one is chosen when the drive has several: grey left, colour
/// left, and those on the right.
const CAMERAS: [&str; 4] = ["image_00", "image_02", "image_01", "image_03"];

/// The drive's folder, and the camera if the path names one.
fn split_camera(path: &Path) -> (PathBuf, Option<&'static str>) {
    let last = path.file_name().and_then(|name| name.to_str());
    let camera = CAMERAS.into_iter().find(|camera| last == Some(camera));
    match (camera, path.parent()) {
        (Some(camera), Some(drive)) => (drive.to_owned(), Some(camera)),
        _ => (path.to_owned(), None),
    }
}

/// The folder of the day, with the calibration.
fn day_of(drive: &Path) -> PathBuf {
    match drive.canonicalize() {
        Ok(drive) => drive.parent().map(Path::to_owned).unwrap_or(drive),
        Err(_) => drive.join(".."),
    }
}

fn open(path: &Path, correct: bool) -> Result<Box<dyn Scene>, SceneError> {
    let (drive, wanted) = split_camera(path);
    let found = CAMERAS.iter().find(|camera| drive.join(camera).is_dir());
    let camera = wanted.or(found.copied()).ok_or_else(|| {
        SceneError::expected(
            &drive,
            "an image folder expected (image_00, image_02, …), none found",
        )
    })?;
    let photos = numbered(&drive.join(camera).join("data"), "png")?;
    let Some(first) = photos.values().next() else {
        return Err(SceneError::expected(
            drive.join(camera).join("data"),
            "images NNNNNNNNNN.png expected, none found",
        ));
    };
    let day = day_of(&drive);
    let calibration = Calibration::read(&day, camera)?;
    let size = photo_file::dimensions(first)?;
    if size != calibration.size {
        let (width, height) = calibration.size;
        return Err(SceneError::expected(
            first,
            format!(
                "a rectified image of {width}x{height} pixels expected, as in the drives called \
                 _sync, {}x{} found",
                size.0, size.1
            ),
        ));
    }
    let (intrinsics, camera_from_camera0) = split_projection(
        &calibration.projection,
        size,
        &day.join(calibration::CAMERAS),
    )?;
    let packets = oxts::read(&drive.join("oxts"))?;
    if packets.is_empty() {
        log::warn!(
            "{}: no oxts packets, so no frame can be a reference and nothing has an error",
            drive.display()
        );
    }
    let world_from_camera0 = oxts::world_from_camera0(&packets, &calibration.camera0_from_imu());
    let times = timestamps::read(&drive.join(camera).join("timestamps.txt"))?;
    let frames: Vec<Frame> = photos
        .iter()
        .map(|(&number, photo)| Frame {
            name: stem(photo),
            photo: photo.clone(),
            intrinsics,
            lens: None,
            world_from_camera: world_from_camera0
                .get(&number)
                .map(|pose| pose * camera_from_camera0.inverse()),
            time_s: times.get(number).copied(),
        })
        .collect();
    let scans = Scans {
        folder: drive.join("velodyne_points"),
        of_frames: scans(
            &drive.join("velodyne_points"),
            photos.keys(),
            &packets,
            correct,
        )?,
        camera_from_velodyne: camera_from_camera0 * calibration.camera0_from_velodyne,
        velodyne_from_imu: calibration.velodyne_from_imu,
    };
    if correct
        && scans
            .of_frames
            .iter()
            .flatten()
            .any(|scan| scan.sweep.is_some())
    {
        log::info!(
            "{}: scans are corrected for the motion during the sweep; `:{UNCORRECTED}` after the \
             path leaves them as they are",
            drive.display()
        );
    }
    let mut name = format!("kitti-raw/{}", folder_name(&drive));
    if let Some(camera) = wanted {
        name += &format!("/{camera}");
    }
    if !correct {
        name += &format!(":{UNCORRECTED}");
    }
    Ok(Box::new(FileScene::new(name, frames, scans)))
}

/// The files of a folder whose name is a number, by it.
fn numbered(folder: &Path, extension: &str) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    let io = SceneError::io(folder);
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.extension().is_some_and(|found| found == extension)
            && let Ok(number) = stem(&path).parse()
        {
            files.insert(number, path);
        }
    }
    Ok(files)
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// The scans of frames, by position; none where the drive has no scans.
fn scans<'a>(
    folder: &Path,
    frames: impl Iterator<Item = &'a usize>,
    packets: &BTreeMap<usize, Packet>,
    correct: bool,
) -> Result<Vec<Option<Scan>>, SceneError> {
    let data = folder.join("data");
    let files = if data.is_dir() {
        numbered(&data, "bin")?
    } else {
        BTreeMap::new()
    };
    let starts = timestamps::read(&folder.join("timestamps_start.txt"))?;
    let ends = timestamps::read(&folder.join("timestamps_end.txt"))?;
    let scan = |number: &usize| {
        let path = files.get(number)?.clone();
        let duration_s = match (starts.get(*number), ends.get(*number)) {
            (Some(start), Some(end)) => end - start,
            _ => sweep::USUAL_S,
        };
        let packet = packets.get(number).filter(|_| correct);
        Some(Scan {
            path,
            sweep: packet.map(|packet| Sweep::new(packet, duration_s)),
        })
    };
    Ok(frames.map(scan).collect())
}

/// A scan and how the car moved while it was taken, if it is to be corrected.
struct Scan {
    path: PathBuf,
    sweep: Option<Sweep>,
}

struct Scans {
    folder: PathBuf,
    of_frames: Vec<Option<Scan>>,
    camera_from_velodyne: Pose,
    velodyne_from_imu: Pose,
}

impl Clouds for Scans {
    fn has(&self, frame: usize) -> bool {
        self.of_frames[frame].is_some()
    }

    fn place(&self, frame: usize) -> &Path {
        let scan = self.of_frames[frame].as_ref();
        scan.map_or(&self.folder, |scan| &scan.path)
    }

    fn read(&self, index: usize, _frame: &Frame) -> Result<Cloud, SceneError> {
        let sweep = self.of_frames[index]
            .as_ref()
            .and_then(|s| s.sweep.as_ref());
        let into_camera = |point: Point3<f64>| {
            let point = match sweep {
                Some(sweep) => sweep.corrected(&point, &self.velodyne_from_imu),
                None => point,
            };
            self.camera_from_velodyne * point
        };
        read_scan(self.place(index), into_camera)
    }
}
