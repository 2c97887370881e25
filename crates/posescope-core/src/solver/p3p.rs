//! The perspective-three-point problem.

use arrayvec::ArrayVec;
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

use super::conic;
use crate::geometry::Pose;

/// Solutions of a problem at most.
pub const MAX_SOLUTIONS: usize = 4;

/// Smallest sine of a triangle's angle at its first corner. Below it the points count as collinear
/// and leave the rotation about their line open.
const MIN_SINE: f64 = 1e-7;

/// Newton steps on the distances at most. One does for all of 100,000 random problems; the others
/// are for double roots, where a step only halves the error.
const POLISH_STEPS: usize = 8;

/// The reprojection error at which a polished solution is given up \[rad\].
const MAX_ANGULAR_ERROR: f64 = 1e-9;

/// Poses `camera_from_points` with `λ x = R X + t`, λ > 0, for three bearings `x` (unit length,
/// camera frame) and points `X` \[m\].
///
/// Ding, Yang, Larsson, Olsson, Åström, *Revisiting the P3P Problem*, CVPR 2023. The law of
/// cosines for each pair gives `λᵢ² + λⱼ² − 2 λᵢ λⱼ xᵢ·xⱼ = |Xᵢ − Xⱼ|²`. Eliminating the scale
/// leaves two conics in `(λ₁ : λ₂ : λ₃)` that meet in up to four points. One member of their
/// pencil, found from a cubic, is a pair of lines; the lines carry the four points. Newton's
/// method on the three cosine laws then removes what rounding has left.
///
/// Up to four solutions, in no particular order; a double root may be there twice. Collinear or
/// equal points, equal bearings and numbers that are not finite give no solution or valid ones.
pub fn p3p(
    bearings: &[Unit<Vector3<f64>>; 3],
    points: &[Point3<f64>; 3],
) -> ArrayVec<Pose, MAX_SOLUTIONS> {
    let mut poses = ArrayVec::new();
    let Some(points_from_triangle) = triangle_frame(points) else {
        return poses;
    };
    let laws = CosineLaws::new(bearings, points);
    for ratios in laws.depth_ratios() {
        let Some(depths) = laws.polish(ratios) else {
            continue;
        };
        let seen: [Point3<f64>; 3] =
            std::array::from_fn(|i| Point3::from(bearings[i].into_inner() * depths[i]));
        if let Some(camera_from_triangle) = triangle_frame(&seen) {
            let rotation = camera_from_triangle * points_from_triangle.transpose();
            let translation = seen[0].coords - rotation * points[0].coords;
            poses.push(Pose::from_parts(
                Translation3::from(translation),
                UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)),
            ));
        }
    }
    poses
}

/// An orthonormal frame fixed to a triangle: its first side, its normal, and across both. `None`
/// for a triangle without area.
///
/// The frames of two congruent triangles give a rotation without inverting anything.
fn triangle_frame([a, b, c]: &[Point3<f64>; 3]) -> Option<Matrix3<f64>> {
    let (side, other) = (b - a, c - a);
    let normal = side.cross(&other);
    let has_area = normal.norm() > MIN_SINE * side.norm() * other.norm();
    if !has_area || !normal.norm_squared().is_finite() {
        return None;
    }
    let (e1, e3) = (side.normalize(), normal.normalize());
    Some(Matrix3::from_columns(&[e1, e3.cross(&e1), e3]))
}

/// The pairs of corners, in the order of the fields of [`CosineLaws`].
const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// `λᵢ² + λⱼ² − 2 λᵢ λⱼ cos = side²` for the [`PAIRS`] of corners.
struct CosineLaws {
    /// Cosine between the bearings.
    cosines: [f64; 3],
    /// Squared distance of the points \[m²\].
    squared_sides: [f64; 3],
}

impl CosineLaws {
    fn new(bearings: &[Unit<Vector3<f64>>; 3], points: &[Point3<f64>; 3]) -> Self {
        Self {
            cosines: PAIRS.map(|(i, j)| bearings[i].dot(&bearings[j])),
            squared_sides: PAIRS.map(|(i, j)| (points[i] - points[j]).norm_squared()),
        }
    }

