//! What an estimator has reported up to the cursor about each query feature, and how that looks.

use std::borrow::Cow;

use egui::Color32;

use super::legend::MarkShape;
use crate::app::{ViewContext, theme};
use crate::estimator::{self, Family};
use crate::feature_progress::FeatureProgress;
use crate::features::{FeatureState, Keypoint};
use crate::method::Method;
use crate::robust::MlesacParams;
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

/// The method at the cursor, one that it has run inside itself, and then those that are asked for, of those that match
/// features: with what they are, or of a hybrid what its first part is.
pub(super) fn methods<'a>(
    context: &ViewContext<'a>,
) -> impl Iterator<Item = (Method, Method)> + use<'a> {
    let params = &context.run.params;
    let asked = context.setup.task.protocol.methods.iter().copied();
    let matching = move |method: Method| {
        let first = estimator::find(method)?.hybrid().map_or(method, |parts| parts.first);
        let family = estimator::find(first)?.family(params);
        matches!(family, Some(Family::Features | Family::Guided)).then_some((method, first))
    };
    let inside = context.inside(|method| matching(method).is_some()).map(|(method, ..)| method);
    context.method().into_iter().chain(inside).chain(asked).filter_map(matching)
}

/// The part of a method of [`methods`], and the cursor in it.
pub(super) fn part_of<'a>(
    context: &ViewContext<'a>,
    method: Method,
) -> Option<(Cow<'a, Span>, usize)> {
    let inside = context.inside(|inner| inner == method);
    let inside = inside.map(|(_, span, cursor)| (Cow::Owned(span), cursor));
    inside.or_else(|| context.part_of(method).map(|(span, cursor)| (Cow::Borrowed(span), cursor)))
}

/// How the method whose matches are shown agrees on a pose.
pub(super) fn mlesac<'a>(context: &ViewContext<'a>) -> &'a MlesacParams {
    let params = &context.run.params;
    let shown = methods(context).next().and_then(|(_, method)| estimator::find(method));
    match shown.and_then(|entry| entry.family(params)) {
        Some(Family::Guided) => &params.fb2.mlesac,
        _ => &params.fb.mlesac,
    }
}

/// The progress at the cursor; for the direct methods that of the FB or `fb2` inside them, or of these alone, or of the
/// hybrid where these were not asked to run.
pub(super) fn at<'a>(context: &ViewContext<'a>) -> FeatureProgress<'a> {
    let part = methods(context).find_map(|(method, _)| part_of(context, method));
    part.map_or_else(FeatureProgress::default, |(span, cursor)| of(context, &span, cursor))
}

/// The progress of a part up to a cursor.
pub(super) fn of<'a>(context: &ViewContext<'a>, span: &Span, cursor: usize) -> FeatureProgress<'a> {
    let threshold_px = mlesac(context).inlier_threshold_px;
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
