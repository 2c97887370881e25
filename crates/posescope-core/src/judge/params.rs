//! Parameters of the judge.

use crate::describe::{choice, parameters};

/// Which channels the cost is the mean of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// The grey value.
    Intensity,
    /// The grey value against its surroundings.
    Contrast,
    /// The strength of edges.
    Gradient,
    /// All three.
    Three,
}

choice!(Channels:
    Intensity = "intensity",
    Contrast = "contrast",
    Gradient = "gradient",
    Three = "three",
);

impl Channels {
    /// How many there are.
    pub(super) fn count(self) -> usize {
        if self == Self::Three { 3 } else { 1 }
    }
}

parameters! {
    /// Parameters of the cost that judges the poses of `mi6`, `fb2` and `robust`.
    #[derive(Clone, Debug, PartialEq)]
    pub struct JudgeParams {
        /// Channels of the cost that decides: grey value, local contrast, edge strength, or the mean of all. Smaller copies
        /// of the photos are always searched with all.
        pub channels: Channels = Channels::Contrast => choice("channels"),
        /// Whether to subtract the chance level at this number of pixels from normalised mutual information.
        pub corrected: bool = true => flag("corrected"),
        /// Standard deviation of the Gaussian that smooths both photos.
        pub sigma_px: f64 = 1.5 => number("sigma", "px", 0.0..=20.0),
        /// Standard deviation of the neighbourhood that local contrast compares a grey value with.
        pub contrast_sigma_px: f64 = 8.0 => number("contrast_sigma", "px", 1.0..=200.0),
        /// Bins per axis of each joint histogram.
        pub bins: usize = 16 => count("bins", "", 2..=256),
    }
}
