//! For posescope's own crates: may change in any version.
//!
//! How far a pose may be off, and how its errors go together.

use nalgebra::{
    Matrix2, Matrix2x3, Matrix3, Matrix3x6, Matrix6, Point3, UnitQuaternion, Vector2, Vector3,
    Vector6,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::camera::Intrinsics;
use crate::diagnosis::Tolerance;
use crate::geometry::Pose;

/// The covariance of a camera's pose: rotation about its own axes x, y, z \[rad\], then position of its centre along
/// them \[m, or the unit of the scene\].
///
/// Stored, it is 36 numbers, row by row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct PoseCovariance(Matrix6<f64>);

/// Errors that are drawn to know how far a pose is off in 95 % of cases.
const DRAWN: usize = 500;

impl PoseCovariance {
    /// A covariance from its matrix; `None` where that is none: not finite, not symmetric, or not positive definite.
    pub fn new(matrix: Matrix6<f64>) -> Option<Self> {
        let is_symmetric = (matrix - matrix.transpose()).amax() <= 1e-6 * matrix.amax();
        let symmetric = 0.5 * (matrix + matrix.transpose());
        (is_symmetric && symmetric.cholesky().is_some()).then_some(Self(symmetric))
    }

    /// Standard deviations, in the order of the covariance.
    pub fn deviations(&self) -> Vector6<f64> {
        self.0.diagonal().map(f64::sqrt)
    }

    /// The matrix.
    pub fn matrix(&self) -> &Matrix6<f64> {
        &self.0
    }

    /// The same with other standard deviations. What goes together stays.
    #[must_use]
    pub fn with_deviations(&self, deviations: &Vector6<f64>) -> Self {
        let by = Matrix6::from_diagonal(&deviations.component_div(&self.deviations()));
        Self(by * self.0 * by)
    }

    /// All errors this many times as great.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self(self.0 * (factor * factor))
    }

    /// As ROS defines `PoseWithCovariance` for a pose `world_from_camera`: position along the axes of the world first,
    /// then rotation about them.
    pub fn in_world_axes(&self, world_from_camera: &Pose) -> Matrix6<f64> {
        let turn = world_from_camera.rotation.to_rotation_matrix();
        let mut turned = Matrix6::zeros();
        turned.fixed_view_mut::<3, 3>(0, 3).copy_from(turn.matrix());
        turned.fixed_view_mut::<3, 3>(3, 0).copy_from(turn.matrix());
        turned * self.0 * turned.transpose()
    }

    /// As pycolmap defines it for `cam_from_world`, the inverse of the pose: a small rotation that is applied after
    /// that of `cam_from_world`, then what is added to its translation.
    pub fn of_camera_from_world(&self, world_from_camera: &Pose) -> Matrix6<f64> {
        let translation = world_from_camera.inverse().translation.vector;
        let mut moves = Matrix6::identity();
        moves.fixed_view_mut::<3, 3>(3, 0).copy_from(&-translation.cross_matrix());
        moves * self.0 * moves.transpose()
    }

    /// The covariance of the position alone.
    pub fn of_position(&self) -> Matrix3<f64> {
        self.0.fixed_view::<3, 3>(3, 3).into_owned()
    }

    /// The ellipsoid around the camera's centre that holds 95 % of normally distributed errors: its axes as a turn in
    /// the camera's frame, and half its lengths along them \[m\].
    pub fn ellipsoid(&self) -> (UnitQuaternion<f64>, Vector3<f64>) {
        /// Below this, 95 % of the squares of a normally distributed vector in space are.
        const NINETY_FIVE_OF_THREE: f64 = 7.814_728;
        let parts = self.of_position().symmetric_eigen();
        let mut axes = parts.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.column_mut(0).neg_mut();
        }
        let turn = UnitQuaternion::from_matrix(&axes);
        (turn, parts.eigenvalues.map(|square| (NINETY_FIVE_OF_THREE * square.max(0.0)).sqrt()))
    }

    /// The outline of what holds 95 % of the errors to the right and forward in another frame: points around the camera's
    /// centre, right and forward \[m\]. `turn` leads from the camera's frame to the other.
    pub fn outline(&self, turn: &UnitQuaternion<f64>) -> Vec<[f64; 2]> {
        let turn = turn.to_rotation_matrix();
        let position = turn.matrix() * self.of_position() * turn.matrix().transpose();
        ellipse(Matrix2::new(
            position[(0, 0)],
            position[(0, 2)],
            position[(2, 0)],
            position[(2, 2)],
        ))
    }

    /// The outline of where a point is truly seen in 95 % of cases: pixels of the photo \[px\]. `point` is in the frame
    /// of the estimated camera \[m\]. Empty for a point that is not in front of it.
    pub fn outline_of_point(&self, camera: &Intrinsics, point: &Point3<f64>) -> Vec<[f64; 2]> {
        let Some(centre) = camera.project(point) else {
            return Vec::new();
        };
        // A camera that is turned and shifted by a little sees p at p − ω × p − t.
        let mut moves = Matrix3x6::zeros();
        moves.fixed_view_mut::<3, 3>(0, 0).copy_from(&point.coords.cross_matrix());
        moves.fixed_view_mut::<3, 3>(0, 3).copy_from(&-Matrix3::identity());
        let (x, y, z) = (point.x, point.y, point.z);
        let sees = Matrix2x3::new(
            camera.fx / z,
            0.0,
            -camera.fx * x / (z * z),
            0.0,
            camera.fy / z,
            -camera.fy * y / (z * z),
        );
        let by = sees * moves;
        let around = ellipse(by * self.0 * by.transpose()).into_iter();
        around.map(|[right, down]| [centre.x + right, centre.y + down]).collect()
    }

    /// Distances \[m\] and angles \[rad\] of errors that are drawn from it, always the same.
    fn errors(&self) -> Vec<(f64, f64)> {
        let Some(factor) = self.0.cholesky() else {
            return Vec::new();
        };
        let mut rng = Pcg64::seed_from_u64(0);
        let drawn = (0..DRAWN).map(|_| {
            let error = factor.l() * Vector6::from_fn(|_, _| normal(&mut rng));
            (error.fixed_rows::<3>(3).norm(), error.fixed_rows::<3>(0).norm())
        });
        drawn.collect()
    }

    /// The distance \[m\] and the angle \[°\] that hold this share of all errors, each by itself.
    pub fn holding(&self, share: f64) -> Tolerance {
        let errors = self.errors();
        let quantile = |value: fn(&(f64, f64)) -> f64| {
            let mut values: Vec<f64> = errors.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            let at = (share * values.len() as f64) as usize;
            values.get(at.min(values.len().saturating_sub(1))).copied().unwrap_or(0.0)
        };
        Tolerance {
            translation_m: quantile(|error| error.0),
            rotation_deg: quantile(|error| error.1).to_degrees(),
        }
    }

    /// The share of errors that are within a tolerance.
    pub fn share_within(&self, tolerance: Tolerance) -> f64 {
        let errors = self.errors();
        let is_within = |&&(distance, angle): &&(f64, f64)| {
            distance <= tolerance.translation_m && angle.to_degrees() <= tolerance.rotation_deg
        };
        errors.iter().filter(is_within).count() as f64 / errors.len().max(1) as f64
    }
}

