//! R7: the pose was right and refused.

use super::*;

pub(super) const RULE: Rule = Rule {
    code: Code::R7,
    title: "the right pose was refused",
    advice: "get more matches, or try fb.accept=paper",
    applies_to: Family::MATCHING,
    needs_truth: true,
    is_conclusive: false,
    test: Test::Method(test),
    decided_at: DecidedAt::End,
    proof: Proof::RivalInliers,
    remedies: r3::remedies,
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    case.matches()?;
    let failure = case.subject.outcome.pose.as_ref().err()?;
    let error = case.consensus_error()?;
    case.subject
        .tolerance
        .contains(&error)
        .then(|| RULE.found(&Refused { error, because: failure.to_string() }))
}

evidence!(Refused { error: PoseError, because: String } =>
    "The right pose was found, {} from the truth, but not accepted. {because}",
    metres(error.translation_m)
);
