//! Refinement of a pose together with the focal length of the camera.

use nalgebra::{SMatrix, SVector};

use super::Correspondence;
use super::loss::Loss;
use super::refine::moved;
use super::reprojection::Reprojection;
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// Steps tried, taken or not.
const MAX_STEPS: usize = 12;

/// First damping factor. The start may be far away.
const FIRST_LAMBDA: f64 = 1e-3;

/// A step that lowers the cost by less than this fraction is the last.
const MIN_DECREASE: f64 = 1e-4;

/// Focal lengths beyond these factors are those of no other camera.
const ZOOMS: std::ops::RangeInclusive<f64> = 0.3..=3.0;

/// A pose, and what the focal lengths of the stated camera are multiplied by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Zoomed {
    /// `camera_from_points`.
    pub pose: Pose,
    pub zoom: f64,
}

impl Zoomed {
    /// The stated camera with these focal lengths.
    pub fn camera(&self, stated: &Intrinsics) -> Intrinsics {
        Intrinsics { fx: self.zoom * stated.fx, fy: self.zoom * stated.fy, ..*stated }
    }

    /// How many correspondences are within so many pixels.
    pub fn explains(
        &self,
        correspondences: &[Correspondence],
        stated: &Intrinsics,
        threshold_px: f64,
    ) -> usize {
        let camera = self.camera(stated);
        let is_explained = |one: &&Correspondence| {
            let seen = camera.project(&(self.pose * one.point));
            seen.is_some_and(|seen| (seen - one.pixel).norm() <= threshold_px)
        };
        correspondences.iter().filter(is_explained).count()
    }
}

/// Minimises the mean of `loss` over the pose and the logarithm of the focal lengths, from `start`.
///
/// Levenberg–Marquardt, as [`refine`](super::refine()). Correspondences may be false, so points that come to lie behind
/// the camera are as far off as the photo is large.
pub(crate) fn refine_zoomed(
    correspondences: &[Correspondence],
    stated: &Intrinsics,
    start: Zoomed,
    loss: Loss,
) -> Zoomed {
    let of = |zoomed: &Zoomed| Reprojection::new(correspondences, &zoomed.camera(stated));
    let cost = |zoomed: &Zoomed| of(zoomed).cost_of_seen(&zoomed.pose, loss);
    let (mut best, mut least) = (start, cost(&start));
    let mut lambda = FIRST_LAMBDA;
    let mut normal = of(&best).zoom_equations(&best.pose, loss);
    for _ in 0..MAX_STEPS {
        let (hessian, gradient) = &normal;
        let damping = SMatrix::<f64, 7, 7>::from_diagonal(&(hessian.diagonal() * lambda));
        let step = (hessian + damping).cholesky().map(|factor| -factor.solve(gradient));
        let next = step.map(|step: SVector<f64, 7>| Zoomed {
            pose: moved(&best.pose, &step.fixed_rows::<6>(0).into_owned()),
            zoom: best.zoom * step[6].exp(),
        });
        let next = next.filter(|next| ZOOMS.contains(&next.zoom));
        match next.map(|next| (next, cost(&next))).filter(|(_, new)| *new < least) {
            Some((next, new)) => {
                let is_last = least - new < MIN_DECREASE * least;
                (best, least) = (next, new);
                if is_last {
                    break;
                }
                lambda *= 0.1;
                normal = of(&best).zoom_equations(&best.pose, loss);
            }
            None => lambda *= 10.0,
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector2, Vector3, Vector6};

    use super::*;
    use crate::solver::KITTI;

    fn truth() -> Zoomed {
        let pose = Pose::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.02, -0.05, 0.01));
        Zoomed { pose, zoom: 1.25 }
    }

    /// Points at many depths, seen without noise, each seventh somewhere else.
    fn scene() -> Vec<Correspondence> {
        let point = |k: u32| {
            let (x, y) = (f64::from(k * 37 % 100), f64::from(k * 53 % 40));
            Point3::new(0.2 * x - 10.0, 0.1 * y - 2.0, 6.0 + f64::from(k * 29 % 25))
        };
        let camera = truth().camera(&KITTI);
        let seen = (0..80).filter_map(|k| {
            let point = point(k);
            let mut pixel = camera.project(&(truth().pose * point))?;
            if k % 7 == 0 {
                pixel += Vector2::new(150.0, f64::from(k) - 40.0);
            }
            Some(Correspondence { pixel, point })
        });
        seen.collect()
    }

    #[test]
    fn the_gradient_is_that_of_central_differences() {
        let scene = scene();
        let start = Zoomed { zoom: 1.1, ..truth() };
        let loss = Loss::Cauchy(20.0);
        let cost = |pose: &Pose, zoom: f64| {
            let camera = Zoomed { pose: *pose, zoom }.camera(&KITTI);
            Reprojection::new(&scene, &camera).cost_of_seen(pose, loss)
        };
        let reprojection = Reprojection::new(&scene, &start.camera(&KITTI));
        let (_, gradient) = reprojection.zoom_equations(&start.pose, loss);
        for k in 0..7 {
            let at = |by: f64| match k {
                6 => cost(&start.pose, start.zoom * by.exp()),
                _ => cost(&moved(&start.pose, &Vector6::ith(k, by)), start.zoom),
            };
            let numeric = (at(1e-6) - at(-1e-6)) / 2e-6 * scene.len() as f64 / 2.0;
            assert!((numeric - gradient[k]).abs() < 1e-5 * gradient.amax(), "{k}: {numeric}");
        }
    }

    #[test]
    fn the_focal_length_is_found_with_the_pose_among_false_matches() {
        let scene = scene();
        let true_ones = scene.iter().enumerate().filter(|(k, _)| k % 7 != 0).count();
        let mut found = Zoomed { zoom: 1.0, ..truth() };
        assert!(found.explains(&scene, &KITTI, 3.0) < true_ones / 2);
        for scale in [20.0, 3.0, 3.0] {
            found = refine_zoomed(&scene, &KITTI, found, Loss::Cauchy(scale));
        }
        assert!((found.zoom - 1.25).abs() < 0.01, "{found:?}");
        assert!(found.explains(&scene, &KITTI, 3.0) >= true_ones, "{found:?}");
        let nothing = refine_zoomed(&[], &KITTI, truth(), Loss::Squared);
        assert_eq!(nothing, truth());
    }
}
