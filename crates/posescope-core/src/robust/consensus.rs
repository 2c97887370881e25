//! The trials and the outcome of MLESAC.

use serde::Serialize;

use super::likelihood::LikelihoodScore;
use super::params::SAMPLE;
use crate::geometry::Pose;
use crate::solver::Refinement;

/// A pose and how well it explains the correspondences.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Hypothesis {
    /// `camera_from_points`.
    #[serde(skip)]
    pub pose: Pose,
    /// Its likelihood, mixing and number of inliers.
    #[serde(flatten)]
    pub score: LikelihoodScore,
}

/// One random sample, passed to the observer of [`super::mlesac()`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Trial {
    /// Number of the trial, from 0.
    #[serde(rename = "trial")]
    pub index: usize,
    /// The correspondences drawn.
    pub sample: [usize; SAMPLE],
    /// The likeliest pose of the sample, before any refinement; `None` where there is no solution.
    pub hypothesis: Option<Hypothesis>,
    /// Whether the hypothesis is likelier than all before.
    pub is_best: bool,
    /// The best so far, refined.
    pub best: Option<Hypothesis>,
    /// Trials that the inliers of the best so far ask for.
    pub trials_needed: usize,
}

/// The outcome of [`super::mlesac()`]. All of it belongs to the one refined pose.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Consensus {
    /// `camera_from_points`.
    pub pose: Pose,
    /// Correspondences within the inlier threshold, ascending.
    pub inliers: Vec<usize>,
    /// Reprojection error of every correspondence; infinite behind the camera \[px\].
    pub residuals_px: Vec<f64>,
    /// Logarithm of the likelihood of the residuals, each a density per px².
    pub log_likelihood: f64,
    /// γ, the estimated share of true matches.
    pub mixing: f64,
    /// Samples drawn.
    pub trials: usize,
    /// The refinement that ended at the pose; `None` where refining did not make the pose of the
    /// sample likelier.
    pub refinement: Option<Refinement>,
}

/// Why there is no consensus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MlesacError<C> {
    /// Fewer correspondences than a sample and one to confirm it.
    #[error("{found} correspondences found, {needed} needed")]
    TooFewCorrespondences {
        /// Correspondences given.
        found: usize,
        /// Correspondences needed.
        needed: usize,
    },
    /// No pose is confirmed by a correspondence beyond its sample.
    #[error("no model after {trials} trials, at best {best_inliers} inliers")]
    NoModel {
        /// Samples drawn.
        trials: usize,
        /// Most inliers of the best pose.
        best_inliers: usize,
    },
    /// The observer asked to stop.
    #[error("cancelled")]
    Cancelled(C),
}
