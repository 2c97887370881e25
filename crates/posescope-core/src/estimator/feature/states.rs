//! The state of each query feature, from stage to stage.

use std::sync::Arc;

use super::Pairing;
use crate::depth::LiftedMatch;
use crate::estimator::FeatureCounts;
use crate::features::{FeatureState, Match, MatchVerdict};

/// The state of each query feature, brought up to date by every stage until the one it ends in.
#[derive(Default)]
pub(in crate::estimator) struct FeatureStates {
    states: Vec<FeatureState>,
}

impl FeatureStates {
    /// At first no feature has a match at all.
    pub(in crate::estimator) fn new(keypoints: usize) -> Self {
        Self { states: vec![FeatureState::RatioFailed { ratio: f32::INFINITY }; keypoints] }
    }

    /// Returns the unique matches as (query, reference) indices.
    pub(in crate::estimator) fn after_matching(
        &mut self,
        decisions: &[Option<Match>],
    ) -> Vec<(usize, usize)> {
        let mut matches = Vec::new();
        for decision in decisions.iter().flatten() {
            self.states[decision.query] = match decision.verdict {
                MatchVerdict::Ambiguous => FeatureState::RatioFailed { ratio: decision.ratio },
                MatchVerdict::NotUnique { rival } => FeatureState::NotUnique { rival },
                MatchVerdict::Candidate => {
                    matches.push((decision.query, decision.reference));
                    // Until a pose explains it, nothing does.
                    FeatureState::Outlier { residual_px: f64::INFINITY }
                }
            };
        }
        matches
    }

    pub(in crate::estimator) fn after_depth_lift(&mut self, lifted: &[LiftedMatch]) {
        for lifted in lifted.iter().filter(|lifted| lifted.point.is_none()) {
            self.states[lifted.query] =
                FeatureState::NoDepth { distance_px: lifted.lidar_distance_px };
        }
    }

    /// What a pose makes of matches, by their residuals \[px\]: inliers are within the threshold.
    pub(in crate::estimator) fn after_pose(
        &mut self,
        pairings: &[Pairing],
        residuals_px: &[f64],
        threshold_px: f64,
    ) {
        for (pairing, &residual_px) in pairings.iter().zip(residuals_px) {
            self.states[pairing.query] = if residual_px <= threshold_px {
                FeatureState::Inlier { residual_px }
            } else {
                FeatureState::Outlier { residual_px }
            };
        }
    }

    /// The counts that the states add up to.
    pub(in crate::estimator) fn counts(&self, reference_keypoints: usize) -> FeatureCounts {
        let mut counts = FeatureCounts {
            query_keypoints: self.states.len(),
            reference_keypoints,
            ..FeatureCounts::default()
        };
        for state in &self.states {
            let tests = [
                &mut counts.ratio_passed,
                &mut counts.unique,
                &mut counts.with_depth,
                &mut counts.inliers,
            ];
            // It passed as many tests as there are states before it.
            for count in tests.into_iter().take(state.index()) {
                *count += 1;
            }
        }
        counts
    }

    pub(in crate::estimator) fn shared(&self) -> Arc<[FeatureState]> {
        self.states.as_slice().into()
    }
}
