//! Oxford RobotCar as its SDK lays it out: the folder of a traversal with `stereo/centre` or `mono_rear`,
//! scans of `lms_front`, `lms_rear` and `ldmrs`, visual odometry and GPS/INS; and the SDK's own folder with
//! `models` and `extrinsics`.
//!
//! Photos are demosaiced and undistorted by the look-up table of their camera model. Poses are those of
//! the GPS/INS where it calls its solution good. The cloud of a frame is made of the scans around it, moved
//! by visual odometry where there is any, else by the INS. One frame in ten is kept, and none from before
//! the car first moves or after it last stops (Fu et al., section 4.1), unless `:all` follows the path.

mod bayer;
mod poses;
mod scans;
mod sdk;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use self::bayer::{Pattern, demosaiced};
use self::poses::{Track, first_and_last_motion, read_ins, read_odometry};
use self::scans::{ScanFile, gathered, scan_files};
use self::sdk::{CameraModel, Sdk};
use super::argument::split_word;
use super::file_scene::folder_name;
use super::lines::TextFile;
use super::{Entry, Scene, SceneError, photo_file};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;

pub(super) const ENTRY: Entry = Entry {
    name: "robotcar",
    about: "Oxford RobotCar: a traversal's folder with stereo/centre or mono_rear, or one camera of it, \
            and the SDK's models and extrinsics in it, beside it or in sdk or robotcar-dataset-sdk there; \
            with :all every frame, not one in ten of those where the car moves",
    recognizes: |argument| {
        let (path, _) = split_word(argument, &[ALL]);
        let (traversal, _) = split_camera(path);
        CAMERAS
            .iter()
            .any(|camera| traversal.join(camera.folder).is_dir())
            && Sdk::find(&traversal).is_some()
    },
    open: |argument| {
        let (path, word) = split_word(argument, &[ALL]);
        Ok(Box::new(RobotCar::open(path, word.is_some())?))
    },
};

/// Keeps every frame.
const ALL: &str = "all";
/// Otherwise one frame in so many, as in the paper.
const KEPT: usize = 10;
/// Timestamps count microseconds.
const PER_SECOND: f64 = 1e6;

/// A camera that is read.
#[derive(Debug)]
struct CameraKind {
    /// The folder of its photos.
    folder: &'static str,
    /// The file with the times of all its photos.
    timestamps: &'static str,
    /// The extrinsics of its rig.
    extrinsics: &'static str,
    /// Its model.
    model: &'static str,
    pattern: Pattern,
}

/// In the order in which one is chosen. The centre camera of the stereo rig pairs with the left one, at a
/// wide baseline.
const CAMERAS: &[CameraKind] = &[
    CameraKind {
        folder: "stereo/centre",
        timestamps: "stereo.timestamps",
        extrinsics: "stereo",
        model: "stereo_narrow_left",
        pattern: Pattern::Gbrg,
    },
    CameraKind {
        folder: "mono_rear",
        timestamps: "mono_rear.timestamps",
        extrinsics: "mono_rear",
        model: "mono_rear",
        pattern: Pattern::Rggb,
    },
    CameraKind {
        folder: "mono_left",
        timestamps: "mono_left.timestamps",
        extrinsics: "mono_left",
        model: "mono_left",
        pattern: Pattern::Rggb,
    },
    CameraKind {
        folder: "mono_right",
        timestamps: "mono_right.timestamps",
        extrinsics: "mono_right",
        model: "mono_right",
        pattern: Pattern::Rggb,
    },
];

/// The traversal's folder, and the camera if the path names one.
fn split_camera(path: &Path) -> (PathBuf, Option<&'static CameraKind>) {
    for camera in CAMERAS {
        if path.ends_with(camera.folder) {
            let depth = Path::new(camera.folder).components().count();
            if let Some(traversal) = path.ancestors().nth(depth) {
                return (traversal.to_owned(), Some(camera));
            }
        }
    }
    (path.to_owned(), None)
}

/// A traversal.
struct RobotCar {
    name: String,
    names: Vec<String>,
    /// Photos and their times \[µs\].
    photos: Vec<(u64, PathBuf)>,
    camera: &'static CameraKind,
    model: CameraModel,
    /// From the camera of the model to the vehicle.
    vehicle_from_image: Pose,
    sdk: Sdk,
    /// The vehicle in the world, where the solution is good.
    ins: Track,
    /// How the vehicle moved, for scans.
    motion: Track,
    scans: Vec<ScanFile>,
}

