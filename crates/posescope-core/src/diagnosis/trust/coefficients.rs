//! The fitted coefficients of each method's probability.
//!
//! `cargo run -p posescope-diagnosis --bin calibration` fits them, prints them in this form and shows how well
//! they hold on conditions that they were not fitted on.

use super::Signals;
use crate::method::Method;

/// The probability that a pose of these signals is within a metre; `None` for a method without
/// coefficients.
pub(super) fn probability(method: Method, signals: &Signals) -> Option<f64> {
    let (_, coefficients) = FITTED.iter().find(|(name, _)| *name == method.name())?;
    let (constant, weights) = coefficients.split_first()?;
    let sum: f64 = weights
        .iter()
        .zip(&signals.values)
        .map(|(w, v)| w * v)
        .sum();
    Some(1.0 / (1.0 + (-(constant + sum)).exp()))
}

/// By method: the constant, then one weight per signal in their order.
#[rustfmt::skip]
const FITTED: &[(&str, &[f64])] = &[
    // constant, inliers, inlier_share, beyond_chance, spread, deviation, residual, distance
    ("fb", &[-4.6589, 0.2906, 7.7375, 0.4399, 4.6002, -0.3532, -0.7431, 2.1287]),
    // constant, depth, refined_by, margin, above_start, gain, coverage, yaw_depth, distance
    ("mi", &[-5.9960, 0.8675, 0.4243, 0.6716, -0.6377, 5.0349, -1.3214, 3.4759, -3.4659]),
    ("nid", &[-9.7684, 0.9469, 0.2323, 0.8798, 0.8574, -7.0172, -0.5573, 3.0585, -2.3108]),
    ("pm", &[-12.6126, 4.6086, -2.5037, -0.1926, -2.6316, 7.8038, -0.8361, 3.8227, -0.8331]),
];
