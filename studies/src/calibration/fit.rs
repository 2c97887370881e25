//! Fits probabilities and intervals to poses whose errors are known.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3, Vector6};
use posescope::covariance::PoseCovariance;
use posescope::diagnosis::confidence::{Fitted, units};
use posescope::scale::Scale;
use xxhash_rust::xxh3::xxh3_64;

use super::trials::{REAL_STREETS, Sample};
use crate::numbers::{mean, percentile};

/// What a query that does not show its place counts beside one that does: there are more of them than anybody would
/// ask.
const NOTHING_COUNTS: f64 = 0.5;

/// What is added to the squares of the slopes, so that separable samples have a fit.
const RIDGE: f64 = 1.0;

/// The share of samples whose signal is farther out than what is kept as seen, at each end.
const UNSEEN: f64 = 0.005;

/// The natural logarithm of the size of a number of the standard normal distribution, on average.
const LN_SIZE: f64 = -0.635_181_4;

/// The share of near poses that N1 wrongly accuses.
const ACCUSED: f64 = 0.002;

/// Smaller errors are not told apart.
const LEAST_ERROR: f64 = 1e-5;

/// Below this, 90 % of the squares of a normally distributed vector in space are.
const NINETY_OF_THREE: f64 = 6.251;

/// What is fitted to the samples of one method; `None` where there are too few.
pub fn fitted(samples: &[&Sample]) -> Option<Fitted> {
    let signals = samples.first()?.names.clone();
    let range = |k: usize| {
        let mut values: Vec<f64> = samples.iter().map(|s| s.values[k]).collect();
        [percentile(&mut values, UNSEEN), percentile(&mut values, 1.0 - UNSEEN)]
    };
    let seen: Vec<[f64; 2]> = (0..signals.len()).map(range).collect();
    let clamped = |sample: &Sample| -> Vec<f64> {
        let values = sample.values.iter().zip(&seen);
        values.map(|(value, [least, most])| value.clamp(*least, *most)).collect()
    };
    let rows: Vec<Vec<f64>> = samples.iter().map(|s| s.values.clone()).collect();
    let labels: Vec<f64> = samples.iter().map(|s| f64::from(u8::from(s.is_near()))).collect();
    let counts: Vec<f64> =
        samples.iter().map(|s| if s.shown.is_nothing() { NOTHING_COUNTS } else { 1.0 }).collect();
    let near = Design::of(&rows).logistic(&labels, &counts)?;
    let shown = told_apart(samples)?;
    let shown_from = shown_from(samples)?;

    let usable: Vec<(&Sample, [f64; 6], Vec<f64>)> = samples
        .iter()
        .filter(|s| s.is_near())
        .filter_map(|s| {
            let alone = s.alone?.deviations().component_div(&units(scale_of(s)));
            Some((*s, s.error?, alone.map(f64::ln).iter().copied().collect()))
        })
        .collect();
    let deviations = |is_one: &dyn Fn(&Sample) -> bool| -> Option<[Vec<f64>; 6]> {
        let own: Vec<_> = usable.iter().filter(|(sample, ..)| is_one(sample)).collect();
        let deviation = |freedom: usize| {
            let row = |(sample, _, alone): &&(&Sample, [f64; 6], Vec<f64>)| {
                [&[alone[freedom]], clamped(sample).as_slice()].concat()
            };
            let rows: Vec<Vec<f64>> = own.iter().map(row).collect();
            let size = |error: &[f64; 6]| error[freedom].abs().max(LEAST_ERROR).ln() - LN_SIZE;
            let sizes: Vec<f64> = own.iter().map(|(_, error, _)| size(error)).collect();
            Design::of(&rows).linear(&sizes)
        };
        (0..6).map(deviation).collect::<Option<Vec<_>>>()?.try_into().ok()
    };
    let all = deviations(&|_| true)?;
    let mut fitted =
        Fitted { signals, seen: seen.clone(), near, shown, shown_from, deviations: all, tail: 1.0 };

    // Places that were not fitted to say how much wider errors go.
    let mut by_others = Vec::new();
    for fold in 0..FOLDS {
        let deviations = deviations(&|sample| fold_of(sample) != fold)?;
        let others = Fitted { deviations, ..fitted.clone() };
        let own = usable.iter().filter(|(sample, ..)| fold_of(sample) == fold);
        by_others.extend(own.map(|(sample, ..)| (others.clone(), *sample)));
    }
    // So that 90 % of the errors of rotation and of position are within the ellipsoids that say so.
    for first in [0, 3] {
        let mut squares: Vec<f64> =
            by_others.iter().map(|(others, sample)| square(others, sample, first)).collect();
        let factor = (percentile(&mut squares, 0.9) / NINETY_OF_THREE).sqrt();
        for one in by_others.iter_mut().map(|(others, _)| others).chain([&mut fitted]) {
            for weights in &mut one.deviations[first..first + 3] {
                weights[0] += factor.ln();
            }
        }
    }
    let mut ratios: Vec<f64> =
        by_others.iter().flat_map(|(others, sample)| beyond(others, sample)).collect();
    fitted.tail = percentile(&mut ratios, 0.95);
    Some(fitted)
}

