//! What MLESAC is told: its parameters, and how many correspondences make a sample.

use serde::{Deserialize, Serialize};

use crate::memo::bits_of_fields;
use crate::solver::Loss;

/// Correspondences in a sample: as many as the minimal solver takes.
pub const SAMPLE: usize = 3;

/// Correspondences without which there is no consensus: a sample and one that agrees with it.
pub const NEEDED: usize = SAMPLE + 1;

/// Parameters of [`super::mlesac()`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MlesacParams {
    /// σ, the noise of a true match per image axis \[px\].
    pub sigma_px: f64,
    /// Greatest reprojection error of an inlier \[px\].
    pub inlier_threshold_px: f64,
    /// Probability with which a sample without false matches is to be drawn.
    pub confidence: f64,
    /// Trials at most.
    pub max_trials: usize,
    /// Trials at least.
    pub min_trials: usize,
    /// Rounds of expectation–maximisation for the mixing of one hypothesis.
    pub em_iterations: usize,
    /// Loss of the refinement.
    pub loss: Loss,
}

bits_of_fields!(MlesacParams {
    sigma_px,
    inlier_threshold_px,
    confidence,
    max_trials,
    min_trials,
    em_iterations,
    loss,
});

/// The trials are capped at what 7 % true matches need. The others were tried on synthetic scenes
/// with 1 px of noise and 10 to 70 % true matches out of 200 and 1,000: fewer than 100 trials at
/// least (50) and more rounds of EM (8) change nothing that can be measured; for Gaussian noise
/// the Huber loss at 1.5 px costs 2 % of accuracy against least squares, Cauchy at 2 px 5 %.
impl Default for MlesacParams {
    fn default() -> Self {
        Self {
            sigma_px: 1.0,
            inlier_threshold_px: 3.0,
            confidence: 0.999,
            max_trials: 20_000,
            min_trials: 100,
            em_iterations: 3,
            loss: Loss::Huber(1.5),
        }
    }
}
