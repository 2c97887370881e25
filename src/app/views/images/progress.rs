//! What FB has reported up to the cursor about each query feature.

use std::sync::Arc;

use nalgebra::Point3;

use crate::app::ViewContext;
use crate::camera::Intrinsics;
use crate::depth::LiftedMatch;
use crate::estimator::{self, Parts};
use crate::event::{Event, Side};
use crate::features::FeatureState;
use crate::features::{Features, Keypoint, Match, MatchVerdict};
use crate::geometry::Pose;
use crate::method::Method;
use crate::session::{Run, Span};

/// Position of the inliers in [`FeatureState::NAMES`].
pub(super) const INLIER: usize = UNDECIDED - 1;
/// Position of "undecided" after those of [`FeatureState::NAMES`].
pub(super) const UNDECIDED: usize = FeatureState::NAMES.len();
/// The states and "undecided".
pub(super) const KINDS: usize = UNDECIDED + 1;

/// The name of a state, or of none yet.
pub(super) fn name(kind: usize) -> &'static str {
    const NAMES: [&str; KINDS] =
        ["ratio failed", "not unique", "no depth", "outlier", "inlier", "undecided"];
    NAMES[kind]
}

/// The features of both photos, and how far each has come.
#[derive(Clone, Copy, Default)]
pub(super) struct FeatureProgress<'a> {
    query: Option<&'a Arc<Features>>,
    reference: Option<&'a Arc<Features>>,
    decisions: Option<&'a [Option<Match>]>,
    lifted: Option<&'a [LiftedMatch]>,
    states: Option<&'a [FeatureState]>,
    trial: Option<TrialPose<'a>>,
}

/// The pose of the trial at the cursor, or the refined one. Until the states are known, it says which matches it explains.
#[derive(Clone, Copy)]
struct TrialPose<'a> {
    query_from_reference: Pose,
    camera: &'a Intrinsics,
    /// Matches with a larger reprojection error are outliers.
    threshold_px: f64,
}

impl TrialPose<'_> {
    fn state(&self, keypoint: &Keypoint, point: &Point3<f64>) -> FeatureState {
        let seen = self.camera.project(&(self.query_from_reference * point));
        let residual_px = seen.map_or(f64::INFINITY, |seen| (seen - keypoint.pixel()).norm());
        if residual_px <= self.threshold_px {
            FeatureState::Inlier { residual_px }
        } else {
            FeatureState::Outlier { residual_px }
        }
    }
}

impl<'a> FeatureProgress<'a> {
    /// The progress at the cursor; for the direct methods that of FB, or of the hybrid where FB was
    /// not asked to run.
    pub(super) fn at(context: &ViewContext<'a>) -> Self {
        let with_features = |method: Method| {
            estimator::find(method).is_some_and(|entry| match entry.hybrid() {
                Some(parts) => parts.first == Method::FB,
                None => matches!(entry.parts, Parts::Features),
            })
        };
        let asked = context.setup.task.protocol.methods.iter().copied();
        let mut methods = context.method().into_iter().chain(asked);
        methods
            .find_map(|method| with_features(method).then(|| context.part_of(method))?)
            .map_or_else(Self::default, |(span, cursor)| {
                let camera = context.problem().map(|problem| &problem.query.intrinsics);
                let threshold_px = context.run.params.fb.mlesac.inlier_threshold_px;
                Self::until(context.run, span, cursor, camera.map(|camera| (camera, threshold_px)))
            })
    }

