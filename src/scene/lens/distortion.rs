//! Models of lens distortion: where a lens shows a direction (x/z, y/z), in the same normalised coordinates.

use std::fmt;

use nalgebra::{Matrix2, Point2, Vector2};

/// A model with its coefficients, in the notation of OpenCV and COLMAP.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in super::super) enum Distortion {
    #[default]
    None,
    /// Brown–Conrady with a rational radial part: OpenCV's `k1 k2 p1 p2 k3 k4 k5 k6`.
    Brown { k: [f64; 6], p: [f64; 2] },
    /// The angle to the axis times a polynomial: OpenCV's fisheye module with `k1 … k4`, equidistant without
    /// coefficients. Then a tangential part and a thin prism, of the angles before the polynomial or after it.
    Fisheye { k: [f64; 6], p: [f64; 2], s: [f64; 4], after: bool },
    /// Devernay, Faugeras 2001: one field of view \[rad\].
    FieldOfView { omega: f64 },
    /// Fitzgibbon 2001: the distorted point divided by 1 + k r².
    Division { k: f64 },
    /// Khomutenko, Garcia, Martinet 2016: the enhanced unified camera.
    Unified { alpha: f64, beta: f64 },
}

impl Distortion {
    /// OpenCV's coefficients; none if all are zero.
    pub fn brown(k: [f64; 6], p: [f64; 2]) -> Self {
        let are_zero = k.iter().chain(&p).all(|&coefficient| coefficient == 0.0);
        if are_zero { Self::None } else { Self::Brown { k, p } }
    }

    /// OpenCV's fisheye model.
    pub fn fisheye([k1, k2, k3, k4]: [f64; 4]) -> Self {
        Self::Fisheye { k: [k1, k2, k3, k4, 0.0, 0.0], p: [0.0; 2], s: [0.0; 4], after: false }
    }

    pub fn is_fisheye(&self) -> bool {
        !matches!(self, Self::None | Self::Brown { .. } | Self::Division { .. })
    }

    /// The distorted image of a direction.
    pub fn distorted(&self, at: Point2<f64>) -> Point2<f64> {
        let r = at.coords.norm();
        match *self {
            Self::None => at,
            Self::Brown { k, p } => at * brown_factor(&k, r * r) + tangential(at, p),
            Self::Fisheye { .. } => self.of_angles(at * share(r.atan(), r)),
            _ => at * share(self.radial(r), r),
        }
    }

    /// The direction that a distorted image shows; `None` where there is none in front of the camera.
    pub fn direction(&self, seen: Point2<f64>) -> Option<Point2<f64>> {
        let r = seen.coords.norm();
        let found = match *self {
            Self::None => seen,
            Self::Brown { .. } => solved(|at| self.distorted(at), seen)?,
            Self::Fisheye { .. } => {
                let angles = solved(|angles| self.of_angles(angles), seen)?;
                let angle = angles.coords.norm();
                if angle >= std::f64::consts::FRAC_PI_2 {
                    return None;
                }
                angles * share(angle.tan(), angle)
            }
            Self::FieldOfView { omega } if omega.abs() < 1e-6 => seen,
            Self::FieldOfView { omega } => {
                let angle = r * omega;
                if angle.abs() >= std::f64::consts::FRAC_PI_2 {
                    return None;
                }
                seen * share(angle.tan() / field_scale(omega), r)
            }
            Self::Division { k } => seen / (1.0 + k * r * r),
            Self::Unified { .. } => {
                let along =
                    |at: Point2<f64>| at * share(self.radial(at.coords.norm()), at.coords.norm());
                solved(along, seen)?
            }
        };
        let error = (self.distorted(found) - seen).norm();
        (error < 1e-6 && self.is_sound_within(found.coords.norm())).then_some(found)
    }

    /// Whether the distortion is finite and monotonic up to a radius. Where it is not, it folds the image.
    pub fn is_sound_within(&self, radius: f64) -> bool {
        const STEPS: usize = 64;
        let at = |step: usize| self.radial(radius * step as f64 / STEPS as f64);
        let are_rising = (1..=STEPS).all(|step| at(step) > at(step - 1));
        radius.is_finite() && (radius == 0.0 || are_rising)
    }

