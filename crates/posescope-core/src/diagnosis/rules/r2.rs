//! R2: too few keypoints.

use std::fmt;

use serde::Serialize;

use super::{Code, DecidedAt, Rule, Test};
use crate::diagnosis::ask::{Ask, Remedy};
use crate::diagnosis::case::Case;
use crate::diagnosis::family::Family;
use crate::diagnosis::{Diagnosis, Proof};
use crate::event::Stage;

/// Fewer keypoints leave nothing to match.
const FEW_KEYPOINTS: usize = 20;

pub(super) const RULE: Rule = Rule {
    code: Code::R2,
    title: "too few keypoints",
    advice: "lower surf.threshold (fb2: fb2.contrast)",
    applies_to: Family::MATCHING,
    needs_truth: true,
    is_conclusive: false,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Detect),
    proof: Proof::Matches,
    remedies,
};

fn test(case: &Case<'_, '_>) -> Option<Diagnosis> {
    case.matches()?;
    let counts = case.subject.outcome.counts?;
    let (query, reference) = (counts.query_keypoints, counts.reference_keypoints);
    (query.min(reference) < FEW_KEYPOINTS).then(|| RULE.found(&Keypoints { query, reference }))
}

#[derive(Serialize)]
struct Keypoints {
    query: usize,
    reference: usize,
}

impl fmt::Display for Keypoints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Too few keypoints: {} in the query, {} in the reference.",
            self.query, self.reference
        )
    }
}

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    vec![vec![ask.more_keypoints(0.2)], vec![ask.more_keypoints(0.05)]]
}
