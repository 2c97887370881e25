//! What the inliers of a consensus say about its pose, and both photos with them.

use nalgebra::Matrix6;

use super::Signals;
use super::appearance::{Appearance, Look};
use crate::diagnosis::Evidence;
use crate::features::FeatureState;
use crate::params::Params;
use crate::problem::Problem;
use crate::solver::{Correspondence, pose_covariance};
use crate::stats::median;

/// What a probability is made of.
const NAMES: &[&str] = &[
    "inliers",
    "inlier_share",
    "beyond_chance",
    "spread",
    "deviation",
    "residual",
    "seen_depth",
    "seen_margin",
    "seen_rise",
    "seen_rise_farther",
    "seen_above_start",
    "seen_gain",
];

/// What inliers say.
pub(super) struct Inliers {
    count: usize,
    correspondences: usize,
    /// Root mean square distance from their centre, as a share of the image's diagonal.
    pub(super) spread: f64,
    median_residual_px: f64,
    /// Of rotation and position, along the camera's axes.
    pub(super) covariance: Option<Matrix6<f64>>,
    /// What the photos show at the pose.
    appearance: Appearance,
}

impl Inliers {
    pub(super) fn of(
        problem: &Problem,
        params: &Params,
        evidence: &Evidence,
        look: Look,
    ) -> Option<Self> {
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
        let intrinsics = &problem.query.intrinsics;
        let (width, height) = (f64::from(intrinsics.width), f64::from(intrinsics.height));
        let threshold = params.fb.mlesac.inlier_threshold_px;
        let median_residual_px = median(&mut residuals).unwrap_or(threshold);
        // A residual is of two axes; the median of a Rayleigh distribution is 1.177 σ. A perfect fit of
        // few points is no proof of perfect pixels.
        let sigma_px = (median_residual_px / 1.177).max(0.3);
        let camera_from_reference = refined.reference_from_query.inverse();
        Some(Self {
            count: inliers.len(),
            correspondences: lifted.iter().filter(|one| one.point.is_some()).count(),
            spread: root_mean_square_distance(&inliers) / width.hypot(height),
            median_residual_px,
            covariance: pose_covariance(&inliers, intrinsics, &camera_from_reference, sigma_px),
            appearance: Appearance::of(problem, params, &refined.reference_from_query, look),
        })
    }

    /// How far the pose is from the reference is none of them: on the street right poses are near, by how its
    /// pairs are drawn, and on real drives they are not.
    pub(super) fn signals(&self, evidence: &Evidence) -> Signals {
        let log10_nfa = evidence.judged.as_ref().map_or(0.0, |judged| judged.acceptance.log10_nfa);
        let deviation_m = self
            .covariance
            .map_or(1e3, |c| (c[(3, 3)] + c[(4, 4)] + c[(5, 5)]).sqrt().clamp(1e-4, 1e3));
        let mut values = vec![
            (self.count as f64).ln_1p(),
            self.count as f64 / self.correspondences.max(1) as f64,
            (-log10_nfa).max(0.0).ln_1p(),
            self.spread,
            deviation_m.ln(),
            self.median_residual_px,
        ];
        values.extend(self.appearance.signals());
        Signals { names: NAMES, values }
    }
}

fn root_mean_square_distance(inliers: &[Correspondence]) -> f64 {
    let count = inliers.len().max(1) as f64;
    let sum = inliers.iter().fold(nalgebra::Vector2::zeros(), |sum, c| sum + c.pixel.coords);
    let centre = sum / count;
    let squared: f64 = inliers.iter().map(|c| (c.pixel.coords - centre).norm_squared()).sum();
    (squared / count).sqrt()
}
