//! What an estimator has reported about each query feature.

use nalgebra::Point3;

use crate::camera::Intrinsics;
use crate::depth::LiftedMatch;
use crate::event::{Event, Side};
use crate::features::{FeatureState, Keypoint, Match, MatchVerdict};
use crate::geometry::Pose;
use crate::trace::Record;

/// The features of both photos, and how far each has come.
#[derive(Clone, Copy, Default)]
pub struct FeatureProgress<'a> {
    /// Whether the query's keypoints are known, even if there are none.
    pub has_begun: bool,
    /// Query keypoints; none before they are detected.
    pub query: &'a [Keypoint],
    /// Reference keypoints; none before they are detected.
    pub reference: &'a [Keypoint],
    decisions: Option<&'a [Option<Match>]>,
    /// The matches that were lifted into space, or should have been.
    pub lifted: &'a [LiftedMatch],
    /// Where the query features ended.
    pub states: Option<&'a [FeatureState]>,
    /// The best pose so far: that of MLESAC, then the refined one.
    pub reference_from_query: Option<Pose>,
    /// The pose of the trial at the cursor, or the refined one. Until the states are known, it says which matches it
    /// explains.
    trial: Option<Pose>,
    /// What judges a match by a pose.
    judge: Option<Judge<'a>>,
}

/// The query's camera; matches with a larger reprojection error \[px\] are outliers.
type Judge<'a> = (&'a Intrinsics, f64);

impl<'a> FeatureProgress<'a> {
    /// The progress of a part of a run, from its records. Matches with a larger reprojection error than the threshold
    /// are outliers.
    pub fn of(
        records: impl IntoIterator<Item = &'a Record>,
        camera: Option<&'a Intrinsics>,
        threshold_px: f64,
    ) -> Self {
        let mut progress =
            Self { judge: camera.map(|camera| (camera, threshold_px)), ..Self::default() };
        for record in records {
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
    pub fn matched(&self, feature: usize) -> Option<&'a Match> {
        self.decisions?.get(feature)?.as_ref()
    }

    /// What the depth lift said about a query feature.
    pub fn lifted(&self, feature: usize) -> Option<&'a LiftedMatch> {
        let at = self.lifted.binary_search_by_key(&feature, |lifted| lifted.query);
        self.lifted.get(at.ok()?)
    }

    /// Where a query feature has ended as far as it is known, or stands for the trial at the cursor; `None` while
    /// nothing tells. A feature that a test rejected is known at once.
    pub fn state(&self, feature: usize) -> Option<FeatureState> {
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

    /// Whether nothing was matched yet.
    pub fn is_unmatched(&self) -> bool {
        self.decisions.is_none()
    }
}

/// How far from its keypoint a point is seen \[px\]; `None` behind the camera.
pub fn residual_px(
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

    const UNDECIDED: usize = FeatureState::NAMES.len();
    const INLIER: usize = UNDECIDED - 1;

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

    /// The position of each state in [`FeatureState::NAMES`], behind them where there is none yet.
    fn kinds(progress: &FeatureProgress<'_>) -> Vec<usize> {
        let states = (0..progress.query.len()).map(|feature| progress.state(feature));
        states.map(|state| state.map_or(UNDECIDED, |state| state.index())).collect()
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
        assert_eq!(kinds(&progress), [UNDECIDED; 5]);
        progress.decisions = Some(&decisions);
        assert_eq!(kinds(&progress), [0, 1, UNDECIDED, UNDECIDED, 0]);
        let lifted = [2, 3].map(|feature| LiftedMatch {
            query: feature,
            reference: 0,
            lidar_distance_px: 1.5,
            depth_range_m: None,
            point: (feature == 3).then(|| Point3::new(0.0, 0.0, 9.0)),
        });
        progress.lifted = &lifted;
        assert_eq!(kinds(&progress), [0, 1, 2, UNDECIDED, 0]);

        // The point on the axis is seen at the centre, right where the keypoint is: an inlier of this pose.
        let camera = Intrinsics { fx: 9.0, fy: 9.0, cx: 4.0, cy: 1.0, width: 20, height: 20 };
        let poses = [0.0, 3.0].map(|right_m| Pose::translation(right_m, 0.0, 0.0));
        progress.judge = Some((&camera, 2.0));
        for (pose, state) in poses.into_iter().zip([INLIER, INLIER - 1]) {
            progress.trial = Some(pose);
            assert_eq!(kinds(&progress), [0, 1, 2, state, 0]);
        }
    }
}
