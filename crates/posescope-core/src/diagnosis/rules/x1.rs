//! X1: the ground truth, a calibration or the units are suspect.

mod camera;
mod resized;
mod truth;

use std::cell::OnceCell;

use self::camera::{camera_by_matches, camera_of_both};
use self::resized::resized;
use self::truth::{truth_by_cost, truth_by_free_search, truth_by_matches};
use super::*;
use crate::camera::Intrinsics;
use crate::diagnosis::matches::TrueMatches;
use crate::diagnosis::readings::Reading;
use crate::diagnosis::{Evidence, Subject};
use crate::estimator::{Estimator, FeatureBased};
use crate::problem::Problem;
use crate::stats::median;
use crate::trace::Trace;

pub(super) const RULE: Rule = Rule {
    title: "a calibration, a pose convention or the ground truth is suspect",
    advice: "check calibration, pose convention and units; `posescope doctor` does",
    advice_on: |evidence| {
        let is_resized = evidence.pointer("/query/part").is_some();
        is_resized.then_some(
            "scale the keypoints to the size of the photos, or match photos of that size",
        )
    },
    applies_to: Family::ALL,
    needs_truth: false,
    test: Test::Method(test),
    // What one query says of a whole scene may be chance, and these verdicts need no suspicion.
    yields_to: |family, found| {
        let has = |key: &str| found.get(key).is_some();
        if found.get("certain").is_some_and(|certain| certain == false) {
            return Code::ALL;
        }
        let is_of_the_scene =
            has("camera") || has("wrong_depth") || has("reading") && family != Family::Given;
        if is_of_the_scene { &[Code::R1, Code::D4, Code::D7] } else { &[] }
    },
    proof: Proof::CloudOnPhoto,
    remedies: |_| {
        let ([robust, _], [farther, nearer]) = (many_starts(), other_references());
        vec![farther, robust, nearer]
    },
    ..Rule::new(Code::X1)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    if let Some(found) = units(case) {
        return Some(found);
    }
    // A query that shows nothing says nothing about a calibration either.
    if super::d5::is_textureless(case) {
        return None;
    }
    match case.family {
        Family::Features | Family::Guided => {
            // Keypoints of a resized photo look like another camera, or like a wrong truth.
            if let Some(found) = resized(case) {
                return Some(found);
            }
            let matches = case.matches()?;
            // Seen by a wrong camera, the depths of the right cloud look wrong too.
            poses(case)
                .or_else(|| camera_by_matches(case, matches))
                .or_else(|| camera_cloud_or_truth(case, matches))
        }
        Family::Given => {
            case.subject.truth?;
            given_pose(case).or_else(|| poses(case)).or_else(|| {
                let by_fb = SaidByFb::of(case)?;
                by_fb.certain.or(by_fb.hint)
            })
        }
        Family::Grid => {
            let search = case.search?;
            let by_fb = OnceCell::new();
            let by_fb = || by_fb.get_or_init(|| SaidByFb::of(case));
            poses(case)
                .or_else(|| by_fb().as_ref()?.certain.clone())
                .or_else(|| truth_by_cost(case, search))
                .or_else(|| by_fb().as_ref()?.hint.clone())
        }
        Family::MultiStart => poses(case)
            .or_else(|| truth_by_free_search(case))
            .or_else(|| SaidByFb::of(case)?.certain),
        Family::Descent => poses(case),
    }
}

/// What a method without matches learns from those of FB.
struct SaidByFb {
    /// Another camera, or a truth that is wrong.
    certain: Option<Diagnosis>,
    /// A camera that may be another one.
    hint: Option<Diagnosis>,
}

impl SaidByFb {
    fn of(case: &Case<'_>) -> Option<Self> {
        // Where the truth is not searched, that alone explains the result.
        let is_searched = match (case.family, case.search) {
            (Family::Given, _) => true,
            (_, Some(search)) => search.near_truth().is_some(),
            (_, None) => case.free_search()?.near.is_some(),
        };
        if !is_searched {
            return None;
        }
        let subject = case.subject;
        let mut evidence = Evidence::default();
        let fb = FeatureBased::new(subject.params);
        // The matches of another system would repeat its mistakes.
        let own = (case.family == Family::Given)
            .then(|| Problem { matches: None, ..subject.problem.clone() });
        let (problem, params) = (own.as_ref().unwrap_or(subject.problem), subject.params);
        let outcome = fb.estimate(problem, &mut Trace::to(&mut evidence)).ok()?;
        let of_fb = Subject::new(problem, Method::FB, params, &outcome, &evidence)
            .against(subject.truth, subject.tolerance);
        let case = Case::new(&of_fb, Family::Features, None);
        let matches = case.matches()?;
        let of_query = camera_by_matches(&case, matches);
        let of_both = if of_query.is_some() { None } else { camera_of_both(&case, matches) };
        let (of_both, hint) = match of_both {
            Some(one) if one.certain => (Some(one.found), None),
            other => (None, other.map(|one| one.found)),
        };
        let certain = of_query.or(of_both).or_else(|| truth_by_matches(&case, matches));
        Some(Self { certain, hint })
    }
}

