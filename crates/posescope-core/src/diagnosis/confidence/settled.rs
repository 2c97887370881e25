//! What a search from many starts says about the pose in which they settled.

use super::{Signals, eligible_costs, tamed};
use crate::diagnosis::Evidence;
use crate::estimator::Outcome;
use crate::geometry::{Pose, PoseError};
use crate::grid::Phase;
use crate::stats::median_and_deviation;

/// Refined poses no farther apart are at one place.
const SAME_M: f64 = 0.3;
const SAME_DEG: f64 = 1.0;

/// A pose this far from the answer speaks against it \[m\].
const ELSEWHERE_M: f64 = 1.0;

/// A pose in which some of many starts settled, among the others.
pub(super) struct Settled {
    /// In robust standard deviations of the coarse costs, below their median.
    depth: f64,
    /// The same of the reference pose.
    start_depth: f64,
    /// How much deeper than the runner-up, in the same unit; `None` where there is none.
    pub(super) runner_up_margin: Option<f64>,
    /// Share of the cost of shuffled pixels that is saved.
    gain: f64,
    /// Covered pixels over those covered at the reference pose.
    coverage: f64,
    /// The share of the refined starts that ended there.
    gathered: f64,
    /// What features say, where some were asked.
    features: Option<FeaturesSay>,
}

/// Whether the poses that features lead to, refined under the same cost, are that of the answer.
struct FeaturesSay {
    /// 1 where one does that its own method accepts, one half where one does that this refused.
    support: f64,
    /// 1 where one that its method accepts is elsewhere.
    against: f64,
}

impl Settled {
    pub(super) fn of(outcome: &Outcome, evidence: &Evidence) -> Option<Self> {
        let summary = outcome.cost.as_ref()?;
        let coarse = evidence
            .surfaces
            .iter()
            .filter(|surface| surface.lattice.phase == Phase::PositionCoarse);
        let mut costs: Vec<f64> = coarse.flat_map(|surface| eligible_costs(surface)).collect();
        let (centre, deviation) = median_and_deviation(&mut costs)?;
        let depth = |cost: f64| (centre - cost) / deviation;
        let refined = evidence.settled.as_ref()?;
        let answer = match &evidence.candidates {
            Some(candidates) => candidates.first()?.refined.pose,
            None => refined.first()?.pose,
        };
        let same = refined.iter().filter(|one| is_same(&answer, &one.pose));
        let shuffled = summary.shuffled.unwrap_or(1.0).max(f64::MIN_POSITIVE);
        Some(Self {
            depth: depth(summary.best),
            start_depth: summary.initial.map_or(0.0, depth),
            runner_up_margin: summary
                .runner_up
                .map(|runner_up| (runner_up - summary.best) / deviation),
            gain: 1.0 - summary.best / shuffled,
            coverage: summary.coverage_best / summary.coverage_reference.max(f64::MIN_POSITIVE),
            gathered: same.count() as f64 / refined.len() as f64,
            features: evidence.candidates.as_ref().map(|candidates| {
                let of_features = candidates.iter().filter(|one| one.from_features);
                FeaturesSay::of(&answer, of_features.map(|one| (one.refined.pose, one.accepted)))
            }),
        })
    }

    pub(super) fn signals(&self) -> Signals {
        const NAMES: &[&str] = &[
            "depth",
            "margin",
            "above_start",
            "gain",
            "coverage",
            "gathered",
            "support",
            "against",
        ];
        let mut values = vec![
            tamed(self.depth),
            tamed(self.runner_up_margin.unwrap_or(self.depth)),
            tamed(self.depth - self.start_depth),
            self.gain,
            self.coverage.clamp(1e-3, 1e3).ln(),
            self.gathered,
        ];
        if let Some(features) = &self.features {
            values.extend([features.support, features.against]);
        }
        Signals { names: &NAMES[..values.len()], values }
    }
}

impl FeaturesSay {
    fn of(answer: &Pose, poses: impl Iterator<Item = (Pose, bool)>) -> Self {
        let mut says = Self { support: 0.0, against: 0.0 };
        for (pose, accepted) in poses {
            if is_same(answer, &pose) {
                says.support = f64::max(says.support, if accepted { 1.0 } else { 0.5 });
            } else if accepted && PoseError::between(answer, &pose).translation_m > ELSEWHERE_M {
                says.against = 1.0;
            }
        }
        says
    }
}

fn is_same(a: &Pose, b: &Pose) -> bool {
    let apart = PoseError::between(a, b);
    apart.translation_m <= SAME_M && apart.rotation_deg <= SAME_DEG
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_support_what_they_lead_to_and_speak_against_what_is_elsewhere() {
        let answer = Pose::identity();
        let says = |poses: &[(f64, bool)]| {
            let poses =
                poses.iter().map(|&(x, accepted)| (Pose::translation(x, 0.0, 0.0), accepted));
            let says = FeaturesSay::of(&answer, poses);
            (says.support, says.against)
        };
        assert_eq!(says(&[]), (0.0, 0.0));
        assert_eq!(says(&[(0.1, false)]), (0.5, 0.0));
        assert_eq!(says(&[(0.1, true), (0.2, false)]), (1.0, 0.0));
        assert_eq!(says(&[(5.0, true), (0.0, true)]), (1.0, 1.0));
        // Neither here nor elsewhere, or not believed by its own method.
        assert_eq!(says(&[(0.6, true), (5.0, false)]), (0.0, 0.0));
    }
}
