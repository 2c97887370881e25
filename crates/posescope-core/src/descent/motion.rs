//! Moving a camera by six numbers.

use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};

use crate::geometry::Pose;

/// How far away a point is that a unit of rotation moves as far as a unit of translation \[m\]: the
/// descents see all six numbers in one scale.
const ARM_M: f64 = 10.0;

/// A motion of points in the frame of a camera: x, y, z \[m\], and a rotation vector times [`ARM_M`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    /// How the rotation changes with its vector, on the left.
    left_jacobian: Matrix3<f64>,
}

impl Motion {
    pub(super) fn new(x: &[f64]) -> Self {
        let vector = Vector3::new(x[3], x[4], x[5]) / ARM_M;
        let angle = vector.norm();
        let cross = vector.cross_matrix();
        // Below that the series is exact to the last digit.
        let (a, b) = if angle < 1e-4 {
            (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
        } else {
            ((1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / (angle * angle * angle))
        };
        Self {
            rotation: *Rotation3::new(vector).matrix(),
            translation: Vector3::new(x[0], x[1], x[2]),
            left_jacobian: Matrix3::identity() + cross * a + cross * cross * b,
        }
    }

    /// Where a point goes.
    pub(super) fn moved(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }

    /// How the moved point changes with the six numbers.
    pub(super) fn slopes(&self, moved: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
        let turned = moved - self.translation;
        let by_rotation = -turned.cross_matrix() * self.left_jacobian / ARM_M;
        let mut slopes = SMatrix::<f64, 3, 6>::zeros();
        slopes.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        slopes.fixed_view_mut::<3, 3>(0, 3).copy_from(&by_rotation);
        slopes
    }

    /// The camera after the motion, for one that was at `camera_from_reference` before.
    pub(super) fn after(x: &[f64], camera_from_reference: &Pose) -> Pose {
        let vector = Vector3::new(x[3], x[4], x[5]) / ARM_M;
        Pose::new(Vector3::new(x[0], x[1], x[2]), vector) * camera_from_reference
    }
}
