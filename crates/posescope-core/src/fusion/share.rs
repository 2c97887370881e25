//! The share of each reference in the fused pose.

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
    /// Jointly: nothing of it agrees with the pose, or it sees too little from there.
    Unsupportive,
    /// Jointly: alone it puts the query elsewhere, more than 1 m away. What agrees with the joint pose
    /// all the same keeps its weight.
    Outvoted,
}

/// How far a reference supports a pose that was found from several at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support {
    /// By correspondences.
    Inliers {
        /// Those that agree with the pose.
        inliers: usize,
        /// All that it has.
        correspondences: usize,
    },
    /// By its view of the query.
    Cost {
        /// Its own cost at the pose; `None` where it covers too little.
        cost: Option<f64>,
        /// Share of the image that it covers.
        coverage: f64,
    },
}

impl Support {
    /// What the weight is proportional to: inliers, or the share of the image that is covered.
    pub fn amount(&self) -> f64 {
        match *self {
            Self::Inliers { inliers, .. } => inliers as f64,
            Self::Cost { cost: None, .. } => 0.0,
            Self::Cost { coverage, .. } => coverage,
        }
    }

    /// In words: `12 of 40 correspondences agree`.
    pub fn words(&self) -> String {
        match *self {
            Self::Inliers { inliers, correspondences } => {
                format!("{inliers} of {correspondences} correspondences agree")
            }
            Self::Cost { cost: Some(cost), coverage } => {
                format!("cost {cost:.4} over {:.1} % of the image", 100.0 * coverage)
            }
            Self::Cost { cost: None, coverage } => {
                format!("{:.1} % of the image, too little", 100.0 * coverage)
            }
        }
    }
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
    /// How far it supports a joint pose; `None` where poses are averaged.
    pub support: Option<Support>,
}

impl Share {
    /// In a few words: its weight, or why it has none.
    pub fn words(&self) -> String {
        let weight = format!("{:.3}", self.weight);
        match self.outcome {
            ShareOutcome::Kept => weight,
            ShareOutcome::Dropped => "dropped".to_owned(),
            ShareOutcome::Failed => "failed".to_owned(),
            ShareOutcome::FallbackUnneeded => "fallback not needed".to_owned(),
            ShareOutcome::Unsupportive => "nothing agrees".to_owned(),
            ShareOutcome::Outvoted => format!("{weight}, outvoted"),
        }
    }
}
