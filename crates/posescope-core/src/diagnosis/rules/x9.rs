//! X9: an estimator panicked.

use super::*;

pub(super) const RULE: Rule = Rule {
    code: Code::X9,
    title: "a bug in posescope",
    advice: "report it with the command line that repeats it",
    applies_to: &[],
    needs_truth: false,
    is_conclusive: false,
    test: Test::Reported,
    decided_at: DecidedAt::End,
    proof: Proof::DecidingStage,
    remedies: no_remedy,
};
