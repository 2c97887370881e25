//! E4: whether another system's pose is right stays open.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "posescope alone cannot tell whether another system's pose is right",
    advice: "compare it with more references (--reference matches:3), or survey the map",
    needs_truth: false,
    ..Rule::new(Code::E4)
};
