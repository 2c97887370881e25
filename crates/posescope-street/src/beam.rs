//! Rays from one point that go nearly the same way.

use nalgebra::{Point3, Vector3};

/// A pyramid of rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beam {
    /// The point where all rays begin.
    pub(super) origin: Point3<f64>,
    /// The normals of its four sides, towards its inside.
    sides: [Vector3<f64>; 4],
}

impl Beam {
    /// The beam of the rays from `origin` in these directions, all less than 90° from their mean, and
    /// in the directions between them.
    pub(super) fn around(origin: Point3<f64>, directions: &[Vector3<f64>]) -> Self {
        let axis: Vector3<f64> = directions.iter().sum::<Vector3<f64>>().normalize();
        let right = axis.cross(&Vector3::y()).try_normalize(1e-6).unwrap_or_else(Vector3::x);
        let [aside, above] = [right, right.cross(&axis)].map(|across| {
            let slopes = directions.iter().map(|d| d.dot(&across) / d.dot(&axis));
            let (low, high) = slopes
                .fold((f64::MAX, f64::MIN), |(low, high), slope| (low.min(slope), high.max(slope)));
            [across - axis * low, axis * high - across]
        });
        Self { origin, sides: [aside[0], aside[1], above[0], above[1]] }
    }

    /// Whether any part of a box may be inside.
    pub(super) fn reaches(&self, corners: &[Point3<f32>; 2]) -> bool {
        /// What single precision makes of a ray may enter a box that the ray just misses \[m\].
        const MARGIN: f64 = 0.01;
        let [low, high] = corners.map(|corner| corner.cast() - self.origin);
        self.sides.iter().all(|side| {
            let (a, b) = (low.component_mul(side), high.component_mul(side));
            a.x.max(b.x) + a.y.max(b.y) + a.z.max(b.z) >= -MARGIN
        })
    }

    /// Distance of the origin from a box \[m\].
    pub(super) fn distance(&self, corners: &[Point3<f32>; 2]) -> f32 {
        let [low, high] = corners.map(|corner| corner.cast() - self.origin);
        let outside = Vector3::from_fn(|axis, _| low[axis].max(-high[axis]).max(0.0));
        outside.norm() as f32
    }
}
