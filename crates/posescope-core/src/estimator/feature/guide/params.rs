//! Parameters of `fb2`.

use crate::describe::parameters;
use crate::features::SiftParams;
use crate::robust::MlesacParams;

parameters! {
    /// Parameters of matching twice, depth lift, consensus and acceptance.
    #[derive(Clone, Debug, PartialEq)]
    pub struct GuidedParams {
        /// Detector and descriptor.
        pub sift: SiftParams = SiftParams::default() => group(),
        /// Greatest ratio of nearest to second-nearest descriptor distance in the first matching.
        pub ratio: f64 = 0.9 => number("ratio", "", 0.1..=1.0),
        /// How far a projected point may be from the keypoint it lends its depth.
        pub depth_radius_px: f64 = 2.0 => number("depth_radius", "px", 0.1..=50.0),
        /// Greatest spread of the depths within the radius, as a share; more is a depth edge.
        pub depth_spread: f64 = 0.1 => number("depth_spread", "", 0.0..=10.0),
        /// Whether features are matched again where the first pose says that they are.
        pub guided: bool = true => flag("guided"),
        /// How far from there they are sought.
        pub window_px: f64 = 12.0 => number("window", "px", 1.0..=200.0),
        /// Greatest ratio of the distances of the nearest and the second-nearest descriptor within the
        /// window.
        pub window_ratio: f64 = 0.95 => number("window_ratio", "", 0.1..=1.0),
        /// Greatest ratio of a feature's scale to that which it must have.
        pub scale_ratio: f64 = 1.6 => number("scale_ratio", "", 1.0..=10.0),
        /// MLESAC.
        pub mlesac: MlesacParams = MlesacParams::default() => group(),
        /// How far outside the uncertainty radius a pose is still accepted, as a share of it.
        pub radius_slack: f64 = 0.1 => number("radius_slack", "", 0.0..=100.0),
        /// The least probability of being right with which a pose is accepted: streets that look alike
        /// agree on poses beyond chance. 0 accepts what chance does not explain.
        pub least_probability: f64 = 0.7 => number("least_probability", "", 0.0..=1.0),
    }
}
