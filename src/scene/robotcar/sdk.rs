//! The calibration of the SDK: `models` and `extrinsics`.

use std::path::{Path, PathBuf};

use image::RgbImage;
use image::imageops::interpolate_bilinear;
use nalgebra::{Matrix3x4, Rotation3, Translation3, UnitQuaternion};
use posescope_core::files;

use super::super::SceneError;
use super::super::lens::pinhole;
use super::super::lines::TextFile;
use crate::camera::Intrinsics;
use crate::geometry::{Pose, pose_from_matrix};

#[derive(Clone, Debug)]
pub(super) struct Sdk {
    folder: PathBuf,
}

impl Sdk {
    /// Searches a traversal's folder and its parent.
    pub(super) fn find(traversal: &Path) -> Option<Self> {
        let traversal = traversal.canonicalize().ok()?;
        let places = [Some(traversal.as_path()), traversal.parent()];
        let is_sdk =
            |folder: &PathBuf| folder.join("models").is_dir() && folder.join("extrinsics").is_dir();
        places
            .into_iter()
            .flatten()
            .flat_map(|place| ["", "sdk", "robotcar-dataset-sdk"].map(|name| place.join(name)))
            .find(is_sdk)
            .map(|folder| Self { folder })
    }

    /// The extrinsics of a sensor: from the vehicle to a camera, but from a laser or the INS to the vehicle.
    pub(super) fn extrinsics(&self, sensor: &str) -> Result<Pose, SceneError> {
        let file = TextFile::read(&self.folder.join(format!("extrinsics/{sensor}.txt")))?;
        let [[x, y, z, roll, pitch, yaw]] = file.rows()?;
        Ok(transform([x, y, z], [roll, pitch, yaw]))
    }

    /// The model of a camera with photos of this size, and its look-up table.
    pub(super) fn camera_model(
        &self,
        name: &str,
        size: (u32, u32),
    ) -> Result<CameraModel, SceneError> {
        let file = TextFile::read(&self.folder.join(format!("models/{name}.txt")))?;
        let mut lines = file.lines();
        let mut next = || {
            lines.next().ok_or_else(|| {
                file.error("a line `fx fy cx cy` and the four lines of a 4x4 matrix expected, the file is cut off")
            })
        };
        let intrinsics = pinhole(next()?.numbers()?, size).map_err(|why| file.error(why))?;
        let rows: Vec<[f64; 4]> = (0..3).map(|_| next()?.numbers()).collect::<Result<_, _>>()?;
        let matrix = Matrix3x4::from_fn(|row, column| rows[row][column]);
        let camera_from_image =
            pose_from_matrix(&matrix).map_err(|error| file.error(error.to_string()))?;
        let table = format!("models/{name}_distortion_lut.bin");
        Ok(CameraModel {
            intrinsics,
            camera_from_image,
            table: read_table(&self.folder.join(table), size)?,
        })
    }
}

/// The position in the original photo for each pixel of undistorted photos \[px\]. The file has all columns first, then
/// all rows.
fn read_table(path: &Path, (width, height): (u32, u32)) -> Result<Vec<[f32; 2]>, SceneError> {
    let bytes = files::read(path, files::SCAN).map_err(SceneError::io(path))?;
    let pixels = width as usize * height as usize;
    if bytes.len() != pixels * 16 {
        return Err(SceneError::expected(
            path,
            format!(
                "a look-up table of {} bytes for photos of {width}x{height} pixels expected, {} bytes found",
                pixels * 16,
                bytes.len()
            ),
        ));
    }
    let (numbers, _) = bytes.as_chunks::<8>();
    let (columns, rows) = numbers.split_at(pixels);
    let place = |(x, y): (&[u8; 8], &[u8; 8])| [x, y].map(|n| f64::from_le_bytes(*n) as f32);
    Ok(columns.iter().zip(rows).map(place).collect())
}

/// The SDK's transform of a position and roll, pitch, yaw: Rz(yaw) Ry(pitch) Rx(roll).
pub(super) fn transform(position: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Pose {
    let rotation = Rotation3::from_euler_angles(roll, pitch, yaw);
    Pose::from_parts(Translation3::from(position), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// A camera, and the table that undistorts its photos.
pub(super) struct CameraModel {
    /// The pinhole of undistorted photos.
    pub(super) intrinsics: Intrinsics,
    /// From x right, y down, z forward to the camera's axes.
    pub(super) camera_from_image: Pose,
    /// The position in the original photo for each pixel \[px\].
    table: Vec<[f32; 2]>,
}

impl CameraModel {
    /// The undistorted photo; black outside the original photo.
    pub(super) fn undistorted(&self, raw: &RgbImage) -> RgbImage {
        let (width, height) = raw.dimensions();
        let mut straight = RgbImage::new(width, height);
        for (pixel, &[x, y]) in straight.pixels_mut().zip(&self.table) {
            if let Some(seen) = interpolate_bilinear(raw, x, y) {
                *pixel = seen;
            }
        }
        straight
    }
}
