//! What a hypothesis is worth.

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
