//! Parameters of FB.

use crate::describe::{choice, parameters};
use crate::robust::{AcceptanceRule, MlesacParams};

/// Which depth a reference keypoint takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthRule {
    /// The depth of the nearest projected point.
    Nearest,
    /// The same, refused where the depths around it differ too much: near a depth edge the nearest
    /// point may belong to the other surface.
    Guarded,
}

choice!(DepthRule: Nearest = "nearest", Guarded = "guarded");

parameters! {
    /// Parameters of matching, depth lift, consensus and acceptance.
    #[derive(Clone, Debug, PartialEq)]
    pub struct FeatureParams {
        /// Greatest ratio of nearest to second-nearest descriptor distance.
        ///
        /// On distances, not squared. 0.89 gave the smallest errors on a real pair in both
        /// directions; 0.6 on squared distances, a common default, is 0.775 here.
        pub ratio: f64 = 0.89 => number("ratio", "", 0.1..=1.0),
        /// Whether a match must be the best in both directions.
        pub unique: bool = true => flag("unique"),
        /// How far a projected point may be from the keypoint it lends its depth.
        pub depth_radius_px: f64 = 3.0 => number("depth_radius", "px", 0.1..=50.0),
        /// Which depth a keypoint takes: that of the nearest point, guarded against edges or not.
        pub depth: DepthRule = DepthRule::Nearest => choice("depth"),
        /// Guarded: greatest spread of the depths within the radius, as a share.
        pub depth_spread: f64 = 0.1 => number("depth_spread", "", 0.0..=10.0),
        /// Whether only points lend their depth that the reference camera sees.
        ///
        /// A scanner beside the camera also meets what something nearer hides from it; `render` says what
        /// that is.
        pub visible: bool = false => flag("visible"),
        /// MLESAC.
        pub mlesac: MlesacParams = MlesacParams::default() => group(),
        /// When a consensus becomes a pose: beyond what chance explains, or the paper's four inliers.
        pub accept: AcceptanceRule = AcceptanceRule::Consensus => choice("accept"),
        /// Whether matches of one place in the query, which a detector may find at several scales, count
        /// once in whether a consensus is more than chance.
        pub once: bool = true => flag("once"),
        /// How far outside the uncertainty radius a pose is still accepted, as a share of it.
        ///
        /// The reference is taken within the radius of the true position, which is itself uncertain.
        pub radius_slack: f64 = 0.1 => number("radius_slack", "", 0.0..=100.0),
    }
}
