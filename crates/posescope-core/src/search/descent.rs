//! Descending a direct cost by its derivatives, which is what the direct costs of the paper come from.
//!
//! | file | what |
//! |---|---|
//! | `view` | what a moved camera's photo shows at the points of a coloured cloud, and its slope |
//! | [`photometric`] | the squared differences, robustly, by Levenberg–Marquardt (after Tykkälä, Audras, Comport, *Direct iterative closest point for real-time visual odometry*, ICCV workshops 2011) |
//! | [`information`] | the normalised information distance of a smooth histogram by BFGS (after Pascoe, Maddern, Tanner, Piniés, Newman, *NID-SLAM*, CVPR 2017) |
//!
//! Both go from a coarse copy of the photos to a fine one, and end in the minimum that the start leads
//! to, which need not be the right one.

pub mod information;
pub mod photometric;
mod view;

pub use view::View;

use crate::describe::parameters;
use crate::geometry::Pose;

parameters! {
    /// Parameters of `pm.search=descent` and `mi.search=descent`.
    ///
    /// Five levels to σ = 16 px, which on a photo of 1241 px is what a copy of 40 px shows.
    #[derive(Clone, Debug, PartialEq)]
    pub struct DescentParams {
        /// Number of pyramid levels, each half the size of the next finer one.
        pub levels: usize = 5 => count("levels", "", 1..=8),
        /// Standard deviation of the Gaussian that smooths both photos on the finest level.
        pub sigma_px: f64 = 1.0 => number("sigma", "px", 0.3..=20.0),
        /// Most steps per level.
        pub max_steps: usize = 40 => count("steps", "", 1..=1000),
        /// Most points of the cloud, evenly sampled.
        pub max_points: usize = 6000 => count("points", "", 50..=1_000_000),
    }
}

/// One step of a descent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// `camera_from_reference` after it.
    pub camera_from_reference: Pose,
    /// The smooth cost there.
    pub cost: f64,
}

/// The fewest points in view that say anything.
pub const MIN_POINTS: usize = 50;

#[cfg(test)]
mod tests;
