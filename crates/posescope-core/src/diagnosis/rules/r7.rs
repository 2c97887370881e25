//! R7: the pose was right and refused.

use std::fmt;

use serde::Serialize;

use super::{Code, DecidedAt, Rule, Test, r3};
use crate::diagnosis::case::Case;
use crate::diagnosis::family::Family;
use crate::diagnosis::numbers::metres;
use crate::diagnosis::{Diagnosis, Proof};
use crate::geometry::PoseError;

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

fn test(case: &Case<'_, '_>) -> Option<Diagnosis> {
    case.matches()?;
    let failure = case.subject.outcome.pose.as_ref().err()?;
    let error = case.consensus_error()?;
    case.subject
        .tolerance
        .contains(&error)
        .then(|| RULE.found(&Refused { error, because: failure.to_string() }))
}

#[derive(Serialize)]
struct Refused {
    error: PoseError,
    because: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "The right pose was found, {} from the truth, but not accepted. {}",
            metres(self.error.translation_m),
            self.because
        )
    }
}