/// What one query says of a whole scene.
struct Suspicion {
    found: Diagnosis,
    /// Whether one query is enough to say so; else it is a hint, which counts where many queries give it.
    certain: bool,
}

/// A certain suspicion, or else a hint.
fn camera_cloud_or_truth(case: &Case<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    let (camera, cloud) = (camera_of_both(case, matches), cloud(matches));
    let is_certain = |one: &Option<Suspicion>| one.as_ref().is_some_and(|one| one.certain);
    let is_of_the_scene = is_certain(&camera) || is_certain(&cloud);
    let hint = camera.or(cloud).map(|one| one.found);
    if is_of_the_scene {
        return hint;
    }
    truth_by_matches(case, matches).or(hint)
}

/// The cloud is not in metres.
fn units(case: &Case<'_>) -> Option<Diagnosis> {
    /// Median depths of a cloud that no scanner and no indoor depth camera has \[m\].
    const MIN_DEPTH_M: f64 = 0.1;
    const MAX_DEPTH_M: f64 = 400.0;
    const STRIDE: usize = 16;
    if !case.subject.params.scale.is_metric() {
        return None;
    }
    let points = case.subject.problem.reference.cloud.points.iter();
    let depths = points.step_by(STRIDE).map(|point| f64::from(point.z));
    let median_depth_m = median(&mut depths.filter(|&depth| depth > 0.0).collect::<Vec<_>>())?;
    let (unit, times) = if median_depth_m > MAX_DEPTH_M {
        ("millimetres", 1e-3)
    } else if median_depth_m < MIN_DEPTH_M {
        ("kilometres", 1e3)
    } else {
        return None;
    };
    Some(RULE.found(&Units { median_depth_m, unit, depth_in_unit_m: median_depth_m * times }))
}

