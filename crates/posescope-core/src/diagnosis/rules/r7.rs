//! R7: the pose was right and refused.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the right pose was refused",
    advice: "try fb.accept=paper, or use --method robust",
    advice_of: |family| match family {
        Family::Guided => Some("lower fb2.least_probability, or use --method robust"),
        _ => None,
    },
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    proof: Proof::RivalInliers,
    remedies,
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

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let accepted = match ask.family {
        Family::Guided => ask.set("fb2.least_probability", 0.0),
        _ => ask.word("fb.accept", "paper"),
    };
    let more = [vec![ask.ratio(0.06)], vec![ask.more_keypoints(0.2)]];
    [vec![accepted]].into_iter().chain(many_starts()).chain(more).collect()
}
