//! H1, F1, V1: what is made of several methods, references or places.

use serde_json::json;

use super::trust::WITHIN_M;
use super::{Code, Diagnosis, Subject, Tolerance, Trust, low_confidence};
use crate::estimator::{self, Failure};
use crate::fusion::{Share, ShareOutcome, average_pose};
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::retrieval::ReferenceRanking;

/// A hybrid that kept its first method's pose answers for it.
pub(super) fn of_hybrid(subject: &Subject<'_>, responsible: Method) -> Option<Diagnosis> {
    let parts = estimator::find(subject.method)?.hybrid()?;
    let error = subject.error()?;
    (responsible == parts.first).then(|| {
        Diagnosis::new(
            Code::H1,
            format!(
                "the hybrid kept the pose of {}, which is {error} off, and never asked {}",
                parts.first, parts.second
            ),
            json!({ "kept": parts.first.name(), "not_asked": parts.second.name() }),
        )
    })
}

/// What one reference had to say in a fusion, and what is said about it alone.
#[derive(Clone, Copy, Debug)]
pub struct Member<'a> {
    /// Its weight and its pose.
    pub share: &'a Share,
    /// The verdicts on it alone.
    pub verdicts: &'a [Diagnosis],
    /// How far its pose is to be believed.
    pub trust: Option<&'a Trust>,
}

