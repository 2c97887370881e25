//! D5: nothing makes one hypothesis stand out.

use super::*;

/// Standard deviation of grey values below which a photo shows nothing.
const TEXTURELESS: f64 = 2.0;

pub(super) const RULE: Rule = Rule {
    title: "no pose stands out: the query shows nothing",
    advice: "use another photo, or another reference",
    applies_to: Family::SEARCHING,
    needs_truth: false,
    is_conclusive: true,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Assess),
    proof: Proof::CostMap(MapOverlay::Flat),
    remedies: |_| other_references().into(),
    ..Rule::new(Code::D5)
};

/// Whether the query is the same everywhere: costs may differ, but by nothing that it shows.
pub(super) fn is_textureless(case: &Case<'_>) -> bool {
    Family::SEARCHING.contains(&case.family)
        && case.subject.outcome.pose.is_ok()
        && case.contrast() < TEXTURELESS
}

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    is_textureless(case).then(|| RULE.found(&Textureless { deviation: case.contrast() }))
}

evidence!(Textureless { deviation: f64 } =>
    "The query has no texture: its grey values vary by {deviation:.1} only. No pose can stand \
     out."
);
