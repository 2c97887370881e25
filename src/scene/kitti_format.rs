//! What the two layouts of KITTI have in common: projection matrices and scans.

use std::path::Path;

use nalgebra::{Matrix3, Matrix3x4, Point3, Translation3, UnitQuaternion, Vector3};

use super::SceneError;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// The intrinsics of a projection matrix P = K [I | t], and the transform from the rectified camera 0.
pub(super) fn split_projection(
    projection: &Matrix3x4<f64>,
    (width, height): (u32, u32),
    path: &Path,
) -> Result<(Intrinsics, Pose), SceneError> {
    let k: Matrix3<f64> = projection.fixed_columns::<3>(0).into_owned();
    let inverse = k
        .try_inverse()
        .filter(|_| k[(0, 0)] > 0.0 && k[(1, 1)] > 0.0);
    let Some(inverse) = inverse else {
        return Err(SceneError::expected(
            path,
            "a projection matrix with positive focal lengths expected",
        ));
    };
    let intrinsics = Intrinsics {
        fx: k[(0, 0)],
        fy: k[(1, 1)],
        cx: k[(0, 2)],
        cy: k[(1, 2)],
        width,
        height,
    };
    let translation: Vector3<f64> = inverse * projection.column(3);
    let camera_from_camera0 =
        Pose::from_parts(Translation3::from(translation), UnitQuaternion::identity());
    Ok((intrinsics, camera_from_camera0))
}

/// A scan: little-endian `f32` x, y, z, reflectance, its points taken to the camera's frame.
pub(super) fn read_scan(
    path: &Path,
    camera_from_velodyne: impl Fn(Point3<f64>) -> Point3<f64>,
) -> Result<Cloud, SceneError> {
    const BYTES_PER_POINT: usize = 16;
    let bytes = std::fs::read(path).map_err(SceneError::io(path))?;
    let content = |expected: String| SceneError::expected(path, expected);
    if bytes.is_empty() {
        return Err(content("points expected, the scan is empty".to_owned()));
    }
    if bytes.len() % BYTES_PER_POINT != 0 {
        return Err(content(format!(
            "whole points of {BYTES_PER_POINT} bytes expected, {} bytes found; the file is cut off",
            bytes.len()
        )));
    }
    let mut points = Vec::with_capacity(bytes.len() / BYTES_PER_POINT);
    for (index, record) in bytes.chunks_exact(BYTES_PER_POINT).enumerate() {
        let coordinate = |axis: usize| {
            let at = 4 * axis;
            f64::from(f32::from_le_bytes([
                record[at],
                record[at + 1],
                record[at + 2],
                record[at + 3],
            ]))
        };
        let point = Point3::new(coordinate(0), coordinate(1), coordinate(2));
        if !point.iter().all(|value| value.is_finite()) {
            return Err(content(format!(
                "finite coordinates expected, point {index} (byte {}) is {}, {}, {}",
                index * BYTES_PER_POINT,
                point.x,
                point.y,
                point.z
            )));
        }
        points.push(camera_from_velodyne(point).cast());
    }
    Ok(Cloud { points })
}
