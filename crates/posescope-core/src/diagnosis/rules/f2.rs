//! F2: a method that has no joint pose of several references.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the method takes one reference at a time",
    advice: "choose another --fusion",
    needs_truth: false,
    decided_at: DecidedAt::Stage(Stage::Fuse),
    proof: Proof::PoseMap,
    ..Rule::new(Code::F2)
};
