//! What the layout of a recording shows first: the failures with their proofs, and all poses.

use super::blueprint::Focus;
use crate::geometry::Pose;
use crate::localize::QueryResult;
use crate::method::Method;
use crate::problem::Problem;
use crate::proof::responsible;

/// Whether a result is wrong or missing, or has a failure verdict.
pub(super) fn is_wrong(result: &QueryResult) -> bool {
    let mut verdicts = result.diagnosis.iter();
    result.grade.is_failure() || verdicts.any(|one| one.code.is_failure())
}

/// What the layout shows first, from all results of a query.
pub(super) fn focus(
    first: &Problem,
    truth: Option<&Pose>,
    results: &[QueryResult],
    proven: &[Method],
) -> Focus {
    let wrong = results.iter().filter(|result| is_wrong(result));
    let estimates = results.iter().filter_map(|result| result.pose.as_ref()?.to_pose());
    let in_reference =
        |pose: &Pose| -> [f64; 3] { first.reference_from_query(pose).translation.vector.into() };
    Focus {
        wrong: wrong.filter_map(responsible).collect(),
        proven: proven.to_vec(),
        places: estimates.chain(truth.copied()).map(|pose| in_reference(&pose)).collect(),
    }
}
