//! Non-linear refinement of a pose: Levenberg–Marquardt on the reprojection error.

use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector6};

use super::Correspondence;
use super::loss::Loss;
use super::reprojection::{NormalEquations, Reprojection};
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// Steps tried, taken or not, before the refinement gives up. From the pose of a three-point
/// sample with 1 px of noise, five or six are usual.
const MAX_STEPS: usize = 30;

/// First damping factor. The start is close: nearly a Gauss–Newton step.
const FIRST_LAMBDA: f64 = 1e-4;

/// The damping at which not even a tiny step downhill lowers the cost.
const MAX_LAMBDA: f64 = 1e10;

/// A step that lowers the cost by less than this fraction is the last.
const MIN_DECREASE: f64 = 1e-9;

/// Why the refinement ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// The last step lowered the cost by a negligible fraction.
    Converged,
    /// No step lowers the cost: a minimum to working precision, or a plateau.
    NoDecrease,
    /// The limit of steps was reached.
    StepLimit,
    /// No cost at the start: a point behind the camera or a number that is not finite.
    Unusable,
}

/// The outcome of [`refine`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Refinement {
    /// The refined pose `camera_from_points`.
    pub pose: Pose,
    /// Mean loss at the start \[px²\].
    pub cost_before: f64,
    /// Mean loss at [`Self::pose`] \[px²\], never above the one before.
    pub cost_after: f64,
    /// Steps tried.
    pub steps: usize,
    /// Why it ended.
    pub termination: Termination,
}

/// Minimises the mean of `loss(|π(T X) − x|²)` over the pose `T = camera_from_points`, from `start`.
///
/// Levenberg–Marquardt with the damping on the diagonal of the normal equations (Marquardt 1963)
/// and the loss as weights (see [`Loss`]). A step must keep all points in front of the camera. A
/// pose that the points do not determine (fewer than three, or on a line) stays near its start
/// along what is left open.
pub fn refine(
    correspondences: &[Correspondence],
    intrinsics: &Intrinsics,
    start: &Pose,
    loss: Loss,
) -> Refinement {
    let reprojection = Reprojection::new(correspondences, intrinsics);
    let cost_before = reprojection.cost(start, loss);
    let mut refinement = Refinement {
        pose: *start,
        cost_before,
        cost_after: cost_before,
        steps: 0,
        termination: Termination::StepLimit,
    };
    if !cost_before.is_finite() {
        refinement.termination = Termination::Unusable;
        return refinement;
    }
    let mut lambda = FIRST_LAMBDA;
    let mut normal = reprojection.normal_equations(start, loss);
    while refinement.steps < MAX_STEPS {
        refinement.steps += 1;
        let (old, mut new) = (refinement.cost_after, f64::NAN);
        if let Some(twist) = damped_step(&normal, lambda) {
            let pose = moved(&refinement.pose, &twist);
            new = reprojection.cost(&pose, loss);
            // NaN loses.
            if new < old {
                refinement.pose = pose;
                refinement.cost_after = new;
            }
        }
        if new < old {
            if old - new < MIN_DECREASE * old {
                refinement.termination = Termination::Converged;
                break;
            }
            lambda *= 0.1;
            normal = reprojection.normal_equations(&refinement.pose, loss);
        } else if lambda < MAX_LAMBDA {
            lambda *= 10.0;
        } else {
            refinement.termination = Termination::NoDecrease;
            break;
        }
    }
    refinement
}

/// Covariance of the twist \[rad², m²\], rotation first, by which the pose may be off, if pixels are off
/// by `sigma_px` along each axis: σ² (Σ JᵀJ)⁻¹. `None` where the correspondences do not fix the pose.
pub fn pose_covariance(
    correspondences: &[Correspondence],
    intrinsics: &Intrinsics,
    pose: &Pose,
    sigma_px: f64,
) -> Option<Matrix6<f64>> {
    let reprojection = Reprojection::new(correspondences, intrinsics);
    let normal = reprojection.normal_equations(pose, Loss::Squared);
    let inverse = normal.hessian.cholesky()?.inverse() * (sigma_px * sigma_px);
    inverse.iter().all(|entry| entry.is_finite()).then_some(inverse)
}

/// The pose after a twist in the camera frame: rotation \[rad\] first, translation \[m\] second.
pub(super) fn moved(pose: &Pose, twist: &Vector6<f64>) -> Pose {
    let rotation = UnitQuaternion::from_scaled_axis(twist.fixed_rows::<3>(0).into_owned());
    let translation = Translation3::from(twist.fixed_rows::<3>(3).into_owned());
    Pose::from_parts(translation, rotation) * pose
}