/// Points around what holds 95 % of normally distributed vectors in a plane; empty where they have no spread.
fn ellipse(covariance: Matrix2<f64>) -> Vec<[f64; 2]> {
    /// Below this, 95 % of the squares of a normally distributed vector in a plane are.
    const NINETY_FIVE_OF_TWO: f64 = 5.991_465;
    const POINTS: u32 = 48;
    let Some(factor) = (covariance * NINETY_FIVE_OF_TWO).cholesky() else {
        return Vec::new();
    };
    let point = |at: u32| {
        let angle = std::f64::consts::TAU * f64::from(at) / f64::from(POINTS);
        (factor.l() * Vector2::new(angle.cos(), angle.sin())).into()
    };
    (0..POINTS).map(point).collect()
}

/// What is added to an estimate to reach the truth, both `world_from_camera`, as a [`PoseCovariance`] orders it.
pub fn error_vector(truth: &Pose, estimate: &Pose) -> Vector6<f64> {
    let between = estimate.inverse() * truth;
    let turn: Vector3<f64> = UnitQuaternion::scaled_axis(&between.rotation);
    let shift = between.translation.vector;
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// A number of the standard normal distribution (Box and Muller 1958).
fn normal(rng: &mut Pcg64) -> f64 {
    let (radius, angle): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - radius).ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}

