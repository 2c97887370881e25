//! TUM RGB-D: `rgb.txt` and `depth.txt` list the images by time, `groundtruth.txt` the poses of the
//! camera. Images are associated by time.
//!
//! The camera is in `calibration.txt` (`fx fy cx cy`, an addition of ETH3D). Without it, the reader uses the
//! benchmark's recommendation: the default calibration of the Kinect drivers, to which the depth images are
//! registered. 5000 is a metre in depth images, or the number in `depth_per_metre.txt`.

use std::path::{Path, PathBuf};

use super::depth_image::{DepthImages, unit_m};
use super::file_scene::{FileScene, Frame};
use super::folder::{Bounds, folder_name, warn_without_poses, within};
use super::lens::pinhole;
use super::lines::TextFile;
use super::pose_text::by_time;
use super::trajectory::{Trajectory, associated};
use super::{Scene, SceneError, SceneFormat, photo_file};
use crate::camera::Intrinsics;

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "tum",
    about: "TUM RGB-D: a folder with rgb.txt, depth.txt and groundtruth.txt",
    recognizes: |argument| {
        let folder = Path::new(argument);
        ["rgb.txt", "depth.txt"].iter().all(|list| folder.join(list).is_file())
    },
    open: |argument| open(Path::new(argument)),
};

/// The depth of a value of 1 \[m\].
const UNIT_M: f64 = 1.0 / 5000.0;

/// The default of the Kinect drivers: fx, fy, cx, cy for 640 × 480 pixels, with pixel centres at integers.
const KINECT: [f64; 4] = [525.0, 525.0, 319.5, 239.5];
const KINECT_SIZE: (u32, u32) = (640, 480);

fn open(folder: &Path) -> Result<Box<dyn Scene>, SceneError> {
    let photos = image_list(folder, "rgb.txt")?;
    let depths = image_list(folder, "depth.txt")?;
    if photos.is_empty() {
        return Err(SceneError::expected(
            folder.join("rgb.txt"),
            "lines `time file` expected, none found",
        ));
    }
    let paths: Vec<PathBuf> = photos.iter().map(|(_, photo)| photo.clone()).collect();
    let intrinsics = camera(folder, photo_file::common_size(&paths)?.0)?;
    let truth = folder.join("groundtruth.txt");
    let trajectory = if truth.is_file() {
        Some(Trajectory::in_seconds(by_time(&TextFile::read(&truth)?)?))
    } else {
        warn_without_poses(folder, "groundtruth.txt");
        None
    };
    let times = |list: &[(f64, PathBuf)]| list.iter().map(|(time, _)| *time).collect::<Vec<_>>();
    let images = associated(&times(&photos), &times(&depths))
        .into_iter()
        .map(|depth| depth.map(|depth| depths[depth].1.clone()))
        .collect();
    let frames: Vec<Frame> = photos
        .into_iter()
        .map(|(time, photo)| Frame {
            world_from_camera: trajectory.as_ref().and_then(|all| all.at(time)),
            time_s: Some(time),
            ..Frame::new(photo, intrinsics)
        })
        .collect();
    if let Some((first, last)) = trajectory.as_ref().and_then(Trajectory::range)
        && frames.iter().all(|frame| frame.world_from_camera.is_none())
    {
        return Err(SceneError::expected(
            truth,
            format!(
                "poses at the times of rgb.txt expected, but the poses are between {first} and {last}"
            ),
        ));
    }
    let name = format!("tum/{}", folder_name(folder));
    let clouds = DepthImages {
        images,
        listed_in: folder.join("depth.txt"),
        beside: None,
        unit_m: unit_m(folder, UNIT_M)?,
    };
    let bounds = Bounds::Folder(folder.to_owned());
    Ok(Box::new(FileScene::new(name, frames, clouds).within(bounds)))
}

/// The images of a list in the order of their times \[s\].
fn image_list(folder: &Path, list: &str) -> Result<Vec<(f64, PathBuf)>, SceneError> {
    let file = TextFile::read(&folder.join(list))?;
    let mut images = file
        .lines()
        .map(|line| {
            let (time, name) = (line.text.split_once(char::is_whitespace))
                .ok_or_else(|| line.error("a line `time file` expected, one word found"))?;
            let path = within(folder, name.trim()).map_err(|why| line.error(why))?;
            Ok((line.number(time)?, path))
        })
        .collect::<Result<Vec<_>, SceneError>>()?;
    images.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(images)
}

/// The camera of the folder, whose images are of this size.
fn camera(folder: &Path, (width, height): (u32, u32)) -> Result<Intrinsics, SceneError> {
    let path = folder.join("calibration.txt");
    if path.is_file() {
        let file = TextFile::read(&path)?;
        file.expect_order(&["fx", "fy", "cx", "cy"])?;
        let [camera] = file.rows::<1, 4>()?;
        return pinhole(camera, (width, height)).map_err(|why| file.error(why));
    }
    if (width, height) != KINECT_SIZE {
        return Err(SceneError::expected(
            path,
            format!(
                "a file with fx fy cx cy expected, since the images have {width}x{height} pixels \
                 and the default camera is for 640x480"
            ),
        ));
    }
    log::info!(
        "{}: no calibration.txt; using the Kinect's default, f = 525, centre 319.5, 239.5",
        folder.display()
    );
    pinhole(KINECT, KINECT_SIZE).map_err(|why| SceneError::expected(path, why))
}
