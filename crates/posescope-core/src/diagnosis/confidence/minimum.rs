//! What the lattices of a search say about its minimum.

use super::{Costs, Evidenced, gain_and_coverage, signed_log};
use crate::diagnosis::Evidence;
use crate::estimator::Outcome;
use crate::grid::Phase;

/// What a minimum among the hypotheses of its search says of its pose.
///
/// Depths are in robust standard deviations of the coarse costs, below their median. How far the pose is
/// from the reference is none of the signals: on the street right ones are near, by how its pairs are
/// drawn, and on real drives they are not.
pub(super) fn evidenced(outcome: &Outcome, evidence: &Evidence) -> Option<Evidenced> {
    let summary = outcome.cost.as_ref()?;
    // Without one there is nothing to judge.
    evidence.minimum?;
    let coarse = Costs::of(evidence.surface(Phase::PositionCoarse))?;
    let (depth, coarse_depth) = (coarse.depth(summary.best), coarse.depth(coarse.least));
    let start_depth = summary.initial.map_or(0.0, |cost| coarse.depth(cost));
    let yaws = Costs::of(evidence.surface(Phase::YawCoarse));
    let yaw_depth = yaws.map_or(0.0, |yaws| yaws.depth(yaws.least));
    let above = |runner_up: f64| (runner_up - coarse.least) / coarse.deviation;
    let runner_up_margin = summary.runner_up.map(above);
    let mut signals = vec![
        ("depth", signed_log(depth)),
        ("refined_by", signed_log(depth - coarse_depth)),
        ("margin", signed_log(runner_up_margin.unwrap_or(coarse_depth))),
        ("above_start", signed_log(depth - start_depth)),
    ];
    signals.extend(gain_and_coverage(summary));
    signals.push(("yaw_depth", signed_log(yaw_depth)));
    let chance_level = summary.shuffled;
    Some(Evidenced { signals, alone: None, inlier_spread: None, runner_up_margin, chance_level })
}
