//! Assessing what a method answered: is its pose accepted, and what is wrong with it?

use super::work::{Estimated, MethodOutcome, QueryWork};
use super::{Localizer, Request};
use crate::diagnosis::{Assessment, Grade, Subject, confidence, diagnose_ranking};
use crate::geometry::Pose;
use crate::localize::{QueryResult, evaluate};
use crate::method::Method;
use crate::scene::Scene;

impl Localizer<'_> {
    /// A result that is not right because retrieval found another place says so first.
    pub(super) fn with_ranking_assessed(
        &self,
        mut result: QueryResult,
        request: &Request,
        truth: Option<&Pose>,
    ) -> QueryResult {
        // Another system found its pose from references of its own.
        let is_ours = self.foreign.estimates(result.method).is_none();
        let ranking = request.references.ranking.as_ref().zip(truth).filter(|_| is_ours);
        if result.grade != Grade::Right
            && let Some(verdict) = ranking
                .and_then(|(ranking, truth)| diagnose_ranking(ranking, truth, request.radius_m))
        {
            result.diagnosis.insert(0, verdict);
        }
        result
    }

    /// Refuses a pose of too low a confidence, and assesses the result.
    pub(super) fn assessed(
        &self,
        work: &QueryWork<'_>,
        problem: usize,
        method: Method,
        estimated: Estimated,
    ) -> MethodOutcome {
        let Estimated { outcome: estimated, evidence, times, verdicts } = estimated;
        let solved = &work.problems[problem];
        let subject = Subject::new(solved, method, self.params, &estimated, &evidence)
            .against(work.truth_for(method), self.tolerance);
        let outcome = confidence::accepted(&subject, self.least_probability);
        let subject = subject.answering(&outcome);
        let assessment = match verdicts {
            Some(verdicts) => Assessment {
                grade: subject.grade(),
                confidence: subject.confidence.clone(),
                verdicts,
            },
            None => Assessment::of(&subject),
        };
        let mut result = evaluate(self.references.name(), &subject, assessment);
        if let Ok(pose) = &outcome.pose {
            result.agreement = work.agreement(problem, method, pose);
        }
        MethodOutcome { estimated, outcome, evidence, result, times }
    }
}
