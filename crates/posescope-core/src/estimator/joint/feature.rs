//! FB of several references: the correspondences of all in one MLESAC.

use super::{JointPose, JointReference, between, lead};
use crate::estimator::feature::{FeatureBased, MINIMUM};
use crate::estimator::{Failure, Halt};
use crate::event::Stage;
use crate::fusion::share::Support;
use crate::robust::{Consensus, mlesac};
use crate::solver::Correspondence;
use crate::trace::Trace;

impl FeatureBased {
    /// The pose that the references agree on.
    ///
    /// Each lifts its own matches to points of its own cloud, as it does alone. In one frame they are one set:
    /// MLESAC draws its samples from all, so that three references with two true matches each fix a pose that
    /// none of them would. Whether it is more than chance is asked of keypoints of the query: one that several
    /// references explain is a single observation, and one that has several matches has as many occasions to
    /// agree by accident.
    pub(super) fn agree(
        &self,
        references: &[JointReference<'_>],
        trace: &mut Trace<'_>,
    ) -> Result<JointPose, Halt> {
        trace.stage(Stage::Consensus, |trace| self.joint_consensus(references, trace))
    }

    fn joint_consensus(
        &self,
        references: &[JointReference<'_>],
        trace: &mut Trace<'_>,
    ) -> Result<JointPose, Halt> {
        let lead = references[lead(references)].problem;
        // In the frame of the lead's camera, and the reference of each.
        let (mut correspondences, mut origins) = (Vec::new(), Vec::new());
        let (mut unique, mut keypoints) = (0, 0);
        for (index, reference) in references.iter().enumerate() {
            trace.checkpoint()?;
            // What one alone is too little of may be enough with the others.
            let Ok(gathered) = self.gather(reference.problem) else {
                continue;
            };
            unique += gathered.unique;
            keypoints = gathered.query_keypoints;
            let lead_from_reference = between(lead, reference.problem);
            for Correspondence { pixel, point } in gathered.correspondences {
                let point = lead_from_reference * point;
                correspondences.push(Correspondence { pixel, point });
                origins.push(index);
            }
        }
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
            &correspondences,
            &lead.query.intrinsics,
            &self.params.mlesac,
            lead.random_seed("mlesac"),
            |_| trace.checkpoint(),
        );
        let consensus =
            consensus.map_err(|error| FeatureBased::halt(error, correspondences.len()))?;
        let supports = supports(&origins, &consensus, references.len());

        let intrinsics = &lead.query.intrinsics;
        let beyond = self.beyond_chance(&correspondences, &consensus.inliers, intrinsics, 0.0);
        // Where the query can be, the reference says that explains most of it.
        let inliers = |index: usize| supports[index].map_or(0.0, |support| support.amount());
        let most = (0..references.len())
            .rev()
            .max_by(|&a, &b| inliers(a).total_cmp(&inliers(b)))
            .unwrap_or_default();
        let nearest = references[most].problem;
        let reference_from_query = between(nearest, lead) * consensus.pose.inverse();
        let pose = self.accepted(&reference_from_query, &beyond, nearest, &mut Trace::off())?;
        Ok((pose, supports))
    }
}

/// Inliers of each reference among its correspondences; `origins` is the reference of each correspondence.
fn supports(origins: &[usize], consensus: &Consensus, references: usize) -> Vec<Option<Support>> {
    let mut counts = vec![(0, 0); references];
    for &index in origins {
        counts[index].1 += 1;
    }
    for &inlier in &consensus.inliers {
        counts[origins[inlier]].0 += 1;
    }
    let support = |(inliers, correspondences)| Support::Inliers { inliers, correspondences };
    counts.into_iter().map(support).map(Some).collect()
}