/// The same fit with the signals of another one. Those that it did not know decide nothing.
pub fn with_signals(fitted: &Fitted, other: &Fitted) -> Fitted {
    let known = |name: &String| fitted.signals.iter().position(|own| own == name);
    // A constant, and what else comes before the signals.
    let weights = |own: &[f64], before: usize| -> Vec<f64> {
        let of_signals =
            other.signals.iter().map(|name| known(name).map_or(0.0, |k| own[before + k]));
        own[..before].iter().copied().chain(of_signals).collect()
    };
    let seen = other.signals.iter().zip(&other.seen);
    Fitted {
        signals: other.signals.clone(),
        seen: seen.map(|(name, seen)| known(name).map_or(*seen, |k| fitted.seen[k])).collect(),
        near: weights(&fitted.near, 1),
        shown: weights(&fitted.shown, 1),
        deviations: fitted.deviations.each_ref().map(|own| weights(own, 2)),
        ..*fitted
    }
}

/// Parts of the places; each is judged by what is fitted to the others.
const FOLDS: u64 = 6;

/// The part that the place of a sample belongs to.
fn fold_of(sample: &Sample) -> u64 {
    xxh3_64(format!("{}/{}", sample.of, sample.pair[0]).as_bytes()) % FOLDS
}

/// What all but [`ACCUSED`] of the poses that are near have of the function that tells them from those of queries that do
/// not show the place, where it is fitted to other places.
fn shown_from(samples: &[&Sample]) -> Option<f64> {
    let mut near = Vec::new();
    for fold in 0..FOLDS {
        let (own, others): (Vec<&Sample>, Vec<&Sample>) =
            samples.iter().copied().partition(|sample| fold_of(sample) == fold);
        let weights = told_apart(&others)?;
        let own = own.into_iter().filter(|sample| sample.is_near());
        near.extend(own.map(|sample| {
            let weighted = weights[1..].iter().zip(&sample.values).map(|(w, value)| w * value);
            1.0 / (1.0 + (-weights[0] - weighted.sum::<f64>()).exp())
        }));
    }
    Some(percentile(&mut near, ACCUSED))
}

/// The logistic function that tells poses that are near from those of queries that do not show the place.
fn told_apart(samples: &[&Sample]) -> Option<Vec<f64>> {
    let known: Vec<&&Sample> =
        samples.iter().filter(|s| s.is_near() || s.shown.is_nothing()).collect();
    let rows: Vec<Vec<f64>> = known.iter().map(|s| s.values.clone()).collect();
    let labels: Vec<f64> = known.iter().map(|s| f64::from(u8::from(s.is_near()))).collect();
    Design::of(&rows).logistic(&labels, &vec![1.0; known.len()])
}

/// The scale of the scene of a sample.
fn scale_of(sample: &Sample) -> Scale {
    if sample.metre == 1.0 { Scale::PAPER } else { Scale::of_depth(10.0 * sample.metre, true) }
}

/// How far registered poses of real photos are off, as their data say: a standard deviation of rotation \[rad\] and one of
/// position \[m\] for each axis. An error of a pose that is measured against them has that error, too.
const OF_TRUTH: [f64; 2] = [0.000_52, 0.02];

