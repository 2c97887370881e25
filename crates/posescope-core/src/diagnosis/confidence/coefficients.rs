//! What was fitted to say how likely a pose is right and how far it may be off.
//!
//! `cargo run -p posescope-studies -- calibration --fit FILE --write` fits all of it, writes `fitted.json` beside this
//! file, and shows how well it holds on towns that it was not fitted on. `studies/README.md` says which numbers are of
//! which run.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use nalgebra::Vector6;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use crate::covariance::PoseCovariance;
use crate::method::Method;
use crate::scale::Scale;

/// What was fitted for the poses of one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// The signals, in the order of all numbers below.
    pub signals: Vec<String>,
    /// What signals were seen when the deviations were fitted, from the least to the greatest. There, one beyond counts
    /// as the outermost.
    pub seen: Vec<[f64; 2]>,
    /// Of the logistic function that says how likely a pose is near: the constant, then a weight for each signal.
    pub near: Vec<f64>,
    /// Of the logistic function that tells poses that are near from those of queries that do not show the place: the
    /// constant, then a weight for each signal.
    pub shown: Vec<f64>,
    /// What but one in two hundred poses that are near have at least of it.
    pub shown_from: f64,
    /// The natural logarithm of the standard deviation of each freedom, in the order of a [`PoseCovariance`]: a
    /// constant, the weight of its logarithm as the photo alone gives it, and a weight for each signal.
    pub deviations: [Vec<f64>; 6],
    /// How many times farther than those of a normal distribution 95 % of the errors go.
    pub tail: f64,
}

/// No freedom is more uncertain than that: rotation \[rad\], and position at the scale of the paper \[m\].
const MOST: [f64; 2] = [1.0, 20.0];

/// What was fitted, by method.
const NUMBERS: &str = include_str!("fitted.json");

/// What tells one fit from another.
pub fn fit() -> &'static str {
    static FIT: LazyLock<String> =
        LazyLock::new(|| format!("{:016x}", xxh3_64(NUMBERS.as_bytes())));
    &FIT
}

/// The fitted numbers of a method's poses; `None` for a method without.
pub fn fitted(method: Method) -> Option<&'static Fitted> {
    static FITTED: LazyLock<BTreeMap<String, Fitted>> =
        LazyLock::new(|| serde_json::from_str(NUMBERS).expect("a test reads it"));
    FITTED.get(method.name())
}

impl Fitted {
    /// The probability that a pose of these signals is near.
    pub fn probability(&self, signals: &[f64]) -> f64 {
        1.0 / (1.0 + (-weighted_sum(&self.near, signals)).exp())
    }

    /// The farthest search that was fitted to, at the scale of the paper \[m\].
    pub fn farthest(&self) -> Option<f64> {
        let at = self.signals.iter().position(|name| name == "radius")?;
        Some(self.seen.get(at)?[1].exp())
    }

    /// How likely a pose of these signals is near, beside one of a query that does not show the place.
    pub fn shown(&self, signals: &[f64]) -> f64 {
        1.0 / (1.0 + (-weighted_sum(&self.shown, signals)).exp())
    }

    /// The covariance of a pose of these signals, if it is near, from what the photo alone gives.
    pub fn covariance(
        &self,
        alone: &PoseCovariance,
        signals: &[f64],
        scale: Scale,
    ) -> PoseCovariance {
        let units = units(scale);
        let seen = signals.iter().zip(&self.seen);
        let signals: Vec<f64> =
            seen.map(|(value, [least, most])| value.clamp(*least, *most)).collect();
        let alone_deviations = alone.deviations().component_div(&units);
        let deviations = Vector6::from_fn(|freedom, _| {
            let weights = &self.deviations[freedom];
            let own = weights[1] * alone_deviations[freedom].ln();
            let rest: Vec<f64> = [&weights[..1], &weights[2..]].concat();
            (own + weighted_sum(&rest, &signals)).exp().min(MOST[freedom / 3])
        });
        alone.with_deviations(&deviations.component_mul(&units))
    }
}

/// The constant and the weighted sum of the signals.
fn weighted_sum(weights: &[f64], signals: &[f64]) -> f64 {
    let weighted = weights[1..].iter().zip(signals).map(|(weight, value)| weight * value);
    weights[0] + weighted.sum::<f64>()
}

/// What deviations are measured in: radians, and the length that stands for a metre.
pub fn units(scale: Scale) -> Vector6<f64> {
    let metre = scale.metre();
    Vector6::new(1.0, 1.0, 1.0, metre, metre, metre)
}
