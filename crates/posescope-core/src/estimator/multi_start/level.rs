//! The cost of the search at one size of the photos.

use std::convert::Infallible;

use super::MultiStart;
use crate::geometry::Pose;
use crate::grid::least_covered;
use crate::problem::Problem;
use crate::render::{Objective, Score};
use crate::search::{CrossEntropy, PatternSearch, Refined, Start, cross_entropy, pattern_search};

/// A cost at one size of the photos.
pub(in crate::estimator) struct Level<O> {
    pub(in crate::estimator) objective: O,
    /// Of the reference pose.
    pub(in crate::estimator) initial: Score,
    /// Pixels that a pose must cover to be eligible.
    pub(in crate::estimator) least_covered: u32,
}

impl MultiStart {
    /// The level of a cost.
    pub(in crate::estimator) fn level<O: Objective>(&self, objective: O) -> Level<O> {
        let initial = objective.score(&[Pose::identity()])[0];
        let least_covered = least_covered(self.grid.coverage_floor, initial.covered);
        Level { objective, initial, least_covered }
    }

    /// Refines a pose (`reference_from_camera`) as the search does with its best starts; `None` where it lies outside the
    /// disc, leads out of it, or covers too little to have a cost.
    ///
    /// # Errors
    /// What the checkpoint says, which is asked before each round.
    pub(in crate::estimator) fn refined<E>(
        &self,
        problem: &Problem,
        level: &Level<impl Objective>,
        pose: Pose,
        mut checkpoint: impl FnMut() -> Result<(), E>,
    ) -> Result<Option<Refined>, E> {
        let reach = self.reach(problem);
        if pose.translation.vector.norm() > reach {
            return Ok(None);
        }
        let map_cost = |_: &Pose, cost: f64| cost;
        let starts = level.starts(&[pose]);
        let walks = level.gathered(&starts, &self.around(problem), map_cost, &mut checkpoint)?;
        let refined = self.halved(level, walks, &self.in_six(), 1, map_cost, checkpoint)?;
        let inside = refined.first().filter(|one| one.pose.translation.vector.norm() <= reach);
        Ok(inside.copied())
    }
}

impl MultiStart {
    /// The minimum that a pose leads to, though no search started there; `None` where there is none.
    pub(in crate::estimator) fn basin_of(
        &self,
        problem: &Problem,
        level: &Level<impl Objective>,
        reference_from_camera: &Pose,
    ) -> Option<Refined> {
        let never = || Ok::<_, Infallible>(());
        let Ok(refined) = self.refined(problem, level, *reference_from_camera, never);
        refined
    }
}

impl<O: Objective> Level<O> {
    fn costs(&self, poses: &[Pose]) -> Vec<Option<f64>> {
        let scores = self.objective.score(poses).into_iter();
        scores.map(|score| score.eligible_cost(self.least_covered)).collect()
    }

    /// The costs of poses, with a checkpoint before each batch.
    fn checked_costs<E>(
        &self,
        mut checkpoint: impl FnMut() -> Result<(), E>,
    ) -> impl FnMut(&[Pose]) -> Result<Vec<Option<f64>>, E> {
        move |poses| {
            checkpoint()?;
            Ok(self.costs(poses))
        }
    }

    /// Those of the poses that have a cost.
    pub(super) fn starts(&self, poses: &[Pose]) -> Vec<Start> {
        let both = poses.iter().zip(self.costs(poses));
        both.filter_map(|(&pose, cost)| Some(Start { pose, cost: cost? })).collect()
    }

    /// Moves walks to the cheapest of samples around them.
    ///
    /// # Errors
    /// Those of `checkpoint`, which is asked before each batch.
    pub(super) fn gathered<E>(
        &self,
        starts: &[Start],
        plan: &CrossEntropy,
        map_cost: impl Fn(&Pose, f64) -> f64,
        checkpoint: impl FnMut() -> Result<(), E>,
    ) -> Result<Vec<Refined>, E> {
        let mut walks: Vec<Refined> = starts.iter().map(Refined::unmoved).collect();
        cross_entropy(&mut walks, plan, map_cost, self.checked_costs(checkpoint))?;
        Ok(walks)
    }

    /// Refines the starts.
    ///
    /// # Errors
    /// Those of `checkpoint`, which is asked before each round.
    pub(super) fn refined<E>(
        &self,
        starts: &[Start],
        plan: &PatternSearch,
        checkpoint: impl FnMut() -> Result<(), E>,
    ) -> Result<Vec<Refined>, E> {
        pattern_search(starts, plan, self.checked_costs(checkpoint))
    }
}
