//! R8: the pose was accepted and is wrong.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "a wrong pose was accepted",
    advice: "lower fb.ratio; something moved, or the place looks like another",
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    proof: Proof::Matches,
    remedies,
    ..Rule::new(Code::R8)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    let matches = case.matches()?;
    Some(RULE.found(&Accepted {
        error: case.subject.error()?,
        inliers: matches.inliers(),
        true_inliers: matches.funnel.inliers,
        supports_truth: matches.funnel.lifted,
        true_matches: matches.funnel,
    }))
}

evidence!(Accepted {
    error: PoseError,
    inliers: usize,
    true_inliers: usize,
    supports_truth: usize,
    true_matches: Funnel,
} =>
    "A wrong pose was accepted: {inliers} matches agree on it, {} off, {true_inliers} of them \
     true. The truth explains {supports_truth}.",
    metres(error.translation_m)
);

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let mut tried = vec![vec![ask.ratio(-0.1)], vec![ask.ratio(-0.2)]];
    if ask.family == Family::Features {
        tried.insert(1, vec![ask.word("fb.depth", "guarded")]);
    }
    tried
}
