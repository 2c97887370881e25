//! Reprojection errors of correspondences, with their derivatives by the pose.

use nalgebra::{Matrix6, SMatrix, SVector, Vector2, Vector6};

use super::Correspondence;
use super::loss::Loss;
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// Parts of each sum, to which correspondences are added by turns: the additions of one need not wait for
/// those of another.
const PARTS: usize = 8;

/// The part of a twist \[rad, then m\] that each axis of a pixel depends on: neither moves with a shift along
/// the other.
const MOVES: [[usize; 5]; 2] = [[0, 1, 2, 3, 5], [0, 1, 2, 4, 5]];

/// Entries of the lower triangle of a 5 × 5 matrix.
const ENTRIES: usize = 15;

/// `H ξ = −g` for the twist ξ, with `H = Σ w JᵀJ` and `g = Σ w Jᵀr`.
pub(super) struct NormalEquations {
    pub(super) hessian: Matrix6<f64>,
    pub(super) gradient: Vector6<f64>,
}

/// The correspondences of a refinement and the camera that sees them.
pub(super) struct Reprojection<'a> {
    correspondences: &'a [Correspondence],
    intrinsics: Intrinsics,
}

/// A correspondence as it is seen: the residual \[px\], the point's place in the normalised image plane, and
/// its inverse depth \[1/m\].
struct Seen {
    residual: [f64; 2],
    plane: [f64; 2],
    inverse_depth: f64,
}

impl<'a> Reprojection<'a> {
    pub(super) fn new(correspondences: &'a [Correspondence], intrinsics: &Intrinsics) -> Self {
        Self { correspondences, intrinsics: *intrinsics }
    }

    /// Mean loss \[px²\] of a pose `camera_from_points`; infinite where a point is not in front of the camera,
    /// no number without points.
    pub(super) fn cost(&self, pose: &Pose, loss: Loss) -> f64 {
        let mut sums = [0.0; PARTS];
        for (at, seen) in self.seen(pose).enumerate() {
            sums[at % PARTS] +=
                seen.map_or(f64::INFINITY, |Seen { residual: [u, v], .. }| loss.rho(u * u + v * v));
        }
        sums.iter().sum::<f64>() / self.correspondences.len() as f64
    }

    /// Each correspondence as it is seen from a pose; `None` for points that are not in front of the camera.
    fn seen(&self, pose: &Pose) -> impl Iterator<Item = Option<Seen>> {
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        let shift = pose.translation.vector;
        let Intrinsics { fx, fy, cx, cy, .. } = self.intrinsics;
        self.correspondences.iter().map(move |Correspondence { pixel, point }| {
            let along = |axis: usize| {
                rotation[(axis, 0)] * point.x
                    + rotation[(axis, 1)] * point.y
                    + rotation[(axis, 2)] * point.z
                    + shift[axis]
            };
            let depth = along(2);
            let inverse_depth = depth.recip();
            let (across, down) = (along(0) * inverse_depth, along(1) * inverse_depth);
            (depth > 0.0).then(|| Seen {
                residual: [fx * across + cx - pixel.x, fy * down + cy - pixel.y],
                plane: [across, down],
                inverse_depth,
            })
        })
    }

    /// The normal equations at a pose; points that are not in front of the camera are left out.
    pub(super) fn normal_equations(&self, pose: &Pose, loss: Loss) -> NormalEquations {
        // Of u and of v.
        let mut squares = [[[0.0; PARTS]; ENTRIES]; 2];
        let mut slopes = [[[0.0; PARTS]; 5]; 2];
        for (at, seen) in self.seen(pose).enumerate() {
            let (part, Some(seen)) = (at % PARTS, seen) else { continue };
            let [u, v] = seen.residual;
            let weight = loss.weight(u * u + v * v);
            for (axis, derivatives) in self.derivatives(&seen).into_iter().enumerate() {
                let mut entry = 0;
                for i in 0..5 {
                    let weighted = derivatives[i] * weight;
                    slopes[axis][i][part] += weighted * seen.residual[axis];
                    for other in &derivatives[..=i] {
                        squares[axis][entry][part] += weighted * other;
                        entry += 1;
                    }
                }
            }
        }
        let mut normal = NormalEquations { hessian: Matrix6::zeros(), gradient: Vector6::zeros() };
        for (axis, moves) in MOVES.into_iter().enumerate() {
            let mut entry = 0;
            for (at, &i) in moves.iter().enumerate() {
                normal.gradient[i] += slopes[axis][at].iter().sum::<f64>();
                for &j in &moves[..=at] {
                    normal.hessian[(i, j)] += squares[axis][entry].iter().sum::<f64>();
                    entry += 1;
                }
            }
        }
        normal.hessian.fill_upper_triangle_with_lower_triangle();
        normal
    }

    /// Mean loss \[px²\] of a pose, where points that are not in front of the camera are as far off as the photo is large;
    /// no number without points.
    pub(super) fn cost_of_seen(&self, pose: &Pose, loss: Loss) -> f64 {
        let Intrinsics { width, height, .. } = self.intrinsics;
        let unseen = f64::from(width).powi(2) + f64::from(height).powi(2);
        let squares = self.seen(pose).map(|seen| {
            seen.map_or(unseen, |Seen { residual: [u, v], .. }| (u * u + v * v).min(unseen))
        });
        squares.map(|square| loss.rho(square)).sum::<f64>() / self.correspondences.len() as f64
    }

