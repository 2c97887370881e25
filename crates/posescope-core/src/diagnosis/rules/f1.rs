//! F1: one reference dragged the fusion.

use super::*;
use crate::diagnosis::case::heaviest;
use crate::fusion::{ShareOutcome, average_pose};

pub(super) const RULE: Rule = Rule {
    title: "one reference dragged the fusion",
    advice: "use --fusion joint or --fusion r-wavg",
    test: Test::Fusion(test),
    decided_at: DecidedAt::Stage(Stage::Fuse),
    proof: Proof::PoseMap,
    remedies: |_| ["joint", "r-wavg", "maxf"].map(|name| vec![Change::Fusion(name)]).into(),
    ..Rule::new(Code::F1)
};

fn test(case: &FusionCase<'_>) -> Option<Diagnosis> {
    let pose = case.pose.as_ref().ok()?;
    let error = PoseError::between(case.truth, pose);
    if case.is_joint {
        resting(heaviest(case.members)?, case.truth, error)
    } else {
        dragging(case, error)
    }
}

/// The reference without which the fused pose would be right; of several the one whose pose is farthest
/// off.
fn dragging(case: &FusionCase<'_>, error: PoseError) -> Option<Diagnosis> {
    let kept: Vec<(&Member<'_>, &Pose)> = case
        .members
        .iter()
        .filter(|member| member.share.outcome == ShareOutcome::Kept)
        .filter_map(|member| Some((member, member.share.pose.as_ref()?)))
        .collect();
    let is_right = |pose: &Pose| (case.tolerance).contains(&PoseError::between(case.truth, pose));
    let without = |left_out: usize| {
        let others = kept.iter().enumerate().filter(|(at, _)| *at != left_out);
        let others: Vec<(f64, &Pose)> =
            others.map(|(_, (member, pose))| (member.share.weight, *pose)).collect();
        average_pose(&others)
    };
    let culprits = kept.iter().enumerate().filter_map(|(at, (member, own))| {
        let rest = without(at).filter(is_right)?;
        Some((member, PoseError::between(case.truth, own), PoseError::between(case.truth, &rest)))
    });
    let (member, own_error, error_without) =
        culprits.max_by(|a, b| a.1.translation_m.total_cmp(&b.1.translation_m))?;
    Some(RULE.found(&Dragged {
        reference: member.share.reference.clone(),
        weight: member.share.weight,
        own_error,
        error_without,
        error,
    }))
}

evidence!(Dragged {
    reference: String,
    weight: f64,
    own_error: PoseError,
    error_without: PoseError,
    error: PoseError,
} => {
    let [own, without, fused] =
        [own_error, error_without, error].map(|error| metres(error.translation_m));
    format!(
        "Reference {reference} dragged the fused pose: alone it puts the query {own} off. Without it the \
         fused pose is {without} off, with it {fused}."
    )
});

/// On which reference a wrong joint pose rests.
fn resting(member: &Member<'_>, truth: &Pose, error: PoseError) -> Option<Diagnosis> {
    let share = member.share;
    let support = share.support?;
    Some(RULE.found(&Resting {
        reference: share.reference.clone(),
        weight: share.weight,
        own_error: share.pose.map(|own| PoseError::between(truth, &own)),
        error,
        support: support.words(),
    }))
}

evidence!(Resting {
    reference: String,
    weight: f64,
    own_error: Option<PoseError>,
    error: PoseError,
    support: String,
} => {
    let off = metres(error.translation_m);
    let alone = match own_error {
        Some(own) => format!("Alone it puts the query {} off.", metres(own.translation_m)),
        None => "Alone it has no pose.".to_owned(),
    };
    format!("The joint pose is {off} off and rests on reference {reference} (weight {weight:.2}). {alone}")
});
