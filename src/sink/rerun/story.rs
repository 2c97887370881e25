//! What a recording leads the eye to: what went wrong, and what it looks like beside the truth.

use super::blueprint::Focus;
use super::direct;
use super::entities;
use super::stream::Stream;
use crate::estimator::{self, Entry};
use crate::geometry::Pose;
use crate::localize::{PoseReport, QueryResult};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;

/// The estimator that a result comes from: of a hybrid the part that it took.
pub(super) fn responsible(result: &QueryResult) -> Option<Method> {
    let entry = estimator::find(result.method)?;
    Some(match entry.hybrid() {
        Some(parts) if result.cost.is_some() => parts.second,
        Some(parts) => parts.first,
        None => result.method,
    })
}

/// Whether a result is wrong or missing, as its verdicts say.
fn is_wrong(result: &QueryResult) -> bool {
    result.diagnosis.iter().any(|one| one.code.is_failure())
}

/// What the layout leads to, from all results of a query.
pub(super) fn focus(
    first: &Problem,
    truth: Option<&Pose>,
    results: &[QueryResult],
    beside_truth: &[Method],
) -> Focus {
    let mut wrong = Vec::new();
    for method in results
        .iter()
        .filter(|result| is_wrong(result))
        .filter_map(responsible)
    {
        if !wrong.contains(&method) {
            wrong.push(method);
        }
    }
    let estimates = results
        .iter()
        .filter_map(|result| result.pose.as_ref()?.to_pose());
    let in_reference =
        |pose: &Pose| -> [f64; 3] { first.reference_from_query(pose).translation.vector.into() };
    Focus {
        wrong,
        beside_truth: beside_truth.to_vec(),
        places: estimates
            .chain(truth.copied())
            .map(|pose| in_reference(&pose))
            .collect(),
    }
}

/// What a wrong result is held against.
pub(super) struct BesideTruth<'a> {
    pub(super) problem: &'a Problem,
    pub(super) truth: &'a Pose,
    pub(super) params: &'a Params,
}

impl BesideTruth<'_> {
    /// Records what a method that searches a cost compares at its result and at the truth; whether
    /// there was anything wrong to be shown.
    pub(super) fn log(&self, method: Method, result: &QueryResult, stream: &mut Stream) -> bool {
        let searches = estimator::find(method).and_then(Entry::cost).is_some();
        let pose = result.pose.as_ref().and_then(PoseReport::to_pose);
        let (true, true, Some(pose)) = (searches, is_wrong(result), pose) else {
            return false;
        };
        let Some(estimator) = estimator::find(method).map(|entry| entry.make(self.params)) else {
            return false;
        };
        let places = [
            (entities::AT_RESULT, &pose),
            (entities::AT_TRUTH, self.truth),
        ];
        for (place, world_from_query) in places {
            if let Some(comparison) = estimator.compare_at(self.problem, world_from_query) {
                for (part, picture) in direct::packed(&comparison) {
                    let part = format!("{place}/{part}");
                    stream.log_image(&entities::direct(method, &part), picture);
                }
            }
        }
        true
    }
}