    /// The normal equations of a pose, and of the logarithm of the focal lengths last; points that are not in front of the
    /// camera are left out.
    pub(super) fn zoom_equations(
        &self,
        pose: &Pose,
        loss: Loss,
    ) -> (SMatrix<f64, 7, 7>, SVector<f64, 7>) {
        let (mut hessian, mut gradient) = (SMatrix::zeros(), SVector::zeros());
        let Intrinsics { fx, fy, .. } = self.intrinsics;
        for seen in self.seen(pose).flatten() {
            let residual = Vector2::from(seen.residual);
            let weight = loss.weight(residual.norm_squared());
            let mut jacobian = SMatrix::<f64, 2, 7>::zeros();
            for (axis, derivatives) in self.derivatives(&seen).into_iter().enumerate() {
                for (freedom, derivative) in MOVES[axis].into_iter().zip(derivatives) {
                    jacobian[(axis, freedom)] = derivative;
                }
            }
            jacobian[(0, 6)] = fx * seen.plane[0];
            jacobian[(1, 6)] = fy * seen.plane[1];
            hessian += jacobian.transpose() * jacobian * weight;
            gradient += jacobian.transpose() * residual * weight;
        }
        (hessian, gradient)
    }

    /// Derivatives of both axes of a pixel by what moves them, of a twist in the camera frame \[px/rad, px/m\].
    ///
    /// The twist moves a point p by `ω × p + v`, and `∂π/∂p = [f/z, −f p/z²]` per image axis.
    fn derivatives(&self, seen: &Seen) -> [[f64; 5]; 2] {
        let Intrinsics { fx, fy, .. } = self.intrinsics;
        let Seen { plane: [x, y], inverse_depth, .. } = *seen;
        [
            [
                -fx * (x * y),
                fx * (1.0 + x * x),
                -fx * y,
                fx * inverse_depth,
                -fx * (x * inverse_depth),
            ],
            [
                -fy * (1.0 + y * y),
                fy * (x * y),
                fy * x,
                fy * inverse_depth,
                -fy * (y * inverse_depth),
            ],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::KITTI;
    use crate::solver::refine::moved;
    use nalgebra::{Matrix2x6, Point2, Point3, Vector2, Vector3};
    use proptest::prelude::*;

    /// `∂π/∂ξ` by central differences.
    fn jacobian(pose: &Pose, point: &Point3<f64>) -> Matrix2x6<f64> {
        let pixel = |twist| KITTI.project(&(moved(pose, &twist) * point)).expect("in front");
        let columns: [Vector2<f64>; 6] = std::array::from_fn(|k| {
            let step = Vector6::ith(k, 1e-6);
            (pixel(step) - pixel(-step)) / 2e-6
        });
        Matrix2x6::from_columns(&columns)
    }

    fn some_correspondences() -> impl Strategy<Value = Vec<Correspondence>> {
        let one = (-6.0..6.0_f64, -2.0..2.0_f64, -10.0..40.0_f64, -30.0..30.0_f64);
        let made = one.prop_map(|(x, y, z, off)| {
            let point = Point3::new(x, y, if z.abs() < 3.0 { z + 8.0 } else { z });
            let pixel = KITTI.project(&point).unwrap_or(Point2::new(300.0, 100.0));
            Correspondence { pixel: pixel + Vector2::new(off, -0.5 * off), point }
        });
        prop::collection::vec(made, 0..20)
    }

    proptest! {
        #[test]
        fn cost_and_normal_equations_are_those_that_are_written_out(
            correspondences in some_correspondences(),
            turn in -0.05..0.05_f64,
            which in 0_usize..3,
        ) {
            let loss = [Loss::Squared, Loss::Huber(5.0), Loss::Cauchy(5.0)][which];
            let pose = Pose::new(Vector3::new(0.2, -turn, 0.1), Vector3::new(turn, -turn, 0.5 * turn));
            let reprojection = Reprojection::new(&correspondences, &KITTI);
            let (mut sum, mut hessian, mut gradient) = (0.0, Matrix6::zeros(), Vector6::zeros());
            for Correspondence { pixel, point } in &correspondences {
                let Some(seen) = KITTI.project(&(pose * point)) else {
                    sum = f64::INFINITY;
                    continue;
                };
                let residual = seen - pixel;
                sum += loss.rho(residual.norm_squared());
                let weight = loss.weight(residual.norm_squared());
                let jacobian = jacobian(&pose, point);
                hessian += jacobian.transpose() * jacobian * weight;
                gradient += jacobian.transpose() * residual * weight;
            }
            let cost = reprojection.cost(&pose, loss);
            let expected = sum / correspondences.len() as f64;
            prop_assert!(
                cost == expected || (cost - expected).abs() < 1e-9 * expected
                    || (cost.is_nan() && correspondences.is_empty()),
                "{} {}", cost, expected
            );
            let normal = reprojection.normal_equations(&pose, loss);
            let off = (normal.hessian - hessian).amax();
            prop_assert!(off <= 1e-5 * hessian.amax(), "{} {}", normal.hessian, hessian);
            let off = (normal.gradient - gradient).amax();
            prop_assert!(off <= 1e-5 * gradient.amax(), "{} {}", normal.gradient, gradient);
        }
    }
}
