//! The file with a scene's calibration, with another place of its scanner.

use std::path::PathBuf;

use super::{SceneError, described, format_of, kitti, kitti_raw};
use crate::geometry::Pose;

/// A calibration file as it should be.
pub struct Recalibrated {
    /// The scene's own file, which is not changed.
    pub path: PathBuf,
    /// The whole text of the better one.
    pub text: String,
}

/// The calibration file of a scene, for clouds that are moved in the camera's frame.
///
/// # Errors
/// A format whose calibration is in no file, and files that cannot be read.
pub fn recalibrated(
    argument: &str,
    format: Option<&str>,
    camera_from_stated: &Pose,
) -> Result<Recalibrated, SceneError> {
    let made = match format_of(argument, format).map(|entry| entry.name) {
        Some("kitti") => kitti::recalibrated,
        Some("kitti-raw") => kitti_raw::recalibrated,
        Some("toml") => described::recalibrated,
        _ => {
            let expected = "a scene of KITTI, KITTI raw or scene.toml expected: others have no file with the scanner's \
                            place";
            return Err(SceneError::expected(argument, expected));
        }
    };
    made(argument, camera_from_stated)
}
