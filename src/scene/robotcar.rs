//! Oxford RobotCar as its SDK lays it out: the folder of a traversal with `stereo/centre` or `mono_rear`,
//! scans of `lms_front`, `lms_rear` and `ldmrs`, visual odometry and GPS/INS; and the SDK's own folder with
//! `models` and `extrinsics`.
//!
//! Photos are demosaiced and undistorted by the look-up table of their camera model. Poses come from GPS/INS rows
//! with a good solution. The cloud of a frame accumulates the scans around it, moved by visual odometry or else by
//! the INS. As in the paper (section 4.1), one frame in ten is kept, and none before the car first moves or after
//! it last stops; `:all` after the path keeps every frame.

mod bayer;
mod poses;
mod scans;
mod sdk;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use self::bayer::{Pattern, demosaiced};
use self::poses::{first_and_last_motion, read_ins, read_odometry};
use self::scans::{Scans, scan_files};
use self::sdk::{CameraModel, Sdk};
use super::file_scene::{Develop, FileScene, Frame};
use super::folder::{folder_name, numbered, split_word, warn_without_poses};
use super::lines::{Line, TextFile};
use super::trajectory::Trajectory;
use super::{Scene, SceneError, SceneFormat, photo_file};
use crate::image::Photo;

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "robotcar",
    about: "Oxford RobotCar: a traversal's folder with stereo/centre or mono_rear, or one camera of it. The \
            SDK's models and extrinsics must be in it, next to it, or in sdk or robotcar-dataset-sdk there. \
            :all keeps every frame instead of one in ten while the car moves",
    recognizes: |argument| {
        let (path, _) = split_word(argument, &[ALL]);
        let (traversal, _) = split_camera(path);
        CAMERAS.iter().any(|camera| traversal.join(camera.folder).is_dir())
            && Sdk::find(&traversal).is_some()
    },
    open: |argument| {
        let (path, word) = split_word(argument, &[ALL]);
        open(path, word.is_some())
    },
};

/// Keeps every frame.
const ALL: &str = "all";
/// One frame in this many is kept otherwise, as in the paper.
const KEPT: usize = 10;
/// Timestamps count microseconds.
const PER_SECOND: f64 = 1e6;

struct CameraKind {
    /// The folder of its photos.
    folder: &'static str,
    model: &'static str,
    pattern: Pattern,
}

/// The cameras in the order of preference. The SDK files the stereo rig's centre camera as the left one of the
/// narrow pair.
const CAMERAS: [CameraKind; 4] = [
    CameraKind { folder: "stereo/centre", model: "stereo_narrow_left", pattern: Pattern::Gbrg },
    mono("mono_rear"),
    mono("mono_left"),
    mono("mono_right"),
];

const fn mono(name: &'static str) -> CameraKind {
    CameraKind { folder: name, model: name, pattern: Pattern::Rggb }
}

impl CameraKind {
    /// The name of the camera's rig in files of times and extrinsics.
    fn rig(&self) -> &'static str {
        self.folder.split('/').next().unwrap_or_default()
    }
}

/// The traversal's folder, and the camera if the path names one.
fn split_camera(path: &Path) -> (PathBuf, Option<&'static CameraKind>) {
    for camera in &CAMERAS {
        if path.ends_with(camera.folder) {
            let depth = Path::new(camera.folder).components().count();
            if let Some(traversal) = path.ancestors().nth(depth) {
                return (traversal.to_owned(), Some(camera));
            }
        }
    }
    (path.to_owned(), None)
}

