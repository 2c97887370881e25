//! Reprojection errors of many correspondences, with their derivatives by the pose, several side by side.

use fearless_simd::{Level, dispatch};
use nalgebra::{Matrix6, Vector6};

use super::Correspondence;
use super::loss::Loss;
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// Correspondences in a block, so that the compiler handles several at a time. Sums are made lane by lane,
/// whatever the processor, so that they round alike on all of them.
const LANES: usize = 8;

/// One number of each correspondence of a block.
type Lanes = [f64; LANES];

/// [`LANES`] correspondences, one array per coordinate. The last block is filled up with its last one, which
/// does not count again.
struct Block {
    point: [Lanes; 3],
    pixel: [Lanes; 2],
    /// How many of them count.
    count: usize,
}

/// The part of a twist \[rad, then m\] that each axis of a pixel depends on: neither moves with a shift along
/// the other.
const MOVES_U: [usize; 5] = [0, 1, 2, 3, 5];
const MOVES_V: [usize; 5] = [0, 1, 2, 4, 5];

/// Entries of the lower triangle of a 5 × 5 matrix.
const ENTRIES: usize = 15;

/// `H ξ = −g` for the twist ξ, with `H = Σ w JᵀJ` and `g = Σ w Jᵀr`.
pub(super) struct NormalEquations {
    pub(super) hessian: Matrix6<f64>,
    pub(super) gradient: Vector6<f64>,
}

/// The correspondences of a refinement and the camera that sees them.
pub(super) struct Reprojection {
    level: Level,
    intrinsics: Intrinsics,
    blocks: Vec<Block>,
    count: usize,
}

impl Block {
    fn new(correspondences: &[Correspondence]) -> Self {
        let at = |lane: usize| &correspondences[lane.min(correspondences.len() - 1)];
        let point = |axis: usize| std::array::from_fn(|lane| at(lane).point[axis]);
        let pixel = |axis: usize| std::array::from_fn(|lane| at(lane).pixel[axis]);
        Self {
            point: std::array::from_fn(point),
            pixel: std::array::from_fn(pixel),
            count: correspondences.len(),
        }
    }

    /// The points in the camera's frame.
    #[inline(always)]
    fn seen(&self, Motion { rotation, shift }: &Motion) -> [Lanes; 3] {
        let [x, y, z] = &self.point;
        let mut seen = [[0.0; LANES]; 3];
        for (axis, seen) in seen.iter_mut().enumerate() {
            let [by_x, by_y, by_z] = rotation[axis];
            for i in 0..LANES {
                seen[i] = by_x * x[i] + by_y * y[i] + by_z * z[i] + shift[axis];
            }
        }
        seen
    }
}

/// A pose as it is put to use.
struct Motion {
    /// Row by row.
    rotation: [[f64; 3]; 3],
    shift: [f64; 3],
}

impl Motion {
    fn of(pose: &Pose) -> Self {
        let rotation = pose.rotation.to_rotation_matrix();
        let row = |row| std::array::from_fn(|column| rotation[(row, column)]);
        Self { rotation: [row(0), row(1), row(2)], shift: pose.translation.vector.into() }
    }
}

/// A block as it is seen: the residuals \[px\], the points' places in the normalised image plane, their inverse
/// depths \[1/m\], and whether they are in front of the camera.
struct Seen {
    residual: [Lanes; 2],
    plane: [Lanes; 2],
    inverse_depth: Lanes,
    is_in_front: [bool; LANES],
}

impl Reprojection {
    pub(super) fn new(correspondences: &[Correspondence], intrinsics: &Intrinsics) -> Self {
        Self {
            level: Level::new(),
            intrinsics: *intrinsics,
            blocks: correspondences.chunks(LANES).map(Block::new).collect(),
            count: correspondences.len(),
        }
    }

    /// Mean loss \[px²\] of a pose `camera_from_points`; infinite where a point is not in front of the camera,
    /// no number without points.
    pub(super) fn cost(&self, pose: &Pose, loss: Loss) -> f64 {
        let motion = Motion::of(pose);
        dispatch!(self.level, _simd => self.sum_of_losses(&motion, loss)) / self.count as f64
    }

    #[inline(always)]
    fn sum_of_losses(&self, motion: &Motion, loss: Loss) -> f64 {
        let mut sums = [0.0; LANES];
        for block in &self.blocks {
            let seen = self.see(block, motion);
            let [u, v] = &seen.residual;
            let mut losses = [0.0; LANES];
            for i in 0..LANES {
                losses[i] = if seen.is_in_front[i] {
                    loss.rho(u[i] * u[i] + v[i] * v[i])
                } else {
                    f64::INFINITY
                };
            }
            for i in 0..block.count {
                sums[i] += losses[i];
            }
        }
        sums.iter().sum()
    }

