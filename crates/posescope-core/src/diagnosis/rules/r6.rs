//! R6: MLESAC missed a pose that the truth supports.

use super::*;
use crate::solver::{Correspondence, refine};

pub(super) const RULE: Rule = Rule {
    title: "MLESAC missed the right pose",
    advice: "raise fb.max_trials or fb.confidence",
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    proof: Proof::RivalInliers,
    remedies,
    ..Rule::new(Code::R6)
};

/// Near the truth is a pose that the method would accept, with more inliers than the one that it ended with.
fn test(case: &Case<'_>) -> Option<Diagnosis> {
    let matches = case.matches()?;
    if case.consensus_is_right() {
        return None;
    }
    let subject = case.subject;
    let query_from_reference = subject.reference_from_truth()?.inverse();
    let supporters: Vec<Correspondence> =
        matches.true_ones().into_iter().map(|at| matches.correspondences[at]).collect();
    let camera = &subject.problem.query.intrinsics;
    let params = case.matching().mlesac;
    let refined = refine(&supporters, camera, &query_from_reference, params.loss()).pose;
    let error = PoseError::between(&query_from_reference.inverse(), &refined.inverse());
    let is_explained = |at: &usize| {
        let Correspondence { pixel, point } = matches.correspondences[*at];
        let seen = camera.project(&(refined * point));
        seen.is_some_and(|seen| (seen - pixel).norm() <= params.inlier_threshold_px)
    };
    let explained: Vec<usize> = (0..matches.correspondences.len()).filter(is_explained).collect();
    let (supports_truth, inliers) = (explained.len(), matches.inliers());
    let is_missed = subject.tolerance.contains(&error)
        && supports_truth > inliers
        && case.would_accept(matches, &explained);
    is_missed.then(|| {
        let refined = subject.evidence.refined.as_ref();
        RULE.found(&Missed {
            supports_truth,
            inliers,
            trials: refined.map(|refined| refined.trials),
            true_matches: matches.funnel,
        })
    })
}

evidence!(Missed {
    supports_truth: usize,
    inliers: usize,
    trials: Option<usize>,
    true_matches: Funnel,
} => {
    let after = trials.map(|trials| format!(" after {trials} trials")).unwrap_or_default();
    format!(
        "MLESAC missed the right pose: it ended with {inliers} inliers{after}. A pose near the truth has \
         {supports_truth}."
    )
});

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let group = ask.key("fb", "fb2");
    let trials = (ask.matching().mlesac.max_trials * 10).clamp(20_000, 10_000_000);
    let set = |key: &str, value: &str| Change::Set(format!("{group}.{key}={value}"));
    vec![
        vec![set("max_trials", &trials.to_string())],
        vec![set("confidence", "0.99999"), set("min_trials", "10000")],
        vec![ask.ratio(-0.1)],
    ]
}