impl From<PoseCovariance> for Vec<f64> {
    fn from(covariance: PoseCovariance) -> Self {
        covariance.0.transpose().iter().copied().collect()
    }
}

impl TryFrom<Vec<f64>> for PoseCovariance {
    type Error = String;

    fn try_from(numbers: Vec<f64>) -> Result<Self, String> {
        (numbers.len() == 36)
            .then(|| Matrix6::from_row_slice(&numbers))
            .and_then(Self::new)
            .ok_or_else(|| {
                "a covariance of 36 numbers, symmetric and positive, expected".to_owned()
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> PoseCovariance {
        let root = Matrix6::from_fn(|row, column| match row.cmp(&column) {
            std::cmp::Ordering::Less => 0.0,
            std::cmp::Ordering::Equal => 0.02 + 0.01 * row as f64,
            std::cmp::Ordering::Greater => 0.004 * (row as f64 - 2.0 * column as f64),
        });
        PoseCovariance::new(root * root.transpose()).expect("a covariance")
    }

    fn pose() -> Pose {
        Pose::new(Vector3::new(3.0, -1.0, 7.0), Vector3::new(0.4, -1.1, 0.3))
    }

    /// The covariance of what `measure` makes of poses whose errors are drawn from [`some`], tenfold smaller, so that
    /// all is linear.
    fn sampled(measure: impl Fn(&Pose) -> Vector6<f64>) -> Matrix6<f64> {
        let small = some().scaled(0.1);
        let factor = small.matrix().cholesky().expect("positive");
        let mut rng = Pcg64::seed_from_u64(7);
        let count = 40_000;
        let mut sum = Matrix6::zeros();
        for _ in 0..count {
            let error = factor.l() * Vector6::from_fn(|_, _| normal(&mut rng));
            let [turn, shift] = [0, 3].map(|first| error.fixed_rows::<3>(first).into_owned());
            let truth =
                pose() * Pose::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn));
            let measured = measure(&truth);
            sum += measured * measured.transpose();
        }
        sum * (100.0 / f64::from(count))
    }

    fn is_like(found: &Matrix6<f64>, expected: &Matrix6<f64>) -> bool {
        (found - expected).amax() < 0.03 * expected.amax()
    }

    fn stacked(first: Vector3<f64>, second: Vector3<f64>) -> Vector6<f64> {
        Vector6::new(first.x, first.y, first.z, second.x, second.y, second.z)
    }

    #[test]
    fn errors_that_are_drawn_have_the_covariance_in_each_of_its_forms() {
        let estimate = pose();
        let own = sampled(|truth| error_vector(truth, &estimate));
        assert!(is_like(&own, some().matrix()), "{own}");
        let in_world = sampled(|truth| {
            let turn = (truth.rotation * estimate.rotation.inverse()).scaled_axis();
            stacked(truth.translation.vector - estimate.translation.vector, turn)
        });
        assert!(is_like(&in_world, &some().in_world_axes(&estimate)), "{in_world}");
        let of_camera_from_world = sampled(|truth| {
            let [truth, estimate] = [truth.inverse(), estimate.inverse()];
            let turn = (truth.rotation * estimate.rotation.inverse()).scaled_axis();
            stacked(turn, truth.translation.vector - estimate.translation.vector)
        });
        let expected = some().of_camera_from_world(&estimate);
        assert!(is_like(&of_camera_from_world, &expected), "{of_camera_from_world} {expected}");
    }

    /// The share of drawn positions for which this holds.
    fn share_of_positions(is_in: impl Fn(&Vector3<f64>) -> bool) -> f64 {
        let factor = some().matrix().cholesky().expect("positive");
        let mut rng = Pcg64::seed_from_u64(3);
        let count = 20_000;
        let held = (0..count).filter(|_| {
            let error = factor.l() * Vector6::from_fn(|_, _| normal(&mut rng));
            is_in(&error.fixed_rows::<3>(3).into_owned())
        });
        held.count() as f64 / f64::from(count)
    }

    #[test]
    fn an_ellipsoid_and_its_outline_hold_nineteen_of_twenty_errors() {
        let (turn, half) = some().ellipsoid();
        let share = share_of_positions(|position| {
            (turn.inverse() * position).component_div(&half).norm() <= 1.0
        });
        assert!((share - 0.95).abs() < 0.006, "{share}");

        let turn = pose().rotation;
        let outline = some().outline(&turn);
        let share = share_of_positions(|position| {
            let seen = turn * position;
            is_inside(&outline, [seen.x, seen.z])
        });
        assert!((share - 0.95).abs() < 0.006, "{share}");
    }

    /// Inside of an outline that goes around anticlockwise, every edge has the point at its left.
    fn is_inside(outline: &[[f64; 2]], point: [f64; 2]) -> bool {
        let next = outline.iter().cycle().skip(1);
        outline.iter().zip(next).all(|(from, to)| {
            let (along, to_point) =
                ([to[0] - from[0], to[1] - from[1]], [point[0] - from[0], point[1] - from[1]]);
            along[0] * to_point[1] - along[1] * to_point[0] >= 0.0
        })
    }

    #[test]
    fn the_outline_of_a_point_holds_nineteen_of_twenty_of_where_it_is_seen() {
        let camera =
            Intrinsics { fx: 700.0, fy: 650.0, cx: 600.0, cy: 180.0, width: 1241, height: 376 };
        let small = some().scaled(0.1);
        let factor = small.matrix().cholesky().expect("positive");
        for point in [Point3::new(-3.0, 0.5, 9.0), Point3::new(4.0, -1.5, 22.0)] {
            let outline = small.outline_of_point(&camera, &point);
            let mut rng = Pcg64::seed_from_u64(5);
            let count = 20_000;
            let held = (0..count).filter(|_| {
                let error = factor.l() * Vector6::from_fn(|_, _| normal(&mut rng));
                let [turn, shift] = [0, 3].map(|first| error.fixed_rows::<3>(first).into_owned());
                let from_truth =
                    Pose::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn));
                let seen = camera.project(&(from_truth.inverse() * point)).expect("in front");
                is_inside(&outline, seen.into())
            });
            let share = held.count() as f64 / f64::from(count);
            assert!((share - 0.95).abs() < 0.01, "{share}");
        }
        assert!(small.outline_of_point(&camera, &Point3::new(0.0, 0.0, -1.0)).is_empty());
    }

    #[test]
    fn a_distance_that_holds_a_share_holds_it() {
        let round = PoseCovariance::new(Matrix6::from_diagonal(&Vector6::from([
            0.01, 0.01, 0.01, 0.04, 0.04, 0.04,
        ])));
        let round = round.expect("a covariance");
        // Of a normal distribution in space, 95 % are within 2.795 standard deviations.
        let held = round.holding(0.95);
        assert!((held.translation_m - 0.559).abs() < 0.04, "{held}");
        assert!((held.rotation_deg.to_radians() - 0.2795).abs() < 0.02, "{held}");
        let share = round.share_within(held);
        assert!((0.88..0.94).contains(&share), "{share}");
        assert!(round.scaled(0.01).share_within(held) == 1.0);
        let doubled = round.with_deviations(&(2.0 * round.deviations()));
        assert!((doubled.matrix() - 4.0 * round.matrix()).amax() < 1e-12);
    }

    #[test]
    fn a_covariance_is_read_back_and_what_is_none_is_refused() {
        let text = serde_json::to_string(&some()).expect("numbers");
        assert_eq!(text.matches(',').count(), 35);
        let back: PoseCovariance = serde_json::from_str(&text).expect("a covariance");
        assert!((back.matrix() - some().matrix()).amax() < 1e-15);
        for wrong in ["[]", "[1.0]"] {
            assert!(serde_json::from_str::<PoseCovariance>(wrong).is_err());
        }
        let mut skewed = *some().matrix();
        skewed[(0, 5)] += 0.01;
        assert!(PoseCovariance::new(skewed).is_none());
        assert!(PoseCovariance::new(-some().matrix()).is_none());
        assert!(PoseCovariance::new(Matrix6::from_element(f64::NAN)).is_none());
    }
}
