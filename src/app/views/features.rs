//! What an estimator has reported up to the cursor about each query feature, and how that looks.

use egui::Color32;

use super::legend::MarkShape;
use crate::app::{ViewContext, theme};
use crate::estimator::{self, Family};
use crate::feature_progress::FeatureProgress;
use crate::features::{FeatureState, Keypoint};
use crate::method::Method;
use crate::session::Span;

/// Position of the inliers in [`FeatureState::NAMES`].
pub(super) const INLIER: usize = UNDECIDED - 1;
/// Position of "undecided" after those of [`FeatureState::NAMES`].
pub(super) const UNDECIDED: usize = FeatureState::NAMES.len();
/// The states and "undecided".
pub(super) const KINDS: usize = UNDECIDED + 1;

/// The states and "undecided": their names, what they mean, and their marks.
const LOOKS: [(&str, &str, MarkShape); KINDS] = [
    (
        "ratio failed",
        "The two nearest reference features are about equally similar",
        MarkShape::Cross,
    ),
    (
        "not unique",
        "The nearest reference feature resembles another query feature more",
        MarkShape::Triangle,
    ),
    ("no depth", "No LiDAR depth near the reference keypoint", MarkShape::Ring),
    (
        "outlier",
        "The estimated pose does not explain the match, or there is no pose",
        MarkShape::Diamond,
    ),
    ("inlier", "The estimated pose explains the match", MarkShape::Disc),
    ("undecided", "Not decided at this step", MarkShape::Square),
];

/// The name of a state, or of none yet.
pub(super) fn name(kind: usize) -> &'static str {
    LOOKS[kind].0
}

/// What a state means.
pub(super) fn about(kind: usize) -> &'static str {
    LOOKS[kind].1
}

/// The mark of a state, or of none yet.
pub(super) fn mark(kind: usize) -> MarkShape {
    LOOKS[kind].2
}

/// The colour of a state, or of none yet.
pub(super) fn color(kind: usize) -> Color32 {
    if kind == UNDECIDED { theme::CAMERA } else { theme::state(kind) }
}

/// Where a keypoint is \[px\].
pub(super) fn position(keypoint: &Keypoint) -> [f32; 2] {
    [keypoint.x, keypoint.y]
}

/// The progress at the cursor; for the direct methods that of FB, or of the hybrid where FB was
/// not asked to run.
pub(super) fn at<'a>(context: &ViewContext<'a>) -> FeatureProgress<'a> {
    let with_features = |method: Method| {
        estimator::find(method).is_some_and(|entry| match entry.hybrid() {
            Some(parts) => parts.first == Method::FB,
            None => entry.family(&context.run.params) == Some(Family::Features),
        })
    };
    let asked = context.setup.task.protocol.methods.iter().copied();
    let methods = context.method().into_iter().chain(asked);
    let mut parts = methods.filter(|method| with_features(*method));
    let part = parts.find_map(|method| context.part_of(method));
    part.map_or_else(FeatureProgress::default, |(span, cursor)| of(context, span, cursor))
}

/// The progress of a part up to a cursor.
pub(super) fn of<'a>(context: &ViewContext<'a>, span: &Span, cursor: usize) -> FeatureProgress<'a> {
    let threshold_px = context.run.params.fb.mlesac.inlier_threshold_px;
    let camera = context.problem().map(|problem| problem.query().intrinsics());
    FeatureProgress::of(context.run.until(span, cursor), camera, threshold_px)
}

/// A query feature's state with the number that decided it.
pub(super) fn words(progress: &FeatureProgress<'_>, feature: usize) -> String {
    let Some(state) = progress.state(feature) else {
        return name(UNDECIDED).to_owned();
    };
    let decided_by = match state {
        FeatureState::RatioFailed { ratio } if ratio.is_infinite() => "nothing to match".to_owned(),
        FeatureState::RatioFailed { ratio } => format!("ratio {ratio:.3}"),
        FeatureState::NotUnique { rival } => format!("nearer to query feature {rival}"),
        FeatureState::NoDepth { distance_px } => format!("LiDAR {distance_px:.2} px away"),
        FeatureState::Outlier { residual_px } | FeatureState::Inlier { residual_px } => {
            error_px(residual_px)
        }
    };
    format!("{}: {decided_by}", name(state.index()))
}

/// The position of each query feature's state in [`FeatureState::NAMES`], or [`UNDECIDED`].
pub(super) fn kinds(progress: &FeatureProgress<'_>) -> Vec<usize> {
    (0..progress.query.len())
        .map(|feature| progress.state(feature).map_or(UNDECIDED, |state| state.index()))
        .collect()
}
/// A reprojection error in words.
pub(super) fn error_px(residual_px: f64) -> String {
    if residual_px.is_infinite() { "no pose".to_owned() } else { format!("{residual_px:.2} px") }
}
