//! From the world of poses (x right, y down, z forward) to the town's (y up, the road at y = 0).

use nalgebra::{Point3, Vector3};

use super::camera_path::CAMERA_HEIGHT;
use super::frame::Ray;
use posescope_core::geometry::Pose;

/// A world point in town coordinates.
pub(super) fn town_from_world(p: &Point3<f64>) -> Point3<f64> {
    Point3::new(p.x, CAMERA_HEIGHT - p.y, p.z)
}

/// A ray of the camera frame in town coordinates.
pub(super) fn town_ray(pose: &Pose, origin: &Point3<f64>, direction: &Vector3<f64>) -> Ray {
    let turned = pose.rotation * direction;
    Ray {
        origin: town_from_world(&(pose * origin)),
        direction: Vector3::new(turned.x, -turned.y, turned.z),
    }
}