/// The step for a damping factor; `None` where the damped matrix is not positive definite.
fn damped_step(normal: &NormalEquations, lambda: f64) -> Option<Vector6<f64>> {
    let damping = Matrix6::from_diagonal(&(normal.hessian.diagonal() * lambda));
    let factor = (normal.hessian + damping).cholesky()?;
    Some(-factor.solve(&normal.gradient))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::KITTI;
    use nalgebra::{Point2, Point3, Vector2, Vector3};

    fn truth() -> Pose {
        Pose::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.1, -0.2, 0.05))
    }

    /// Six points in front of the camera, seen without noise from [`truth`].
    fn scene() -> Vec<Correspondence> {
        [
            (-3.0, -1.0, 8.0),
            (2.0, 1.0, 6.0),
            (4.0, -2.0, 15.0),
            (-5.0, 1.5, 20.0),
            (0.5, 0.5, 5.0),
            (1.0, -1.0, 30.0),
        ]
        .map(|(x, y, z)| {
            let point = Point3::new(x, y, z);
            let pixel = KITTI.project(&(truth() * point)).expect("in front");
            Correspondence { pixel, point }
        })
        .to_vec()
    }

    fn start() -> Pose {
        moved(&truth(), &Vector6::new(0.02, -0.03, 0.01, 0.3, -0.2, 0.4))
    }

    #[test]
    fn the_gradient_of_each_loss_matches_central_differences_of_the_cost() {
        // Residuals of tens of pixels: beyond the kink of the Huber loss.
        let scene = scene();
        for loss in [Loss::Squared, Loss::Huber(1.5), Loss::Cauchy(20.0)] {
            let reprojection = Reprojection::new(&scene, &KITTI);
            let normal = reprojection.normal_equations(&start(), loss);
            for k in 0..6 {
                let step = Vector6::ith(k, 1e-6);
                let at = |twist| reprojection.cost(&moved(&start(), &twist), loss);
                // The cost is the mean of ρ(r²) with the derivative 2 w Jᵀr.
                let numeric = (at(step) - at(-step)) / 2e-6 * scene.len() as f64 / 2.0;
                let error = (numeric - normal.gradient[k]).abs();
                assert!(error < 1e-5 * normal.gradient.amax(), "{loss:?} {k}: {error}");
            }
        }
    }

    #[test]
    fn exact_pixels_lead_back_to_the_truth() {
        for loss in [Loss::Squared, Loss::Huber(1.5), Loss::Cauchy(2.0)] {
            let refined = refine(&scene(), &KITTI, &start(), loss);
            assert!(refined.cost_after < 1e-12, "{refined:?}");
            let error = refined.pose.inverse() * truth();
            assert!(error.translation.vector.norm() < 1e-6, "{loss:?}: {refined:?}");
            assert!(refined.cost_after < refined.cost_before);
        }
    }

    #[test]
    fn a_robust_loss_shrugs_off_a_false_match_that_least_squares_believes() {
        let mut scene = scene();
        scene[3].pixel += Vector2::new(60.0, -40.0);
        let error = |loss| {
            let pose = refine(&scene, &KITTI, &truth(), loss).pose;
            (pose.inverse().translation.vector - truth().inverse().translation.vector).norm()
        };
        assert!(error(Loss::Cauchy(1.0)) < 0.01);
        assert!(error(Loss::Squared) > 0.1);
    }

    #[test]
    fn a_point_behind_the_camera_or_a_nan_makes_the_start_unusable() {
        let behind = Correspondence {
            pixel: Point2::new(600.0, 180.0),
            point: Point3::new(0.0, 0.0, -50.0),
        };
        let nan = Correspondence { pixel: Point2::new(f64::NAN, 0.0), ..scene()[0] };
        for bad in [behind, nan] {
            let mut scene = scene();
            scene.push(bad);
            let refined = refine(&scene, &KITTI, &start(), Loss::Squared);
            assert_eq!(refined.termination, Termination::Unusable);
            assert_eq!(refined.pose, start());
        }
        let nothing = refine(&[], &KITTI, &start(), Loss::Squared);
        assert_eq!(nothing.termination, Termination::Unusable);
    }

    #[test]
    fn points_that_leave_the_pose_open_do_not_upset_it() {
        let on_a_line: Vec<_> = (0..10)
            .map(|i| {
                let point = Point3::new(0.0, 0.0, 5.0 + f64::from(i));
                let pixel = KITTI.project(&(truth() * point)).expect("in front");
                Correspondence { pixel, point }
            })
            .collect();
        for subset in [&on_a_line[..], &scene()[..1], &scene()[..2]] {
            let refined = refine(subset, &KITTI, &start(), Loss::Huber(1.5));
            assert!(refined.pose.to_homogeneous().iter().all(|entry| entry.is_finite()));
            assert!(refined.cost_after <= refined.cost_before);
        }
    }
}
