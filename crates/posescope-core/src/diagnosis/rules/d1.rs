//! D1: the lowest cost covers too little.

use super::*;
use crate::diagnosis::search::TELLING_PIXELS;

/// A minimum that covers less than this share of what the truth covers is hardly covered.
const HARDLY_COVERED: f64 = 0.5;

/// What the truth must save more than the result, as a share of the cost of shuffled pixels, if the
/// result's cost is low by chance.
const MORE_GAIN: f64 = 0.02;

/// Without the truth, a minimum that covers less than this share of what the reference covers.
const NEXT_TO_NOTHING: f64 = 0.15;

pub(super) const RULE: Rule = Rule {
    title: "the lowest cost covers too little",
    advice: "raise grid.coverage_floor",
    applies_to: &[Family::Grid],
    needs_truth: false,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Search(Phase::PositionCoarse)),
    proof: Proof::CostMap(MapOverlay::Coverage),
    remedies,
    ..Rule::new(Code::D1)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    match case.search {
        Some(search) => too_few_pixels(search),
        None => next_to_nothing(case),
    }
}

/// So few pixels match by chance.
fn too_few_pixels(search: &FinishedSearch<'_>) -> Option<Diagnosis> {
    let rivals = search.rivals()?;
    let at_truth = search.covered(&rivals.near.offset);
    let at_result = search.covered(&rivals.winner.offset);
    if !is_hardly_covered(at_result, at_truth) {
        return None;
    }
    let gain_at_truth = search.gain(&rivals.near.offset)?;
    let gain_at_result = search.gain(&rivals.winner.offset)?;
    (gain_at_result + MORE_GAIN < gain_at_truth).then(|| {
        RULE.found(&TooFewPixels {
            covered_at_result: at_result,
            covered_at_truth: at_truth,
            gain_at_result,
            gain_at_truth,
        })
    })
}

/// Whether a minimum covers so few pixels beside the truth that this is a cause. Where the truth covers
/// next to nothing too, that the minimum covers less is none.
fn is_hardly_covered(at_result: usize, at_truth: usize) -> bool {
    (at_result as f64) < HARDLY_COVERED * at_truth as f64 && at_truth >= TELLING_PIXELS
}

evidence!(TooFewPixels {
    covered_at_result: usize,
    covered_at_truth: usize,
    gain_at_result: f64,
    gain_at_truth: f64,
} =>
    "The pose of lowest cost covers too little: {covered_at_result} px, where one near the truth \
     covers {covered_at_truth} px. With so few, a low cost can be chance."
);

/// Of a pose that is more likely wrong than right, what speaks against it without the truth.
fn next_to_nothing(case: &Case<'_>) -> Option<Diagnosis> {
    if case.subject.truth.is_some() || !case.subject.is_low() {
        return None;
    }
    let summary = case.subject.outcome.cost?;
    case.subject.evidence.minimum?;
    let share_of_reference = summary.coverage_best / summary.coverage_reference;
    (share_of_reference < NEXT_TO_NOTHING).then(|| {
        RULE.found(&Uncovered {
            coverage: summary.coverage_best,
            share_of_reference,
            chance_level: summary.shuffled,
        })
    })
}

evidence!(Uncovered { coverage: f64, share_of_reference: f64, chance_level: Option<f64> } =>
    "The pose of lowest cost covers too little: {:.2} % of the photo. The reference pose covers \
     {:.1} times as much.",
    100.0 * coverage, 1.0 / share_of_reference
);

pub(super) fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let mut tried = vec![
        vec![ask.floor(2.0, 0.1)],
        vec![ask.floor(4.0, 0.2)],
        vec![ask.radius(1.5)],
        vec![ask.radius(0.5)],
        vec![ask.floor(8.0, 0.4)],
    ];
    if let Some(more) = ask.more_search() {
        tried.push(vec![ask.floor(2.0, 0.1), more]);
    }
    tried
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_minimum_is_hardly_covered_beside_a_truth_that_tells_something() {
        assert!(is_hardly_covered(249, 500));
        assert!(!is_hardly_covered(250, 500), "half of what the truth covers");
        assert!(!is_hardly_covered(10, 499), "too little at the truth");
        assert!(is_hardly_covered(4_999, 10_000));
    }
}
