//! What an estimator has reported up to the cursor about each query feature.

use egui::Color32;
use nalgebra::Point3;

use super::mark_shape::MarkShape;
use crate::app::{ViewContext, theme};
use crate::camera::Intrinsics;
use crate::depth::LiftedMatch;
use crate::estimator::{self, Family};
use crate::event::{Event, Side};
use crate::features::{FeatureState, Keypoint, Match, MatchVerdict};
use crate::geometry::Pose;
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

/// The features of both photos, and how far each has come.
#[derive(Clone, Copy, Default)]
pub(super) struct FeatureProgress<'a> {
    /// Whether the query's keypoints are known, even if there are none.
    pub(super) has_begun: bool,
    /// Query keypoints; none before they are detected.
    pub(super) query: &'a [Keypoint],
    /// Reference keypoints; none before they are detected.
    pub(super) reference: &'a [Keypoint],
    decisions: Option<&'a [Option<Match>]>,
    /// The matches that were lifted into space, or should have been.
    pub(super) lifted: &'a [LiftedMatch],
    /// Where the query features ended.
    pub(super) states: Option<&'a [FeatureState]>,
    /// The best pose so far: that of MLESAC, then the refined one.
    pub(super) reference_from_query: Option<Pose>,
    /// The pose of the trial at the cursor, or the refined one. Until the states are known, it says which matches it
    /// explains.
    trial: Option<Pose>,
    /// What judges a match by a pose.
    judge: Option<Judge<'a>>,
}

/// The query's camera; matches with a larger reprojection error \[px\] are outliers.
type Judge<'a> = (&'a Intrinsics, f64);

impl<'a> FeatureProgress<'a> {
    /// The progress at the cursor; for the direct methods that of FB, or of the hybrid where FB was
    /// not asked to run.
    pub(super) fn at(context: &ViewContext<'a>) -> Self {
        let with_features = |method: Method| {
            estimator::find(method).is_some_and(|entry| match entry.hybrid() {
                Some(parts) => parts.first == Method::FB,
                None => entry.family == Some(Family::Features),
            })
        };
        let asked = context.setup.task.protocol.methods.iter().copied();
        let methods = context.method().into_iter().chain(asked);
        let mut parts = methods.filter(|method| with_features(*method));
        let part = parts.find_map(|method| context.part_of(method));
        part.map_or_else(Self::default, |(span, cursor)| Self::of(context, span, cursor))
    }

    /// The progress of a part up to a cursor.
    pub(super) fn of(context: &ViewContext<'a>, span: &Span, cursor: usize) -> Self {
        let threshold_px = context.run.params.fb.mlesac.inlier_threshold_px;
        let camera = context.problem().map(|problem| &problem.query.intrinsics);
        let mut progress =
            Self { judge: camera.map(|camera| (camera, threshold_px)), ..Self::default() };
        for record in context.run.until(span, cursor) {
            match &record.event {
                Event::FeaturesDetected(detected) => match detected.side {
                    Side::Query => {
                        progress.has_begun = true;
                        progress.query = &detected.features.keypoints;
                    }
                    Side::Reference => progress.reference = &detected.features.keypoints,
                },
                Event::MatchesDecided(decided) => progress.decisions = Some(&decided.decisions),
                Event::DepthsLifted(lifted) => progress.lifted = &lifted.matches,
                Event::MatchesGuided(guided) => progress.lifted = &guided.matches,
                Event::HypothesisTried(tried) => {
                    progress.trial = tried.trial.hypothesis.as_ref().map(|one| one.pose);
                    if let Some(best) = &tried.trial.best {
                        progress.reference_from_query = Some(best.pose.inverse());
                    }
                }
                Event::PoseRefined(refined) => {
                    progress.trial = Some(refined.reference_from_query.inverse());
                    progress.reference_from_query = Some(refined.reference_from_query);
                }
                Event::FeaturesClassified(classified) => progress.states = Some(&classified.states),
                _ => {}
            }
        }
        progress
    }

