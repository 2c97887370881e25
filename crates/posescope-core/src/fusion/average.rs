//! The weighted mean of poses.

use nalgebra::{Matrix4, Quaternion, SymmetricEigen, Translation3, UnitQuaternion, Vector3};

use crate::geometry::Pose;

/// The mean of camera poses, `world_from_camera`, with positive weights; `None` of none.
///
/// The camera centres are averaged as points. The rotation is the one that minimises the weighted
/// sum of squared chordal distances to all: Markley, Cheng, Crassidis, Oshman, *Averaging
/// Quaternions*, Journal of Guidance, Control, and Dynamics 30(4), 2007, equations 12 and 13. It is
/// the eigenvector of the greatest eigenvalue of Σ wᵢ qᵢ qᵢᵀ, in which the sign of a quaternion
/// makes no difference.
pub fn average_pose(members: &[(f64, &Pose)]) -> Option<Pose> {
    // The mean of one is that one, to the last bit.
    if let [(_, only)] = members {
        return Some(**only);
    }
    let total: f64 = members.iter().map(|(weight, _)| weight).sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let centre: Vector3<f64> =
        members.iter().map(|(weight, pose)| pose.translation.vector * (weight / total)).sum();
    let outer: Matrix4<f64> = members
        .iter()
        .map(|(weight, pose)| {
            let q = pose.rotation.coords;
            q * q.transpose() * (weight / total)
        })
        .sum();
    Some(Pose::from_parts(Translation3::from(centre), principal_rotation(outer)))
}

