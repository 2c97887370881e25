//! A search in six freedoms beside the truth: a multi-start search, or a descent.
//!
//! Nothing is frozen and no step is too coarse in six freedoms, so the pose that the truth leads to under
//! the same cost tells search from cost.

use super::{Family, Subject, confidence};
use crate::estimator::{self, prior_penalty};
use crate::geometry::{Pose, PoseError};
use crate::search::Refined;

/// Where the truth leads, and the result.
pub(super) struct FreeSearch {
    /// Whether the search went downhill from the reference pose alone.
    pub(super) is_descent: bool,
    /// The pose that the truth leads to; `None` where too little of the cloud is seen from there, or the
    /// way leads out of the disc.
    pub(super) near: Option<Near>,
    /// The cost at the result.
    pub(super) result_cost: f64,
    /// What the prior on poses adds to it.
    pub(super) result_penalty: f64,
    /// The distance of the truth from the reference \[m\].
    pub(super) distance_m: f64,
}

/// The pose that the truth leads to.
pub(super) struct Near {
    pub(super) refined: Refined,
    /// What the prior on poses adds to its cost.
    pub(super) penalty: f64,
    /// How far it is from the truth.
    pub(super) error: PoseError,
    /// Whether that is within the tolerance.
    pub(super) is_right: bool,
}

impl FreeSearch {
    pub(super) fn of(subject: &Subject<'_>, family: Family) -> Option<Self> {
        let is_descent = family == Family::Descent;
        let truth = subject.reference_from_truth()?;
        let (summary, pose) = (subject.outcome.cost?, subject.outcome.pose.as_ref().ok()?);
        // Where `robust` had no search to compare with, there is nothing to look at.
        if !is_descent && subject.evidence.settled.is_none() {
            return None;
        }
        let responsible = confidence::responsible(subject.method, subject.outcome);
        let estimator = estimator::find(responsible)?.make(subject.params);
        // A descent has no prior on poses.
        let penalty = |pose: &Pose| match family {
            Family::MultiStart => prior_penalty(subject.params, &subject.evidence.surfaces, pose),
            _ => 0.0,
        };
        let near = estimator.led_from(subject.problem, &truth).map(|refined| {
            let error = PoseError::between(&truth, &refined.pose);
            Near {
                penalty: penalty(&refined.pose),
                error,
                is_right: subject.tolerance.contains(&error),
                refined,
            }
        });
        Some(Self {
            is_descent,
            near,
            result_cost: summary.best,
            result_penalty: penalty(&subject.problem.reference_from_query(pose)),
            distance_m: truth.translation.vector.norm(),
        })
    }

    /// Whether the pose near the truth is right and would have won.
    pub(super) fn is_missed(&self) -> bool {
        self.near.as_ref().is_some_and(|near| {
            near.is_right
                && near.refined.cost + near.penalty < self.result_cost + self.result_penalty
        })
    }

    /// Whether the prior on poses turned the comparison of costs.
    pub(super) fn is_turned_by_prior(&self) -> bool {
        self.near.as_ref().is_some_and(|near| {
            let by_cost = near.refined.cost < self.result_cost;
            let by_both = near.refined.cost + near.penalty < self.result_cost + self.result_penalty;
            by_cost != by_both
        })
    }
}
