//! R7: the pose was right and refused.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the right pose was refused",
    advice: "get more matches, or try fb.accept=paper",
    advice_of: |family| match family {
        Family::Guided => Some("get more matches, or lower fb2.least_probability"),
        _ => None,
    },
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    proof: Proof::RivalInliers,
    remedies: r3::remedies,
    ..Rule::new(Code::R7)
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
