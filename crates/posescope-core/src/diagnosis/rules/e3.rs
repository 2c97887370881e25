//! E3: posescope's own trusted pose is elsewhere than that of another system.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "another system's pose is contradicted by a trusted one",
    advice: "look at the photos at both poses, and check the pose's matches and place",
    proof: Proof::BothPoses,
    needs_truth: false,
    ..Rule::new(Code::E3)
};
