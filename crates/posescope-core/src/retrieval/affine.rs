//! Affine transforms of the image plane: from one pair of features, or from many pairs of points.

use nalgebra::{Matrix2, Matrix3, Point2, Vector2, Vector3};

use crate::features::Keypoint;

/// `reference = linear · query + translation`, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// Scale, rotation and shear.
    pub linear: Matrix2<f64>,
    /// Shift \[px\].
    pub translation: Vector2<f64>,
}

impl Affine {
    /// The similarity that one pair of features determines: their scales and angles give scale and
    /// rotation, their places the shift. Upright features, whose angles are 0, leave scale and shift.
    ///
    /// Philbin et al. 2007, section 4, where regions are ellipses, so that one pair fixes 3 to 5
    /// degrees of freedom; those of SURF are circles: 3 upright, else 4.
    pub fn from_features(query: &Keypoint, reference: &Keypoint) -> Self {
        let scale = f64::from(reference.scale) / f64::from(query.scale);
        let (sin, cos) = (f64::from(reference.angle) - f64::from(query.angle)).sin_cos();
        // Angles grow from the x axis towards the y axis.
        let linear = scale * Matrix2::new(cos, -sin, sin, cos);
        Self { linear, translation: reference.pixel().coords - linear * query.pixel().coords }
    }

    /// The transform with the least sum of squared distances, of pairs of query and reference; `None`
    /// where the points of the query lie on a line or there are fewer than three.
    pub fn least_squares(pairs: &[(Point2<f64>, Point2<f64>)]) -> Option<Self> {
        if pairs.len() < 3 {
            return None;
        }
        let count = pairs.len() as f64;
        let sums = pairs.iter().fold((Vector2::zeros(), Vector2::zeros()), |sums, pair| {
            (sums.0 + pair.0.coords, sums.1 + pair.1.coords)
        });
        let (query_mean, reference_mean) = (sums.0 / count, sums.1 / count);
        let mut scatter = Matrix2::zeros();
        let mut cross = Matrix2::zeros();
        for (query, reference) in pairs {
            let query = query.coords - query_mean;
            scatter += query * query.transpose();
            cross += (reference.coords - reference_mean) * query.transpose();
        }
        // A thin cloud of points leaves the direction across it to the noise.
        let eigenvalues = scatter.symmetric_eigenvalues();
        if eigenvalues.min() < 1e-4 * eigenvalues.max() || eigenvalues.max() <= 0.0 {
            return None;
        }
        let linear = cross * scatter.try_inverse()?;
        let affine = Self { linear, translation: reference_mean - linear * query_mean };
        affine.is_finite().then_some(affine)
    }

    /// Where a pixel of the query is in the reference.
    pub fn apply(&self, query: &Point2<f64>) -> Point2<f64> {
        Point2::from(self.linear * query.coords + self.translation)
    }

    /// Side of the square that has the area of a transformed unit square; negative where it mirrors.
    pub fn scale(&self) -> f64 {
        let determinant = self.linear.determinant();
        determinant.abs().sqrt().copysign(determinant)
    }

    /// Whether every number is.
    pub fn is_finite(&self) -> bool {
        self.linear.iter().all(|v| v.is_finite()) && self.translation.iter().all(|v| v.is_finite())
    }

    /// The 3 × 3 matrix for homogeneous pixels.
    pub fn to_homogeneous(&self) -> Matrix3<f64> {
        let [first, second] = [0, 1].map(|column| self.linear.column(column).push(0.0));
        Matrix3::from_columns(&[first, second, Vector3::from(self.translation.push(1.0))])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn keypoint(x: f32, y: f32, scale: f32, angle: f32) -> Keypoint {
        Keypoint { x, y, scale, angle, response: 1.0, laplacian_positive: true }
    }

    #[test]
    fn a_quarter_turn_at_twice_the_scale_by_hand() {
        let turn = std::f32::consts::FRAC_PI_2;
        let query = keypoint(10.0, 0.0, 2.0, 0.3);
        let reference = keypoint(100.0, 50.0, 4.0, 0.3 + turn);
        let affine = Affine::from_features(&query, &reference);
        // From x towards y: a step right in the query is two steps down in the reference.
        let right = affine.apply(&Point2::new(11.0, 0.0));
        assert!((right - Point2::new(100.0, 52.0)).norm() < 1e-5, "{right}");
        let down = affine.apply(&Point2::new(10.0, 1.0));
        assert!((down - Point2::new(98.0, 50.0)).norm() < 1e-5, "{down}");
        let pixel = affine.to_homogeneous() * Vector3::new(11.0, 0.0, 1.0);
        assert!((pixel - right.to_homogeneous()).norm() < 1e-9);
    }

    #[test]
    fn points_on_a_line_have_no_affine_transform() {
        let pair = |i: i32| {
            let point = Point2::new(f64::from(i), 2.0 * f64::from(i));
            (point, point)
        };
        let line: Vec<_> = (0..10).map(pair).collect();
        assert_eq!(Affine::least_squares(&line), None);
        assert_eq!(Affine::least_squares(&[pair(1); 5]), None);
        assert_eq!(Affine::least_squares(&[]), None);
    }

    proptest! {
        #[test]
        fn one_pair_of_features_recovers_a_similarity(
            scale in 0.3..3.0_f64, angle in -3.0..3.0_f64,
            dx in -500.0..500.0_f64, dy in -300.0..300.0_f64,
            x in 0.0..1000.0_f32, y in 0.0..400.0_f32, size in 1.2..20.0_f32, own in -3.0..3.0_f32,
        ) {
            let (sin, cos) = angle.sin_cos();
            let truth = Affine {
                linear: scale * Matrix2::new(cos, -sin, sin, cos),
                translation: Vector2::new(dx, dy),
            };
            let query = keypoint(x, y, size, own);
            let seen = truth.apply(&query.pixel());
            let reference =
                keypoint(seen.x as f32, seen.y as f32, size * scale as f32, own + angle as f32);
            let found = Affine::from_features(&query, &reference);
            prop_assert!((found.linear - truth.linear).amax() < 1e-5 * scale.max(1.0));
            prop_assert!((found.scale() - scale).abs() < 1e-5 * scale.max(1.0));
            let other = Point2::new(500.0, 200.0);
            prop_assert!((found.apply(&other) - truth.apply(&other)).norm() < 0.02);
        }

        #[test]
        fn many_pairs_recover_an_affine_transform(
            numbers in prop::array::uniform6(-2.0..2.0_f64),
            points in prop::collection::vec((0.0..1000.0_f64, 0.0..400.0_f64), 6..30),
        ) {
            let [a, b, c, d, e, f] = numbers;
            let truth = Affine {
                linear: Matrix2::new(a, b, c, d),
                translation: Vector2::new(e, f) * 100.0,
            };
            let pairs: Vec<_> = points
                .iter()
                .map(|&(x, y)| (Point2::new(x, y), truth.apply(&Point2::new(x, y))))
                .collect();
            if let Some(found) = Affine::least_squares(&pairs) {
                prop_assert!((found.linear - truth.linear).amax() < 1e-6);
                prop_assert!((found.translation - truth.translation).amax() < 1e-3);
            }
        }
    }
}
