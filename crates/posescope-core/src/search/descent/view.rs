//! What a camera's photo shows at the points of a cloud, and how that changes as the camera moves.

use nalgebra::{Matrix3, Point3, Rotation3, SMatrix, Vector3};

use crate::camera::Intrinsics;
use crate::geometry::Pose;
use crate::image::FloatImage;

/// Nearer points are not seen \[m\].
const MIN_DEPTH_M: f64 = 0.1;

/// How a value changes with the six numbers of a motion.
pub(super) type Slope = [f64; 6];

/// The points of a reference's cloud, with the values that its photo gives them, before a query camera.
pub struct View<'a> {
    query: &'a FloatImage,
    intrinsics: Intrinsics,
    /// The points in the frame of the start.
    points: Vec<Vector3<f64>>,
    /// Their values in the reference photo.
    pub(super) values: Vec<f64>,
    camera_from_reference: Pose,
}

impl<'a> View<'a> {
    /// What the query shows of points of the reference's frame, for a camera that starts at
    /// `camera_from_reference`. Points that the reference photo does not show are left out.
    pub fn new(
        query: (&'a FloatImage, &Intrinsics),
        reference: (&FloatImage, &Intrinsics),
        points: &[Point3<f32>],
        camera_from_reference: &Pose,
    ) -> Self {
        let (photo, camera) = reference;
        let valued = points.iter().filter_map(|point| {
            let point: Point3<f64> = point.cast();
            let pixel = camera.project(&point)?;
            let (value, _) = sampled(photo, pixel.x, pixel.y)?;
            Some(((camera_from_reference * point).coords, value))
        });
        let (points, values) = valued.unzip();
        Self {
            query: query.0,
            intrinsics: *query.1,
            points,
            values,
            camera_from_reference: *camera_from_reference,
        }
    }

    /// The camera after a motion.
    pub(super) fn camera_after(&self, x: &[f64]) -> Pose {
        Motion::after(x, &self.camera_from_reference)
    }

    /// What the moved camera's photo shows of each point, and how that changes; `None` out of view.
    pub(super) fn seen(&self, x: &[f64]) -> Vec<Option<(f64, Slope)>> {
        let motion = Motion::new(x);
        let points = self.points.iter();
        points.map(|point| self.seen_at(&motion, point)).collect()
    }

    fn seen_at(&self, motion: &Motion, point: &Vector3<f64>) -> Option<(f64, Slope)> {
        let moved = motion.moved(point);
        if moved.z.is_nan() || moved.z <= MIN_DEPTH_M {
            return None;
        }
        let Intrinsics { fx, fy, cx, cy, .. } = self.intrinsics;
        let (x, y, inverse) = (moved.x / moved.z, moved.y / moved.z, 1.0 / moved.z);
        let (value, [across, down]) = sampled(self.query, fx * x + cx, fy * y + cy)?;
        let (by_x, by_y) = (across * fx * inverse, down * fy * inverse);
        let by_point = SMatrix::<f64, 1, 3>::new(by_x, by_y, -(by_x * x + by_y * y));
        let slope = by_point * motion.slopes(&moved);
        Some((value, std::array::from_fn(|i| slope[i])))
    }
}

/// The value between the pixels by cubic convolution (Keys 1981, a = −0.5), and how it changes with the
/// column and with the row \[1/px\]; `None` where not all sixteen pixels are in the image.
pub(super) fn sampled(image: &FloatImage, x: f64, y: f64) -> Option<(f64, [f64; 2])> {
    let (width, height) = image.dimensions();
    let is_inside =
        x >= 1.0 && y >= 1.0 && x < f64::from(width) - 2.0 && y < f64::from(height) - 2.0;
    if !is_inside {
        return None;
    }
    let (left, top) = (x.floor(), y.floor());
    let (columns, column_slopes) = catmull_rom(x - left);
    let (rows, row_slopes) = catmull_rom(y - top);
    let (mut value, mut across, mut down) = (0.0, 0.0, 0.0);
    let samples = image.as_raw();
    for row in 0..4 {
        let at = (top as usize - 1 + row) * width as usize + left as usize - 1;
        let samples: &[f32] = &samples[at..at + 4];
        let along = |weights: &[f64; 4]| -> f64 {
            let terms = weights.iter().zip(samples);
            terms.map(|(weight, &sample)| weight * f64::from(sample)).sum()
        };
        let (here, slope) = (along(&columns), along(&column_slopes));
        value += rows[row] * here;
        across += rows[row] * slope;
        down += row_slopes[row] * here;
    }
    Some((value, [across, down]))
}

/// Weights of the samples at −1, 0, 1, 2 for a position `t` in 0 … 1, and how they change with it.
fn catmull_rom(t: f64) -> ([f64; 4], [f64; 4]) {
    let (t2, t3) = (t * t, t * t * t);
    let weights = [
        -0.5 * t + t2 - 0.5 * t3,
        1.0 - 2.5 * t2 + 1.5 * t3,
        0.5 * t + 2.0 * t2 - 1.5 * t3,
        -0.5 * t2 + 0.5 * t3,
    ];
    let slopes =
        [-0.5 + 2.0 * t - 1.5 * t2, -5.0 * t + 4.5 * t2, 0.5 + 4.0 * t - 4.5 * t2, -t + 1.5 * t2];
    (weights, slopes)
}

/// How far away a point is that a unit of rotation moves as far as a unit of translation \[m\]: the
/// descents see all six numbers in one scale.
const ARM_M: f64 = 10.0;

/// A motion of points in the frame of a camera: x, y, z \[m\], and a rotation vector times [`ARM_M`].
#[derive(Clone, Copy, Debug)]
struct Motion {
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    /// How the rotation changes with its vector, on the left.
    left_jacobian: Matrix3<f64>,
}

impl Motion {
    fn new(x: &[f64]) -> Self {
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
    fn moved(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }

    /// How the moved point changes with the six numbers.
    fn slopes(&self, moved: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
        let turned = moved - self.translation;
        let by_rotation = -turned.cross_matrix() * self.left_jacobian / ARM_M;
        let mut slopes = SMatrix::<f64, 3, 6>::zeros();
        slopes.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        slopes.fixed_view_mut::<3, 3>(0, 3).copy_from(&by_rotation);
        slopes
    }

    /// The camera after the motion, for one that was at `camera_from_reference` before.
    fn after(x: &[f64], camera_from_reference: &Pose) -> Pose {
        let vector = Vector3::new(x[3], x[4], x[5]) / ARM_M;
        Pose::new(Vector3::new(x[0], x[1], x[2]), vector) * camera_from_reference
    }
}
