//! The calibration of a day: `calib_cam_to_cam.txt`, `calib_velo_to_cam.txt`, `calib_imu_to_velo.txt`.

use std::path::Path;

use nalgebra::Matrix3x4;
use posescope_core::files;

use super::super::SceneError;
use super::super::kitti_format::{in_camera0, labelled, split_projection, with_labelled};
use super::super::lines::{self, TextFile};
use super::super::recalibrated::Recalibrated;
use crate::camera::Intrinsics;
use crate::geometry::{Pose, pose_from_matrix};

pub(super) const CAMERAS: &str = "calib_cam_to_cam.txt";
const VELODYNE: &str = "calib_velo_to_cam.txt";
const IMU: &str = "calib_imu_to_velo.txt";

/// The extrinsics of a drive's sensors, and one of its rectified cameras.
pub(super) struct Calibration {
    pub intrinsics: Intrinsics,
    pub camera_from_camera0: Pose,
    pub camera0_from_velodyne: Pose,
    /// The scanner from the IMU; the axes of both are forward, left, up.
    pub velodyne_from_imu: Pose,
}

impl Calibration {
    /// Reads the calibration of a camera such as `image_02` from the folder of its day.
    pub fn read(day: &Path, camera: &str) -> Result<Self, SceneError> {
        let number = camera.trim_start_matches("image_");
        let cameras = TextFile::read(&day.join(CAMERAS))?;
        let projection = labelled::<12>(&cameras, &format!("P_rect_{number}"))?;
        let [width, height] = labelled::<2>(&cameras, &format!("S_rect_{number}"))?;
        // All extrinsics refer to the rectified camera 0.
        let rectified_from_camera0 = pose(&cameras, "R_rect_00", None)?;
        let velodyne = TextFile::read(&day.join(VELODYNE))?;
        let imu = TextFile::read(&day.join(IMU))?;
        let size = (width as u32, height as u32);
        let (intrinsics, camera_from_camera0) = split_projection(&projection, size, &cameras)?;
        Ok(Self {
            intrinsics,
            camera_from_camera0,
            camera0_from_velodyne: rectified_from_camera0 * pose(&velodyne, "R", Some("T"))?,
            velodyne_from_imu: pose(&imu, "R", Some("T"))?,
        })
    }

    pub fn camera0_from_imu(&self) -> Pose {
        self.camera0_from_velodyne * self.velodyne_from_imu
    }
}

/// `calib_velo_to_cam.txt` of a day, with the clouds moved in the frame of a camera.
pub(super) fn recalibrated(
    day: &Path,
    camera: &str,
    change: &Pose,
) -> Result<Recalibrated, SceneError> {
    let stated = Calibration::read(day, camera)?;
    let rectified_from_camera0 = pose(&TextFile::read(&day.join(CAMERAS))?, "R_rect_00", None)?;
    let better = in_camera0(change, &stated.camera_from_camera0) * stated.camera0_from_velodyne;
    let better = rectified_from_camera0.inverse() * better;
    let path = day.join(VELODYNE);
    let text = lines::read_text(&path, files::DESCRIPTION)?;
    let rotation = better.rotation.to_rotation_matrix().transpose();
    let text = with_labelled(&text, "R", rotation.matrix().as_slice());
    let text = with_labelled(&text, "T", better.translation.vector.as_slice());
    Ok(Recalibrated { path, text })
}

/// The transform of a rotation and an optional translation.
fn pose(file: &TextFile, rotation: &str, translation: Option<&str>) -> Result<Pose, SceneError> {
    let [a, b, c, d, e, f, g, h, i] = labelled::<9>(file, rotation)?;
    let [x, y, z] = match translation {
        Some(label) => labelled::<3>(file, label)?,
        None => [0.0; 3],
    };
    let matrix = Matrix3x4::new(a, b, c, x, d, e, f, y, g, h, i, z);
    pose_from_matrix(&matrix).map_err(|error| file.error(format!("`{rotation}:`: {error}")))
}
