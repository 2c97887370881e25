//! D9: a grid of more cells than can be scored and kept.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the search grid is too large",
    advice: "use larger steps or a smaller radius",
    needs_truth: false,
    proof: Proof::CostMap(MapOverlay::Reach),
    ..Rule::new(Code::D9)
};
