//! What a multi-start search says about the pose in which they settled.

use super::{Costs, Evidenced, NEAR, explained, gain_and_coverage, signed_log};
use crate::diagnosis::Subject;
use crate::geometry::{Pose, PoseError};
use crate::grid::Phase;
use crate::scale::Scale;

/// What the starts of a search say of the pose in which some of them settled. Depths are in robust standard deviations of the coarse costs, below their median.
pub(super) fn evidenced(subject: &Subject<'_>) -> Option<Evidenced> {
    let (outcome, evidence, scale) = (subject.outcome, subject.evidence, subject.params.scale);
    let summary = outcome.cost.as_ref()?;
    let surfaces = evidence.surfaces.iter().map(|surface| &**surface);
    let coarse = Costs::of(surfaces.filter(|one| one.lattice.phase == Phase::PositionCoarse))?;
    let refined = evidence.settled.as_ref()?;
    let answer = match &evidence.candidates {
        Some(candidates) => candidates.first()?.refined.pose,
        None => refined.first()?.pose,
    };
    let same = refined.iter().filter(|one| scale.is_same_pose(&answer, &one.pose));
    let depth = coarse.depth(summary.best);
    let start_depth = summary.initial.map_or(0.0, |cost| coarse.depth(cost));
    let above = |runner_up: f64| (runner_up - summary.best) / coarse.deviation;
    let runner_up_margin = summary.runner_up.map(above);
    let mut signals = vec![
        ("depth", signed_log(depth)),
        ("margin", signed_log(runner_up_margin.unwrap_or(depth))),
        ("above_start", signed_log(depth - start_depth)),
    ];
    signals.extend(gain_and_coverage(summary));
    // The share of the refined starts that ended there.
    signals.push(("gathered", same.count() as f64 / refined.len() as f64));
    if let Some(candidates) = &evidence.candidates {
        let of_features = candidates.iter().filter(|one| one.from_features);
        let poses = of_features.map(|one| (one.refined.pose, one.accepted));
        let FeaturesSay { support, against } = FeaturesSay::of(&answer, poses, scale);
        signals.extend([("support", support), ("against", against)]);
        signals.extend(explained::signals(subject, &answer));
    }
    let chance_level = summary.shuffled;
    Some(Evidenced { signals, alone: None, inlier_spread: None, runner_up_margin, chance_level })
}

/// Whether the poses that features lead to, refined under the same cost, are that of the answer.
struct FeaturesSay {
    /// 1 where one does that its own method accepts, one half where one does that this refused.
    support: f64,
    /// 1 where one that its method accepts is elsewhere.
    against: f64,
}

impl FeaturesSay {
    fn of(answer: &Pose, poses: impl Iterator<Item = (Pose, bool)>, scale: Scale) -> Self {
        let elsewhere_m = NEAR.at(scale).translation_m;
        let mut says = Self { support: 0.0, against: 0.0 };
        for (pose, accepted) in poses {
            if scale.is_same_pose(answer, &pose) {
                says.support = f64::max(says.support, if accepted { 1.0 } else { 0.5 });
            } else if accepted && PoseError::between(answer, &pose).translation_m > elsewhere_m {
                says.against = 1.0;
            }
        }
        says
    }
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
            let says = FeaturesSay::of(&answer, poses, Scale::PAPER);
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
