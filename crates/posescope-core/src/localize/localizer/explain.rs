//! What would have helped: a query that went wrong is localised again, differently.

use nalgebra::Point3;

use super::work::Answer;
use super::{LocalizeError, Localizer, Request};
use crate::diagnosis::Grade;
use crate::diagnosis::remedies::{Change, Remedy, changes_matching, remedies};
use crate::fusion::Fusion;
use crate::geometry::PoseError;
use crate::localize::observer::{LocalizeObserver, NoObserver, checkpoint};
use crate::localize::{Explanation, Helped, QueryResult, frames_within};
use crate::method::Method;
use crate::trace::Cancelled;

impl Localizer<'_> {
    /// Says of every answer that is wrong what would have helped.
    ///
    /// # Errors
    /// [`Cancelled`], and then the explanation at work is incomplete and says so.
    pub(super) fn explain_wrong(
        &self,
        answers: &mut [Answer],
        query: usize,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(), Cancelled> {
        for answer in answers {
            let result = &answer.result;
            let is_measured = result.initial_error.is_some();
            if !is_measured || !result.grade.is_failure() {
                continue;
            }
            let mut explanation = Explanation::default();
            let outcome = self.explain(answer, query, &mut explanation, observer);
            answer.result.explanation = Some(explanation);
            observer.explained(&answer.result);
            outcome?;
        }
        Ok(())
    }

    /// Tries the remedies on an answer, up to the limit of runs. The observer does not see their events,
    /// but can stop them.
    fn explain(
        &self,
        answer: &Answer,
        query: usize,
        explanation: &mut Explanation,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(), Cancelled> {
        let Answer { result, asked, .. } = answer;
        let candidates = result.diagnosis.first().map_or(Vec::new(), |primary| {
            let (method, fell_back) = (result.method, result.fell_back());
            let mut tried = remedies(primary, method, fell_back, self.params(), asked.radius_m);
            if primary.has_given_matches() {
                tried.retain(|remedy| !changes_matching(remedy));
            }
            tried
        });
        let candidates: Vec<Changed> = candidates
            .iter()
            .filter_map(|remedy| self.changed(result.method, asked, query, remedy))
            .take(self.runs_to_explain)
            .collect();
        for (tried, changed) in candidates.iter().enumerate() {
            observer.explaining(result, tried, candidates.len());
            checkpoint(observer)?;
            explanation.runs += 1;
            match changed.run(self, query) {
                Some(error) => {
                    explanation.helped.push(Helped { args: changed.args.clone(), error });
                }
                None => explanation.failed.push(changed.args.clone()),
            }
        }
        explanation.complete = true;
        Ok(())
    }

    /// What a remedy makes of a query that a method localised; `None` where it cannot be tried.
    #[doc(hidden)]
    pub fn changed(
        &self,
        method: Method,
        asked: &Request,
        query: usize,
        remedy: &Remedy,
    ) -> Option<Changed> {
        let mut changed = Changed {
            params: self.params().clone(),
            method,
            request: Request { setting: None, ..asked.clone() },
            args: Vec::new(),
        };
        let mut option = |name: &str, value: String| {
            changed.args.extend([format!("--{name}"), value]);
        };
        for change in remedy {
            match change {
                Change::Set(assignment) => {
                    changed.params.assign(assignment).ok()?;
                    option("set", assignment.clone());
                }
                Change::Radius(radius_m) => {
                    // Without a prior of its own, the query is taken to be within the radius.
                    let within_m = &mut changed.request.references.within_m;
                    if *within_m == Some(changed.request.radius_m) {
                        *within_m = Some(*radius_m);
                    }
                    changed.request.radius_m = *radius_m;
                    option("radius", radius_m.to_string());
                }
                Change::Method(method) => {
                    changed.method = *method;
                    option("method", method.to_string());
                }
                Change::Reference(farther) => {
                    let frame = self.farther_reference(asked, query, *farther)?;
                    changed.request.references.frames = vec![frame];
                    option("reference", self.references().frames()[frame].clone());
                }
                Change::Fusion(name) => {
                    let fusion: Fusion = name.parse().ok()?;
                    if asked.fusions.is_empty() || asked.fusions.contains(&fusion) {
                        return None;
                    }
                    changed.request.fusions = vec![fusion];
                    option("fusion", (*name).to_owned());
                }
                Change::Ranked(count) => {
                    let ranking = asked.references.ranking.as_deref()?;
                    let frames =
                        ranking.frames.get(..*count).filter(|_| *count > ranking.chosen)?;
                    changed.request.references.frames =
                        frames.iter().map(|one| one.ranked.frame).collect();
                    option("reference", format!("{}:{count}", ranking.criterion.way()));
                }
            }
        }
        Some(changed)
    }

    /// A reference farther from the one used, of those within the radius around it: a third of them on for
    /// each step of `farther`.
    fn farther_reference(&self, asked: &Request, query: usize, farther: usize) -> Option<usize> {
        let [used] = asked.references.frames[..] else {
            return None;
        };
        let references = self.references();
        let place = Point3::from(references.pose(used)?.translation.vector);
        let left_out = |frame: usize| frame == used || self.is_one_drive && frame == query;
        let radius_m = asked.radius_m;
        let within = frames_within(references, &place, radius_m, &left_out);
        within.get(farther * within.len() / 3).copied()
    }
}

/// A query asked differently.
#[doc(hidden)]
pub struct Changed {
    params: crate::params::Params,
    /// The method that answers now.
    pub method: Method,
    request: Request,
    /// The arguments that ask so.
    pub args: Vec<String>,
}

impl Changed {
    /// The error of the pose, if it is right now.
    pub fn run(&self, localizer: &Localizer<'_>, query: usize) -> Option<PoseError> {
        let again = localizer.with_other_params(&self.params);
        let mut found = None;
        let keep = |result: QueryResult, _| {
            let is_right = result.grade == Grade::Right;
            found = found.or(result.error.filter(|_| is_right));
            Ok::<(), LocalizeError>(())
        };
        let requests = std::slice::from_ref(&self.request);
        let done = again.localize(0, query, requests, &[self.method], &mut NoObserver, keep);
        // A frame that cannot be read does not help.
        done.ok()?;
        found
    }
}
