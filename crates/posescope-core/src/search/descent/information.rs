//! The normalised information distance, descended by BFGS.

use std::convert::Infallible;

use basin::{Bfgs, CostFunction, Executor, FirstOrderState, Gradient, State as _, StepOutcome};

use super::view::Slope;
use super::{MIN_POINTS, Step, View};

/// A distance that changes by less from one step to the next is at its minimum.
const MIN_CHANGE: f64 = 1e-7;

/// NID = (H(Q,S) − I(Q;S)) / H(Q,S) of a joint histogram into which every pair of values falls smoothly:
/// a cubic B-spline spreads each value over four bins, so that the distance has derivatives.
pub(super) struct Distance<'a> {
    view: &'a View<'a>,
    /// Bins per axis: those between 0 and 255, and three that the kernel reaches beyond.
    bins: usize,
    /// Where the reference's values fall.
    fallen: Vec<Fallen>,
}

/// How a value is spread over four bins.
#[derive(Clone, Copy)]
struct Fallen {
    first: usize,
    weights: [f64; 4],
    /// How the weights change with the value.
    slopes: [f64; 4],
}

impl Fallen {
    fn new(value: f64, bins: usize) -> Self {
        let per_value = (bins - 3) as f64 / 256.0;
        let at = 1.0 + value.clamp(0.0, 255.0) * per_value;
        let (whole, t) = (at.floor(), at - at.floor());
        let (t2, t3) = (t * t, t * t * t);
        let rest = 1.0 - t;
        // Beyond both ends nothing changes any more.
        let per_value = if (0.0..=255.0).contains(&value) { per_value } else { 0.0 };
        Self {
            first: whole as usize - 1,
            weights: [
                rest * rest * rest / 6.0,
                (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0,
                (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0) / 6.0,
                t3 / 6.0,
            ],
            slopes: [-0.5 * rest * rest, 1.5 * t2 - 2.0 * t, -1.5 * t2 + t + 0.5, 0.5 * t2]
                .map(|slope| slope * per_value),
        }
    }
}

/// The smooth histogram of a pose.
struct Histogram {
    seen: Vec<Option<(Fallen, Slope)>>,
    points: f64,
    joint: Vec<f64>,
    query: Vec<f64>,
    synthetic: Vec<f64>,
}

/// −Σ p ln p \[nat\].
fn entropy(shares: &[f64]) -> f64 {
    let terms = shares.iter().filter(|&&share| share > 0.0);
    -terms.map(|share| share * share.ln()).sum::<f64>()
}

impl<'a> Distance<'a> {
    pub(super) fn new(view: &'a View<'a>, bins: usize) -> Self {
        let bins = bins + 3;
        let values = view.values.iter();
        Self { view, bins, fallen: values.map(|&value| Fallen::new(value, bins)).collect() }
    }

    fn histogram(&self, x: &[f64]) -> Option<Histogram> {
        let seen: Vec<_> = self
            .view
            .seen(x)
            .into_iter()
            .map(|seen| seen.map(|(value, slope)| (Fallen::new(value, self.bins), slope)))
            .collect();
        let points = seen.iter().flatten().count();
        if points < MIN_POINTS {
            return None;
        }
        let share = 1.0 / points as f64;
        let mut joint = vec![0.0; self.bins * self.bins];
        for (seen, own) in seen.iter().zip(&self.fallen) {
            let Some((query, _)) = seen else { continue };
            for (i, weight) in query.weights.iter().enumerate() {
                let row = (query.first + i) * self.bins + own.first;
                for (j, other) in own.weights.iter().enumerate() {
                    joint[row + j] += share * weight * other;
                }
            }
        }
        let (mut query, mut synthetic) = (vec![0.0; self.bins], vec![0.0; self.bins]);
        for (cell, &value) in joint.iter().enumerate() {
            query[cell / self.bins] += value;
            synthetic[cell % self.bins] += value;
        }
        Some(Histogram { seen, points: points as f64, joint, query, synthetic })
    }
}

impl CostFunction for Distance<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Infallible;

    /// 1, as of photos that have nothing in common, where too little is in view.
    fn cost(&self, x: &Vec<f64>) -> Result<f64, Infallible> {
        let Some(histogram) = self.histogram(x) else {
            return Ok(1.0);
        };
        let both = entropy(&histogram.joint);
        let single = entropy(&histogram.query) + entropy(&histogram.synthetic);
        Ok(if both > 1e-9 { 2.0 - single / both } else { 1.0 })
    }
}

impl Gradient for Distance<'_> {
    type Gradient = Vec<f64>;

    /// With H = −Σ p ln p and Σ dp = 0 is dH = −Σ ln p dp, for the joint entropy and for that of the query;
    /// the reference's does not change.
    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, Infallible> {
        let mut gradient = vec![0.0; 6];
        let Some(histogram) = self.histogram(x) else {
            return Ok(gradient);
        };
        let both = entropy(&histogram.joint);
        if both <= 1e-9 {
            return Ok(gradient);
        }
        let single = entropy(&histogram.query) + entropy(&histogram.synthetic);
        let ln = |share: f64| if share > 0.0 { share.ln() } else { 0.0 };
        let by_query: Vec<f64> = histogram.query.iter().map(|&share| ln(share) / both).collect();
        let by_joint = single / (both * both);
        for (seen, own) in histogram.seen.iter().zip(&self.fallen) {
            let Some((query, slope)) = seen else { continue };
            let mut by_value = 0.0;
            for (i, change) in query.slopes.iter().enumerate() {
                let bin = query.first + i;
                let row = bin * self.bins + own.first;
                let joint: f64 = own
                    .weights
                    .iter()
                    .enumerate()
                    .map(|(j, weight)| weight * ln(histogram.joint[row + j]))
                    .sum();
                by_value += change * (by_query[bin] - by_joint * joint);
            }
            for (total, slope) in gradient.iter_mut().zip(slope) {
                *total += by_value * slope / histogram.points;
            }
        }
        Ok(gradient)
    }
}

/// Descends from the start of a view, with `bins` per axis of the histogram, and passes every step to `tell`;
/// the last is where it ends.
///
/// # Errors
/// Those of `tell`.
pub fn descend<E>(
    view: &View<'_>,
    bins: usize,
    max_steps: usize,
    mut tell: impl FnMut(Step) -> Result<(), E>,
) -> Result<(), E> {
    let start = FirstOrderState::new(vec![0.0; 6]);
    let Ok(mut stepper) = Executor::new(Distance::new(view, bins), Bfgs::new(), start)
        .max_iter(max_steps as u64)
        .into_stepper();
    let mut before = f64::INFINITY;
    loop {
        let Ok(outcome) = stepper.step();
        let state = stepper.state();
        let cost = state.cost();
        if state.param().iter().all(|x| x.is_finite()) {
            tell(Step { camera_from_reference: view.camera_after(state.param()), cost })?;
        }
        if matches!(outcome, StepOutcome::Stopped(_)) || before - cost < MIN_CHANGE {
            return Ok(());
        }
        before = cost;
    }
}
