//! X1: what cannot be the estimator's fault.

use nalgebra::Translation3;
use serde_json::json;

use super::{Code, Diagnosis, Subject};
use crate::geometry::{Pose, PoseError};

/// Median depths of a cloud that no scanner and no indoor depth camera has \[m\].
const LEAST_DEPTH_M: f64 = 0.1;
const GREATEST_DEPTH_M: f64 = 400.0;

/// How well another reading of the poses must agree with the estimate.
const AGREEING_M: f64 = 0.5;
const AGREEING_DEG: f64 = 2.0;

/// One point of so many is looked at.
const STRIDE: usize = 16;

/// The cloud is not in metres.
pub(super) fn of_units(subject: &Subject<'_>) -> Option<Diagnosis> {
    let reference = &subject.problem.reference;
    let mut depths: Vec<f32> = reference
        .cloud
        .points
        .iter()
        .step_by(STRIDE)
        .map(|point| point.z)
        .filter(|&depth| depth > 0.0)
        .collect();
    let middle = depths.len().checked_sub(1)? / 2;
    let median_m = f64::from(*depths.select_nth_unstable_by(middle, f32::total_cmp).1);
    let (words, times) = if median_m > GREATEST_DEPTH_M {
        ("millimetres", 1e-3)
    } else if median_m < LEAST_DEPTH_M {
        ("kilometres", 1e3)
    } else {
        return None;
    };
    Some(Diagnosis::new(
        Code::X1,
        format!(
            "the median depth of the cloud before the reference camera is {median_m:.3} m: it is \
             hardly in metres (as {words} it would be {:.1} m)",
            median_m * times
        ),
        json!({ "median_depth_m": median_m }),
    ))
}

/// The pose agrees with the truth if the poses of the scene are read in another way.
///
/// Only for a pose that is to be believed: one of many poses agrees with something by chance.
pub(super) fn of_poses(subject: &Subject<'_>) -> Option<Diagnosis> {
    let pose = subject.outcome.pose.as_ref().ok()?;
    let truth = subject.truth?;
    const BELIEVED: f64 = 0.5;
    let probability = subject.trust.as_ref().and_then(|trust| trust.probability);
    if probability.is_some_and(|probability| probability < BELIEVED) {
        return None;
    }
    let reference = &subject.problem.reference.world_from_camera;
    let found = subject.problem.reference_from_query(pose);
    let stated = subject.reference_from_truth()?;
    let inverted = reference * truth.inverse();
    let in_metres = Pose::from_parts(
        Translation3::from(stated.translation.vector / 1000.0),
        stated.rotation,
    );
    let radius_m = subject.problem.uncertainty_radius_m;
    let is_far = stated.translation.vector.norm() > 5.0 * radius_m;
    let readings = [
        ("inverted, as camera_from_world", inverted, true),
        ("in millimetres", in_metres, is_far),
    ];
    let agreeing = readings.into_iter().find(|(_, reading, is_possible)| {
        let error = PoseError::between(reading, &found);
        *is_possible && error.translation_m < AGREEING_M && error.rotation_deg < AGREEING_DEG
    });
    let (words, reading, _) = agreeing?;
    let error = PoseError::between(&reading, &found);
    Some(Diagnosis::new(
        Code::X1,
        format!(
            "the estimate is {error} from the truth if the poses of the scene are read as {words}, and \
             {} from it as they are stated",
            PoseError::between(&stated, &found)
        ),
        json!({ "reading": words, "error": error }),
    ))
}
