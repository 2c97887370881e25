//! The state of each query feature, from stage to stage.

use std::sync::Arc;

use crate::depth::LiftedMatch;
use crate::features::FeatureState;
use crate::features::{Match, MatchVerdict};
use crate::robust::Consensus;

/// The state of each query feature, brought up to date by every stage until the one it ends in.
pub(super) struct FeatureStates {
    states: Vec<FeatureState>,
}

impl FeatureStates {
    /// At first no feature has a match at all.
    pub(super) fn new(keypoints: usize) -> Self {
        Self {
            states: vec![
                FeatureState::RatioFailed {
                    ratio: f32::INFINITY
                };
                keypoints
            ],
        }
    }

    /// Returns the unique matches as (query, reference) indices.
    pub(super) fn after_matching(&mut self, decisions: &[Option<Match>]) -> Vec<(usize, usize)> {
        let mut matches = Vec::new();
        for decision in decisions.iter().flatten() {
            self.states[decision.query] = match decision.verdict {
                MatchVerdict::Ambiguous => FeatureState::RatioFailed {
                    ratio: decision.ratio,
                },
                MatchVerdict::NotUnique { rival } => FeatureState::NotUnique { rival },
                MatchVerdict::Candidate => {
                    matches.push((decision.query, decision.reference));
                    // Until a pose explains it, nothing does.
                    FeatureState::Outlier {
                        residual_px: f64::INFINITY,
                    }
                }
            };
        }
        matches
    }

    pub(super) fn passed_ratio_test(&self) -> usize {
        self.states
            .iter()
            .filter(|state| !matches!(state, FeatureState::RatioFailed { .. }))
            .count()
    }

    pub(super) fn after_depth_lift(&mut self, lifted: &[LiftedMatch]) {
        for lifted in lifted.iter().filter(|lifted| lifted.point.is_none()) {
            self.states[lifted.query] = FeatureState::NoDepth {
                distance_px: lifted.lidar_distance_px,
            };
        }
    }

    pub(super) fn after_consensus(&mut self, members: &[usize], consensus: &Consensus) {
        for (&query, &residual_px) in members.iter().zip(&consensus.residuals_px) {
            self.states[query] = FeatureState::Outlier { residual_px };
        }
        for &inlier in &consensus.inliers {
            self.states[members[inlier]] = FeatureState::Inlier {
                residual_px: consensus.residuals_px[inlier],
            };
        }
    }

    pub(super) fn shared(&self) -> Arc<[FeatureState]> {
        self.states.as_slice().into()
    }
}
