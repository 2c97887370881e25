//! What a rule looks at: one result with all that is known about it. What takes time is computed once, when
//! the first rule asks.

use std::cell::OnceCell;

use super::Family;
use super::confidence::{self, PoseConfidence};
use super::free_search::FreeSearch;
use super::matches::{Matching, TrueMatches};
use super::search::FinishedSearch;
use super::{Diagnosis, Subject, Tolerance};
use crate::estimator::{self, Failure, FeatureBased, FeatureParams, HybridParts};
use crate::fusion::Share;
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::retrieval::ReferenceRanking;
use crate::stats::mean_and_squares;

/// A result that is wrong, missing or perhaps uncertain.
pub struct Case<'a> {
    pub(super) subject: &'a Subject<'a>,
    pub(super) family: Family,
    /// The method whose pose it is: of a hybrid the one that it took.
    pub(super) responsible: Method,
    /// The search on a grid, or what stands for one.
    pub(super) search: Option<&'a FinishedSearch<'a>>,
    /// How the method matches features, if it does.
    features: FeatureBased,
    matches: OnceCell<Option<TrueMatches>>,
    starts: OnceCell<Option<FreeSearch>>,
    contrast: OnceCell<f64>,
}

impl<'a> Case<'a> {
    pub(super) fn new(
        subject: &'a Subject<'a>,
        family: Family,
        search: Option<&'a FinishedSearch<'a>>,
    ) -> Self {
        Self {
            subject,
            family,
            responsible: confidence::responsible(subject.method, subject.outcome),
            search,
            features: FeatureBased::of(family, subject.params),
            matches: OnceCell::new(),
            starts: OnceCell::new(),
            contrast: OnceCell::new(),
        }
    }

    /// A length of a rule, at the scale of the scene.
    pub(super) fn length(&self, paper_m: f64) -> f64 {
        self.subject.params.scale.length(paper_m)
    }

    /// The parts of the hybrid that the method is, if it is one.
    pub(super) fn hybrid(&self) -> Option<HybridParts> {
        estimator::find(self.subject.method)?.hybrid()
    }

    /// What the truth says about the features and their matches; `None` where no features were sought.
    pub(super) fn matches(&self) -> Option<&TrueMatches> {
        let matches = || TrueMatches::of(self.subject, &self.matching());
        self.matches.get_or_init(matches).as_ref()
    }

    /// Where the truth leads under the cost of a search in six freedoms.
    pub(super) fn free_search(&self) -> Option<&FreeSearch> {
        let starts = || FreeSearch::of(self.subject, self.family);
        self.starts.get_or_init(starts).as_ref()
    }

    /// Standard deviation of the query's grey values.
    pub(super) fn contrast(&self) -> f64 {
        const STRIDE: usize = 7;
        *self.contrast.get_or_init(|| {
            let photo = &self.subject.problem.query.photo.gray;
            let values = photo.as_raw().iter().step_by(STRIDE);
            let values: Vec<f64> = values.map(|&value| f64::from(value)).collect();
            let squares = mean_and_squares(&values).map_or(f64::NAN, |(_, squares)| squares);
            (squares / values.len() as f64).sqrt()
        })
    }

    /// How the method matches features.
    pub(super) fn matching(&self) -> Matching<'_> {
        let FeatureParams { mlesac, depth_radius_px, visible, radius_slack, .. } =
            &self.features.params;
        let (depth_radius_px, visible) = (*depth_radius_px, *visible);
        Matching { mlesac, depth_radius_px, visible, radius_slack: *radius_slack }
    }

    /// The parameter that limits the number of keypoints, with its value, where the query reached it.
    pub(super) fn keypoint_limit(&self) -> Option<String> {
        let params = self.subject.params;
        let (key, limit) = match self.family {
            Family::Guided => ("fb2.max_keypoints", params.fb2.sift.max_keypoints),
            _ => ("surf.max_keypoints", params.surf.max_keypoints),
        };
        let found = self.subject.outcome.counts?.query_keypoints;
        (limit > 0 && found >= limit).then(|| format!("{key}={limit}"))
    }

    /// Whether the method would accept a pose that these correspondences agree on.
    pub(super) fn would_accept(&self, matches: &TrueMatches, inliers: &[usize]) -> bool {
        let camera = &self.subject.problem.query.intrinsics;
        self.features.would_accept(&matches.correspondences, inliers, camera)
    }

    /// The error of the consensus, accepted or not.
    pub(super) fn consensus_error(&self) -> Option<PoseError> {
        let refined = self.subject.evidence.refined.as_ref()?;
        let pose = (self.subject.problem).world_from_query(&refined.reference_from_query);
        Some(PoseError::between(self.subject.truth?, &pose))
    }

    /// How far the inliers of the consensus let its camera centre move \[m\]; `None` where they do not fix it.
    pub(super) fn deviation_m(&self, matches: &TrueMatches) -> Option<f64> {
        matches.deviation_m(self.subject, self.matching().mlesac.sigma_px)
    }

    /// How far the truth is from the reference, and how far the prior lets it be \[m\]; `None` where it is within that.
    pub(super) fn truth_beyond_prior(&self) -> Option<(f64, f64)> {
        let distance_m = self.subject.reference_from_truth()?.translation.vector.norm();
        let slack = self.matching().radius_slack;
        let allowed_m = self.subject.problem.believed_within_m() * (1.0 + slack);
        (distance_m > allowed_m).then_some((distance_m, allowed_m))
    }

    /// Whether the consensus, accepted or not, is right.
    pub(super) fn consensus_is_right(&self) -> bool {
        let error = self.consensus_error();
        error.is_some_and(|error| self.subject.tolerance.contains(&error))
    }
}

/// What one reference gave in a fusion, and what is known of it alone.
#[derive(Clone, Copy, Debug)]
pub struct Member<'a> {
    /// Its weight and its pose.
    pub share: &'a Share,
    /// The verdicts on it alone.
    pub verdicts: &'a [Diagnosis],
    /// The confidence of its pose.
    pub confidence: Option<&'a PoseConfidence>,
}

/// The member of most weight, of equals the first.
pub(super) fn heaviest<'m, 'a>(members: &'m [Member<'a>]) -> Option<&'m Member<'a>> {
    members.iter().rev().max_by(|a, b| a.share.weight.total_cmp(&b.share.weight))
}

/// A fused pose, and what each reference gave.
pub struct FusionCase<'a> {
    pub(super) pose: &'a Result<Pose, Failure>,
    pub(super) members: &'a [Member<'a>],
    pub(super) truth: &'a Pose,
    pub(super) tolerance: Tolerance,
    /// Whether all references were used at once, in place of an average.
    pub(super) is_joint: bool,
}

/// How references were ranked by what they look like.
pub struct RankingCase<'a> {
    pub(super) ranking: &'a ReferenceRanking,
    pub(super) truth: &'a Pose,
    /// A frame is of the right place if it is within this of the truth \[m\].
    pub(super) radius_m: f64,
}
