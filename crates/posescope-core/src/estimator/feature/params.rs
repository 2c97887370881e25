//! Parameters of FB.

use crate::describe::{About, Choice, Describe, ParamVisitor};
use crate::robust::{AcceptanceRule, MlesacParams};

/// Which depth a reference keypoint takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthRule {
    /// That of the nearest projected point.
    Nearest,
    /// The same, refused where the depths around it differ too much: near a depth edge the nearest
    /// point may belong to the other surface.
    Guarded,
}

macro_rules! choice {
    ($type:ty, $($variant:path => $name:literal),+) => {
        impl Choice for $type {
            fn names(&self) -> &'static [&'static str] { &[$($name),+] }
            fn index(&self) -> usize { *self as usize }
            fn choose(&mut self, index: usize) { *self = [$($variant),+][index]; }
        }
    };
}
choice!(AcceptanceRule, AcceptanceRule::Consensus => "consensus", AcceptanceRule::Paper => "paper");
choice!(DepthRule, DepthRule::Nearest => "nearest", DepthRule::Guarded => "guarded");

/// Parameters of matching, depth lift, consensus and acceptance.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureParams {
    /// Greatest ratio of nearest to second-nearest descriptor distance.
    ///
    /// On distances, not squared. 0.89 gave the smallest errors on a real pair in both directions;
    /// 0.6 on squared distances, a common default, is 0.775 here.
    pub ratio: f64,
    /// Whether a match must be the best in both directions.
    pub unique: bool,
    /// How far a projected point may be from the keypoint it lends its depth \[px\].
    pub depth_radius_px: f64,
    /// Which depth a keypoint takes.
    pub depth: DepthRule,
    /// Greatest spread of depths within the radius that the guarded rule accepts, as a share.
    pub depth_spread: f64,
    /// MLESAC.
    pub mlesac: MlesacParams,
    /// When a consensus becomes a pose.
    pub accept: AcceptanceRule,
    /// How far outside the uncertainty radius a pose is still accepted, as a share of it: the
    /// reference is taken within the radius of the true position, which is itself uncertain.
    pub radius_slack: f64,
}

impl Default for FeatureParams {
    fn default() -> Self {
        Self {
            ratio: 0.89,
            unique: true,
            depth_radius_px: 3.0,
            depth: DepthRule::Nearest,
            depth_spread: 0.1,
            mlesac: MlesacParams::default(),
            accept: AcceptanceRule::Consensus,
            radius_slack: 0.1,
        }
    }
}

impl Describe for FeatureParams {
    fn visit(&mut self, visitor: &mut dyn ParamVisitor) {
        let about = |name, unit, help| About { name, unit, help };
        visitor.number(
            about(
                "ratio",
                "",
                "greatest ratio of nearest to second-nearest distance",
            ),
            &mut self.ratio,
            0.1..=1.0,
        );
        visitor.flag(
            about("unique", "", "a match must be the best in both directions"),
            &mut self.unique,
        );
        visitor.number(
            about(
                "depth_radius",
                "px",
                "how far a LiDAR point may be from its keypoint",
            ),
            &mut self.depth_radius_px,
            0.1..=50.0,
        );
        visitor.choice(
            about(
                "depth",
                "",
                "depth of a keypoint: the nearest point's, guarded against edges or not",
            ),
            &mut self.depth,
        );
        visitor.number(
            about(
                "depth_spread",
                "",
                "guarded: greatest spread of depths around, as a share",
            ),
            &mut self.depth_spread,
            0.0..=10.0,
        );
        visitor.number(
            about(
                "sigma",
                "px",
                "MLESAC: standard deviation of an inlier's reprojection error",
            ),
            &mut self.mlesac.sigma_px,
            0.05..=20.0,
        );
        visitor.number(
            about(
                "inlier",
                "px",
                "MLESAC: greatest reprojection error of an inlier",
            ),
            &mut self.mlesac.inlier_threshold_px,
            0.1..=50.0,
        );
        visitor.number(
            about(
                "confidence",
                "",
                "MLESAC: probability of drawing one clean sample",
            ),
            &mut self.mlesac.confidence,
            0.5..=0.999_999,
        );
        visitor.count(
            about("max_trials", "", "MLESAC: greatest number of hypotheses"),
            &mut self.mlesac.max_trials,
            1..=10_000_000,
        );
        visitor.choice(
            about(
                "accept",
                "",
                "when a consensus becomes a pose: beyond chance, or the paper's four",
            ),
            &mut self.accept,
        );
        visitor.number(
            about(
                "radius_slack",
                "",
                "share of the uncertainty radius that a pose may lie beyond it",
            ),
            &mut self.radius_slack,
            0.0..=100.0,
        );
    }
}
