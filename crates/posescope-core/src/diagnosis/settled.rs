//! H1, D2, D3, D4 of methods that search from many starts: did the search fail, or the cost, or did the judge
//! pass over what was right?
//!
//! Nothing is frozen and no step is too coarse in six freedoms, so the pose that the truth leads to under
//! the same cost tells search from cost.

use serde_json::json;

use super::direct::textureless;
use super::{Code, Diagnosis, Subject, failure_alone, suspicion};
use crate::estimator::SixFreedoms;
use crate::geometry::{Pose, PoseError};
use crate::judge::Refined;

/// The verdicts, in the order in which they are tried.
pub(super) fn diagnose(subject: &Subject<'_>) -> Vec<Diagnosis> {
    if let Some(finding) = textureless(subject) {
        return vec![finding];
    }
    // Of another estimator that draws views nobody knows what its cost is.
    let (Some(truth), Some(summary), Some(_), Ok(pose)) = (
        subject.reference_from_truth(),
        subject.outcome.cost,
        &subject.evidence.settled,
        &subject.outcome.pose,
    ) else {
        return failure_alone(subject);
    };
    let mut found: Vec<Diagnosis> = suspicion::of_poses(subject).into_iter().collect();
    found.extend(passed_over(subject, &truth));
    let six = SixFreedoms::new(subject.params);
    found.push(match six.basin_of(subject.problem, &truth) {
        Some(near) => {
            let dearer = |pose: &Pose| six.dearer(&subject.evidence.surfaces, pose);
            let result = subject.problem.reference_from_query(pose);
            let rivals = Rivals {
                near_dearer: dearer(&near.pose),
                near,
                result_cost: summary.best,
                result_dearer: dearer(&result),
            };
            search_or_cost(subject, &truth, &rivals)
        }
        None => no_say(subject, &truth),
    });
    found
}

/// A candidate was right, and another one was taken.
fn passed_over(subject: &Subject<'_>, truth: &Pose) -> Option<Diagnosis> {
    let candidates = subject.evidence.candidates.as_ref()?;
    let (taken, others) = candidates.split_first()?;
    let error = |pose: &Pose| PoseError::between(truth, pose);
    let right = others
        .iter()
        .find(|other| subject.tolerance.contains(&error(&other.refined.pose)))?;
    Some(Diagnosis::new(
        Code::H1,
        format!(
            "the pose of {} is {} off and costs {:.4}; it was passed over for that of {}, which costs {:.4}",
            right.method,
            error(&right.refined.pose),
            right.refined.cost,
            taken.method,
            taken.refined.cost,
        ),
        json!({
            "kept": taken.method.name(),
            "cost_kept": taken.refined.cost,
            "passed_over": right.method.name(),
            "cost_passed_over": right.refined.cost,
        }),
    ))
}

/// Where the truth leads, and the result.
struct Rivals {
    near: Refined,
    /// How much dearer the pose near the truth is for being unlikely, and so the result.
    near_dearer: f64,
    result_cost: f64,
    result_dearer: f64,
}

fn search_or_cost(subject: &Subject<'_>, truth: &Pose, rivals: &Rivals) -> Diagnosis {
    let &Rivals {
        near,
        near_dearer,
        result_cost,
        result_dearer,
    } = rivals;
    let error = PoseError::between(truth, &near.pose);
    let is_there = subject.tolerance.contains(&error);
    let is_cheaper = near.cost + near_dearer < result_cost + result_dearer;
    // The cost alone may say otherwise than with what is known of poses.
    let likeliness = match (near.cost < result_cost, is_cheaper) {
        (true, false) => ", which is the likelier pose by heading, height and tilt",
        (false, true) => ", which is the less likely pose by heading, height and tilt",
        _ => "",
    };
    let evidence = json!({
        "cost_near_truth": near.cost,
        "cost_at_result": result_cost,
        "dearer_near_truth": near_dearer,
        "dearer_at_result": result_dearer,
        "near_truth_error": error,
    });
    let costs = format!(
        "refined from the truth it is {:.4}, {error} from it, and {result_cost:.4} at the result{likeliness}",
        near.cost
    );
    match (is_there, is_cheaper) {
        (true, true) => Diagnosis::new(
            Code::D3,
            format!("the search failed, not the cost: {costs}"),
            evidence,
        ),
        (true, false) => Diagnosis::new(
            Code::D2,
            format!("the cost failed, not the search: {costs}"),
            evidence,
        ),
        (false, _) => Diagnosis::new(
            Code::D2,
            format!(
                "the cost failed, not the search: refined from the truth it leads {error} away from it"
            ),
            evidence,
        ),
    }
}

/// The truth lies outside the disc, or hardly a point of the cloud is seen from there.
fn no_say(subject: &Subject<'_>, truth: &Pose) -> Diagnosis {
    let distance_m = truth.translation.vector.norm();
    let radius_m = subject.problem.uncertainty_radius_m;
    let text = if distance_m > radius_m {
        format!(
            "the truth is {distance_m:.1} m from the reference, and positions up to {radius_m:.1} m are searched"
        )
    } else {
        "from the truth too little of the cloud is seen to have a say (grid.coverage_floor), or its basin \
         leads out of the disc"
            .to_owned()
    };
    let evidence = json!({ "distance_m": distance_m, "radius_m": radius_m });
    Diagnosis::new(Code::D4, text, evidence)
}
