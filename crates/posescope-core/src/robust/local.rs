//! Local optimisation: from the pose of three points to the pose of all that agree with it.

use super::consensus::Hypothesis;
use super::likelihood::Likelihood;
use super::params::MlesacParams;
use crate::camera::Intrinsics;
use crate::geometry::Pose;
use crate::solver::{Correspondence, Refinement, refine};

/// Refinements of one hypothesis at most, each on the inliers of the one before. The likelihood
/// must rise each time, so there is no going round in circles.
const MAX_ROUNDS: usize = 10;

/// A hypothesis after [`locally_optimized`].
#[derive(Clone, Copy)]
pub(super) struct LocalOptimum {
    pub(super) hypothesis: Hypothesis,
    /// The refinement that ended at its pose.
    pub(super) refinement: Option<Refinement>,
}

/// Refines a hypothesis on its inliers, and again on the inliers of the refined pose, for as long
/// as the likelihood of all correspondences rises. Calls `look` before each.
pub(super) fn locally_optimized<E>(
    hypothesis: Hypothesis,
    (correspondences, intrinsics, params): (&[Correspondence], &Intrinsics, &MlesacParams),
    likelihood: &mut Likelihood,
    mut look: impl FnMut() -> Result<(), E>,
) -> Result<LocalOptimum, E> {
    let mut optimum = LocalOptimum { hypothesis, refinement: None };
    for _ in 0..MAX_ROUNDS {
        look()?;
        let Hypothesis { pose, score: old } = optimum.hypothesis;
        let residuals_px = residuals(correspondences, intrinsics, &pose);
        let agreeing: Vec<_> = inliers(&residuals_px, params.inlier_threshold_px)
            .map(|i| correspondences[i])
            .collect();
        let refinement = refine(&agreeing, intrinsics, &pose, params.loss());
        let new = likelihood.score(&refinement.pose);
        if new.log_likelihood > old.log_likelihood {
            optimum.hypothesis = Hypothesis { pose: refinement.pose, score: new };
            optimum.refinement = Some(refinement);
        } else {
            break;
        }
    }
    Ok(optimum)
}

/// Reprojection error of every correspondence; infinite behind the camera \[px\].
pub(crate) fn residuals(
    correspondences: &[Correspondence],
    intrinsics: &Intrinsics,
    pose: &Pose,
) -> Vec<f64> {
    correspondences
        .iter()
        .map(|Correspondence { pixel, point }| {
            intrinsics.project(&(pose * point)).map_or(f64::INFINITY, |seen| (seen - pixel).norm())
        })
        .collect()
}

/// Indices of the residuals within the threshold, ascending.
pub(super) fn inliers(residuals_px: &[f64], threshold_px: f64) -> impl Iterator<Item = usize> {
    (0..residuals_px.len()).filter(move |&i| residuals_px[i] <= threshold_px)
}
