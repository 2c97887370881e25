//! H1: a method that chooses between poses kept a wrong one.

use std::fmt;

use serde::Serialize;

use super::{Code, DecidedAt, Rule, Test, no_remedy};
use crate::diagnosis::case::Case;
use crate::diagnosis::family::Family;
use crate::diagnosis::numbers::{metres, pair};
use crate::diagnosis::{Diagnosis, Proof};
use crate::geometry::{Pose, PoseError};
use crate::method::Method;

pub(super) const RULE: Rule = Rule {
    code: Code::H1,
    title: "the wrong method's pose was kept",
    advice: "run the other method alone, or use robust",
    applies_to: Family::ALL,
    needs_truth: true,
    is_conclusive: false,
    test: Test::Method(test),
    decided_at: DecidedAt::End,
    proof: Proof::DecidingStage,
    remedies: no_remedy,
};

fn test(case: &Case<'_, '_>) -> Option<Diagnosis> {
    match case.family {
        Family::Starts => passed_over(case),
        _ => kept_by_hybrid(case),
    }
}

/// A hybrid that kept its first method's pose answers for it.
fn kept_by_hybrid(case: &Case<'_, '_>) -> Option<Diagnosis> {
    let parts = case.hybrid()?;
    let error = case.subject.error()?;
    (case.responsible == parts.first).then(|| {
        RULE.found(&Kept {
            hybrid: case.subject.method,
            kept: parts.first,
            not_asked: parts.second,
            error,
        })
    })
}

#[derive(Serialize)]
struct Kept {
    hybrid: Method,
    kept: Method,
    not_asked: Method,
    error: PoseError,
}

impl fmt::Display for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} kept the wrong pose of {}, {} off, because that method accepted it. Its fallback {} was not asked.",
            self.hybrid.label(),
            self.kept,
            metres(self.error.translation_m),
            self.not_asked
        )
    }
}

/// A candidate was right, and another one was taken.
fn passed_over(case: &Case<'_, '_>) -> Option<Diagnosis> {
    case.subject.evidence.settled.as_ref()?;
    let truth = case.subject.reference_from_truth()?;
    let candidates = case.subject.evidence.candidates.as_ref()?;
    let (taken, others) = candidates.split_first()?;
    let error = |pose: &Pose| PoseError::between(&truth, pose);
    let is_right = |pose: &Pose| case.subject.tolerance.contains(&error(pose));
    let right = others.iter().find(|other| is_right(&other.refined.pose))?;
    Some(RULE.found(&PassedOver {
        kept: taken.method,
        cost_kept: taken.refined.cost,
        passed_over: right.method,
        cost_passed_over: right.refined.cost,
        error: error(&right.refined.pose),
    }))
}

#[derive(Serialize)]
struct PassedOver {
    kept: Method,
    cost_kept: f64,
    passed_over: Method,
    cost_passed_over: f64,
    error: PoseError,
}

impl fmt::Display for PassedOver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (right, kept) = pair(self.cost_passed_over, self.cost_kept);
        write!(
            f,
            "A right pose of {}, cost {right}, lost to a wrong one of {}, cost {kept} (lower is better).",
            self.passed_over, self.kept
        )?;
        if self.cost_passed_over < self.cost_kept {
            f.write_str(" The prior, or the credit of features, decided.")
        } else {
            Ok(())
        }
    }
}
