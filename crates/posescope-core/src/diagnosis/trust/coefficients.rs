//! The fitted coefficients of each method's probability.
//!
//! `cargo run -p posescope-diagnosis --bin calibration` fits them, prints them in this form and shows how well
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
    // constant, inliers, inlier_share, beyond_chance, spread, deviation, residual, distance
    ("fb", &[-4.6589, 0.2906, 7.7375, 0.4399, 4.6002, -0.3532, -0.7431, 2.1287]),
    // constant, inliers, inlier_share, beyond_chance, spread, deviation, residual
    ("fb2", &[-4.2539, 1.0520, -2.5614, 0.7270, -1.7487, -0.4098, -0.0080]),
    // constant, depth, refined_by, margin, above_start, gain, coverage, yaw_depth
    ("mi", &[-6.6958, 0.5146, 0.3756, 1.1216, -0.2002, 4.2765, 0.7650, 3.3455]),
    ("nid", &[-10.1176, 0.6680, -0.4161, 0.9769, 1.4828, 0.2423, 1.1824, 3.1252]),
    ("pm", &[-13.2549, 4.9114, -7.2906, 0.9337, -2.1627, 7.7036, -0.3163, 4.0411]),
    // constant, depth, margin, above_start, gain, coverage, gathered
    ("mi6", &[-6.7476, 1.0142, 1.3853, 0.9549, 1.9337, 1.3260, 26.3874]),
    // constant, depth, margin, above_start, gain, coverage, gathered, support, against
    ("robust", &[-5.1971, 0.7059, 1.3180, 0.3647, 0.8251, 0.4883, 23.8075, 1.9803, -0.1500]),
];
