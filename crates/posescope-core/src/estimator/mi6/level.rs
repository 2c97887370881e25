//! The cost of the search at one size of the photos.

use super::SixFreedoms;
use crate::geometry::Pose;
use crate::grid::least_covered;
use crate::judge::{Judge, Refined, Shrinking, Start, shrink};
use crate::problem::Problem;
use crate::render::Score;

/// The judge at one size of the photos.
pub(in crate::estimator) struct Level {
    pub(in crate::estimator) judge: Judge,
    /// Of the reference pose.
    pub(super) initial: Score,
    /// Pixels that a pose must cover to be eligible.
    pub(super) least_covered: u32,
}

impl SixFreedoms {
    /// The level of photos that are so many times smaller.
    pub(in crate::estimator) fn level(&self, problem: &Problem, shrink: u32) -> Level {
        let judge = Judge::new(problem, &self.render, &self.judge, shrink);
        let initial = judge.score(&[Pose::identity()])[0];
        let least_covered = least_covered(self.grid.coverage_floor, initial.covered);
        Level { judge, initial, least_covered }
    }
}

impl Level {
    /// Those of the poses that have a cost.
    pub(super) fn starts(&self, poses: &[Pose]) -> Vec<Start> {
        let costs = self.judge.costs(poses, self.least_covered);
        let both = poses.iter().zip(costs);
        both.filter_map(|(&pose, cost)| Some(Start { pose, cost: cost? })).collect()
    }

    /// Refines the starts.
    ///
    /// # Errors
    /// Those of `checkpoint`, which is asked before each round.
    pub(super) fn refined<E>(
        &self,
        starts: &[Start],
        plan: &Shrinking,
        mut checkpoint: impl FnMut() -> Result<(), E>,
    ) -> Result<Vec<Refined>, E> {
        shrink(starts, plan, |poses| {
            checkpoint()?;
            Ok(self.judge.costs(poses, self.least_covered))
        })
    }
}