    /// The left side of one law as a quadratic form in the depths.
    fn form(&self, pair: usize) -> Matrix3<f64> {
        let (i, j) = PAIRS[pair];
        let mut form = Matrix3::zeros();
        form[(i, i)] = 1.0;
        form[(j, j)] = 1.0;
        form[(i, j)] = -self.cosines[pair];
        form[(j, i)] = -self.cosines[pair];
        form
    }

    /// Depths up to scale, all positive, at which the three laws agree on the scale.
    fn depth_ratios(&self) -> ArrayVec<Vector3<f64>, MAX_SOLUTIONS> {
        // Sides in units of the longest: the conics then have entries of order one.
        let longest = self.squared_sides.iter().copied().fold(0.0, f64::max);
        let [a, b, c] = self.squared_sides.map(|side| side / longest);
        let last = self.form(2);
        let first = self.form(0) * c - last * a;
        let second = self.form(1) * c - last * b;
        conic::intersections(&first, &second)
            .into_iter()
            .filter(|ratios| ratios.iter().all(|&ratio| ratio > 0.0))
            .collect()
    }

    /// Solves the laws from `ratios` by Newton's method; `None` where it ends elsewhere than in a
    /// solution with positive depths.
    fn polish(&self, ratios: Vector3<f64>) -> Option<Vector3<f64>> {
        // The scale that fits the sum of the laws.
        let sum: f64 = (0..3).map(|pair| self.value(pair, &ratios)).sum();
        let mut depths = ratios * (self.squared_sides.iter().sum::<f64>() / sum).sqrt();
        for _ in 0..POLISH_STEPS {
            let residual = self.residual(&depths);
            if self.angular_error(&residual, &depths) < 1e-3 * MAX_ANGULAR_ERROR {
                break;
            }
            let Some(inverse) = self.jacobian(&depths).try_inverse() else {
                break;
            };
            depths -= inverse * residual;
        }
        let solved = self.angular_error(&self.residual(&depths), &depths) < MAX_ANGULAR_ERROR;
        (solved && depths.min() > 0.0).then_some(depths)
    }

    /// The left side of one law.
    fn value(&self, pair: usize, depths: &Vector3<f64>) -> f64 {
        let (i, j) = PAIRS[pair];
        let (di, dj) = (depths[i], depths[j]);
        di * di + dj * dj - 2.0 * di * dj * self.cosines[pair]
    }

