//! What would have helped: a query that went wrong is localised again, differently.

use super::{LocalizeError, Localizer, Request};
use crate::diagnosis::remedies::{Change, Remedy, remedies};
use crate::geometry::PoseError;
use crate::localize::observer::{LocalizeObserver, NoObserver, checkpoint};
use crate::localize::{Explanation, Helped, QueryResult, frames_within};
use crate::method::Method;
use crate::trace::Cancelled;

/// A result that is to be explained.
pub(super) struct Unexplained<'a> {
    /// The result.
    pub(super) result: &'a QueryResult,
    /// The query's position in its scene.
    pub(super) query: usize,
    /// What was asked.
    pub(super) request: &'a Request,
}

impl Localizer<'_> {
    /// Tries at most `most` remedies on a result. Whoever watches hears nothing of them, but can stop
    /// them.
    pub(super) fn explain(
        &self,
        unexplained: &Unexplained<'_>,
        most: usize,
        observer: &mut dyn LocalizeObserver,
    ) -> (Explanation, Result<(), Cancelled>) {
        let mut explanation = Explanation::default();
        let Unexplained {
            result, request, ..
        } = unexplained;
        let Some(primary) = result.diagnosis.first() else {
            return (explanation, Ok(()));
        };
        let candidates = remedies(primary.code, result.method, self.params(), request.radius_m);
        for remedy in candidates.into_iter().take(most) {
            if let Err(cancelled) = checkpoint(observer) {
                return (explanation, Err(cancelled));
            }
            let Some(changed) = self.changed(unexplained, &remedy) else {
                continue;
            };
            explanation.runs += 1;
            if let Some(error) = changed.run(self, unexplained.query) {
                explanation.helped.push(Helped {
                    args: changed.args,
                    error,
                });
            }
        }
        explanation.complete = true;
        (explanation, Ok(()))
    }

    fn changed(&self, unexplained: &Unexplained<'_>, remedy: &Remedy) -> Option<Changed> {
        let mut changed = Changed {
            params: self.params().clone(),
            method: unexplained.result.method,
            request: Request {
                setting: None,
                ..unexplained.request.clone()
            },
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
                    changed.request.radius_m = *radius_m;
                    option("radius", radius_m.to_string());
                }
                Change::Method(method) => {
                    changed.method = *method;
                    option("method", method.to_string());
                }
                Change::Reference(farther) => {
                    let frame = self.farther_reference(unexplained, *farther)?;
                    changed.request.references = vec![frame].into();
                    option("reference", self.references().frames()[frame].clone());
                }
            }
        }
        Some(changed)
    }

    /// The reference that is so many places farther from the one that was used, of those within the
    /// radius around it.
    fn farther_reference(&self, unexplained: &Unexplained<'_>, farther: usize) -> Option<usize> {
        let [used] = unexplained.request.references.frames[..] else {
            return None;
        };
        let (references, queries) = (self.references(), self.queries());
        let is_same_scene = references.name() == queries.name();
        let place = references.pose(used)?;
        let left_out = |frame: usize| frame == used || is_same_scene && frame == unexplained.query;
        let radius_m = unexplained.request.radius_m;
        let within = frames_within(references, &place, radius_m, &left_out);
        within.get(farther * within.len() / 3).copied()
    }
}

/// A query asked differently.
struct Changed {
    params: crate::params::Params,
    method: Method,
    request: Request,
    args: Vec<String>,
}

impl Changed {
    /// The error of the pose, if it is right now.
    fn run(&self, localizer: &Localizer<'_>, query: usize) -> Option<PoseError> {
        let again = localizer.with_other_params(&self.params);
        let mut found = None;
        let keep = |result: QueryResult, _| {
            let is_right = |error: &PoseError| again.tolerance().contains(error);
            found = found.or(result.error.filter(is_right));
            Ok::<(), LocalizeError>(())
        };
        let requests = std::slice::from_ref(&self.request);
        let done = again.localize(0, query, requests, &[self.method], &mut NoObserver, keep);
        // A frame that cannot be read helps nobody.
        done.ok()?;
        found
    }
}
