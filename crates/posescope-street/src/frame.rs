//! Rays and the frames of solids.
//!
//! Town coordinates are x right, y *up*, z forward, seen from the first camera, with the
//! carriageway at y = 0 \[m\].

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::path::right_of;

/// A ray; `direction` is of unit length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    /// Where it begins.
    pub(super) origin: Point3<f64>,
    /// Where it goes.
    pub(super) direction: Vector3<f64>,
}

impl Ray {
    /// The point `distance` metres along.
    #[inline]
    pub(super) fn at(&self, distance: f64) -> Point3<f64> {
        self.origin + self.direction * distance
    }
}

/// A horizontal frame: z ahead, x to its right, y up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Origin, at the height of the solid's base.
    pub(super) origin: Point3<f64>,
    /// The frame's z axis in the plan.
    pub(super) ahead: Vector2<f64>,
}

impl Frame {
    /// A frame at a point of the plan.
    pub(super) fn new(plan: Point2<f64>, height: f64, ahead: Vector2<f64>) -> Self {
        Self { origin: Point3::new(plan.x, height, plan.y), ahead }
    }

    #[inline]
    fn vector_to_local(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let right = right_of(self.ahead);
        Vector3::new(v.x * right.x + v.z * right.y, v.y, v.x * self.ahead.x + v.z * self.ahead.y)
    }

    /// A vector of the frame in town coordinates.
    #[inline]
    pub(super) fn vector_to_town(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let right = right_of(self.ahead);
        Vector3::new(v.x * right.x + v.z * self.ahead.x, v.y, v.x * right.y + v.z * self.ahead.y)
    }

    /// A ray of the town in the frame's coordinates.
    #[inline]
    pub(super) fn ray_to_local(&self, ray: &Ray) -> Ray {
        Ray {
            origin: Point3::from(self.vector_to_local(&(ray.origin - self.origin))),
            direction: self.vector_to_local(&ray.direction),
        }
    }
}
