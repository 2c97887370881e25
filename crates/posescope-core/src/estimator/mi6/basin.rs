//! Where a pose leads, refined under the cost of the search.

use std::convert::Infallible;

use super::SixFreedoms;
use crate::geometry::Pose;
use crate::judge::{Judge, Refined, Start, shrink};
use crate::problem::Problem;

impl SixFreedoms {
    /// Refines a pose (`reference_from_camera`) in all six freedoms, as the search does with its best
    /// starts; `None` where it lies outside the disc, leads out of it, or covers too little to have a cost.
    ///
    /// # Errors
    /// What the checkpoint says, which is asked before each round.
    pub(in crate::estimator) fn refined<E>(
        &self,
        problem: &Problem,
        judge: &Judge,
        pose: Pose,
        mut checkpoint: impl FnMut() -> Result<(), E>,
    ) -> Result<Option<Refined>, E> {
        let reach = self.reach(problem);
        if pose.translation.vector.norm() > reach {
            return Ok(None);
        }
        let scores = judge.score(&[Pose::identity(), pose]);
        let least_covered = self.least_covered(scores[0]);
        let Some(cost) = scores[1].eligible_cost(least_covered) else {
            return Ok(None);
        };
        let start = [Start { pose, cost }];
        let refined = shrink(&start, &self.in_six(), |poses| {
            checkpoint()?;
            Ok(judge.costs(poses, least_covered))
        })?;
        let inside = refined.first().filter(|one| one.pose.translation.vector.norm() <= reach);
        Ok(inside.copied())
    }

    /// The same for a pose that nobody searched from.
    pub fn basin_of(&self, problem: &Problem, reference_from_camera: &Pose) -> Option<Refined> {
        let judge = self.judge(problem);
        let never = || Ok::<_, Infallible>(());
        match self.refined(problem, &judge, *reference_from_camera, never) {
            Ok(refined) => refined,
        }
    }
}
