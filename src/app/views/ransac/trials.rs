//! The support of the trials as curves, with no more points than a plot can show.

use crate::event::{Event, HypothesisTried};
use crate::robust::Trial;
use crate::trace::Record;

/// A curve keeps the lowest and the highest point of each of so many stretches.
const STRETCHES: usize = 400;

/// The trials up to the cursor.
#[derive(Default)]
pub(super) struct Trials {
    /// The support of some hypotheses: `[trial, inliers]`.
    pub(super) support: Vec<[f64; 2]>,
    /// That of the best so far, refined, as steps.
    pub(super) best_support: Vec<[f64; 2]>,
    /// Samples for which the solver had no pose.
    pub(super) without_pose: usize,
    /// The best trial: that whose hypothesis was refined last.
    pub(super) best: Option<Trial>,
    last: Option<Trial>,
    /// The record of each trial.
    records: Vec<usize>,
}

impl Trials {
    /// The trials among records, the first of which is at `start` in its run.
    pub(super) fn read(records: &[Record], start: usize) -> Self {
        let mut all = Self::default();
        let mut support = Vec::new();
        for (at, record) in records.iter().enumerate() {
            let Event::HypothesisTried(HypothesisTried { trial }) = &record.event else {
                continue;
            };
            let x = trial.index as f64;
            match &trial.hypothesis {
                Some(hypothesis) => support.push([x, hypothesis.score.inliers as f64]),
                None => all.without_pose += 1,
            }
            if trial.is_best {
                all.best = Some(*trial);
                if let Some(best) = &trial.best {
                    step(&mut all.best_support, x, best.score.inliers as f64);
                }
            }
            all.records.push(start + at);
            all.last = Some(*trial);
        }
        if let (Some(last), Some(&[_, value])) = (&all.last, all.best_support.last()) {
            all.best_support.push([last.index as f64, value]);
        }
        all.support = thinned(&support);
        all
    }

    /// Trials made.
    pub(super) fn made(&self) -> usize {
        self.records.len()
    }

    /// Trials needed by the best so far.
    pub(super) fn needed(&self) -> Option<usize> {
        Some(self.last.as_ref()?.trials_needed)
    }

    /// The latest trial at the cursor.
    pub(super) fn at_cursor(&self) -> Option<&Trial> {
        self.last.as_ref()
    }

    /// The record of the trial whose point is nearest by `distance`.
    pub(super) fn nearest(&self, distance: impl Fn([f64; 2]) -> f32) -> Option<usize> {
        let points = self.support.iter();
        let nearest = points.min_by(|a, b| distance(**a).total_cmp(&distance(**b)))?;
        self.records.get(nearest[0] as usize).copied()
    }
}

/// A value that holds from here on.
fn step(curve: &mut Vec<[f64; 2]>, x: f64, value: f64) {
    if let Some(&[_, before]) = curve.last() {
        curve.push([x, before]);
    }
    curve.push([x, value]);
}

/// The least and the greatest of each stretch of the points, in the points' order.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    if points.len() <= 2 * STRETCHES {
        return points.to_vec();
    }
    let length = points.len().div_ceil(STRETCHES);
    let ends = points.chunks(length).flat_map(|stretch| {
        let by_value = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let ends = [stretch.iter().min_by(by_value), stretch.iter().max_by(by_value)];
        let mut ends: Vec<[f64; 2]> = ends.into_iter().flatten().copied().collect();
        ends.sort_by(|a, b| a[0].total_cmp(&b[0]));
        ends.dedup();
        ends
    });
    ends.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_step_keeps_the_value_before_it_up_to_where_it_is() {
        let mut curve = Vec::new();
        step(&mut curve, 0.0, 5.0);
        step(&mut curve, 3.0, 7.0);
        assert_eq!(curve, [[0.0, 5.0], [3.0, 5.0], [3.0, 7.0]]);
    }

    proptest! {
        #[test]
        fn thinning_keeps_the_extremes_and_the_order(
            values in prop::collection::vec(-1e3..1e3, 1..5000)
        ) {
            let points: Vec<[f64; 2]> = values
                .iter()
                .enumerate()
                .map(|(x, &y)| [x as f64, y])
                .collect();
            let thin = thinned(&points);
            prop_assert!(thin.len() <= 2 * STRETCHES);
            prop_assert!(thin.iter().all(|point| points[point[0] as usize] == *point));
            prop_assert!(thin.windows(2).all(|pair| pair[0][0] < pair[1][0]));
            let greatest = |points: &[[f64; 2]]| points.iter().map(|p| p[1]).fold(f64::MIN, f64::max);
            let least = |points: &[[f64; 2]]| points.iter().map(|p| p[1]).fold(f64::MAX, f64::min);
            prop_assert_eq!(greatest(&thin), greatest(&points));
            prop_assert_eq!(least(&thin), least(&points));
        }
    }
}