fn principal_rotation(outer: Matrix4<f64>) -> UnitQuaternion<f64> {
    let eigen = SymmetricEigen::new(outer);
    let principal = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    // Either sign is the same rotation; one of them makes equal runs equal.
    let sign = if principal.w < 0.0 { -1.0 } else { 1.0 };
    UnitQuaternion::from_quaternion(Quaternion::from_vector(principal * sign))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn turned(axis: [f64; 3], angle: f64) -> Pose {
        let axis = nalgebra::Unit::new_normalize(Vector3::from(axis));
        Pose::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&axis, angle))
    }

    fn mean(members: &[(f64, Pose)]) -> Pose {
        let members: Vec<_> = members.iter().map(|(w, pose)| (*w, pose)).collect();
        average_pose(&members).expect("there are members")
    }

    #[test]
    fn opposite_turns_cancel() {
        let axis = [1.0, 2.0, -0.5];
        let mean = mean(&[(1.0, turned(axis, 0.7)), (1.0, turned(axis, -0.7))]);
        assert!(mean.rotation.angle() < 1e-12);
    }

    #[test]
    fn three_turns_about_the_axes_average_to_one_about_the_diagonal() {
        let angle = 0.4;
        let members =
            [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(|axis| (1.0, turned(axis, angle)));
        let mean = mean(&members);
        let axis = mean.rotation.axis().expect("it turns");
        let diagonal = Vector3::repeat(1.0 / 3f64.sqrt());
        assert!((axis.into_inner() - diagonal).norm() < 1e-12);
        // q = (c, s/3 …) is no eigenvector; by hand, the matrix on span{1, diagonal} is
        // [[3c², √3cs], [√3cs, s²]] with c, s of half the angle.
        let (s, c) = (angle / 2.0f64).sin_cos();
        let half = (2.0 * 3f64.sqrt() * c * s).atan2(3.0 * c * c - s * s) / 2.0;
        assert!((mean.rotation.angle() - 2.0 * half).abs() < 1e-12);
    }

    #[test]
    fn a_weight_of_zero_is_no_weight_and_none_is_no_mean() {
        let pose = turned([0.0, 1.0, 0.0], 0.3);
        let other = turned([1.0, 0.0, 0.0], 2.0);
        let mean = mean(&[(2.0, pose), (0.0, other)]);
        assert!(mean.rotation.angle_to(&pose.rotation) < 1e-7);
        assert_eq!(average_pose(&[]), None);
        assert_eq!(average_pose(&[(0.0, &pose), (0.0, &other)]), None);
    }

    fn rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
        let component = || -1.0..1.0f64;
        (component(), component(), component(), component())
            .prop_filter("not zero", |(a, b, c, d)| a * a + b * b + c * c + d * d > 0.01)
            .prop_map(|(a, b, c, d)| UnitQuaternion::from_quaternion(Quaternion::new(a, b, c, d)))
    }

    /// Rotations within 40° of each other, whose mean is well determined.
    fn cluster() -> impl Strategy<Value = Vec<(f64, Pose)>> {
        let member = (
            0.05..1.0f64,
            prop::array::uniform3(-0.2..0.2f64),
            prop::array::uniform3(-50.0..50.0f64),
        );
        (rotation(), prop::collection::vec(member, 2..6)).prop_map(|(middle, members)| {
            let pose = |(weight, turn, place): (f64, [f64; 3], [f64; 3])| {
                let rotation = middle * UnitQuaternion::from_scaled_axis(Vector3::from(turn));
                (weight, Pose::from_parts(Translation3::from(place), rotation))
            };
            members.into_iter().map(pose).collect()
        })
    }

    proptest! {
        /// Two rotations about one axis: their quaternions span a plane, in which the mean is the
        /// direction of the weighted sum of doubled angles.
        #[test]
        fn two_turns_about_one_axis_average_as_by_hand(
            axis in prop::array::uniform3(0.1..1.0f64), angle in 0.01..3.0f64,
            first in 0.1..5.0f64, second in 0.1..5.0f64,
        ) {
            let mean = mean(&[(first, turned(axis, 0.0)), (second, turned(axis, angle))]);
            let expected = (second * angle.sin()).atan2(first + second * angle.cos());
            prop_assert!((mean.rotation.angle() - expected.abs()).abs() < 1e-9);
        }

        #[test]
        fn the_sign_of_a_quaternion_makes_no_difference(members in cluster(), flips in any::<u8>()) {
            let flipped: Vec<_> = members.iter().enumerate().map(|(i, (weight, pose))| {
                let mut pose = *pose;
                if flips >> i & 1 == 1 {
                    pose.rotation = UnitQuaternion::new_unchecked(-pose.rotation.into_inner());
                }
                (*weight, pose)
            }).collect();
            prop_assert_eq!(mean(&members), mean(&flipped));
        }

        #[test]
        fn the_mean_moves_with_the_world(members in cluster(), turn in rotation()) {
            let world = Pose::from_parts(Translation3::new(5.0, -3.0, 100.0), turn);
            let moved: Vec<_> = members.iter().map(|(w, pose)| (*w, world * pose)).collect();
            let (expected, found) = (world * mean(&members), mean(&moved));
            prop_assert!((expected.translation.vector - found.translation.vector).norm() < 1e-9);
            prop_assert!(expected.rotation.angle_to(&found.rotation) < 1e-6);
        }

        #[test]
        fn order_and_scale_of_the_weights_make_no_difference(members in cluster(), factor in 0.01..100.0f64) {
            let mut other: Vec<_> = members.iter().map(|(w, pose)| (w * factor, *pose)).collect();
            other.reverse();
            let (expected, found) = (mean(&members), mean(&other));
            prop_assert!((expected.translation.vector - found.translation.vector).norm() < 1e-9);
            prop_assert!(expected.rotation.angle_to(&found.rotation) < 1e-6);
        }

        /// No rotation nearby is at a smaller sum of squared chordal distances.
        #[test]
        fn nothing_beside_the_mean_is_nearer_to_all(
            members in cluster(), turn in prop::array::uniform3(-0.1..0.1f64),
        ) {
            let sum = |rotation: UnitQuaternion<f64>| -> f64 {
                members.iter().map(|(w, pose)| {
                    let (a, b) = (rotation.to_rotation_matrix(), pose.rotation.to_rotation_matrix());
                    w * (a.matrix() - b.matrix()).norm_squared()
                }).sum()
            };
            let best = mean(&members).rotation;
            let beside = best * UnitQuaternion::from_scaled_axis(Vector3::from(turn));
            prop_assert!(sum(best) <= sum(beside) + 1e-9);
        }
    }
}
