//! E2: another system's pose is that of a reference, and posescope's own trusted pose is elsewhere.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "another system's pose is that of a reference",
    advice: "check whether the other system fell back to the pose of the reference that it retrieved",
    proof: Proof::BothPoses,
    needs_truth: false,
    ..Rule::new(Code::E2)
};
