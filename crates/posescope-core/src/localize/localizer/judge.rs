//! Judging what a method answered: is its pose accepted, and what is wrong with it?

use super::work::{MethodOutcome, QueryWork};
use super::{Localizer, Request};
use crate::diagnosis::{Evidence, Subject, diagnose_ranking, trust};
use crate::estimator::Outcome;
use crate::geometry::Pose;
use crate::localize::{QueryResult, StageTimes, evaluate};
use crate::method::Method;
use crate::scene::Scene;

impl Localizer<'_> {
    /// A result that is not right because retrieval found another place says so first.
    pub(super) fn with_ranking_judged(
        &self,
        mut result: QueryResult,
        request: &Request,
        truth: Option<&Pose>,
    ) -> QueryResult {
        let is_right = result
            .error
            .is_some_and(|error| self.tolerance.contains(&error));
        let ranking = request.references.ranking.as_ref().zip(truth);
        if !is_right
            && let Some(verdict) = ranking
                .and_then(|(ranking, truth)| diagnose_ranking(ranking, truth, request.radius_m))
        {
            result.diagnosis.insert(0, verdict);
        }
        result
    }

    /// What is made of an estimator's outcome: a pose that is not believed enough is refused, and what
    /// is wrong with the result is said.
    pub(super) fn judged(
        &self,
        work: &QueryWork<'_>,
        problem: usize,
        method: Method,
        estimated: Outcome,
        evidence: Evidence,
        times: StageTimes,
    ) -> MethodOutcome {
        let solved = &work.problems[problem];
        let subject = Subject::new(solved, method, self.params, &estimated, &evidence);
        let outcome = trust::accepted(&subject, self.least_probability);
        let subject = Subject {
            outcome: &outcome,
            ..subject
        };
        let subject = subject.against(work.truth.as_ref(), self.tolerance);
        let mut result = evaluate(self.references.name(), &subject);
        if let Ok(pose) = &outcome.pose {
            result.agreement = work.agreement(problem, method, pose);
        }
        MethodOutcome {
            estimated,
            outcome,
            evidence,
            result,
            times,
        }
    }
}
