//! The fitted coefficients of each method's probability.
//!
//! `cargo run --release --example calibration` fits them, prints them in this form and shows how well
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
const FITTED: &[(&str, &[f64])] = &[];
