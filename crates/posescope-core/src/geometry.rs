//! Rigid transforms, rotation angles and pose errors.
//!
//! Transforms are named `a_from_b`: they take a point given in frame `b` to frame `a`, so that
//! neighbouring names match up in a product. The camera frame is x right, y down, z forward; the
//! world frame of every scene is metric. Poses are `f64`, because map coordinates do not fit `f32`.

use std::fmt;

use nalgebra::{Isometry3, Matrix3, Matrix3x4, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A rigid transform \[m, rad\].
pub type Pose = Isometry3<f64>;

/// Why a 3 × 4 matrix is not a rigid transform.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotRigid {
    /// An entry is NaN or infinite.
    #[error("the matrix has an entry that is not a finite number")]
    NotFinite,
    /// The left 3 × 3 block is not a rotation.
    #[error("the left 3x3 block is not a rotation (R·Rᵀ differs from I by {deviation:.3})")]
    NotRotation {
        /// Largest absolute entry of `R Rᵀ − I`, or of `det R − 1`.
        deviation: f64,
    },
}

/// The rigid transform nearest to the 3 × 4 matrix `[R|t]`.
///
/// Published matrices carry a few decimals only, so a small deviation of `R` from a rotation is
/// projected away; one above 0.02 is an error.
///
/// # Errors
/// [`NotRigid`] when an entry is not finite or `R` is not a rotation.
pub fn pose_from_matrix(matrix: &Matrix3x4<f64>) -> Result<Pose, NotRigid> {
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return Err(NotRigid::NotFinite);
    }
    let linear: Matrix3<f64> = matrix.fixed_columns::<3>(0).into_owned();
    let gram = (linear * linear.transpose() - Matrix3::identity()).amax();
    let deviation = gram.max((linear.determinant() - 1.0).abs());
    if deviation > 0.02 {
        return Err(NotRigid::NotRotation { deviation });
    }
    let svd = linear.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Err(NotRigid::NotRotation { deviation });
    };
    let rotation = Rotation3::from_matrix_unchecked(u * v_t);
    Ok(Pose::from_parts(
        Translation3::from(matrix.column(3).into_owned()),
        UnitQuaternion::from_rotation_matrix(&rotation),
    ))
}

/// The 3 × 4 matrix `[R|t]` of a rigid transform.
pub fn matrix_from_pose(pose: &Pose) -> Matrix3x4<f64> {
    pose.to_homogeneous().fixed_rows::<3>(0).into_owned()
}

/// A rotation about the camera's up axis (−y); a positive angle turns the view to the left.
///
/// The paper's "up axis z of the car" is this axis.
pub fn yaw(angle_rad: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&-Vector3::y_axis(), angle_rad)
}

/// How far an estimated pose is from the true one.
///
/// There are two measures of the rotation, and no sentence shows one under the other's name:
/// "rotation" is the geodesic angle, "max Euler" the paper's. People read all of it as
/// `0.112 m, 0.66° (max Euler 0.50°)`, or its parts in columns of these names.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PoseError {
    /// Distance of the camera centres \[m\].
    pub translation_m: f64,
    /// Geodesic angle of the relative rotation \[°\].
    pub rotation_deg: f64,
    /// Max Euler, the paper's measure: the relative rotation as ZYX Euler angles, the greatest magnitude \[°\].
    pub max_euler_deg: f64,
}

impl PoseError {
    /// The error of `estimate` against `truth`, both `world_from_camera`.
    pub fn between(truth: &Pose, estimate: &Pose) -> Self {
        let relative = truth.rotation.inverse() * estimate.rotation;
        let (roll, pitch, yaw) = relative.euler_angles();
        let max_euler = roll.abs().max(pitch.abs()).max(yaw.abs());
        Self {
            translation_m: (truth.translation.vector - estimate.translation.vector).norm(),
            rotation_deg: relative.angle().to_degrees(),
            max_euler_deg: max_euler.to_degrees(),
        }
    }

    /// The translation as people read it. A millimetre at the camera and a hundredth of a degree
    /// move what is seen 10 m away by about as much.
    pub fn translation(&self) -> String {
        format!("{:.3} m", self.translation_m)
    }

    /// The geodesic angle as people read it.
    pub fn rotation(&self) -> String {
        format!("{:.2}°", self.rotation_deg)
    }

    /// The part that moves more of what is seen 10 m away, as people read it.
    pub fn greater(&self) -> String {
        const SEEN_AT_M: f64 = 10.0;
        if SEEN_AT_M * self.rotation_deg.to_radians() > self.translation_m {
            self.rotation()
        } else {
            self.translation()
        }
    }

    /// The greatest Euler angle as people read it.
    pub fn max_euler(&self) -> String {
        format!("{:.2}°", self.max_euler_deg)
    }
}

impl fmt::Display for PoseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [translation, rotation] = [self.translation(), self.rotation()];
        write!(f, "{translation}, {rotation} (max Euler {})", self.max_euler())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_of_a_known_rotation_and_shift() {
        let truth = Pose::translation(1.0, 2.0, 3.0);
        let estimate = Pose::from_parts(
            Translation3::new(1.0, 2.0, 7.0),
            UnitQuaternion::from_euler_angles(0.0, 0.0, 0.1),
        );
        let error = PoseError::between(&truth, &estimate);
        assert!((error.translation_m - 4.0).abs() < 1e-12);
        assert!((error.rotation_deg - 0.1_f64.to_degrees()).abs() < 1e-9);
        assert!((error.max_euler_deg - 0.1_f64.to_degrees()).abs() < 1e-9);
    }

    #[test]
    fn largest_euler_angle_is_below_the_geodesic_angle_for_a_mixed_rotation() {
        let estimate = Pose::from_parts(
            Translation3::identity(),
            UnitQuaternion::from_euler_angles(0.05, -0.06, 0.07),
        );
        let error = PoseError::between(&Pose::identity(), &estimate);
        assert!((error.max_euler_deg - 0.07_f64.to_degrees()).abs() < 1e-9);
        assert!(error.rotation_deg > error.max_euler_deg);
        assert_eq!(error.to_string(), "0.000 m, 6.07° (max Euler 4.01°)");
    }

    #[test]
    fn positive_yaw_turns_the_view_to_the_left() {
        let forward = yaw(0.3) * Vector3::z();
        assert!(forward.x < 0.0, "left is negative x: {forward}");
        assert!(forward.y.abs() < 1e-12);
    }

    #[test]
    fn a_matrix_with_few_decimals_becomes_a_rotation_and_a_sheared_one_is_refused() {
        let rounded = Matrix3x4::new(
            0.9998, 0.0009, -0.0185, 1.0, -0.0009, 1.0, 0.0012, 2.0, 0.0185, -0.0011, 0.9998, 3.0,
        );
        let pose = pose_from_matrix(&rounded).expect("nearly a rotation");
        assert!((matrix_from_pose(&pose) - rounded).amax() < 2e-4);

        let mut sheared = rounded;
        sheared[(0, 1)] = 0.3;
        assert!(matches!(pose_from_matrix(&sheared), Err(NotRigid::NotRotation { .. })));
        let mut broken = rounded;
        broken[(2, 3)] = f64::NAN;
        assert_eq!(pose_from_matrix(&broken), Err(NotRigid::NotFinite));
    }
}
