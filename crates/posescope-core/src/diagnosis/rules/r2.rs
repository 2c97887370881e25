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

#[derive(Serialize)]
struct Keypoints {
    query: usize,
    reference: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<String>,
}

impl fmt::Display for Keypoints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { query, reference, limit } = self;
        write!(f, "Too few keypoints: {query} in the query, {reference} in the reference.")?;
        limit.iter().try_for_each(|limit| write!(f, " The limit is {limit}."))
    }
}

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    vec![vec![ask.more_keypoints(0.2)], vec![ask.more_keypoints(0.05)]]
}
