//! What FB remembers of two photos, and what it depends on.

use std::sync::Arc;

use crate::camera::Intrinsics;
use crate::estimator::Failure;
use crate::features::{Match, SurfParams};
use crate::memo::{Exact, MemoId, Remembered};
use crate::robust::{Consensus, MlesacParams, Trial};
use crate::solver::Correspondence;

/// What the matches of two photos depend on beside the query's photo.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct MatchesKey {
    pub reference: MemoId,
    pub surf: Exact<SurfParams>,
    pub ratio: Exact<f64>,
    pub unique: bool,
}

/// Remembered matches.
pub(super) struct Decisions(pub Arc<[Option<Match>]>);

impl Remembered for Decisions {
    fn heap_bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}

/// All that a consensus depends on.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct ConsensusKey {
    pub camera: Exact<Intrinsics>,
    pub params: Exact<MlesacParams>,
    pub seed: u64,
    pub correspondences: Exact<[Correspondence]>,
    /// Whether the trials are kept.
    pub is_heard: bool,
}

/// What MLESAC found.
pub(super) struct Solved {
    pub outcome: Result<Consensus, Failure>,
    /// All it tried on the way, if somebody wanted to hear it and it is not too much.
    pub trials: Option<Vec<Trial>>,
}

impl Remembered for Solved {
    fn heap_bytes(&self) -> usize {
        let found = self.outcome.as_ref().map_or(0, |consensus| {
            size_of_val(consensus.inliers.as_slice())
                + size_of_val(consensus.residuals_px.as_slice())
        });
        self.trials.as_deref().map_or(0, size_of_val) + found
    }
}
