//! A search from many starts beside the truth.
//!
//! Nothing is frozen and no step is too coarse in six freedoms, so the pose that the truth leads to under
//! the same cost tells search from cost.

use super::Subject;
use crate::estimator::SixFreedoms;
use crate::geometry::{Pose, PoseError};
use crate::judge::Refined;

/// Where the truth leads, and the result.
pub(super) struct Starts {
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

impl Starts {
    pub(super) fn of(subject: &Subject<'_>) -> Option<Self> {
        let truth = subject.reference_from_truth()?;
        let (summary, pose) = (subject.outcome.cost?, subject.outcome.pose.as_ref().ok()?);
        subject.evidence.settled.as_ref()?;
        let six = SixFreedoms::new(subject.params);
        let penalty = |pose: &Pose| six.penalty(&subject.evidence.surfaces, pose);
        let near = six.basin_of(subject.problem, &truth).map(|refined| {
            let error = PoseError::between(&truth, &refined.pose);
            Near {
                penalty: penalty(&refined.pose),
                error,
                is_right: subject.tolerance.contains(&error),
                refined,
            }
        });
        Some(Self {
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