    #[inline(always)]
    fn see(&self, block: &Block, motion: &Motion) -> Seen {
        let Intrinsics { fx, fy, cx, cy, .. } = self.intrinsics;
        let [x, y, z] = block.seen(motion);
        let [u, v] = &block.pixel;
        let mut seen = Seen {
            residual: [[0.0; LANES]; 2],
            plane: [[0.0; LANES]; 2],
            inverse_depth: [0.0; LANES],
            is_in_front: [false; LANES],
        };
        for i in 0..LANES {
            let inverse_depth = z[i].recip();
            let (across, down) = (x[i] * inverse_depth, y[i] * inverse_depth);
            seen.inverse_depth[i] = inverse_depth;
            seen.plane[0][i] = across;
            seen.plane[1][i] = down;
            seen.residual[0][i] = fx * across + cx - u[i];
            seen.residual[1][i] = fy * down + cy - v[i];
            seen.is_in_front[i] = z[i] > 0.0;
        }
        seen
    }

    /// The normal equations at a pose; points that are not in front of the camera are left out.
    pub(super) fn normal_equations(&self, pose: &Pose, loss: Loss) -> NormalEquations {
        let motion = Motion::of(pose);
        dispatch!(self.level, _simd => self.summed(&motion, loss))
    }

    #[inline(always)]
    fn summed(&self, motion: &Motion, loss: Loss) -> NormalEquations {
        // Of u and of v.
        let mut squares = [[[0.0; LANES]; ENTRIES]; 2];
        let mut slopes = [[[0.0; LANES]; 5]; 2];
        for block in &self.blocks {
            let seen = self.see(block, motion);
            let [u, v] = &seen.residual;
            let mut weights = [0.0; LANES];
            for i in 0..LANES {
                weights[i] = loss.weight(u[i] * u[i] + v[i] * v[i]);
            }
            let mut derivatives = self.derivatives(&seen);
            let mut residual = seen.residual;
            for i in 0..LANES {
                // What does not count may not even be a number.
                if i >= block.count || !seen.is_in_front[i] {
                    weights[i] = 0.0;
                    for axis in 0..2 {
                        residual[axis][i] = 0.0;
                        derivatives[axis].iter_mut().for_each(|by| by[i] = 0.0);
                    }
                }
            }
            for axis in 0..2 {
                add(
                    &mut squares[axis],
                    &mut slopes[axis],
                    &derivatives[axis],
                    &residual[axis],
                    &weights,
                );
            }
        }
        let mut normal = NormalEquations { hessian: Matrix6::zeros(), gradient: Vector6::zeros() };
        for (axis, moves) in [MOVES_U, MOVES_V].into_iter().enumerate() {
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

    /// Derivatives of both axes of a pixel by what moves them, of a twist in the camera frame \[px/rad, px/m\].
    ///
    /// The twist moves a point p by `ω × p + v`, and `∂π/∂p = [f/z, −f p/z²]` per image axis.
    #[inline(always)]
    fn derivatives(&self, seen: &Seen) -> [[Lanes; 5]; 2] {
        let Intrinsics { fx, fy, .. } = self.intrinsics;
        let [x, y] = &seen.plane;
        let mut by = [[[0.0; LANES]; 5]; 2];
        let [of_u, of_v] = &mut by;
        for i in 0..LANES {
            let inverse_depth = seen.inverse_depth[i];
            of_u[0][i] = -fx * (x[i] * y[i]);
            of_u[1][i] = fx * (1.0 + x[i] * x[i]);
            of_u[2][i] = -fx * y[i];
            of_u[3][i] = fx * inverse_depth;
            of_u[4][i] = -fx * (x[i] * inverse_depth);
            of_v[0][i] = -fy * (1.0 + y[i] * y[i]);
            of_v[1][i] = fy * (x[i] * y[i]);
            of_v[2][i] = fy * x[i];
            of_v[3][i] = fy * inverse_depth;
            of_v[4][i] = -fy * (y[i] * inverse_depth);
        }
        by
    }
}

/// Adds what an axis of the pixels of a block says: `w JᵀJ`, entry by entry, and `w Jᵀr`.
#[inline(always)]
fn add(
    squares: &mut [Lanes; ENTRIES],
    slopes: &mut [Lanes; 5],
    derivatives: &[Lanes; 5],
    residual: &Lanes,
    weights: &Lanes,
) {
    let mut entry = 0;
    for at in 0..5 {
        let mut weighted = [0.0; LANES];
        for i in 0..LANES {
            weighted[i] = derivatives[at][i] * weights[i];
        }
        for i in 0..LANES {
            slopes[at][i] += weighted[i] * residual[i];
        }
        for other in &derivatives[..=at] {
            for i in 0..LANES {
                squares[entry][i] += weighted[i] * other[i];
            }
            entry += 1;
        }
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
            let baseline = Reprojection { level: Level::baseline(), ..reprojection };
            prop_assert_eq!(baseline.cost(&pose, loss).to_bits(), cost.to_bits());
            let same = baseline.normal_equations(&pose, loss);
            prop_assert_eq!((same.hessian, same.gradient), (normal.hessian, normal.gradient));
        }
    }
}
