//! What an estimator is asked: one query photo, one reference tuple. No ground truth in here.

use std::sync::Arc;

use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;
use crate::memo::Memo;

/// The photo whose pose is sought.
#[derive(Clone, Debug)]
pub struct Query {
    /// The frame's name in its scene.
    pub name: String,
    /// The photo.
    pub photo: Photo,
    /// The query camera.
    pub intrinsics: Intrinsics,
    /// What estimators worked out about this query.
    pub memo: Memo,
}

/// A photo with known pose and the cloud registered with it: the paper's reference tuple (I_R, P_R).
#[derive(Clone, Debug)]
pub struct ReferenceTuple {
    /// The frame's name in its scene.
    pub name: String,
    /// The photo I_R.
    pub photo: Photo,
    /// The reference camera.
    pub intrinsics: Intrinsics,
    /// Where the reference camera stood.
    pub world_from_camera: Pose,
    /// The cloud P_R, in the reference camera's frame.
    pub cloud: Cloud,
    /// What estimators worked out about this reference.
    pub memo: Memo,
}

/// One query to localise against one reference tuple.
///
/// Several references are several problems that share their query.
#[derive(Clone, Debug)]
pub struct Problem {
    /// What is sought.
    pub query: Arc<Query>,
    /// What is known.
    pub reference: Arc<ReferenceTuple>,
    /// How far from the reference the query may be \[m\].
    ///
    /// The direct methods search this disc, and the feature-based method rejects a pose outside.
    pub uncertainty_radius_m: f64,
    /// Every random choice of an estimator derives from this.
    pub seed: u64,
}

impl Problem {
    /// The pose of a camera whose pose in the reference camera's frame is `reference_from_query`.
    pub fn world_from_query(&self, reference_from_query: &Pose) -> Pose {
        self.reference.world_from_camera * reference_from_query
    }

    /// A seed for one random choice: it depends on the problem and the purpose, and on nothing else.
    pub fn random_seed(&self, purpose: &str) -> u64 {
        let Self {
            query, reference, ..
        } = self;
        let text = format!("{}/{}/{}/{purpose}", self.seed, query.name, reference.name);
        xxhash_rust::xxh3::xxh3_64(text.as_bytes())
    }

    /// The inverse of [`Self::world_from_query`].
    pub fn reference_from_query(&self, world_from_query: &Pose) -> Pose {
        self.reference.world_from_camera.inverse() * world_from_query
    }
}