/// The covariance of the errors of a sample: that of its pose, with that of the truth it is measured against.
fn of_errors(fitted: &Fitted, sample: &Sample, alone: &PoseCovariance) -> Option<PoseCovariance> {
    let own = fitted.covariance(alone, &sample.values, scale_of(sample));
    if sample.of != REAL_STREETS {
        return Some(own);
    }
    let [turn, shift] = OF_TRUTH.map(|deviation| deviation * deviation);
    let of_truth = Vector6::new(turn, turn, turn, shift, shift, shift);
    PoseCovariance::new(own.matrix() + Matrix6::from_diagonal(&of_truth))
}

/// The square of the error of rotation (from 0) or position (from 3) in units of its covariance; none without one.
pub fn square(fitted: &Fitted, sample: &Sample, first: usize) -> f64 {
    let Some((alone, error)) = sample.alone.as_ref().zip(sample.error) else {
        return f64::NAN;
    };
    let scale = scale_of(sample);
    let Some(covariance) = of_errors(fitted, sample, alone) else {
        return f64::NAN;
    };
    let own: Matrix3<f64> = covariance.matrix().fixed_view::<3, 3>(first, first).into_owned();
    let error = Vector6::from(error).component_mul(&units(scale));
    let error: Vector3<f64> = error.fixed_rows::<3>(first).into_owned();
    own.cholesky().map_or(f64::NAN, |factor| error.dot(&factor.solve(&error)))
}

/// How many times farther the position and the rotation are off than 95 % would be.
pub fn beyond(fitted: &Fitted, sample: &Sample) -> [f64; 2] {
    let Some((alone, error)) = sample.alone.as_ref().zip(sample.error) else {
        return [f64::NAN; 2];
    };
    let scale = scale_of(sample);
    let Some(spread) = of_errors(fitted, sample, alone) else {
        return [f64::NAN; 2];
    };
    let within = spread.scaled(fitted.tail).holding(0.95);
    let error = Vector6::from(error).component_mul(&units(scale));
    let angle = error.fixed_rows::<3>(0).norm().to_degrees();
    [error.fixed_rows::<3>(3).norm() / within.translation_m, angle / within.rotation_deg]
}

/// Rows of signals, standardised, with a constant before them.
struct Design {
    means: Vec<f64>,
    deviations: Vec<f64>,
    matrix: DMatrix<f64>,
}

impl Design {
    fn of(rows: &[Vec<f64>]) -> Self {
        let columns = rows.first().map_or(0, Vec::len);
        let column = |k: usize| rows.iter().map(move |row| row[k]);
        let means: Vec<f64> = (0..columns).map(|k| mean(column(k))).collect();
        let variance = |k: usize| mean(column(k).map(|v| (v - means[k]).powi(2)));
        let deviations: Vec<f64> = (0..columns).map(|k| variance(k).sqrt().max(1e-9)).collect();
        let matrix = DMatrix::from_fn(rows.len(), columns + 1, |row, k| match k {
            0 => 1.0,
            _ => (rows[row][k - 1] - means[k - 1]) / deviations[k - 1],
        });
        Self { means, deviations, matrix }
    }

    /// Logistic regression by iteratively reweighted least squares, with a ridge, so that signals that tell little
    /// keep small weights. The constant first.
    fn logistic(&self, labels: &[f64], counts: &[f64]) -> Option<Vec<f64>> {
        let (labels, counts) = (DVector::from_row_slice(labels), DVector::from_row_slice(counts));
        let mut weights = DVector::zeros(self.matrix.ncols());
        for _ in 0..50 {
            let predicted = (&self.matrix * &weights).map(|x: f64| 1.0 / (1.0 + (-x).exp()));
            let spread = predicted.map(|p| (p * (1.0 - p)).max(1e-6)).component_mul(&counts);
            let gradient = self.matrix.transpose() * (&labels - &predicted).component_mul(&counts);
            let step = self.ridge_step(&spread, gradient, &weights)?;
            weights += &step;
            if step.amax() < 1e-9 {
                break;
            }
        }
        Some(self.of_signals(&weights))
    }

    /// Linear regression with a ridge. The constant first.
    fn linear(&self, values: &[f64]) -> Option<Vec<f64>> {
        let ones = DVector::from_element(values.len(), 1.0);
        let gradient = self.matrix.transpose() * DVector::from_row_slice(values);
        let weights = self.ridge_step(&ones, gradient, &DVector::zeros(self.matrix.ncols()))?;
        Some(self.of_signals(&weights))
    }

