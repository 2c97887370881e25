//! What the inliers of a consensus say about its pose, and both photos with them.

use super::Evidenced;
use super::appearance::{self, Look};
use crate::covariance::PoseCovariance;
use crate::diagnosis::Subject;
use crate::estimator::Family;
use crate::features::FeatureState;
use crate::solver::{Correspondence, pose_covariance};
use crate::stats::median;

/// What the inliers say of their pose.
///
/// How far the pose is from the reference is none of the signals: on the street right poses are near, by
/// how its pairs are drawn, and on real drives they are not.
pub(super) fn evidenced(subject: &Subject<'_>, look: Look) -> Option<Evidenced> {
    let &Subject { problem, params, evidence, .. } = subject;
    let features = evidence.query.as_ref()?;
    let states = evidence.states.as_ref()?;
    let lifted = evidence.rematched.as_ref().or(evidence.lifted.as_ref())?;
    let refined = evidence.refined.as_ref()?;
    let mut residuals = Vec::new();
    let mut inliers = Vec::new();
    for lifted in lifted.iter() {
        if let (Some(FeatureState::Inlier { residual_px }), Some(point)) =
            (states.get(lifted.query), lifted.point)
        {
            let pixel = features.keypoints.get(lifted.query)?.pixel();
            inliers.push(Correspondence { pixel, point });
            residuals.push(*residual_px);
        }
    }
    let correspondences = lifted.iter().filter(|one| one.point.is_some()).count();
    let intrinsics = &problem.query.intrinsics;
    let (width, height) = (f64::from(intrinsics.width), f64::from(intrinsics.height));
    let spread = root_mean_square_distance(&inliers) / width.hypot(height);
    let mlesac = match Family::of(subject.method, params) {
        Some(Family::Guided) => params.fb2.mlesac,
        _ => params.fb.mlesac,
    };
    let median_residual_px = median(&mut residuals).unwrap_or(mlesac.inlier_threshold_px);
    // A residual is of two axes; the median of a Rayleigh distribution is 1.177 σ. A perfect fit of
    // few points is no proof of perfect pixels.
    let sigma_px = (median_residual_px / 1.177).max(0.3);
    let camera_from_reference = refined.reference_from_query.inverse();
    let alone = pose_covariance(&inliers, intrinsics, &camera_from_reference, sigma_px)
        .and_then(PoseCovariance::new);
    let deviation_m = alone.map_or(f64::INFINITY, |known| known.of_position().trace().sqrt());
    let deviation = (deviation_m / params.scale.metre()).clamp(1e-4, 1e3);
    let log10_nfa = evidence.judged.as_ref().map(|judged| judged.acceptance.log10_nfa);
    let mut signals = vec![
        ("inliers", (inliers.len() as f64).ln_1p()),
        ("inlier_share", inliers.len() as f64 / correspondences.max(1) as f64),
        ("beyond_chance", (-log10_nfa.unwrap_or(0.0)).max(0.0).ln_1p()),
        ("spread", spread),
        ("deviation", deviation.ln()),
        ("residual", median_residual_px),
    ];
    signals.extend(appearance::signals(problem, params, &refined.reference_from_query, look));
    Some(Evidenced {
        signals,
        alone,
        inlier_spread: Some(spread),
        runner_up_margin: None,
        chance_level: log10_nfa,
    })
}

/// Root mean square distance of the inliers from their centre \[px\].
fn root_mean_square_distance(inliers: &[Correspondence]) -> f64 {
    let count = inliers.len().max(1) as f64;
    let sum = inliers.iter().fold(nalgebra::Vector2::zeros(), |sum, c| sum + c.pixel.coords);
    let centre = sum / count;
    let squared: f64 = inliers.iter().map(|c| (c.pixel.coords - centre).norm_squared()).sum();
    (squared / count).sqrt()
}