evidence!(Units { median_depth_m: f64, unit: &'static str, depth_in_unit_m: f64 } =>
    "The cloud is hardly in metres: its median depth is {median_depth_m:.3} m. Read as {unit} it \
     would be {depth_in_unit_m:.1} m."
);

/// The pose agrees with the truth if the poses of the scene are read in another way.
///
/// Only for a pose that is more likely right than wrong: one of many poses agrees with something by chance.
fn poses(case: &Case<'_>) -> Option<Diagnosis> {
    const LIKELY: f64 = 0.5;
    /// How well another reading must agree with the estimate, at the paper's scale.
    const AGREEING_M: f64 = 0.5;
    const AGREEING_DEG: f64 = 2.0;
    let subject = case.subject;
    let pose = subject.outcome.pose.as_ref().ok()?;
    let truth = subject.truth?;
    let confidence = subject.confidence.as_ref();
    if confidence.is_some_and(|confidence| confidence.probability < LIKELY) {
        return None;
    }
    let reference = &subject.problem.reference.world_from_camera;
    let found = subject.problem.reference_from_query(pose);
    let stated = subject.reference_from_truth()?;
    let radius_m = subject.problem.uncertainty_radius_m;
    // In other units, near poses are nearly the same, and so is the estimate.
    let is_far = stated.translation.vector.norm() > 5.0 * radius_m;
    let readings = Reading::all().into_iter().map(|reading| {
        let reference_from_truth = reading.of(reference).inverse() * reading.of(truth);
        (reading.name, PoseError::between(&reference_from_truth, &found))
    });
    // A car that drives straight on reads alike in several axes.
    let (reading, error) = readings
        .filter(|(reading, error)| {
            (is_far || !reading.ends_with("metres"))
                && error.translation_m < case.length(AGREEING_M)
                && error.rotation_deg < AGREEING_DEG
        })
        .min_by(|a, b| a.1.translation_m.total_cmp(&b.1.translation_m))?;
    Some(RULE.found(&Poses {
        reading,
        error,
        error_as_stated: PoseError::between(&stated, &found),
    }))
}

evidence!(Poses { reading: String, error: PoseError, error_as_stated: PoseError } =>
    "The scene's poses are suspect: read as {reading}, the estimate is {} off. As stated it is {} \
     off.",
    metres(error.translation_m), metres(error_as_stated.translation_m)
);

/// The pose of another system agrees with the truth if it is read in another way.
fn given_pose(case: &Case<'_>) -> Option<Diagnosis> {
    /// How much nearer to the truth the other reading must be.
    const TIMES: f64 = 10.0;
    const AGREEING_DEG: f64 = 2.0;
    let (Family::Given, Ok(pose), Some(truth)) =
        (case.family, &case.subject.outcome.pose, case.subject.truth)
    else {
        return None;
    };
    let error_as_stated = case.subject.error()?;
    Reading::all().into_iter().find_map(|reading| {
        let error = PoseError::between(&reading.of(pose), truth);
        let is_nearer = TIMES * error.translation_m < error_as_stated.translation_m;
        // Where the place is right already, the heading decides.
        let is_turned = TIMES * error.rotation_deg < error_as_stated.rotation_deg
            && case.subject.tolerance.contains(&error);
        let agrees = error.rotation_deg < AGREEING_DEG && (is_nearer || is_turned);
        agrees.then(|| {
            let reading = reading.name;
            RULE.found(&GivenPose { reading, error, error_as_stated })
        })
    })
}

evidence!(GivenPose { reading: String, error: PoseError, error_as_stated: PoseError } =>
    "The pose of this system is in another convention: read as {reading}, it is {} and {:.1}° off, \
     not {} and {:.1}°.",
    metres(error.translation_m), error.rotation_deg,
    metres(error_as_stated.translation_m), error_as_stated.rotation_deg
);

/// Fewer matches than this stand out from no crowd.
const FEW_MATCHES: usize = 8;

/// The matches agree with the truth but their depths do not: the cloud is not that of the photo.
///
/// It is certain if nearly no depth is right.
fn cloud(matches: &TrueMatches) -> Option<Suspicion> {
    let (right_depth, wrong_depth) = (matches.funnel.lifted, matches.wrong_depth);
    let certain = wrong_depth >= 3 * FEW_MATCHES && wrong_depth > 4 * right_depth;
    let is_odd = wrong_depth >= 2 * FEW_MATCHES && wrong_depth > right_depth;
    let found = || RULE.found(&Cloud { wrong_depth, right_depth, certain });
    is_odd.then(|| Suspicion { found: found(), certain })
}

evidence!(Cloud { wrong_depth: usize, right_depth: usize, certain: bool } => {
    let fits = if *certain { "does not fit" } else { "may not fit" };
    format!(
        "The cloud {fits} the reference photo: {wrong_depth} true matches have a wrong depth, {right_depth} the \
         right one."
    )
});

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion};

    use super::*;
    use crate::diagnosis::axes::other_axes;

    /// Poses that were written in another convention are right when they are read so.
    #[test]
    fn each_convention_is_undone_by_its_reading() {
        let truth = Pose::from_parts(
            Translation3::new(3.0, -1.0, 40.0),
            UnitQuaternion::from_euler_angles(0.1, 0.7, -0.2),
        );
        let matrix = |rows: [f64; 9]| {
            let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&rows));
            UnitQuaternion::from_rotation_matrix(&rotation)
        };
        let opengl = matrix([1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]);
        let z_up = matrix([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0]);
        let q = truth.rotation.into_inner().coords;
        // w first, read as x y z w.
        let misread = Quaternion::new(q.z, q.w, q.x, q.y);
        let misread = Pose::from_parts(truth.translation, UnitQuaternion::from_quaternion(misread));
        for (given, wanted) in [
            (truth.inverse(), "camera_from_world (inverted)"),
            (truth * opengl, "camera axes (x, -y, -z)"),
            (z_up * truth, "world axes (x, -z, y)"),
            (misread, "quaternions with w first"),
        ] {
            let right = Reading::all().into_iter().find(|reading| {
                let error = PoseError::between(&reading.of(&given), &truth);
                error.translation_m < 1e-9 && error.rotation_deg < 1e-4
            });
            assert_eq!(right.map(|reading| reading.name).as_deref(), Some(wanted));
        }
        assert_eq!(other_axes().len(), 23);
    }
}
