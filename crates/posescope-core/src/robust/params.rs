//! MLESAC's parameters, and how many correspondences make a sample.

use crate::describe::parameters;
use crate::solver::{Loss, LossShape};

/// Correspondences in a sample: as many as the minimal solver takes.
pub const SAMPLE: usize = 3;

/// Correspondences without which there is no consensus: a sample and one that agrees with it.
pub const NEEDED: usize = SAMPLE + 1;

parameters! {
    /// Parameters of [`super::mlesac()`].
    ///
    /// The trials are capped at what 7 % true matches need. The others were tried on synthetic scenes
    /// with 1 px of noise and 10 to 70 % true matches out of 200 and 1,000: fewer than 100 trials at
    /// least (50) and more rounds of EM (8) change nothing that can be measured; for Gaussian noise
    /// the Huber loss at 1.5 px costs 2 % of accuracy against least squares, Cauchy at 2 px 5 %.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MlesacParams {
        /// MLESAC: σ, the noise of a true match along each image axis.
        pub sigma_px: f64 = 1.0 => number("sigma", "px", 0.05..=20.0),
        /// MLESAC: greatest reprojection error of an inlier.
        pub inlier_threshold_px: f64 = 3.0 => number("inlier", "px", 0.1..=50.0),
        /// MLESAC: required probability of drawing a sample without false matches.
        pub confidence: f64 = 0.999 => number("confidence", "", 0.5..=0.999_999),
        /// MLESAC: most trials.
        pub max_trials: usize = 20_000 => count("max_trials", "", 1..=10_000_000),
        /// MLESAC: fewest trials, limited by max_trials.
        pub min_trials: usize = 100 => count("min_trials", "", 1..=10_000_000),
        /// MLESAC: rounds of expectation–maximisation for the mixing weight of a hypothesis.
        pub em_iterations: usize = 3 => count("em_iterations", "", 1..=1000),
        /// MLESAC: whether a fourth correspondence chooses among the poses of a sample of three, as in the paper;
        /// otherwise the likelihood of all correspondences chooses.
        pub fourth: bool = false => flag("fourth"),
        /// MLESAC: whether a hypothesis that is better than all before is refined on its inliers.
        pub local: bool = true => flag("local"),
        /// Refinement: loss of a residual.
        pub loss: LossShape = LossShape::Huber => choice("loss"),
        /// Refinement: residual from which the loss grows more slowly than quadratically; not used by least
        /// squares.
        pub loss_scale_px: f64 = 1.5 => number("loss_scale", "px", 0.05..=50.0),
    }
}

impl MlesacParams {
    /// The loss of the refinement.
    pub fn loss(&self) -> Loss {
        self.loss.at(self.loss_scale_px)
    }
}