    fn until(
        run: &'a Run,
        span: &Span,
        cursor: usize,
        judge: Option<(&'a Intrinsics, f64)>,
    ) -> Self {
        let mut progress = Self::default();
        let judged = |query_from_reference: Pose| {
            let (camera, threshold_px) = judge?;
            Some(TrialPose { query_from_reference, camera, threshold_px })
        };
        let end = span.records.end.min(cursor.saturating_add(1));
        for record in &run.records()[span.records.start.min(end)..end] {
            match &record.event {
                Event::FeaturesDetected(detected) => match detected.side {
                    Side::Query => progress.query = Some(&detected.features),
                    Side::Reference => progress.reference = Some(&detected.features),
                },
                Event::MatchesDecided(decided) => progress.decisions = Some(&decided.decisions),
                Event::DepthsLifted(lifted) => progress.lifted = Some(&lifted.matches),
                Event::MatchesGuided(guided) => progress.lifted = Some(&guided.matches),
                Event::HypothesisTried(tried) => {
                    progress.trial =
                        tried.trial.hypothesis.as_ref().and_then(|one| judged(one.pose));
                }
                Event::PoseRefined(refined) => {
                    progress.trial = judged(refined.reference_from_query.inverse());
                }
                Event::FeaturesClassified(classified) => progress.states = Some(&classified.states),
                _ => {}
            }
        }
        progress
    }

    /// Whether the query's keypoints are known, even if there are none.
    pub(super) fn has_begun(&self) -> bool {
        self.query.is_some()
    }

    /// Query keypoints; none before they are detected.
    pub(super) fn query(&self) -> &'a [Keypoint] {
        self.query.map_or(&[], |features| &features.keypoints)
    }

    /// Reference keypoints; none before they are detected.
    pub(super) fn reference(&self) -> &'a [Keypoint] {
        self.reference.map_or(&[], |features| &features.keypoints)
    }

    /// The nearest reference feature of a query feature, once it is known.
    pub(super) fn matched(&self, feature: usize) -> Option<&'a Match> {
        self.decisions?.get(feature)?.as_ref()
    }

    /// What the depth lift said about a query feature.
    pub(super) fn lifted(&self, feature: usize) -> Option<&'a LiftedMatch> {
        let lifted = self.lifted?;
        let at = lifted.binary_search_by_key(&feature, |lifted| lifted.query);
        lifted.get(at.ok()?)
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
                Some(self.trial?.state(self.query().get(feature)?, point))
            }
        }
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
        (0..self.query().len())
            .map(|feature| self.state(feature).map_or(UNDECIDED, |state| state.index()))
            .collect()
    }
}

/// A reprojection error in words.
pub(super) fn error_px(residual_px: f64) -> String {
    if residual_px.is_infinite() { "no pose".to_owned() } else { format!("{residual_px:.2} px") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn features(columns: &[f32]) -> Arc<Features> {
        let keypoints = columns.iter().map(|&x| Keypoint {
            x,
            y: 1.0,
            scale: 2.0,
            angle: 0.0,
            response: 1.0,
            laplacian_positive: true,
        });
        Arc::new(Features { keypoints: keypoints.collect(), descriptors: Vec::new() })
    }

    fn decision(query: usize, verdict: MatchVerdict) -> Option<Match> {
        Some(Match { query, reference: 0, distance: 0.3, ratio: 0.8, verdict })
    }

    #[test]
    fn a_feature_is_decided_as_soon_as_a_test_rejects_it() {
        let query = features(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let decisions = [
            decision(0, MatchVerdict::Ambiguous),
            decision(1, MatchVerdict::NotUnique { rival: 0 }),
            decision(2, MatchVerdict::Candidate),
            decision(3, MatchVerdict::Candidate),
            None,
        ];
        let mut progress = FeatureProgress { query: Some(&query), ..FeatureProgress::default() };
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
        progress.lifted = Some(&lifted);
        assert_eq!(progress.kinds(), [0, 1, 2, UNDECIDED, 0]);

        // The point on the axis is seen at the centre, right where the keypoint is: an inlier of this pose.
        let camera = Intrinsics { fx: 9.0, fy: 9.0, cx: 4.0, cy: 1.0, width: 20, height: 20 };
        let poses = [0.0, 3.0].map(|right_m| Pose::translation(right_m, 0.0, 0.0));
        for (pose, state) in poses.into_iter().zip([INLIER, INLIER - 1]) {
            progress.trial =
                Some(TrialPose { query_from_reference: pose, camera: &camera, threshold_px: 2.0 });
            assert_eq!(progress.kinds(), [0, 1, 2, state, 0]);
        }
    }
}
