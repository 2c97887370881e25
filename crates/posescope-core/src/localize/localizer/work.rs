//! A query at work: what was asked of it and what every method made of it so far.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Request;
use crate::diagnosis::{Diagnosis, Evidence};
use crate::estimator::{self, Failure, Outcome};
use crate::foreign::Foreign;
use crate::geometry::{Pose, PoseError};
use crate::localize::{Agreement, QueryResult, References, StageTimes};
use crate::method::Method;
use crate::opinion::OwnAnswer;
use crate::problem::{Problem, Query};

/// What an estimator answered, before it is assessed.
pub(super) struct Estimated {
    /// The answer.
    pub(super) outcome: Outcome,
    /// What verdicts need of its events.
    pub(super) evidence: Evidence,
    /// How long its stages took.
    pub(super) times: StageTimes,
    /// The verdicts of another method that answered the same, where they are known.
    pub(super) verdicts: Option<Vec<Diagnosis>>,
}

/// What one method made of one problem.
pub(super) struct MethodOutcome {
    /// What the estimator answered.
    pub(super) estimated: Outcome,
    /// What is made of it: a pose of low confidence may be refused.
    pub(super) outcome: Outcome,
    /// The events of the estimator.
    pub(super) evidence: Evidence,
    /// The outcome measured and assessed.
    pub(super) result: QueryResult,
    /// How long its stages took.
    pub(super) times: StageTimes,
}

/// What one of posescope's own methods answered to a problem, beside the pose of another system.
#[derive(Debug)]
pub(super) struct OneAnswer {
    /// The pose, or why there is none, as a sentence.
    pub(super) found: Result<OwnAnswer, String>,
    /// What a search's answer costs, and how far the costs around the reference are spread.
    pub(super) searched: Option<(f64, f64)>,
}

/// A query at work, with all that was found out about it.
pub(super) struct QueryWork<'a> {
    /// The query.
    pub(super) query: &'a Query,
    /// Its true pose.
    pub(super) truth: Option<Pose>,
    /// One problem for each reference and radius.
    pub(super) problems: Vec<Problem>,
    /// The query's position in its scene.
    pub(super) frame: usize,
    /// What each problem was made of.
    pub(super) places: Vec<ReferencePlace>,
    /// Feature matches by problem, once they are known.
    pub(super) matches: Vec<Option<usize>>,
    /// What posescope's own methods answered to each problem, where another system's pose was compared with that.
    pub(super) own: Vec<BTreeMap<Method, Arc<OneAnswer>>>,
    /// What each method made of each problem.
    pub(super) candidates: BTreeMap<Method, Vec<Option<MethodOutcome>>>,
}

/// A reference, and what is known about the distance of the query \[m\].
#[derive(Clone, Copy, PartialEq)]
pub(super) struct ReferencePlace {
    /// The reference's position in its scene.
    pub(super) reference: usize,
    /// The radius of the search.
    pub(super) radius_m: f64,
    /// How far the query may be, as [`References::within_m`].
    pub(super) within_m: Option<f64>,
}

/// A result as it is handed out, with what was asked for it.
pub(super) struct Answer {
    /// The result.
    pub(super) result: QueryResult,
    /// How long its stages took.
    pub(super) times: StageTimes,
    /// The request that this result alone answers.
    pub(super) asked: Request,
}

impl QueryWork<'_> {
    /// The truth that measures a method's poses. Nothing measures the truth itself.
    pub(super) fn truth_for(&self, method: Method) -> Option<&Pose> {
        self.truth.as_ref().filter(|_| method != Foreign::TRUTH)
    }

    /// How far the poses of the other methods that solved the problem are from this one.
    pub(super) fn agreement(&self, problem: usize, method: Method, pose: &Pose) -> Vec<Agreement> {
        let others = self.candidates.keys().copied();
        others
            .filter(|other| *other != method)
            .filter_map(|other| {
                let candidate = self.candidate(problem, other)?;
                let error = PoseError::between(candidate.outcome.pose.as_ref().ok()?, pose);
                Some(Agreement {
                    method: other,
                    translation_m: error.translation_m,
                    rotation_deg: error.rotation_deg,
                })
            })
            .collect()
    }

    /// What a method made of a problem, if it had its turn.
    pub(super) fn candidate(&self, problem: usize, method: Method) -> Option<&MethodOutcome> {
        self.candidates.get(&method)?.get(problem)?.as_ref()
    }

    /// The candidates of a hybrid's methods, where it can be made of them.
    pub(super) fn hybrid_parts(
        &self,
        problem: usize,
        method: Method,
    ) -> Option<(&MethodOutcome, &MethodOutcome)> {
        let parts = estimator::find(method)?.hybrid()?;
        let first = self.candidate(problem, parts.first)?;
        let second = self.candidate(problem, parts.second)?;
        let panicked = |candidate: &MethodOutcome| {
            matches!(candidate.outcome.pose, Err(Failure::Internal { .. }))
        };
        (!panicked(first) && !panicked(second)).then_some((first, second))
    }

    /// The request that gives the result of a problem by itself.
    pub(super) fn asked_alone(&self, problem: usize) -> Request {
        let ReferencePlace { reference, radius_m, within_m } = self.places[problem];
        Request {
            radius_m,
            references: References { within_m, ..vec![reference].into() },
            fusions: Vec::new(),
            setting: None,
        }
    }
}
