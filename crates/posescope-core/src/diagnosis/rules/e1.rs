//! E1: another system has no answer for this query.

use super::*;

pub(super) const RULE: Rule = Rule {
    code: Code::E1,
    title: "another system gave no answer",
    advice: "check the names in its file",
    applies_to: &[],
    needs_truth: false,
    is_conclusive: false,
    test: Test::Reported,
    decided_at: DecidedAt::End,
    proof: Proof::DecidingStage,
    remedies: no_remedy,
};
