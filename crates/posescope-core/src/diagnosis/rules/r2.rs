//! R2: too few keypoints.

use super::*;

/// Fewer keypoints leave nothing to match.
const FEW_KEYPOINTS: usize = 20;

pub(super) const RULE: Rule = Rule {
    title: "too few keypoints",
    advice: "lower surf.threshold (fb2: fb2.contrast)",
    advice_of: |family| match family {
        Family::Features => Some("lower surf.threshold"),
        _ => Some("lower fb2.contrast"),
    },
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Detect),
    proof: Proof::Matches,
    remedies,
    ..Rule::new(Code::R2)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    case.matches()?;
    let counts = case.subject.outcome.counts?;
    let (query, reference) = (counts.query_keypoints, counts.reference_keypoints);
    let limit = case.keypoint_limit();
    (query.min(reference) < FEW_KEYPOINTS)
        .then(|| RULE.found(&Keypoints { query, reference, limit }))
}

evidence!(Keypoints {
    query: usize,
    reference: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<String>,
} => {
    let limit = limit.as_ref().map(|limit| format!(" The limit is {limit}.")).unwrap_or_default();
    format!("Too few keypoints: {query} in the query, {reference} in the reference.{limit}")
});

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    vec![vec![ask.more_keypoints(0.2)], vec![ask.more_keypoints(0.05)]]
}