    /// The nearest reference feature of a query feature, once it is known.
    pub(super) fn matched(&self, feature: usize) -> Option<&'a Match> {
        self.decisions?.get(feature)?.as_ref()
    }

    /// What the depth lift said about a query feature.
    pub(super) fn lifted(&self, feature: usize) -> Option<&'a LiftedMatch> {
        let at = self.lifted.binary_search_by_key(&feature, |lifted| lifted.query);
        self.lifted.get(at.ok()?)
    }

    /// Where a query feature has ended as far as it is known, or stands for the trial at the cursor; `None` while
    /// nothing tells. A feature that a test rejected is known at once.
    pub(super) fn state(&self, feature: usize) -> Option<FeatureState> {
        if let Some(states) = self.states {
            return states.get(feature).copied();
        }
        let Some(found) = self.decisions?.get(feature)? else {
            return Some(FeatureState::RatioFailed { ratio: f32::INFINITY });
        };
        match found.verdict {
            MatchVerdict::Ambiguous => Some(FeatureState::RatioFailed { ratio: found.ratio }),
            MatchVerdict::NotUnique { rival } => Some(FeatureState::NotUnique { rival }),
            MatchVerdict::Candidate => {
                let lifted = self.lifted(feature)?;
                let Some(point) = &lifted.point else {
                    return Some(FeatureState::NoDepth { distance_px: lifted.lidar_distance_px });
                };
                self.judged(self.query.get(feature)?, point)
            }
        }
    }

    /// Whether the trial at the cursor explains a match.
    fn judged(&self, keypoint: &Keypoint, point: &Point3<f64>) -> Option<FeatureState> {
        let (camera, threshold_px) = self.judge?;
        let residual_px = residual_px(camera, &self.trial?, point, keypoint);
        let residual_px = residual_px.unwrap_or(f64::INFINITY);
        Some(if residual_px <= threshold_px {
            FeatureState::Inlier { residual_px }
        } else {
            FeatureState::Outlier { residual_px }
        })
    }

    /// A query feature's state with the number that decided it.
    pub(super) fn words(&self, feature: usize) -> String {
        let Some(state) = self.state(feature) else {
            return name(UNDECIDED).to_owned();
        };
        let decided_by = match state {
            FeatureState::RatioFailed { ratio } if ratio.is_infinite() => {
                "nothing to match".to_owned()
            }
            FeatureState::RatioFailed { ratio } => format!("ratio {ratio:.3}"),
            FeatureState::NotUnique { rival } => format!("nearer to query feature {rival}"),
            FeatureState::NoDepth { distance_px } => format!("LiDAR {distance_px:.2} px away"),
            FeatureState::Outlier { residual_px } | FeatureState::Inlier { residual_px } => {
                error_px(residual_px)
            }
        };
        format!("{}: {decided_by}", name(state.index()))
    }

    /// Whether nothing was matched yet.
    pub(super) fn is_unmatched(&self) -> bool {
        self.decisions.is_none()
    }

    /// The position of each query feature's state in [`FeatureState::NAMES`], or [`UNDECIDED`].
    pub(super) fn kinds(&self) -> Vec<usize> {
        (0..self.query.len())
            .map(|feature| self.state(feature).map_or(UNDECIDED, |state| state.index()))
            .collect()
    }
}

/// A reprojection error in words.
pub(super) fn error_px(residual_px: f64) -> String {
    if residual_px.is_infinite() { "no pose".to_owned() } else { format!("{residual_px:.2} px") }
}

/// How far from its keypoint a point is seen \[px\]; `None` behind the camera.
pub(super) fn residual_px(
    camera: &Intrinsics,
    camera_from_points: &Pose,
    point: &Point3<f64>,
    keypoint: &Keypoint,
) -> Option<f64> {
    let seen = camera.project(&(camera_from_points * point))?;
    Some((seen - keypoint.pixel()).norm())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keypoints(columns: &[f32]) -> Vec<Keypoint> {
        let keypoint = |&x: &f32| Keypoint {
            x,
            y: 1.0,
            scale: 2.0,
            angle: 0.0,
            response: 1.0,
            laplacian_positive: true,
        };
        columns.iter().map(keypoint).collect()
    }

    fn decision(query: usize, verdict: MatchVerdict) -> Option<Match> {
        Some(Match { query, reference: 0, distance: 0.3, ratio: 0.8, verdict })
    }

    #[test]
    fn a_feature_is_decided_as_soon_as_a_test_rejects_it() {
        let query = keypoints(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let decisions = [
            decision(0, MatchVerdict::Ambiguous),
            decision(1, MatchVerdict::NotUnique { rival: 0 }),
            decision(2, MatchVerdict::Candidate),
            decision(3, MatchVerdict::Candidate),
            None,
        ];
        let mut progress = FeatureProgress { query: &query, ..FeatureProgress::default() };
        assert_eq!(progress.kinds(), [UNDECIDED; 5]);
        progress.decisions = Some(&decisions);
        assert_eq!(progress.kinds(), [0, 1, UNDECIDED, UNDECIDED, 0]);
        let lifted = [2, 3].map(|feature| LiftedMatch {
            query: feature,
            reference: 0,
            lidar_distance_px: 1.5,
            depth_range_m: None,
            point: (feature == 3).then(|| Point3::new(0.0, 0.0, 9.0)),
        });
        progress.lifted = &lifted;
        assert_eq!(progress.kinds(), [0, 1, 2, UNDECIDED, 0]);

        // The point on the axis is seen at the centre, right where the keypoint is: an inlier of this pose.
        let camera = Intrinsics { fx: 9.0, fy: 9.0, cx: 4.0, cy: 1.0, width: 20, height: 20 };
        let poses = [0.0, 3.0].map(|right_m| Pose::translation(right_m, 0.0, 0.0));
        progress.judge = Some((&camera, 2.0));
        for (pose, state) in poses.into_iter().zip([INLIER, INLIER - 1]) {
            progress.trial = Some(pose);
            assert_eq!(progress.kinds(), [0, 1, 2, state, 0]);
        }
    }
}