/// The verdicts on a fused pose that is wrong, or missing: the reference without which it would be
/// right, and the verdicts on the reference of most weight. A pose that is right, or hardly to be
/// believed where nobody knows the truth, has at most L1.
pub fn diagnose_fusion(
    pose: &Result<Pose, Failure>,
    members: &[Member<'_>],
    truth: Option<&Pose>,
    tolerance: Tolerance,
) -> Vec<Diagnosis> {
    let is_right = |pose: &Pose| {
        truth.is_some_and(|truth| tolerance.contains(&PoseError::between(truth, pose)))
    };
    let mut found = Vec::new();
    let is_fused_right = pose.as_ref().is_ok_and(is_right);
    if !is_fused_right {
        if let (Ok(pose), Some(truth)) = (pose, truth) {
            found.extend(dragging(pose, members, truth, &is_right));
        }
        found.extend(of_heaviest(members));
        if let (Err(failure), true) = (pose, found.is_empty()) {
            found.push(Diagnosis::of_failure(failure));
        }
    }
    with_doubt(found, pose, members, truth)
}

/// As [`diagnose_fusion`], of a pose that is no average: of one that is wrong which reference it rests on
/// most, and the verdicts on that one alone.
pub fn diagnose_joint(
    pose: &Result<Pose, Failure>,
    members: &[Member<'_>],
    truth: Option<&Pose>,
    tolerance: Tolerance,
) -> Vec<Diagnosis> {
    let mut found = Vec::new();
    match (pose, truth) {
        (Err(failure), _) => found.push(Diagnosis::of_failure(failure)),
        (Ok(pose), Some(truth)) => {
            let error = PoseError::between(truth, pose);
            if !tolerance.contains(&error) {
                found.extend(heaviest(members).and_then(|member| resting(member, truth, &error)));
                found.extend(of_heaviest(members));
            }
        }
        (Ok(_), None) => {}
    }
    with_doubt(found, pose, members, truth)
}

/// The member of most weight, of equals the first.
fn heaviest<'m, 'a>(members: &'m [Member<'a>]) -> Option<&'m Member<'a>> {
    members
        .iter()
        .rev()
        .max_by(|a, b| a.share.weight.total_cmp(&b.share.weight))
}

/// What is wrong with the member of most weight.
fn of_heaviest(members: &[Member<'_>]) -> Vec<Diagnosis> {
    let verdicts = heaviest(members).map_or(&[][..], |member| member.verdicts);
    let is_failure = |verdict: &&Diagnosis| verdict.code.is_failure();
    verdicts.iter().filter(is_failure).cloned().collect()
}

/// On which reference a wrong joint pose rests.
fn resting(member: &Member<'_>, truth: &Pose, error: &PoseError) -> Option<Diagnosis> {
    let share = member.share;
    let support = share.support?;
    let own = share.pose.map(|own| PoseError::between(truth, &own));
    let alone = match &own {
        Some(own) => format!("its own pose is {} off", own.translation()),
        None => "alone it has no pose".to_owned(),
    };
    Some(Diagnosis::new(
        Code::F1,
        format!(
            "the joint pose, {} off, rests on reference {} at a weight of {:.2}: {}; {alone}",
            error.translation(),
            share.reference,
            share.weight,
            support.words(),
        ),
        json!({
            "reference": share.reference,
            "weight": share.weight,
            "own_error": own,
        }),
    ))
}

/// The verdicts, and whether the fused pose is hardly to be believed.
fn with_doubt(
    mut found: Vec<Diagnosis>,
    pose: &Result<Pose, Failure>,
    members: &[Member<'_>],
    truth: Option<&Pose>,
) -> Vec<Diagnosis> {
    if let Ok(pose) = pose {
        let trust = fused_trust(pose, members);
        let doubt = trust.as_ref().and_then(low_confidence);
        let place = if truth.is_none() { 0 } else { found.len() };
        found.splice(place..place, doubt);
    }
    found
}

/// How far a fused pose is to be believed: as far as the poses in it on average, by their weights. A
/// pose that the fused one is not near speaks against it.
pub fn fused_trust(pose: &Pose, members: &[Member<'_>]) -> Option<Trust> {
    let believed = |member: &Member<'_>| {
        // A joint pose may rest on what alone gives none: nothing is known of that.
        let Some(own) = member
            .share
            .pose
            .as_ref()
            .filter(|_| member.trust.is_some())
        else {
            return member.share.support.map(|_| 0.0);
        };
        let probability = member.trust?.probability?;
        let apart = PoseError::between(pose, own).translation_m;
        let supports = apart <= WITHIN_M;
        Some(if supports {
            member.share.weight * probability
        } else {
            0.0
        })
    };
    let probability = members
        .iter()
        .filter(|member| member.share.outcome == ShareOutcome::Kept)
        .map(believed)
        .sum::<Option<f64>>()?;
    Some(Trust {
        probability: Some(probability),
        position_std_m: None,
        rotation_std_deg: None,
        inlier_spread: None,
        runner_up_margin: None,
        chance_level: None,
    })
}

/// The reference without which the fused pose would be right; of several the one whose pose is farthest
/// off.
fn dragging(
    pose: &Pose,
    members: &[Member<'_>],
    truth: &Pose,
    is_right: &dyn Fn(&Pose) -> bool,
) -> Option<Diagnosis> {
    let kept: Vec<(&Member<'_>, &Pose)> = members
        .iter()
        .filter(|member| member.share.outcome == ShareOutcome::Kept)
        .filter_map(|member| Some((member, member.share.pose.as_ref()?)))
        .collect();
    let without = |left_out: usize| {
        let others = kept.iter().enumerate().filter(|(at, _)| *at != left_out);
        let others: Vec<(f64, &Pose)> = others
            .map(|(_, (member, pose))| (member.share.weight, *pose))
            .collect();
        average_pose(&others)
    };
    let culprits = kept.iter().enumerate().filter_map(|(at, (member, own))| {
        let rest = without(at).filter(is_right)?;
        Some((
            member,
            PoseError::between(truth, own),
            PoseError::between(truth, &rest),
        ))
    });
    let (member, own, rest) =
        culprits.max_by(|a, b| a.1.translation_m.total_cmp(&b.1.translation_m))?;
    let error = PoseError::between(truth, pose);
    Some(Diagnosis::new(
        Code::F1,
        format!(
            "reference {} dragged the fused pose: its own is {} off at a weight of {:.2}, and without \
             it the fused pose would be {} off instead of {}",
            member.share.reference,
            own.translation(),
            member.share.weight,
            rest.translation(),
            error.translation(),
        ),
        json!({
            "reference": member.share.reference,
            "weight": member.share.weight,
            "own_error": own,
            "error_without": rest,
        }),
    ))
}

/// Whether references that were ranked by what they look like are all of another place, and where in
/// the ranking the first of the right place is.
///
/// A frame is of the right place if it is within `radius_m` of the truth.
pub fn diagnose_ranking(
    ranking: &ReferenceRanking,
    truth: &Pose,
    radius_m: f64,
) -> Option<Diagnosis> {
    let distance = |frame: &crate::retrieval::RankedReference| {
        let pose = frame.world_from_camera.as_ref()?;
        Some((pose.translation.vector - truth.translation.vector).norm())
    };
    let is_right_place = |frame: &crate::retrieval::RankedReference| {
        distance(frame).is_some_and(|distance| distance <= radius_m)
    };
    let first = ranking.frames.iter().position(is_right_place);
    if first.is_some_and(|rank| rank < ranking.chosen) {
        return None;
    }
    let best = ranking.frames.first()?;
    let away = distance(best).map_or(String::new(), |m| format!(", {m:.2} m away"));
    let right = match first {
        Some(rank) => format!(
            "the first frame of the right place, {}, came at rank {}, and {} were taken",
            ranking.frames[rank].name,
            rank + 1,
            ranking.chosen
        ),
        None => format!(
            "no frame within {radius_m} m of the truth is among the first {}",
            ranking.frames.len()
        ),
    };
    Some(Diagnosis::new(
        Code::V1,
        format!("retrieval ranked {} first{away}; {right}", best.name),
        json!({
            "first": best.name,
            "first_distance_m": distance(best),
            "rank_of_right_place": first.map(|rank| rank + 1),
            "taken": ranking.chosen,
        }),
    ))
}
