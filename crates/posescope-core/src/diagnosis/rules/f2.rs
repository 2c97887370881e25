//! F2: a method that has no joint pose of several references.

use super::*;

pub(super) const RULE: Rule = Rule {
    code: Code::F2,
    title: "the method takes one reference at a time",
    advice: "choose another --fusion",
    applies_to: &[],
    needs_truth: false,
    is_conclusive: false,
    test: Test::Reported,
    decided_at: DecidedAt::Stage(Stage::Fuse),
    proof: Proof::PoseMap,
    remedies: no_remedy,
};
