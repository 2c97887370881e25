//! The fitted coefficients of each method's probability.
//!
//! `cargo run -p posescope-studies -- calibration` fits them, prints them in this form and shows how well
//! they hold on conditions that they were not fitted on.

use crate::method::Method;

/// The probability that a pose of these signals, in their order, is within a metre; `None` for a method
/// without coefficients.
pub fn probability(method: Method, signals: &[f64]) -> Option<f64> {
    let (_, coefficients) = FITTED.iter().find(|(name, _)| *name == method.name())?;
    let (constant, weights) = coefficients.split_first()?;
    let sum: f64 = weights.iter().zip(signals).map(|(w, v)| w * v).sum();
    Some(1.0 / (1.0 + (-(constant + sum)).exp()))
}

/// By method: the constant, then one weight per signal in their order.
#[rustfmt::skip]
const FITTED: &[(&str, &[f64])] = &[
    // constant, inliers, inlier_share, beyond_chance, spread, deviation, residual,
    // seen_depth, seen_margin, seen_rise, seen_rise_farther, seen_above_start, seen_gain
    ("fb", &[1.5666, -0.0583, 2.2681, 0.1688, 10.4057, 0.5639, -1.1226, 0.4405, 0.4729, 0.1839, 0.4326, 0.2974, 1.0304]),
    ("fb2", &[-10.5208, 1.9956, 7.6333, -0.1726, -0.2390, -0.1165, 0.4882, 0.0244, 0.3044, 0.0078, 0.1357, 0.8271, 0.0258]),
    // constant, depth, refined_by, margin, above_start, gain, coverage, yaw_depth
    ("mi", &[-6.6958, 0.5146, 0.3756, 1.1216, -0.2002, 4.2765, 0.7650, 3.3455]),
    ("pm", &[-13.2549, 4.9114, -7.2906, 0.9337, -2.1627, 7.7036, -0.3163, 4.0411]),
    // constant, depth, margin, above_start, gain, coverage, gathered
    ("mi6", &[-8.0405, 1.2557, 0.6542, 1.2628, 4.2296, 0.7023, 6.4612]),
    // constant, depth, margin, above_start, gain, coverage, gathered, support, against
    ("robust", &[-5.9610, 0.7129, 0.4500, 0.9737, 1.6127, 0.1653, 6.6869, 1.6426, 0.1989]),
];
