//! HY, the hybrid (paper, section 2.5): FB is the more accurate where it finds enough matches, MI
//! still gives a moderate pose where FB finds none.

use std::sync::Arc;

use super::direct::Direct;
use super::{Estimator, FeatureBased, Outcome, mutual_information};
use crate::event::{BranchTaken, Stage};
use crate::features::FeatureCache;
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::Comparison;
use crate::trace::{Cancelled, Trace};

/// FB, and MI where FB has no pose.
pub struct Hybrid {
    feature: FeatureBased,
    mutual_information: Direct,
}

impl Hybrid {
    /// The hybrid of both with these parameters.
    pub fn new(params: &Params) -> Self {
        Self {
            feature: FeatureBased::new(params),
            mutual_information: mutual_information(params),
        }
    }
}

/// What the hybrid makes of the outcomes of FB and MI for one problem.
///
/// Equal problems have equal answers, so whoever has both need not run the hybrid.
pub fn hybrid_outcome(feature: &Outcome, mutual_information: &Outcome) -> Outcome {
    if feature.pose.is_ok() {
        return feature.clone();
    }
    Outcome {
        counts: feature.counts,
        ..mutual_information.clone()
    }
}

impl Estimator for Hybrid {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        trace.stage(Stage::Estimator(Method::Hybrid), |trace| {
            let indirect = self.feature.estimate(problem, trace)?;
            let failure = match &indirect.pose {
                Ok(_) => {
                    trace.emit(|| BranchTaken {
                        method: Method::Feature,
                        why: "the feature-based pose was accepted".to_owned(),
                    })?;
                    return Ok(indirect);
                }
                Err(failure) => failure,
            };
            trace.emit(|| BranchTaken {
                method: Method::MutualInformation,
                why: failure.to_string(),
            })?;
            let direct = self.mutual_information.estimate(problem, trace)?;
            Ok(hybrid_outcome(&indirect, &direct))
        })
    }

    fn remember(&mut self, features: &Arc<FeatureCache>) {
        self.feature.remember(features);
    }

    fn compare_at(&self, problem: &Problem, world_from_query: &Pose) -> Option<Comparison> {
        self.mutual_information
            .compare_at(problem, world_from_query)
    }
}
