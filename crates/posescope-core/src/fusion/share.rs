//! What each reference has to do with the fused pose.

use crate::geometry::Pose;

/// Whether a candidate is part of the fused pose, and why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShareOutcome {
    /// It is part of the fused pose.
    Kept,
    /// The fusion gives it no weight.
    Dropped,
    /// It had weight, but its reference gave no pose.
    Failed,
    /// It had weight, but its pose is that of a hybrid's second method, and another reference with weight
    /// has one of the first.
    FallbackUnneeded,
}

/// A candidate with its share of the fused pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// The reference frame's name.
    pub reference: String,
    /// How many feature matches it has with the query.
    pub matches: usize,
    /// Its share of the fused pose. Those of all references add up to 1, or to 0 without a pose.
    pub weight: f64,
    /// Whether it is part of the fused pose, and why not.
    pub outcome: ShareOutcome,
    /// The pose that this reference alone gave.
    pub pose: Option<Pose>,
}
