//! What the lattices of a search say about its minimum.

use super::{Costs, PoseConfidence, Signals, gain_and_coverage, signed_log};
use crate::diagnosis::Evidence;
use crate::estimator::Outcome;
use crate::grid::{Phase, ScoredLattice};

/// The signals of a minimum among the hypotheses of its search, and what else is known of its pose.
///
/// Depths are in robust standard deviations of the coarse costs, below their median. How far the pose is
/// from the reference is none of the signals: on the street right ones are near, by how its pairs are
/// drawn, and on real drives they are not.
pub(super) fn signals(outcome: &Outcome, evidence: &Evidence) -> Option<(Signals, PoseConfidence)> {
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
    let deviations = deviations(evidence, coarse.deviation);
    let confidence = PoseConfidence {
        position_std_m: deviations.map(|[right, forward, _]| [right, 0.0, forward]),
        rotation_std_deg: deviations.map(|[.., yaw]| [0.0, yaw.to_degrees(), 0.0]),
        runner_up_margin,
        chance_level: summary.shuffled,
        ..PoseConfidence::new(f64::NAN)
    };
    Some((signals, confidence))
}

/// Standard deviations of right and forward \[m\] and yaw \[rad\]: how far one has to go from the minimum
/// until the cost has risen by as much as coarse costs differ anyway, by the parabola through the minimum
/// and its neighbours on the fine lattices.
fn deviations(evidence: &Evidence, coarse_deviation: f64) -> Option<[f64; 3]> {
    let position = evidence.surface(Phase::PositionFine)?;
    let yaw = evidence.surface(Phase::YawFine)?;
    let along = |surface: &ScoredLattice, step: usize| -> Option<f64> {
        let cell = surface.minimum()?;
        let cost = |cell: usize| surface.scores.get(cell).copied()??.cost;
        let (before, after) = (cost(cell.checked_sub(step)?)?, cost(cell + step)?);
        let curvature = (before + after - 2.0 * cost(cell)?) / surface.lattice.step.powi(2);
        (curvature > 0.0).then(|| (2.0 * coarse_deviation / curvature).sqrt())
    };
    Some([along(position, 1)?, along(position, position.lattice.columns)?, along(yaw, 1)?])
}
