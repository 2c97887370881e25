//! FB of several references: the correspondences of all in one MLESAC.

use super::{JointEstimator, JointOutcome, JointReference, between, lead};
use crate::estimator::feature::{FeatureBased, Gathered, MINIMUM};
use crate::estimator::{Failure, Halt, separate_failure};
use crate::event::Stage;
use crate::fusion::share::Support;
use crate::geometry::Pose;
use crate::params::Params;
use crate::robust::{Consensus, mlesac};
use crate::solver::Correspondence;
use crate::trace::{Cancelled, Trace};

/// The feature-based estimator of several references.
///
/// Each lifts its own matches to points of its own cloud, as it does alone. In one frame they are one set:
/// MLESAC draws its samples from all, so that three references with two true matches each fix a pose that
/// none of them would. Whether it is more than chance is asked of keypoints of the query: one that several
/// references explain is a single observation, and one that has several matches has as many occasions to
/// agree by accident.
pub struct JointFeatures {
    features: FeatureBased,
}

impl JointEstimator for JointFeatures {
    fn estimate(
        &self,
        references: &[JointReference<'_>],
        trace: &mut Trace<'_>,
    ) -> Result<JointOutcome, Cancelled> {
        let agreed = trace.stage(Stage::Consensus, |trace| self.agree(references, trace));
        Ok(match separate_failure(agreed)? {
            Ok((pose, supports)) => JointOutcome { pose: Ok(pose), supports },
            Err(failure) => JointOutcome::failed(failure, references.len()),
        })
    }
}

/// The correspondences of all references in the frame of the lead's camera.
struct Pool {
    correspondences: Vec<Correspondence>,
    /// The reference of each.
    of: Vec<usize>,
}

impl JointFeatures {
    /// The estimator with these parameters.
    pub fn new(params: &Params) -> Self {
        Self { features: FeatureBased::new(params) }
    }

    fn agree(
        &self,
        references: &[JointReference<'_>],
        trace: &mut Trace<'_>,
    ) -> Result<(Pose, Vec<Option<Support>>), Halt> {
        let lead = references[lead(references)].problem;
        let mut pool = Pool { correspondences: Vec::new(), of: Vec::new() };
        let (mut unique, mut keypoints) = (0, 0);
        for (index, reference) in references.iter().enumerate() {
            trace.checkpoint()?;
            // What one alone is too little of may be enough with the others.
            let Ok(gathered) = self.features.gather(reference.problem) else {
                continue;
            };
            let Gathered { correspondences, unique: own, query_keypoints } = gathered;
            unique += own;
            keypoints = query_keypoints;
            let lead_from_reference = between(lead, reference.problem);
            for Correspondence { pixel, point } in correspondences {
                let point = lead_from_reference * point;
                pool.correspondences.push(Correspondence { pixel, point });
                pool.of.push(index);
            }
        }
        let correspondences = pool.correspondences.as_slice();
        if unique < MINIMUM {
            return Err(Halt::from(Failure::TooFewMatches { unique, keypoints }));
        }
        if correspondences.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewDepths {
                with_depth: correspondences.len(),
                unique,
            }));
        }
        trace.checkpoint()?;
        let consensus = mlesac(
            correspondences,
            &lead.query.intrinsics,
            self.features.mlesac(),
            lead.random_seed("mlesac"),
            |_| trace.checkpoint(),
        );
        let consensus =
            consensus.map_err(|error| FeatureBased::halt(error, correspondences.len()))?;
        let supports = pool.supports(&consensus, references.len());

        let intrinsics = &lead.query.intrinsics;
        let beyond =
            (self.features).beyond_chance(correspondences, &consensus.inliers, intrinsics, 0.0);
        // Where the query can be, the reference says that explains most of it.
        let inliers = |index: usize| supports[index].map_or(0.0, |support| support.amount());
        let most = (0..references.len())
            .rev()
            .max_by(|&a, &b| inliers(a).total_cmp(&inliers(b)))
            .unwrap_or_default();
        let nearest = references[most].problem;
        let reference_from_query = between(nearest, lead) * consensus.pose.inverse();
        let features = &self.features;
        let pose = features.judged(&reference_from_query, &beyond, nearest, &mut Trace::off())?;
        Ok((pose, supports))
    }
}

impl Pool {
    /// Inliers of each reference among its correspondences.
    fn supports(&self, consensus: &Consensus, references: usize) -> Vec<Option<Support>> {
        let mut counts = vec![(0, 0); references];
        for &index in &self.of {
            counts[index].1 += 1;
        }
        for &inlier in &consensus.inliers {
            counts[self.of[inlier]].0 += 1;
        }
        let support = |(inliers, correspondences)| Support::Inliers { inliers, correspondences };
        counts.into_iter().map(support).map(Some).collect()
    }
}
