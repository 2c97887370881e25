//! D9: a grid of more cells than can be scored and kept.

use super::*;

pub(super) const RULE: Rule = Rule {
    code: Code::D9,
    title: "the search grid is too large",
    advice: "use larger steps or a smaller radius",
    applies_to: &[],
    needs_truth: false,
    is_conclusive: false,
    test: Test::Reported,
    decided_at: DecidedAt::End,
    proof: Proof::CostMap(MapOverlay::Reach),
    remedies: no_remedy,
};
