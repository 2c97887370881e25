//! The four estimators. Each is a straight-line function from a [`Problem`] to an [`Outcome`] that
//! tells what it does to a [`Trace`].
//!
//! A new estimator is one file, its `mod` line and its entry in [`ALL`].

mod direct;
mod failure;
mod feature;
mod hybrid;
mod mutual_information;
mod photometric;

pub use failure::Failure;
pub use feature::{DepthRule, FeatureBased, FeatureParams, count_matches};
pub use hybrid::{Hybrid, hybrid_outcome};
pub use mutual_information::mutual_information;
pub use photometric::photometric;

use std::sync::Arc;

use crate::features::FeatureCache;
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{Comparison, Score};
use crate::trace::{Cancelled, Trace};

/// How many features passed each step of FB. Every query keypoint is in exactly one state, so
/// each count is at most the one before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct FeatureCounts {
    /// Keypoints of the query photo.
    pub query_keypoints: usize,
    /// Keypoints of the reference photo.
    pub reference_keypoints: usize,
    /// Query keypoints whose nearest reference feature passed the ratio test.
    pub ratio_passed: usize,
    /// Of those, mutually best.
    pub unique: usize,
    /// Of those, with a depth.
    pub with_depth: usize,
    /// Of those, explained by the estimated pose.
    pub inliers: usize,
}

/// What the direct methods found out about their cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CostSummary {
    /// Cost at the reference pose.
    pub initial: Option<f64>,
    /// Cost at the result.
    pub best: f64,
    /// Cost at the result with the view's pixels shuffled.
    pub shuffled: Option<f64>,
    /// Cost of the second-best local minimum of the coarse positions.
    pub runner_up: Option<f64>,
    /// Share of the image that is covered at the result.
    pub coverage_best: f64,
    /// Share of the image that is covered at the reference pose.
    pub coverage_reference: f64,
    /// Hypotheses that were scored.
    pub evaluations: u64,
}

/// What an estimator has to say in the end. A query that cannot be localised is an answer too.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// `world_from_camera` of the query, or why there is none.
    pub pose: Result<Pose, Failure>,
    /// Where the features went, if features were used.
    pub counts: Option<FeatureCounts>,
    /// What the cost was like, if a cost was minimised.
    pub cost: Option<CostSummary>,
}

/// A way to find the query's pose.
pub trait Estimator: Send + Sync {
    /// Localises the query.
    ///
    /// # Errors
    /// Only [`Cancelled`]: a query without a pose is an [`Outcome`] with a [`Failure`].
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled>;

    /// Features of photos may come from this cache, and go there. It saves time and nothing else.
    fn remember(&mut self, features: &Arc<FeatureCache>) {
        let _ = features;
    }

    /// The cost that this estimator minimises, at any pose of the query; `None` if it has none.
    fn score_at(&self, problem: &Problem, world_from_query: &Pose) -> Option<Score> {
        Some(self.compare_at(problem, world_from_query)?.score)
    }

    /// As [`Self::score_at`], with the synthetic view and what the cost was made of.
    fn compare_at(&self, problem: &Problem, world_from_query: &Pose) -> Option<Comparison> {
        let _ = (problem, world_from_query);
        None
    }
}

/// An estimator's place in the registry.
pub struct Entry {
    /// Which method of the paper.
    pub method: Method,
    /// One phrase.
    pub about: &'static str,
    /// Makes the estimator from the parameters.
    pub new: fn(&Params) -> Box<dyn Estimator>,
}

/// Every estimator, in the order in which they run.
pub const ALL: &[Entry] = &[
    Entry {
        method: Method::Feature,
        about: "indirect: SURF, ratio match, depth from the cloud, P3P and MLESAC",
        new: |params| Box::new(FeatureBased::new(params)),
    },
    Entry {
        method: Method::Photometric,
        about: "direct: robust photometric error over a coarse-to-fine grid of synthetic views",
        new: |params| Box::new(photometric(params)),
    },
    Entry {
        method: Method::MutualInformation,
        about: "direct: normalised mutual information over the same grid",
        new: |params| Box::new(mutual_information(params)),
    },
    Entry {
        method: Method::Hybrid,
        about: "the feature-based pose, and mutual information where that has none",
        new: |params| Box::new(Hybrid::new(params)),
    },
];

/// The registry's entry of a method.
///
/// # Panics
/// Never: a test walks over all methods.
pub fn entry(method: Method) -> &'static Entry {
    ALL.iter()
        .find(|entry| entry.method == method)
        .unwrap_or_else(|| unreachable!("every method has an estimator"))
}

/// Why a straight-line estimator stops early.
enum Halt {
    Failed(Failure),
    Cancelled,
}

impl From<Failure> for Halt {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

impl From<Cancelled> for Halt {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// Separates "no pose" from "asked to stop".
fn settle<T>(result: Result<T, Halt>) -> Result<Result<T, Failure>, Cancelled> {
    match result {
        Ok(value) => Ok(Ok(value)),
        Err(Halt::Failed(failure)) => Ok(Err(failure)),
        Err(Halt::Cancelled) => Err(Cancelled),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_an_estimator() {
        let methods: Vec<_> = ALL.iter().map(|entry| entry.method).collect();
        assert_eq!(methods, Method::ALL);
    }
}
