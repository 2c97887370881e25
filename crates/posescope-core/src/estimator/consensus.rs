//! Whether the consensus of a feature-based method becomes a pose.

use super::{Failure, Halt};
use crate::event::ConsensusJudged;
use crate::geometry::Pose;
use crate::problem::Problem;
use crate::robust::{Acceptance, Counted};
use crate::trace::Trace;

/// A pose that so many correspondences agree on, and what is asked of it.
pub(super) struct FoundConsensus {
    /// The query camera's pose in the reference camera's frame.
    pub(super) reference_from_query: Pose,
    /// Its inliers beside what chance gives.
    pub(super) acceptance: Acceptance,
    /// How many they are of.
    pub(super) tested: usize,
    /// What was counted.
    pub(super) counted: Counted,
    /// Whether the inliers are enough.
    pub(super) is_enough: bool,
    /// How far outside the prior it may be, as a share of that; `None` for anywhere.
    pub(super) slack: Option<f64>,
}

impl FoundConsensus {
    /// The query's pose in the world, or why it is none.
    ///
    /// # Errors
    /// [`Failure::ChanceConsensus`], [`Failure::OutsideRadius`], or a run that was cancelled.
    pub(super) fn judged(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Pose, Halt> {
        let distance_m = self.reference_from_query.translation.vector.norm();
        let radius_m = problem.believed_within_m();
        let is_too_far = |slack: f64| distance_m > radius_m * (1.0 + slack);
        let verdict = if !self.is_enough {
            Err(Failure::ChanceConsensus {
                inliers: self.acceptance.inliers,
                tested: self.tested,
                needed: self.acceptance.needed.unwrap_or(self.tested + 1),
                counted: self.counted,
            })
        } else if self.slack.is_some_and(is_too_far) {
            Err(Failure::OutsideRadius { distance_m, radius_m })
        } else {
            Ok(())
        };
        trace.emit(|| ConsensusJudged {
            acceptance: self.acceptance,
            counted: self.counted,
            distance_m,
            accepted: verdict.is_ok(),
        })?;
        verdict?;
        Ok(problem.world_from_query(&self.reference_from_query))
    }
}
