//! What the lattices of a search say about its minimum.

use super::{Signals, eligible_costs, tamed};
use crate::diagnosis::Evidence;
use crate::estimator::Outcome;
use crate::grid::{Phase, ScoredLattice};
use crate::stats::median_and_deviation;

/// A minimum among the hypotheses of its search.
pub(super) struct Minimum {
    /// In robust standard deviations of the coarse costs, below their median.
    depth: f64,
    /// The same of the coarse minimum.
    coarse_depth: f64,
    /// The same of the reference pose.
    start_depth: f64,
    /// How much deeper than the runner-up, in the same unit; `None` where there is none.
    pub(super) runner_up_margin: Option<f64>,
    /// Share of the cost of shuffled pixels that is saved.
    gain: f64,
    /// Covered pixels over those covered at the reference pose.
    coverage: f64,
    /// Depth of the yaw that was chosen among the others, as above.
    yaw_depth: f64,
    /// The standard deviation that all this is measured in.
    deviation: f64,
}

impl Minimum {
    pub(super) fn of(outcome: &Outcome, evidence: &Evidence) -> Option<Self> {
        let summary = outcome.cost.as_ref()?;
        // Without one there is nothing to judge.
        evidence.minimum?;
        let coarse = evidence.surface(Phase::PositionCoarse)?;
        let mut costs = eligible_costs(coarse);
        let coarse_best = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let (centre, deviation) = median_and_deviation(&mut costs)?;
        let depth = |cost: f64| (centre - cost) / deviation;
        let yaw_surface = evidence.surface(Phase::YawCoarse);
        let yaw_depth = yaw_surface.and_then(|surface| {
            let mut costs = eligible_costs(surface);
            let best = costs.iter().copied().fold(f64::INFINITY, f64::min);
            let (centre, deviation) = median_and_deviation(&mut costs)?;
            Some((centre - best) / deviation)
        });
        let shuffled = summary.shuffled.unwrap_or(1.0).max(f64::MIN_POSITIVE);
        Some(Self {
            depth: depth(summary.best),
            coarse_depth: depth(coarse_best),
            start_depth: summary.initial.map_or(0.0, depth),
            runner_up_margin: summary
                .runner_up
                .map(|runner_up| (runner_up - coarse_best) / deviation),
            gain: 1.0 - summary.best / shuffled,
            coverage: summary.coverage_best / summary.coverage_reference.max(f64::MIN_POSITIVE),
            yaw_depth: yaw_depth.unwrap_or(0.0),
            deviation,
        })
    }

    /// How far the pose is from the reference is none of them: on the street right ones are near, by how its
    /// pairs are drawn, and on real drives they are not.
    pub(super) fn signals(&self) -> Signals {
        const NAMES: &[&str] =
            &["depth", "refined_by", "margin", "above_start", "gain", "coverage", "yaw_depth"];
        let margin = self.runner_up_margin.unwrap_or(self.coarse_depth);
        Signals {
            names: NAMES,
            values: vec![
                tamed(self.depth),
                tamed(self.depth - self.coarse_depth),
                tamed(margin),
                tamed(self.depth - self.start_depth),
                self.gain,
                self.coverage.clamp(1e-3, 1e3).ln(),
                tamed(self.yaw_depth),
            ],
        }
    }

    /// Standard deviations of right and forward \[m\] and yaw \[rad\]: how far one has to go from the
    /// minimum until the cost has risen by as much as coarse costs differ anyway, by the parabola
    /// through the minimum and its neighbours on the fine lattices.
    pub(super) fn deviations(&self, evidence: &Evidence) -> Option<[f64; 3]> {
        let position = evidence.surface(Phase::PositionFine)?;
        let yaw = evidence.surface(Phase::YawFine)?;
        let along = |surface: &ScoredLattice, step: usize| -> Option<f64> {
            let cell = surface.minimum()?;
            let cost = |cell: usize| surface.scores.get(cell).copied()??.cost;
            let (before, after) = (cost(cell.checked_sub(step)?)?, cost(cell + step)?);
            let curvature = (before + after - 2.0 * cost(cell)?) / surface.lattice.step.powi(2);
            (curvature > 0.0).then(|| (2.0 * self.deviation / curvature).sqrt())
        };
        Some([along(position, 1)?, along(position, position.lattice.columns)?, along(yaw, 1)?])
    }
}
