//! R1 to R9: why the feature-based method has no pose, or a wrong one.

use nalgebra::Vector3;
use serde_json::json;

use super::matches::TrueMatches;
use super::{Code, Diagnosis, Subject, failure_alone, suspicion, trust};
use crate::camera::Intrinsics;
use crate::estimator::{self, Failure, FeatureBased, FeatureCounts, Guided, Parts};
use crate::geometry::PoseError;
use crate::solver::{Correspondence, pose_covariance, refine};

/// Fewer keypoints than this leave no match to chance.
const FEW_KEYPOINTS: usize = 20;

/// Fewer true matches than this stand out from no crowd of false ones.
const FEW_MATCHES: usize = 8;

/// Share of the reference's points that the query must show.
const LEAST_OVERLAP: f64 = 0.05;

/// A pose is fixed if it is off by less than this, by the covariance of its inliers \[m\].
const FIXED_M: f64 = 0.3;

/// The verdicts of FB, in the order in which they are tried.
pub(super) fn diagnose(subject: &Subject<'_>) -> Vec<Diagnosis> {
    let Some(matches) = TrueMatches::of(subject) else {
        return failure_alone(subject);
    };
    type Rule = fn(&Subject<'_>, &TrueMatches) -> Option<Diagnosis>;
    const RULES: [Rule; 12] = [
        suspect_poses,
        suspect_cloud,
        suspect_camera,
        suspect_truth,
        no_overlap,
        few_features,
        few_matches,
        bad_depths,
        loose_geometry,
        outside_prior,
        missed_model,
        refused_though_right,
    ];
    let mut found: Vec<Diagnosis> = RULES
        .iter()
        .filter_map(|rule| rule(subject, &matches))
        .collect();
    found.extend(accepted_though_wrong(subject, &matches));
    if found.is_empty() {
        found = failure_alone(subject);
    }
    for finding in &mut found {
        if let Some(evidence) = finding.evidence.as_object_mut() {
            evidence.insert("true_matches".to_owned(), matches.funnel.evidence());
        }
    }
    found
}

fn suspect_poses(subject: &Subject<'_>, _: &TrueMatches) -> Option<Diagnosis> {
    suspicion::of_poses(subject)
}

/// The matches agree with the truth but their depths do not, nearly all of them: the cloud is not that
/// of the photo.
fn suspect_cloud(_: &Subject<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    let (right, wrong) = (matches.funnel.lifted, matches.wrong_depth);
    (wrong >= 3 * FEW_MATCHES && wrong > 4 * right).then(|| {
        Diagnosis::new(
            Code::X1,
            format!(
                "{wrong} matches lie on the epipolar lines of the truth, but their depths put only \
                 {right} where they are seen: the cloud does not belong to the reference photo"
            ),
            json!({ "wrong_depth": wrong, "right_depth": right }),
        )
    })
}

/// From the true pose, another focal length and principal point explain far more matches.
fn suspect_camera(subject: &Subject<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    let query_from_reference = subject.reference_from_truth()?.inverse();
    let stated = &subject.problem.query.intrinsics;
    let threshold_px = subject.params.fb.mlesac.inlier_threshold_px;
    let explained = |camera: &Intrinsics| {
        matches
            .correspondences
            .iter()
            .filter(|c| {
                let seen = camera.project(&(query_from_reference * c.point));
                seen.is_some_and(|seen| (seen - c.pixel).norm() <= threshold_px)
            })
            .count()
    };
    let before = explained(stated);
    let (camera, after) = likeliest_camera(matches, &query_from_reference, stated)
        .map(|camera| (camera, explained(&camera)))?;
    // What another pose explains as well says nothing against the camera.
    let is_more =
        after >= 3 * FEW_MATCHES && 2 * after > 3 * before && 5 * after > 6 * matches.inliers();
    let is_other = (camera.fx / stated.fx - 1.0).abs() > 0.02
        || (camera.cx - stated.cx).hypot(camera.cy - stated.cy) > 8.0;
    (is_more && is_other).then(|| {
        Diagnosis::new(
            Code::X1,
            format!(
                "from the true pose the query camera explains {before} matches as it is stated, and \
                 {after} with a focal length of {:.0} px instead of {:.0} and its centre at ({:.0}, \
                 {:.0}) instead of ({:.0}, {:.0})",
                camera.fx, stated.fx, camera.cx, camera.cy, stated.cx, stated.cy
            ),
            json!({ "explained": before, "explained_otherwise": after, "camera": camera }),
        )
    })
}

/// The camera of one focal length and any centre that explains most matches from a pose.
///
/// Two matches fix a focal length and a centre; pairs are taken at a fixed stride, so that equal runs
/// ask equal pairs.
fn likeliest_camera(
    matches: &TrueMatches,
    query_from_reference: &crate::geometry::Pose,
    stated: &Intrinsics,
) -> Option<Intrinsics> {
    const PAIRS: usize = 400;
    const THRESHOLD_PX: f64 = 4.0;
    let rays: Vec<(nalgebra::Vector2<f64>, &Correspondence)> = matches
        .correspondences
        .iter()
        .filter_map(|correspondence| {
            let seen = query_from_reference * correspondence.point;
            (seen.z > 0.1).then(|| (seen.coords.xy() / seen.z, correspondence))
        })
        .collect();
    let count = rays.len();
    if count < FEW_MATCHES {
        return None;
    }
    let aspect = stated.fy / stated.fx;
    let camera_of = |a: usize, b: usize| {
        let ((ray_a, a), (ray_b, b)) = (rays[a], rays[b]);
        let (rays, pixels) = (ray_a - ray_b, a.pixel - b.pixel);
        let scaled = nalgebra::Vector2::new(rays.x, rays.y * aspect);
        let squared = scaled.norm_squared();
        if squared < 0.01 {
            return None;
        }
        let fx = scaled.dot(&pixels) / squared;
        let within = (0.3..3.0).contains(&(fx / stated.fx));
        within.then(|| Intrinsics {
            fx,
            fy: fx * aspect,
            cx: a.pixel.x - fx * ray_a.x,
            cy: a.pixel.y - fx * aspect * ray_a.y,
            ..*stated
        })
    };
    let support = |camera: &Intrinsics| {
        rays.iter()
            .filter(|(ray, c)| {
                let u = camera.fx * ray.x + camera.cx - c.pixel.x;
                let v = camera.fy * ray.y + camera.cy - c.pixel.y;
                u.hypot(v) <= THRESHOLD_PX
            })
            .count()
    };
    (0..PAIRS)
        .filter_map(|k| {
            let a = k * 7919 % count;
            let b = (a + 1 + k * 104_729 % (count - 1)) % count;
            let camera = camera_of(a, b)?;
            Some((support(&camera), camera))
        })
        // Of equal ones the first.
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map(|(_, camera)| camera)
}

/// The photos agree on a pose as well as photos ever do, and it is not the stated truth.
fn suspect_truth(subject: &Subject<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    const NEARLY_CERTAIN: f64 = -15.0;
    let error = subject.error().or_else(|| consensus_error(subject))?;
    let judged = subject.evidence.judged.as_ref()?;
    let (inliers, total) = (matches.inliers(), matches.correspondences.len());
    let is_certain = judged.acceptance.log10_nfa <= NEARLY_CERTAIN
        && 3 * inliers >= total
        && deviation_m(subject, matches).is_some_and(|deviation| deviation < FIXED_M);
    let supports_truth = matches.funnel.lifted;
    // What the truth explains beyond chance is there: then both are, and the truth is not suspect.
    let is_supported = would_be_accepted(subject, matches, &matches.true_ones());
    (is_certain && !is_supported && 5 * supports_truth < inliers).then(|| {
        Diagnosis::new(
            Code::X1,
            format!(
                "{inliers} of {total} matches agree on a pose that is {error} from the stated truth, \
                 which explains {supports_truth}: the truth is suspect"
            ),
            json!({ "inliers": inliers, "supports_truth": supports_truth, "error": error }),
        )
    })
}

fn no_overlap(subject: &Subject<'_>, _: &TrueMatches) -> Option<Diagnosis> {
    let query_from_reference = subject.reference_from_truth()?.inverse();
    let Subject { problem, .. } = subject;
    let mut seen = 0_usize;
    let mut shared = 0_usize;
    for point in problem.reference.cloud.points.iter().step_by(8) {
        let point = point.cast();
        let in_view = |camera: &Intrinsics, point: &nalgebra::Point3<f64>| {
            camera
                .project(point)
                .is_some_and(|pixel| camera.contains(&pixel))
        };
        if in_view(&problem.reference.intrinsics, &point) {
            seen += 1;
            let other = query_from_reference * point;
            shared += usize::from(in_view(&problem.query.intrinsics, &other));
        }
    }
    let overlap = shared as f64 / seen.max(1) as f64;
    (seen > 0 && overlap < LEAST_OVERLAP).then(|| {
        Diagnosis::new(
            Code::R1,
            format!(
                "from its true pose the query sees {:.1} % of the points that the reference sees",
                100.0 * overlap
            ),
            json!({ "overlap": overlap }),
        )
    })
}

fn few_features(subject: &Subject<'_>, _: &TrueMatches) -> Option<Diagnosis> {
    let counts = subject.outcome.counts?;
    let (query, reference) = (counts.query_keypoints, counts.reference_keypoints);
    (query.min(reference) < FEW_KEYPOINTS).then(|| {
        Diagnosis::new(
            Code::R2,
            format!("too few features: {query} in the query, {reference} in the reference"),
            json!({ "query": query, "reference": reference }),
        )
    })
}

fn few_matches(subject: &Subject<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    let funnel = &matches.funnel;
    let counts = subject.outcome.counts?;
    let without_depth = if many_without_depth(matches, counts.unique) {
        matches.wrong_depth + lost_for_depth(&counts, matches)
    } else {
        0
    };
    let true_ones = funnel.unique.max(funnel.lifted) + without_depth;
    if true_ones >= FEW_MATCHES || consensus_is_right(subject) {
        return None;
    }
    let (what, before, after) = funnel.deadliest();
    Some(Diagnosis::new(
        Code::R3,
        format!(
            "{} of {} unique matches are true; of {before} reference keypoints that could be matched \
             there {} {what}",
            funnel.unique,
            counts.unique,
            before - after.min(before),
        ),
        json!({ "unique": counts.unique, "died": what, "before": before, "after": after }),
    ))
}

/// Whether so many unique matches lie on their epipolar lines without the right depth that they cannot
/// all be false. Streets look alike, and false matches of a drive lie near epipolar lines too.
fn many_without_depth(matches: &TrueMatches, unique: usize) -> bool {
    4 * (matches.wrong_depth + matches.no_depth) >= unique
}

/// True matches that a better cloud would have kept. Where the cloud gives depths as clouds do, those
/// that have none lie where no scan reaches, and more of them would not have come from there.
fn lost_for_depth(counts: &FeatureCounts, matches: &TrueMatches) -> usize {
    /// Share of the reference keypoints that a scan gives a depth at least.
    const USUAL: f64 = 0.1;
    let keypoints = counts.reference_keypoints;
    let is_usual = matches.funnel.with_depth as f64 >= USUAL * keypoints as f64;
    if is_usual { 0 } else { matches.no_depth }
}

/// True matches whose depth is missing or wrong.
fn bad_depths(subject: &Subject<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    let right = matches.funnel.lifted;
    let (wrong, missing) = (matches.wrong_depth, matches.no_depth);
    let counts = subject.outcome.counts?;
    let lost = wrong + lost_for_depth(&counts, matches);
    let starved = right < FEW_MATCHES && lost >= FEW_MATCHES.min(counts.unique / 2);
    let misled = wrong >= FEW_MATCHES
        && wrong > right
        && !would_be_accepted(subject, matches, &matches.true_ones());
    let is_telling = many_without_depth(matches, counts.unique);
    ((starved || misled) && is_telling && !consensus_is_right(subject)).then(|| {
        Diagnosis::new(
            Code::R4,
            format!(
                "of the matches on the epipolar lines of the truth {right} have the right depth, \
                 {wrong} a wrong one and {missing} none"
            ),
            json!({ "right": right, "wrong": wrong, "missing": missing }),
        )
    })
}

/// The inliers are true, but do not fix the pose.
fn loose_geometry(subject: &Subject<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    let inliers = matches.inliers();
    subject.outcome.pose.as_ref().ok()?;
    if inliers == 0 || 2 * matches.funnel.inliers < inliers {
        return None;
    }
    let deviation_m = deviation_m(subject, matches);
    if deviation_m.is_some_and(|deviation| deviation < FIXED_M) {
        return None;
    }
    let text = match deviation_m {
        Some(deviation) => format!(
            "{} of the {inliers} inliers are true, but leave {deviation:.2} m of play",
            matches.funnel.inliers
        ),
        None => format!("the {inliers} inliers leave the pose undetermined"),
    };
    let evidence = json!({ "deviation_m": deviation_m, "inliers": inliers });
    Some(Diagnosis::new(Code::R5, text, evidence))
}

/// A pose was refused for its distance from the reference, or the right one would have been.
fn outside_prior(subject: &Subject<'_>, _: &TrueMatches) -> Option<Diagnosis> {
    if let Some(Failure::OutsideRadius {
        distance_m,
        radius_m,
    }) = subject.outcome.pose.as_ref().err()
    {
        let error = consensus_error(subject)?;
        return Some(Diagnosis::new(
            Code::R9,
            format!(
                "the pose found, {error} from the truth, is {distance_m:.1} m from the reference and \
                 was refused: the prior allows {radius_m:.1} m"
            ),
            json!({ "distance_m": distance_m, "radius_m": radius_m, "error": error }),
        ));
    }
    let distance_m = subject.reference_from_truth()?.translation.vector.norm();
    let radius_m = subject.problem.believed_within_m();
    let is_outside = distance_m > radius_m * (1.0 + subject.params.fb.radius_slack);
    is_outside.then(|| {
        Diagnosis::new(
            Code::R9,
            format!(
                "the truth is {distance_m:.1} m from the reference: a right pose would have been \
                 refused, the prior allows {radius_m:.1} m"
            ),
            json!({ "distance_m": distance_m, "radius_m": radius_m }),
        )
    })
}

/// Near the truth is a pose that explains enough matches, more than the one that MLESAC ended with.
fn missed_model(subject: &Subject<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    if consensus_is_right(subject) {
        return None;
    }
    let query_from_reference = subject.reference_from_truth()?.inverse();
    let true_ones = matches.correspondences.iter().zip(&matches.is_true);
    let supporters: Vec<Correspondence> = true_ones
        .filter_map(|(correspondence, is_true)| is_true.then_some(*correspondence))
        .collect();
    let camera = &subject.problem.query.intrinsics;
    let params = &subject.params.fb.mlesac;
    let refined = refine(&supporters, camera, &query_from_reference, params.loss()).pose;
    let error = PoseError::between(&query_from_reference.inverse(), &refined.inverse());
    let is_explained = |at: &usize| {
        let Correspondence { pixel, point } = matches.correspondences[*at];
        let seen = camera.project(&(refined * point));
        seen.is_some_and(|seen| (seen - pixel).norm() <= params.inlier_threshold_px)
    };
    let explained: Vec<usize> = (0..matches.correspondences.len())
        .filter(is_explained)
        .collect();
    let (supported, inliers) = (explained.len(), matches.inliers());
    let is_missed = subject.tolerance.contains(&error)
        && supported > inliers
        && would_be_accepted(subject, matches, &explained);
    is_missed.then(|| {
        let trials = subject
            .evidence
            .refined
            .as_ref()
            .map(|refined| refined.trials);
        Diagnosis::new(
            Code::R6,
            format!(
                "a pose near the truth explains {supported} of {} correspondences, the one that MLESAC \
                 ended with {inliers}{}",
                matches.correspondences.len(),
                trials.map_or(String::new(), |trials| format!(", after {trials} trials")),
            ),
            json!({ "supports_truth": supported, "inliers": inliers, "trials": trials }),
        )
    })
}

/// Whether the method would accept a pose that these correspondences agree on.
fn would_be_accepted(subject: &Subject<'_>, matches: &TrueMatches, inliers: &[usize]) -> bool {
    let responsible = trust::responsible(subject.method, subject.outcome);
    let camera = &subject.problem.query.intrinsics;
    let correspondences = &matches.correspondences;
    match estimator::find(responsible).map(|entry| &entry.parts) {
        Some(Parts::Features) => {
            FeatureBased::new(subject.params).would_accept(correspondences, inliers, camera)
        }
        _ => Guided::new(subject.params).would_accept(correspondences, inliers, camera),
    }
}

/// Whether the consensus, accepted or not, is right.
fn consensus_is_right(subject: &Subject<'_>) -> bool {
    consensus_error(subject).is_some_and(|error| subject.tolerance.contains(&error))
}

fn refused_though_right(subject: &Subject<'_>, _: &TrueMatches) -> Option<Diagnosis> {
    let failure = subject.outcome.pose.as_ref().err()?;
    let error = consensus_error(subject)?;
    subject.tolerance.contains(&error).then(|| {
        Diagnosis::new(
            Code::R7,
            format!("the pose was right, {error} from the truth, and was refused: {failure}"),
            json!({ "error": error }),
        )
    })
}

fn accepted_though_wrong(subject: &Subject<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    let error = subject.error()?;
    let (supported, inliers) = (matches.funnel.lifted, matches.inliers());
    Some(Diagnosis::new(
        Code::R8,
        format!(
            "{inliers} matches agree on a pose that is {error} off, {} of them true; the truth explains \
             {supported}",
            matches.funnel.inliers
        ),
        json!({ "inliers": inliers, "true_inliers": matches.funnel.inliers, "supports_truth": supported }),
    ))
}

/// The error of the consensus, accepted or not.
fn consensus_error(subject: &Subject<'_>) -> Option<PoseError> {
    let refined = subject.evidence.refined.as_ref()?;
    let pose = subject
        .problem
        .world_from_query(&refined.reference_from_query);
    Some(PoseError::between(subject.truth?, &pose))
}

/// How far the inliers of the consensus let its camera centre move \[m\]; `None` where they do not fix
/// it.
fn deviation_m(subject: &Subject<'_>, matches: &TrueMatches) -> Option<f64> {
    let refined = subject.evidence.refined.as_ref()?;
    let inliers: Vec<Correspondence> = matches
        .correspondences
        .iter()
        .zip(&matches.is_inlier)
        .filter_map(|(correspondence, is_inlier)| is_inlier.then_some(*correspondence))
        .collect();
    let covariance = pose_covariance(
        &inliers,
        &subject.problem.query.intrinsics,
        &refined.reference_from_query.inverse(),
        subject.params.fb.mlesac.sigma_px,
    )?;
    let variances = Vector3::new(covariance[(3, 3)], covariance[(4, 4)], covariance[(5, 5)]);
    Some(variances.sum().sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::matches::Funnel;
    use super::*;

    /// Of 200 reference keypoints so many have a depth; 40 true matches have none.
    fn lost(with_depth: usize) -> usize {
        let counts = FeatureCounts {
            reference_keypoints: 200,
            ..FeatureCounts::default()
        };
        let matches = TrueMatches {
            funnel: Funnel {
                with_depth,
                ..Funnel::default()
            },
            correspondences: Vec::new(),
            is_true: Vec::new(),
            is_inlier: Vec::new(),
            wrong_depth: 0,
            no_depth: 40,
        };
        lost_for_depth(&counts, &matches)
    }

    #[test]
    fn matches_without_a_depth_are_lost_where_the_cloud_is_sparser_than_clouds_are() {
        assert_eq!([0, 19].map(lost), [40, 40]);
        assert_eq!([20, 120].map(lost), [0, 0]);
    }
}