    /// The radius of the image of a direction with this radius, without the parts that are not radial.
    fn radial(&self, r: f64) -> f64 {
        match *self {
            Self::None => r,
            Self::Brown { k, .. } => r * brown_factor(&k, r * r),
            Self::Fisheye { k, .. } => r.atan() * fisheye_factor(&k, r.atan().powi(2)),
            Self::FieldOfView { omega } if omega.abs() < 1e-6 => r,
            Self::FieldOfView { omega } => (r * field_scale(omega)).atan() / omega,
            Self::Division { k } => 2.0 * r / (1.0 + (1.0 - 4.0 * k * r * r).sqrt()),
            Self::Unified { alpha, beta } => {
                r / (alpha * (beta * r * r + 1.0).sqrt() + 1.0 - alpha)
            }
        }
    }

    /// The distorted image of a direction that is given by the angle to the axis, as a vector in the image.
    fn of_angles(&self, angles: Point2<f64>) -> Point2<f64> {
        let Self::Fisheye { k, p, s, after } = *self else { return angles };
        let radial = angles * fisheye_factor(&k, angles.coords.norm_squared());
        let base = if after { radial } else { angles };
        let square = base.coords.norm_squared();
        let prism = Vector2::new(
            s[0] * square + s[1] * square * square,
            s[2] * square + s[3] * square * square,
        );
        radial + tangential(base, p) + prism
    }
}

/// How many times as far as `of` `length` is; both are zero together.
fn share(length: f64, of: f64) -> f64 {
    if of < 1e-12 { 1.0 } else { length / of }
}

fn brown_factor([k1, k2, k3, k4, k5, k6]: &[f64; 6], square: f64) -> f64 {
    (1.0 + square * (k1 + square * (k2 + square * k3)))
        / (1.0 + square * (k4 + square * (k5 + square * k6)))
}

fn fisheye_factor(k: &[f64; 6], square: f64) -> f64 {
    1.0 + square * k.iter().rev().fold(0.0, |sum, k| sum * square + k)
}

fn tangential(Point2 { coords }: Point2<f64>, [p1, p2]: [f64; 2]) -> Vector2<f64> {
    let (x, y, square) = (coords.x, coords.y, coords.norm_squared());
    Vector2::new(
        2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
        p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
    )
}

fn field_scale(omega: f64) -> f64 {
    2.0 * (omega / 2.0).tan()
}

/// The point whose image under a smooth function, which is nearly the identity in the middle, is this one. By Newton's
/// method with a step that is halved until it helps.
fn solved(image: impl Fn(Point2<f64>) -> Point2<f64>, wanted: Point2<f64>) -> Option<Point2<f64>> {
    const ROUNDS: usize = 50;
    const STEP: f64 = 1e-6;
    let mut at = wanted;
    let mut error = image(at) - wanted;
    for _ in 0..ROUNDS {
        if error.norm() < 1e-12 {
            return Some(at);
        }
        let slope =
            |axis: Vector2<f64>| (image(at + axis * STEP) - image(at - axis * STEP)) / (2.0 * STEP);
        let slopes = Matrix2::from_columns(&[slope(Vector2::x()), slope(Vector2::y())]);
        let way = slopes.try_inverse()? * error;
        let shorter = (0..20).map(|halvings| at - way * 0.5_f64.powi(halvings));
        let mut tried = shorter.map(|next| (next, image(next) - wanted));
        let Some(better) = tried.find(|(_, left)| left.norm() < error.norm()) else { break };
        (at, error) = better;
    }
    (error.norm() < 1e-9).then_some(at)
}

impl fmt::Display for Distortion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Brown { k: [k1, k2, k3, k4, k5, k6], p: [p1, p2] } => {
                write!(f, "k1 k2 p1 p2 k3 k4 k5 k6 = {k1} {k2} {p1} {p2} {k3} {k4} {k5} {k6}")
            }
            Self::Fisheye { k, .. } => write!(f, "fisheye, k1 k2 k3 k4 = {k:?}"),
            Self::FieldOfView { omega } => write!(f, "field of view, omega = {omega}"),
            Self::Division { k } => write!(f, "division, k = {k}"),
            Self::Unified { alpha, beta } => write!(f, "alpha beta = {alpha} {beta}"),
        }
    }
}
