//! Where a pose leads, refined under the cost of the search.

use std::convert::Infallible;

use super::{Level, SixFreedoms};
use crate::geometry::Pose;
use crate::judge::Refined;
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
        level: &Level,
        pose: Pose,
        checkpoint: impl FnMut() -> Result<(), E>,
    ) -> Result<Option<Refined>, E> {
        let reach = self.reach(problem);
        if pose.translation.vector.norm() > reach {
            return Ok(None);
        }
        let refined = level.refined(&level.starts(&[pose]), &self.in_six(), checkpoint)?;
        let inside = refined.first().filter(|one| one.pose.translation.vector.norm() <= reach);
        Ok(inside.copied())
    }

    /// The same for a pose that nobody searched from.
    pub fn basin_of(&self, problem: &Problem, reference_from_camera: &Pose) -> Option<Refined> {
        let never = || Ok::<_, Infallible>(());
        let Ok(refined) =
            self.refined(problem, &self.level(problem, 1), *reference_from_camera, never);
        refined
    }
}
