//! A ground truth that is wrong: the images are nearly certain of another pose, and nothing of their own speaks for the
//! stated one.

use super::*;
use crate::diagnosis::confidence::percent;

/// Few wrong poses are so likely right.
const NEARLY_CERTAIN: f64 = 0.97;
/// What the images agree at the truth, as a share of how they agree at the result, if both are there.
const SUPPORTED: f64 = 0.5;

/// The photos agree on a pose as well as photos ever do, and it is not the stated truth.
pub(super) fn truth_by_matches(case: &Case<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    /// Chance alone agrees on a pose so well once in 10^15 queries.
    const NEVER_BY_CHANCE: f64 = -15.0;
    let error = case.subject.error().or_else(|| case.consensus_error())?;
    if case.subject.tolerance.contains(&error) {
        return None;
    }
    let judged = case.subject.evidence.judged.as_ref()?;
    let (inliers, total) = (matches.inliers(), matches.correspondences.len());
    let is_by_chance = judged.acceptance.log10_nfa > NEVER_BY_CHANCE || 2 * inliers < total;
    if is_by_chance && !is_nearly_certain(case) {
        return None;
    }
    let limit_m = case.length(super::super::r5::FIXED_M);
    let is_fixed = case.deviation_m(matches).is_some_and(|deviation_m| deviation_m < limit_m);
    // Near the axis of a turn, matches agree with both poses.
    let of_truth_alone = matches.of_truth_alone();
    let is_contradicted = 2 * matches.funnel.inliers < inliers;
    // What the truth explains beyond chance is there: then both are, and the truth is not suspect.
    let is_supported =
        || 5 * of_truth_alone.len() >= inliers || case.would_accept(matches, &of_truth_alone);
    (is_fixed && is_contradicted && !is_supported()).then(|| {
        RULE.found(&TruthByMatches {
            inliers,
            correspondences: total,
            supports_truth: matches.funnel.lifted,
            error,
        })
    })
}

evidence!(TruthByMatches {
    inliers: usize,
    correspondences: usize,
    supports_truth: usize,
    error: PoseError,
} =>
    "The ground truth is suspect: {inliers} of {correspondences} matches agree on a pose {} from \
     it. The truth explains {supports_truth}.",
    distance(error)
);

/// The result is as certain as results ever are, and it is not the stated truth. Where the images agree at
/// the truth too, though less, both are there, and the truth is not suspect.
pub(super) fn truth_by_cost(case: &Case<'_>, search: &FinishedSearch<'_>) -> Option<Diagnosis> {
    // Shuffling takes its time.
    if !is_nearly_certain(case) {
        return None;
    }
    let near = search.near_truth();
    let gain = near.and_then(|near| search.gain(&near.offset));
    if gain.unwrap_or(0.0) > SUPPORTED * search.gain(&search.result)? {
        return None;
    }
    found_by_cost(case)
}

/// The same of a search in six freedoms: the cost has no minimum at the truth, or hardly one.
pub(super) fn truth_by_free_search(case: &Case<'_>) -> Option<Diagnosis> {
    /// What photos cost that share nothing.
    const BY_CHANCE: f64 = 1.0;
    /// How many tolerances from the truth a pose is that is not just inexact.
    const FAR: f64 = 2.0;
    let (error, tolerance) = (case.subject.error()?, case.subject.tolerance);
    let is_far = error.translation_m > FAR * tolerance.translation_m
        || error.rotation_deg > FAR * tolerance.rotation_deg;
    if !is_far || !is_nearly_certain(case) {
        return None;
    }
    let search = case.free_search()?;
    let near = search.near.as_ref()?;
    let gain = |cost: f64| BY_CHANCE - cost;
    let is_supported =
        near.is_right && gain(near.refined.cost) > SUPPORTED * gain(search.result_cost);
    if is_supported { None } else { found_by_cost(case) }
}

fn is_nearly_certain(case: &Case<'_>) -> bool {
    let confidence = case.subject.confidence.as_ref();
    confidence.is_some_and(|confidence| confidence.probability >= NEARLY_CERTAIN)
}

fn found_by_cost(case: &Case<'_>) -> Option<Diagnosis> {
    let probability = case.subject.confidence.as_ref()?.probability;
    Some(RULE.found(&TruthByCost { probability, error: case.subject.error()? }))
}

evidence!(TruthByCost { probability: f64, error: PoseError } =>
    "The ground truth is suspect: the pose is {} likely right, but {} from it.",
    percent(*probability), distance(error)
);
