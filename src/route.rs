//! Cameras seen from above.

use nalgebra::{Point2, Vector3};

use crate::geometry::Pose;

/// The positions of cameras \[m\], right and ahead of the first. `None` for fewer than two poses.
pub(crate) fn from_above(poses: &[Pose]) -> Option<Vec<Point2<f64>>> {
    let [start, _, ..] = poses else {
        return None;
    };
    // The axes of the world are arbitrary, so "down" comes from the cameras.
    let down: Vector3<f64> = poses.iter().map(|pose| pose.rotation * Vector3::y()).sum();
    let down = down.try_normalize(1e-9)?;
    let right = start.rotation * Vector3::x();
    let right = (right - down * down.dot(&right)).try_normalize(1e-9)?;
    let ahead = right.cross(&down);
    let place = |pose: &Pose| {
        let way = pose.translation.vector - start.translation.vector;
        Point2::new(right.dot(&way), ahead.dot(&way))
    };
    Some(poses.iter().map(place).collect())
}