    /// Left side less right side of the three laws \[m²\].
    fn residual(&self, depths: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|pair, _| self.value(pair, depths) - self.squared_sides[pair])
    }

    /// Derivative of [`Self::residual`] by the depths \[m\].
    fn jacobian(&self, depths: &Vector3<f64>) -> Matrix3<f64> {
        let mut jacobian = Matrix3::zeros();
        for (pair, (i, j)) in PAIRS.into_iter().enumerate() {
            jacobian[(pair, i)] = 2.0 * (depths[i] - self.cosines[pair] * depths[j]);
            jacobian[(pair, j)] = 2.0 * (depths[j] - self.cosines[pair] * depths[i]);
        }
        jacobian
    }

    /// About the angle by which points are missed: a side's error, `residual / (2 side)`, seen
    /// from the nearest point \[rad\].
    fn angular_error(&self, residual: &Vector3<f64>, depths: &Vector3<f64>) -> f64 {
        let side_error = residual
            .iter()
            .zip(&self.squared_sides)
            .map(|(residual, squared_side)| residual.abs() / (2.0 * squared_side.sqrt()))
            .sum::<f64>();
        side_error / depths.min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bearings_of(pose: &Pose, points: &[Point3<f64>; 3]) -> [Unit<Vector3<f64>>; 3] {
        points.map(|point| Unit::new_normalize((pose * point).coords))
    }

    /// All numbers finite, and each point on the positive side of its bearing.
    fn is_valid(
        pose: &Pose,
        bearings: &[Unit<Vector3<f64>>; 3],
        points: &[Point3<f64>; 3],
    ) -> bool {
        bearings.iter().zip(points).all(|(bearing, point)| {
            let seen = (pose * point).coords;
            (seen.normalize() - bearing.into_inner()).norm() < 1e-6
        })
    }

    fn point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-10.0..10.0).prop_map(Point3::from)
    }

    fn pose() -> impl Strategy<Value = Pose> {
        let (axis, position) = (prop::array::uniform3(-2.0..2.0), prop::array::uniform3(-9.0..9.0));
        (axis, position)
            .prop_map(|(axis, position)| Pose::new(Vector3::from(position), Vector3::from(axis)))
    }

    #[test]
    fn a_triangle_seen_head_on_has_the_pose_that_was_typed_in() {
        // An equilateral triangle centred on the optical axis, 5 m away: a double root.
        let corner =
            |angle: f64| Point3::new(angle.to_radians().cos(), angle.to_radians().sin(), 0.0);
        let points = [corner(0.0), corner(120.0), corner(240.0)];
        let truth = Pose::translation(0.0, 0.0, 5.0);
        let poses = p3p(&bearings_of(&truth, &points), &points);
        let nearest = poses
            .iter()
            .map(|pose| (pose.inverse() * truth).to_homogeneous())
            .map(|m| (m - nalgebra::Matrix4::identity()).amax())
            .fold(9.0, f64::min);
        assert!(nearest < 1e-9, "{nearest}: {poses:?}");
    }

    #[test]
    fn collinear_or_equal_points_have_no_solution() {
        let truth = Pose::translation(0.1, 0.2, 5.0);
        let [a, b] = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.5, 0.2)];
        for points in [[a, b, a + (b - a) * 2.0], [a, a, b], [a, b, a], [b, a, a], [a, a, a]] {
            assert!(p3p(&bearings_of(&truth, &points), &points).is_empty(), "{points:?}");
        }
    }

    #[test]
    fn numbers_that_are_not_finite_have_no_solution() {
        let points =
            [Point3::new(0.0, 0.0, 5.0), Point3::new(1.0, 0.0, 6.0), Point3::new(0.0, 1.0, 7.0)];
        let bearings = bearings_of(&Pose::identity(), &points);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for corner in 0..3 {
                let mut broken = points;
                broken[corner].y = bad;
                assert!(p3p(&bearings, &broken).is_empty());
                let mut broken = bearings;
                broken[corner] = Unit::new_unchecked(Vector3::new(0.0, bad, 1.0));
                assert!(p3p(&broken, &points).is_empty());
            }
        }
    }

    #[test]
    fn the_distance_jacobian_matches_central_differences() {
        let points =
            [Point3::new(0.0, 0.0, 5.0), Point3::new(1.0, 0.0, 6.0), Point3::new(0.0, 1.0, 7.0)];
        let laws = CosineLaws::new(&bearings_of(&Pose::identity(), &points), &points);
        let depths = Vector3::new(4.0, 5.0, 8.0);
        let jacobian = laws.jacobian(&depths);
        for k in 0..3 {
            let step = Vector3::ith(k, 1e-5);
            let numeric =
                (laws.residual(&(depths + step)) - laws.residual(&(depths - step))) / 2e-5;
            assert!((numeric - jacobian.column(k)).amax() < 1e-8);
        }
    }

    proptest! {
        #[test]
        fn every_solution_reprojects_and_one_is_the_truth(
            truth in pose(), points in prop::array::uniform3(point()),
        ) {
            let seen = points.map(|point| truth * point);
            // Bearings, unlike pixels, may look backwards; the solver does not mind.
            prop_assume!(seen.iter().all(|point| point.coords.norm() > 0.5));
            prop_assume!(triangle_frame(&points).is_some());
            let bearings = bearings_of(&truth, &points);
            let poses = p3p(&bearings, &points);
            for pose in &poses {
                prop_assert!(is_valid(pose, &bearings, &points));
            }
            let error = |pose: &Pose| (pose.inverse() * truth).rotation.angle();
            prop_assert!(poses.iter().map(error).fold(9.0, f64::min) < 1e-3);
        }

        #[test]
        fn anything_at_all_gives_valid_solutions_or_none(
            points in prop::array::uniform3(point()),
            directions in prop::array::uniform3(point()),
            equal in prop::array::uniform2(any::<bool>()),
        ) {
            let mut bearings = directions.map(|direction| Unit::new_normalize(direction.coords));
            if equal[0] { bearings[1] = bearings[0]; }
            if equal[1] { bearings[2] = -bearings[0]; }
            for pose in p3p(&bearings, &points) {
                prop_assert!(is_valid(&pose, &bearings, &points));
            }
        }
    }
}