impl RobotCar {
    fn open(path: &Path, keeps_all: bool) -> Result<Self, SceneError> {
        let (traversal, wanted) = split_camera(path);
        let expected =
            |path: PathBuf, expected: &str| SceneError::expected(path, expected.to_owned());
        let there = CAMERAS
            .iter()
            .find(|camera| traversal.join(camera.folder).is_dir());
        let camera = wanted.or(there).ok_or_else(|| {
            expected(
                traversal.clone(),
                "photos in stereo/centre or mono_rear expected, none found",
            )
        })?;
        let sdk = Sdk::find(&traversal).ok_or_else(|| {
            expected(
                traversal.clone(),
                "the folders models and extrinsics of the SDK expected in the traversal's folder, beside \
                 it, or in sdk or robotcar-dataset-sdk there",
            )
        })?;
        let model = sdk.camera_model(camera.model)?;
        let camera_from_vehicle = sdk.extrinsics(camera.extrinsics)?;
        let vehicle_from_image = camera_from_vehicle.inverse() * model.camera_from_image;
        let ins = match traversal.join("gps/ins.csv") {
            file if file.is_file() => {
                let vehicle_from_ins = sdk.extrinsics("ins")?;
                read_ins(&file)?.moved_by(&vehicle_from_ins.inverse())
            }
            _ => {
                log::warn!(
                    "{}: no gps/ins.csv, so no frame can be a reference and nothing has an error",
                    traversal.display()
                );
                Track::default()
            }
        };
        let motion = match traversal.join("vo/vo.csv") {
            file if file.is_file() => read_odometry(&file)?,
            _ => ins.clone(),
        };
        let times = all_times(&traversal, camera)?;
        let kept = match keeps_all {
            true => times,
            false => {
                let track = if motion.is_empty() { &ins } else { &motion };
                let moving = first_and_last_motion(track);
                let is_moving =
                    |time: &u64| moving.is_none_or(|(first, last)| (first..=last).contains(time));
                times.into_iter().filter(is_moving).step_by(KEPT).collect()
            }
        };
        let folder = traversal.join(camera.folder);
        let photos: Vec<(u64, PathBuf)> = kept
            .into_iter()
            .map(|time| (time, folder.join(format!("{time}.png"))))
            .filter(|(_, photo)| photo.is_file())
            .collect();
        let Some((_, first)) = photos.first() else {
            return Err(expected(
                folder,
                "photos TIMESTAMP.png expected, one in ten while the car moves (or :all behind the path), \
                 none found",
            ));
        };
        let size = photo_file::dimensions(first)?;
        let model = model.for_photos_of(size)?;
        let scans = scan_files(&traversal, &sdk)?;
        Ok(Self {
            name: format!("robotcar/{}", folder_name(&traversal)),
            names: photos.iter().map(|(time, _)| time.to_string()).collect(),
            photos,
            camera,
            model,
            vehicle_from_image,
            sdk,
            ins,
            motion,
            scans,
        })
    }
}

/// The times of all photos that were taken \[µs\]: as the list says, and otherwise of those that are there.
fn all_times(traversal: &Path, camera: &CameraKind) -> Result<Vec<u64>, SceneError> {
    let list = traversal.join(camera.timestamps);
    if list.is_file() {
        let file = TextFile::read(&list)?;
        let times: Result<BTreeSet<u64>, SceneError> = file
            .lines()
            .map(|line| {
                let word = line.words().next().unwrap_or_default();
                let whole = word.parse::<u64>();
                whole.map_err(|_| line.error("a line `timestamp chunk` expected"))
            })
            .collect();
        return Ok(times?.into_iter().collect());
    }
    let folder = traversal.join(camera.folder);
    let io = SceneError::io(&folder);
    let mut times = BTreeSet::new();
    for entry in std::fs::read_dir(&folder).map_err(io)? {
        let name = entry.map_err(io)?.file_name();
        let time = name.to_str().and_then(|name| name.strip_suffix(".png"));
        times.extend(time.and_then(|time| time.parse::<u64>().ok()));
    }
    Ok(times.into_iter().collect())
}

impl Scene for RobotCar {
    fn name(&self) -> &str {
        &self.name
    }

    fn frames(&self) -> &[String] {
        &self.names
    }

    fn intrinsics(&self, _frame: usize) -> Intrinsics {
        self.model.intrinsics
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        let world_from_vehicle = self.ins.at(self.photos[frame].0)?;
        Some(world_from_vehicle * self.vehicle_from_image)
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        Some(self.photos[frame].0 as f64 / PER_SECOND)
    }

    fn has_cloud(&self, frame: usize) -> bool {
        let time = self.photos[frame].0;
        self.motion.at(time).is_some() && scans::any_around(&self.scans, time)
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let (_, path) = &self.photos[frame];
        let raw = Photo::read(path).map_err(SceneError::image(path))?;
        let Intrinsics { width, height, .. } = self.model.intrinsics;
        photo_file::expect_size(path, raw.dimensions(), (width, height))?;
        let color = demosaiced(&raw.gray, self.camera.pattern);
        Ok(Photo::from_color(self.model.undistorted(&color)))
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let (time, path) = &self.photos[frame];
        if !self.has_cloud(frame) {
            return Err(SceneError::NoCloud {
                path: path.clone(),
                frame: self.names[frame].clone(),
                hint: "scans of lms_front, lms_rear or ldmrs around its time, and vo/vo.csv or gps/ins.csv \
                       that say how the car moved, are needed"
                    .to_owned(),
            });
        }
        gathered(
            &self.scans,
            &self.sdk,
            &self.motion,
            *time,
            &self.vehicle_from_image.inverse(),
            &self.model.intrinsics,
        )
    }
}
