//! Fused poses: their verdicts and their confidence.

use super::case::{FusionCase, Member, RankingCase, heaviest};
use super::confidence::PoseConfidence;
use super::rules::{RULES, Test, low};
use super::{Code, Diagnosis, Tolerance};
use crate::estimator::Failure;
use crate::fusion::ShareOutcome;
use crate::geometry::{Pose, PoseError};
use crate::retrieval::ReferenceRanking;

/// The verdicts on a fused pose that is wrong, or missing: F1, and the verdicts on the reference of most
/// weight. A pose that is right has at most L1.
///
/// `is_joint` where all references were used at once, in place of an average: then a failure is the joint
/// estimator's own.
pub fn diagnose_fusion(
    pose: &Result<Pose, Failure>,
    members: &[Member<'_>],
    truth: Option<&Pose>,
    tolerance: Tolerance,
    is_joint: bool,
) -> Vec<Diagnosis> {
    let is_right = match (pose, truth) {
        (Ok(pose), Some(truth)) => tolerance.contains(&PoseError::between(truth, pose)),
        _ => false,
    };
    let mut found = Vec::new();
    if let (false, Some(truth)) = (is_right, truth) {
        let case = FusionCase { pose, members, truth, tolerance, is_joint };
        found.extend(RULES.iter().filter_map(|rule| match rule.test {
            Test::Fusion(test) => test(&case),
            _ => None,
        }));
    }
    // Without the truth, verdicts on single references say nothing about a joint pose.
    let is_of_members = !is_right && (!is_joint || pose.is_ok() && truth.is_some());
    if is_of_members {
        let verdicts = heaviest(members).map_or(&[][..], |member| member.verdicts);
        // What a second opinion says of one pose, it says anew of the fused one.
        let is_opinion = |code: Code| matches!(code, Code::E2 | Code::E3 | Code::E4);
        let is_kept = |code: Code| code.is_failure() && !is_opinion(code);
        let failures = verdicts.iter().filter(|verdict| is_kept(verdict.code));
        found.extend(failures.cloned());
    }
    if let (Err(failure), true) = (pose, found.is_empty()) {
        found.push(Diagnosis::of_failure(failure));
    }
    if let Ok(pose) = pose {
        let doubt = low(fused_confidence(pose, members, tolerance).as_ref());
        let place = if truth.is_none() { 0 } else { found.len() };
        found.splice(place..place, doubt);
    }
    found
}

/// The confidence of a fused pose, where a pose within the tolerance is right: that of the poses in it on average, by
/// their weights. A pose that the fused one is not near speaks against it. The interval is that of
/// the pose of most weight, because an average of poses that may share their error need not be better.
pub fn fused_confidence(
    pose: &Pose,
    members: &[Member<'_>],
    right: Tolerance,
) -> Option<PoseConfidence> {
    let supports = |member: &Member<'_>| {
        let own = member.share.pose.as_ref();
        let (Some(own), Some(confidence)) = (own, member.confidence) else {
            // A joint pose may rest on a reference that alone gives none: nothing is known of that.
            return member.share.support.map(|_| 0.0);
        };
        let apart = PoseError::between(pose, own).translation_m;
        let is_near = apart <= right.translation_m;
        Some(if is_near { member.share.weight * confidence.probability } else { 0.0 })
    };
    let kept = members.iter().filter(|member| member.share.outcome == ShareOutcome::Kept);
    let probability = kept.map(supports).sum::<Option<f64>>()?;
    let of_heaviest = heaviest(members).and_then(|member| member.confidence);
    let alone = PoseConfidence::new(probability, right.into());
    Some(match of_heaviest {
        Some(one) => PoseConfidence {
            calibrated_on: one.calibrated_on,
            lowered_by: one.lowered_by.clone(),
            within_95: one.within_95,
            covariance: one.covariance,
            position_std_m: one.position_std_m,
            rotation_std_deg: one.rotation_std_deg,
            ..alone
        },
        None => alone,
    })
}

/// Whether references that were ranked by what they look like are all of another place (V1). A frame is of
/// the right place if it is within `radius_m` of the truth.
pub fn diagnose_ranking(
    ranking: &ReferenceRanking,
    truth: &Pose,
    radius_m: f64,
) -> Option<Diagnosis> {
    let case = RankingCase { ranking, truth, radius_m };
    RULES.iter().find_map(|rule| match rule.test {
        Test::Ranking(test) => test(&case),
        _ => None,
    })
}
