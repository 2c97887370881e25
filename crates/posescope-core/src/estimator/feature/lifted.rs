//! The depth of features, from the points that are projected near them.

use std::sync::Arc;

use super::{DepthRule, FeatureBased, FeatureParams};
use crate::cloud::Cloud;
use crate::depth::{DepthReading, LiftedMatch, ProjectedCloudIndex};
use crate::event::ProjectedCloud;
use crate::features::Features;
use crate::problem::ReferenceTuple;
use crate::render::RenderParams;
use crate::trace::{Cancelled, Trace};

/// Matches lifted between two checkpoints.
const LIFTED_AT_A_TIME: usize = 256;

/// What the cloud gives the features of a reference.
pub(super) struct Lifted {
    /// The depths of the matches.
    pub(super) matches: Arc<[LiftedMatch]>,
    /// The depth of every feature, whatever it matches, where features are matched again.
    pub(super) all: Option<Arc<Vec<LiftedMatch>>>,
}

impl FeatureBased {
    /// P = K⁻¹ p_R z: the keypoint's own pixel at the depth of the nearest projected point.
    pub(super) fn lift(
        &self,
        matches: &[(usize, usize)],
        reference: &Features,
        tuple: &ReferenceTuple,
        trace: &mut Trace<'_>,
    ) -> Result<Lifted, Cancelled> {
        let cloud = projected_cloud(tuple, self.params.visible.then_some(&self.render));
        trace.emit(|| ProjectedCloud { points: tuple.cloud.len(), in_view: cloud.len() })?;
        let all = match self.guide {
            Some(_) => Some(self.all_lifted(tuple, reference, &cloud, trace)?),
            None => None,
        };
        let mut lifted = Vec::with_capacity(matches.len());
        for matches in matches.chunks(LIFTED_AT_A_TIME) {
            trace.checkpoint()?;
            lifted.extend(matches.iter().map(|&(query, number)| match &all {
                Some(all) => LiftedMatch { query, ..all[number] },
                None => LiftedMatch { query, ..self.lifted_at(number, reference, &cloud, tuple) },
            }));
        }
        Ok(Lifted { matches: lifted.into(), all })
    }

    /// The depth of every feature of a reference, whatever it matches.
    fn all_lifted(
        &self,
        tuple: &ReferenceTuple,
        reference: &Features,
        cloud: &ProjectedCloudIndex,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<Vec<LiftedMatch>>, Cancelled> {
        let FeatureParams { visible, depth_radius_px, depth, depth_spread, .. } = self.params;
        let bytes = |lifted: &Vec<LiftedMatch>| size_of_val(lifted.as_slice());
        let depth = (visible, &self.render, depth_radius_px, depth, depth_spread);
        let lifted = tuple.memo.try_recall((&self.detector, depth), bytes, || {
            let lift = |number: usize| {
                if number.is_multiple_of(LIFTED_AT_A_TIME) {
                    trace.checkpoint()?;
                }
                Ok(self.lifted_at(number, reference, cloud, tuple))
            };
            (0..reference.keypoints.len()).map(lift).collect()
        })?;
        Ok(lifted.value)
    }

    fn lifted_at(
        &self,
        number: usize,
        reference: &Features,
        cloud: &ProjectedCloudIndex,
        tuple: &ReferenceTuple,
    ) -> LiftedMatch {
        let pixel = reference.keypoints[number].pixel();
        let reading = cloud.read(&pixel, self.params.depth_radius_px);
        LiftedMatch {
            query: 0,
            reference: number,
            lidar_distance_px: reading.distance_px,
            depth_range_m: reading.within.map(|depths| (depths.least, depths.greatest)),
            point: self.depth(&reading).map(|z| tuple.intrinsics.unproject(&pixel, z)),
        }
    }

    fn depth(&self, reading: &DepthReading) -> Option<f64> {
        let depths = reading.within?;
        match self.params.depth {
            DepthRule::Guarded if depths.relative_spread() > self.params.depth_spread => None,
            DepthRule::Guarded | DepthRule::Nearest => Some(depths.nearest),
        }
    }
}

/// The cloud of a reference tuple projected into its own photo, kept with the tuple; where `visible` says how,
/// without the points that something nearer hides from the camera, which the scanner beside it may have met all
/// the same.
pub fn projected_cloud(
    tuple: &ReferenceTuple,
    visible: Option<&RenderParams>,
) -> Arc<ProjectedCloudIndex> {
    let cloud = tuple.memo.recall(visible, ProjectedCloudIndex::heap_bytes, || match visible {
        None => ProjectedCloudIndex::new(&tuple.cloud, &tuple.intrinsics),
        Some(render) => {
            let points = tuple.visible_cloud(render).positions().collect();
            ProjectedCloudIndex::new(&Cloud { points }, &tuple.intrinsics)
        }
    });
    cloud.value
}
