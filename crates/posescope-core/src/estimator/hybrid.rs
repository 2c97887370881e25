//! A hybrid: one method's pose, and another's where the first has none.
//!
//! HY, that of the paper (section 2.4), is FB and MI: FB is the more accurate where it finds enough
//! matches, MI still gives a moderate pose where FB finds none.

mod params;

pub use params::HybridParams;

use super::{Estimator, Outcome, entry};
use crate::event::{BranchTaken, Stage};
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{Comparison, Scorer};
use crate::trace::{Cancelled, Trace};

/// The two methods of a hybrid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HybridParts {
    /// The method that runs first.
    pub first: Method,
    /// Runs where the first has no pose.
    pub second: Method,
}

/// The pose of the first method, and of the second where that has none.
pub struct Hybrid {
    method: Method,
    parts: HybridParts,
    first: Box<dyn Estimator>,
    second: Box<dyn Estimator>,
}

impl Hybrid {
    /// The hybrid of both with these parameters.
    pub fn new(method: Method, parts: HybridParts, params: &Params) -> Self {
        Self {
            method,
            parts,
            first: entry(parts.first).make(params),
            second: entry(parts.second).make(params),
        }
    }
}

/// What a hybrid makes of the outcomes of its methods for one problem.
///
/// Equal problems have equal answers: with both outcomes the hybrid need not run.
pub fn hybrid_outcome(first: &Outcome, second: &Outcome) -> Outcome {
    if first.pose.is_ok() {
        return first.clone();
    }
    Outcome { counts: first.counts, fell_back: true, ..second.clone() }
}

impl Hybrid {
    /// As [`Estimator::estimate`], where `ask_first` asks the first method and may refuse its pose.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn estimate_with(
        &self,
        problem: &Problem,
        ask_first: impl FnOnce(&dyn Estimator, &mut Trace<'_>) -> Result<Outcome, Cancelled>,
        trace: &mut Trace<'_>,
    ) -> Result<Outcome, Cancelled> {
        let HybridParts { first, second } = self.parts;
        trace.stage(Stage::Estimator(self.method), |trace| {
            let outcome = ask_first(self.first.as_ref(), trace)?;
            let failure = match &outcome.pose {
                Ok(_) => {
                    trace.emit(|| BranchTaken {
                        method: first,
                        why: "the feature-based pose was accepted".to_owned(),
                    })?;
                    return Ok(outcome);
                }
                Err(failure) => failure,
            };
            trace.emit(|| BranchTaken { method: second, why: failure.to_string() })?;
            let fallback = self.second.estimate(problem, trace)?;
            Ok(hybrid_outcome(&outcome, &fallback))
        })
    }
}

impl Estimator for Hybrid {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        let ask = |first: &dyn Estimator, trace: &mut Trace<'_>| first.estimate(problem, trace);
        self.estimate_with(problem, ask, trace)
    }

    fn scorer(&self, problem: &Problem) -> Option<Scorer<'_>> {
        self.second.scorer(problem)
    }

    fn compare_at(&self, problem: &Problem, world_from_query: &Pose) -> Option<Comparison> {
        self.second.compare_at(problem, world_from_query)
    }
}