    fn ridge_step(
        &self,
        spread: &DVector<f64>,
        mut gradient: DVector<f64>,
        weights: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let mut weighted = self.matrix.clone();
        for (mut row, by) in weighted.row_iter_mut().zip(spread.iter()) {
            row *= *by;
        }
        let mut hessian = self.matrix.transpose() * weighted;
        for k in 1..weights.len() {
            hessian[(k, k)] += RIDGE;
            gradient[k] -= RIDGE * weights[k];
        }
        Some(hessian.cholesky()?.solve(&gradient))
    }

    /// The weights of signals that are not standardised.
    fn of_signals(&self, weights: &DVector<f64>) -> Vec<f64> {
        let slopes: Vec<f64> =
            self.deviations.iter().enumerate().map(|(k, d)| weights[k + 1] / d).collect();
        let shift: f64 = slopes.iter().zip(&self.means).map(|(slope, mean)| slope * mean).sum();
        std::iter::once(weights[0] - shift).chain(slopes).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::trials::Shown;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64;

    /// Signals that have nothing to do with the errors, as many as make a fit to 150 poses follow their chance.
    const SIGNALS: usize = 25;

    /// Poses whose errors are as their covariance says, and one in three of a query that does not show its place.
    fn samples(count: usize, seed: u64) -> Vec<Sample> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut normal = move || {
            let (radius, angle): (f64, f64) = (rng.random(), rng.random());
            (-2.0 * (1.0 - radius).ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
        };
        let deviations = [0.004, 0.004, 0.004, 0.06, 0.06, 0.06];
        let alone = Matrix6::from_diagonal(&Vector6::from(deviations.map(|d| d * d)));
        let sample = |place: usize| Sample {
            method: "fb".to_owned(),
            of: "town".to_owned(),
            pair: [place, 0],
            shown: if place.is_multiple_of(3) { Shown::Town } else { Shown::Same },
            fault: None,
            radius_m: 10.0,
            metre: 1.0,
            error: (!place.is_multiple_of(3))
                .then(|| deviations.map(|deviation| deviation * normal())),
            alone: PoseCovariance::new(alone),
            names: (0..SIGNALS).map(|k| k.to_string()).collect(),
            values: (0..SIGNALS).map(|_| normal()).collect(),
            stated: None,
            named: false,
        };
        (0..count).map(sample).collect()
    }

    #[test]
    fn intervals_hold_poses_that_were_not_fitted_although_they_follow_chance() {
        let own = samples(225, 1);
        let fitted = fitted(&own.iter().collect::<Vec<_>>()).expect("enough");
        let others = samples(3000, 2);
        let near: Vec<&Sample> = others.iter().filter(|sample| sample.is_near()).collect();
        assert_eq!(near.len(), 2000);
        for first in [0, 3] {
            let held = near.iter().filter(|s| square(&fitted, s, first) <= NINETY_OF_THREE).count();
            assert!(
                (0.86..=0.96).contains(&(held as f64 / 2000.0)),
                "from {first}: {held} of 2000"
            );
        }
    }

    #[test]
    fn a_signal_that_was_not_known_decides_nothing() {
        let own = samples(225, 5);
        let fitted = fitted(&own.iter().collect::<Vec<_>>()).expect("enough");
        let mut other = fitted.clone();
        other.signals.insert(3, "light".to_owned());
        other.seen.insert(3, [-4.0, 0.0]);
        let same = with_signals(&fitted, &other);
        for sample in &own[..20] {
            let values = [&sample.values[..3], &[-2.5], &sample.values[3..]].concat();
            assert_eq!(same.probability(&values), fitted.probability(&sample.values));
            assert_eq!(same.shown(&values), fitted.shown(&sample.values));
            let alone = sample.alone.expect("known");
            let covariance = same.covariance(&alone, &values, Scale::PAPER);
            assert_eq!(covariance, fitted.covariance(&alone, &sample.values, Scale::PAPER));
        }
    }

    #[test]
    fn few_right_poses_that_were_not_fitted_are_accused_of_showing_another_place() {
        let own = samples(225, 3);
        let fitted = fitted(&own.iter().collect::<Vec<_>>()).expect("enough");
        let others = samples(3000, 4);
        let near = others.iter().filter(|sample| sample.is_near());
        let accused = near.filter(|s| fitted.shown(&s.values) < fitted.shown_from).count();
        assert!(accused < 60, "{accused} of 2000");
    }
}