fn open(path: &Path, keeps_all: bool) -> Result<Box<dyn Scene>, SceneError> {
    let (traversal, wanted) = split_camera(path);
    let there = CAMERAS.iter().find(|camera| traversal.join(camera.folder).is_dir());
    let camera = wanted.or(there).ok_or_else(|| {
        SceneError::expected(
            &traversal,
            "photos in stereo/centre or mono_rear expected, none found",
        )
    })?;
    let sdk = Sdk::find(&traversal).ok_or_else(|| {
        SceneError::expected(
            &traversal,
            "the folders models and extrinsics of the SDK expected in the traversal's folder, next to \
             it, or in sdk or robotcar-dataset-sdk there, none found",
        )
    })?;
    let ins = match traversal.join("gps/ins.csv") {
        file if file.is_file() => {
            let vehicle_from_ins = sdk.extrinsics("ins")?;
            read_ins(&file)?.of_part(&vehicle_from_ins.inverse())
        }
        _ => {
            warn_without_poses(&traversal, "gps/ins.csv");
            Trajectory::default()
        }
    };
    let motion = match traversal.join("vo/vo.csv") {
        file if file.is_file() => read_odometry(&file)?,
        _ => ins.clone(),
    };
    let driven = if motion.samples().is_empty() { &ins } else { &motion };
    let photos = photos(&traversal, camera, driven, keeps_all)?;
    if photos.is_empty() {
        return Err(SceneError::expected(
            traversal.join(camera.folder),
            "photos TIMESTAMP.png expected, none found among every tenth while the car moves; \
             append :all to the path to keep all",
        ));
    }
    let paths: Vec<PathBuf> = photos.iter().map(|(_, photo)| photo.clone()).collect();
    let model = sdk.camera_model(camera.model, photo_file::common_size(&paths)?.0)?;
    let camera_from_vehicle = sdk.extrinsics(camera.rig())?;
    let vehicle_from_image = camera_from_vehicle.inverse() * model.camera_from_image;
    let intrinsics = model.intrinsics;
    let develop: Arc<dyn Develop> = Arc::new(Sensor { pattern: camera.pattern, model });
    let scans = Scans {
        files: scan_files(&traversal, &sdk)?,
        motion,
        times: photos.iter().map(|(time, _)| *time).collect(),
        image_from_vehicle: vehicle_from_image.inverse(),
    };
    let frames = photos.into_iter().map(|(time, photo)| Frame {
        develop: Some(Arc::clone(&develop)),
        world_from_camera: ins
            .at(time as f64)
            .map(|world_from_vehicle| world_from_vehicle * vehicle_from_image),
        time_s: Some(time as f64 / PER_SECOND),
        ..Frame::new(photo, intrinsics)
    });
    let name = format!("robotcar/{}", folder_name(&traversal));
    Ok(Box::new(FileScene::new(name, frames.collect(), scans)))
}

/// The kept photos that exist, with their times \[µs\].
fn photos(
    traversal: &Path,
    camera: &CameraKind,
    driven: &Trajectory,
    keeps_all: bool,
) -> Result<Vec<(u64, PathBuf)>, SceneError> {
    let folder = traversal.join(camera.folder);
    let list = traversal.join(format!("{}.timestamps", camera.rig()));
    let times = if list.is_file() {
        times(&list)?
    } else {
        numbered(&folder, "png")?.into_keys().collect()
    };
    let moving = first_and_last_motion(driven);
    let is_moving =
        |time: &u64| moving.is_none_or(|(first, last)| (first..=last).contains(&(*time as f64)));
    let kept: Vec<u64> = if keeps_all {
        times.into_iter().collect()
    } else {
        times.into_iter().filter(is_moving).step_by(KEPT).collect()
    };
    let photos = kept.into_iter().map(|time| (time, folder.join(format!("{time}.png"))));
    Ok(photos.filter(|(_, photo)| photo.is_file()).collect())
}

/// The times of all photos in the list \[µs\].
fn times(list: &Path) -> Result<BTreeSet<u64>, SceneError> {
    let file = TextFile::read(list)?;
    let time = |line: Line<'_>| {
        let time = line.fields()[0].parse::<u64>();
        time.map_err(|_| line.error("a line `timestamp chunk` expected"))
    };
    file.lines().map(time).collect()
}

/// Converts a raw image to a pinhole photo: demosaics and undistorts it.
struct Sensor {
    pattern: Pattern,
    model: CameraModel,
}

impl Develop for Sensor {
    fn developed(&self, image: Photo) -> Photo {
        let color = demosaiced(&image.gray, self.pattern);
        Photo::from_color(self.model.undistorted(&color))
    }
}
