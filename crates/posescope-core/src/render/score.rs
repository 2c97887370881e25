//! What a hypothesis is worth.

use crate::geometry::Pose;

/// What a hypothesis is worth. The support always comes with the cost, because a mean over whatever
/// is left in view rewards looking away.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Score {
    /// The cost over the covered pixels; `None` where they decide nothing.
    pub cost: Option<f64>,
    /// Number of covered pixels.
    pub covered: u32,
}

impl Score {
    /// The cost, if at least `least_covered` pixels support it and it is a number.
    pub fn eligible_cost(&self, least_covered: u32) -> Option<f64> {
        self.cost.filter(|cost| self.covered >= least_covered && !cost.is_nan())
    }
}

/// What a search minimises: a cost that scores many poses at once.
pub trait Objective: Sync {
    /// The scores of many cameras `reference_from_camera`, in their order.
    fn score(&self, reference_from_camera: &[Pose]) -> Vec<Score>;

    /// The batch size for a number of hypotheses, small enough that a run can be stopped soon.
    fn batch(&self, hypotheses: usize) -> usize;

    /// The cost at a pose if the view's pixels had nothing to do with the query's: what a minimum must beat to
    /// mean anything.
    fn shuffled(&self, reference_from_camera: &Pose, seed: u64) -> Option<f64>;
}
