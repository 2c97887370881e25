//! L1: low confidence.

use super::*;
use crate::diagnosis::confidence::{self, Confidence, PoseConfidence};

pub(super) const RULE: Rule = Rule {
    title: "low confidence",
    advice: "do not rely on it; --min-confidence 0.9 refuses such poses",
    applies_to: Family::ALL,
    needs_truth: false,
    test: Test::Method(test),
    ..Rule::new(Code::L1)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    low(case.subject.confidence.as_ref())
}

/// The verdict on a pose of this confidence.
pub(in crate::diagnosis) fn low(confidence: Option<&PoseConfidence>) -> Option<Diagnosis> {
    let confidence = confidence?;
    (confidence.word == Confidence::Low).then(|| {
        RULE.found(&Low {
            probability: confidence.probability,
            within_m: confidence.within.m,
            because: confidence.because(),
            runner_up_margin: confidence.runner_up_margin,
            inlier_spread: confidence.inlier_spread,
        })
    })
}

evidence!(Low { probability: f64, within_m: f64, #[serde(skip_serializing_if = "Option::is_none")] because: Option<String>, runner_up_margin: Option<f64>, inlier_spread: Option<f64> } =>
    "Low confidence: {} likely within {} m{}.",
    confidence::percent(*probability), within_m,
    because.as_ref().map(|why| format!(", because {why}")).unwrap_or_default()
);
