//! What became of a feature: the way of a query keypoint through FB.

/// Where a query feature ended, with the number that decided it. Each ends in exactly one state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FeatureState {
    /// The second-nearest reference feature is nearly as near as the nearest.
    RatioFailed {
        /// Nearest over second-nearest distance.
        ratio: f32,
    },
    /// The nearest reference feature resembles another query feature more.
    NotUnique {
        /// Index of that query feature.
        rival: usize,
    },
    /// No depth near the reference keypoint.
    NoDepth {
        /// Distance to the nearest projected point \[px\].
        distance_px: f64,
    },
    /// The estimated pose does not explain it.
    Outlier {
        /// Reprojection error for the returned pose \[px\]; infinite without a pose.
        residual_px: f64,
    },
    /// The estimated pose explains it.
    Inlier {
        /// Reprojection error for the returned pose \[px\].
        residual_px: f64,
    },
}

impl FeatureState {
    /// The names of all states, in the order of the funnel.
    pub const NAMES: [&'static str; 5] =
        ["ratio_failed", "not_unique", "no_depth", "outlier", "inlier"];

    /// Position in [`Self::NAMES`].
    pub fn index(&self) -> usize {
        match self {
            Self::RatioFailed { .. } => 0,
            Self::NotUnique { .. } => 1,
            Self::NoDepth { .. } => 2,
            Self::Outlier { .. } => 3,
            Self::Inlier { .. } => 4,
        }
    }

    /// The state's name in recordings and results.
    pub fn name(&self) -> &'static str {
        Self::NAMES[self.index()]
    }

    /// What decided the state: a ratio, a rival's index, pixels.
    pub fn number(&self) -> f64 {
        match *self {
            Self::RatioFailed { ratio } => f64::from(ratio),
            Self::NotUnique { rival } => rival as f64,
            Self::NoDepth { distance_px } => distance_px,
            Self::Outlier { residual_px } | Self::Inlier { residual_px } => residual_px,
        }
    }
}
