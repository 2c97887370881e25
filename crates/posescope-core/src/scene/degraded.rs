//! A scene whose photos are worse than they were taken.

use std::sync::Arc;

use super::{Scene, SceneError, fingerprint};
use crate::image::{Degradation, Photo};

/// The photos of a scene, degraded; poses, clouds and names are the scene's own. What is degraded are
/// queries: references come from a scene that is not.
pub struct DegradedScene {
    scene: Arc<dyn Scene>,
    degradation: Degradation,
    seed: u64,
}

/// The scene with its photos degraded this way, in the place of any way before. The seed is that of the
/// noise. A degradation that changes nothing gives the scene itself.
pub fn degraded(scene: &Arc<dyn Scene>, degradation: Degradation, seed: u64) -> Arc<dyn Scene> {
    let taken = match scene.as_degraded() {
        Some(before) => &before.scene,
        None => scene,
    };
    if degradation.is_none() {
        Arc::clone(taken)
    } else {
        Arc::new(DegradedScene { scene: Arc::clone(taken), degradation, seed })
    }
}

impl DegradedScene {
    /// What is done to its photos.
    pub fn degradation(&self) -> Degradation {
        self.degradation
    }
}

impl Scene for DegradedScene {
    crate::inner_scene!(scene: name, frames, other_name, pixel_map, intrinsics, pose, position, time_s, has_cloud, lengths, cloud_facts, cloud, cloud_at);

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let photo = self.scene.photo(frame)?;
        Ok((self.degradation).of(&photo, self.seed, &self.frames()[frame]))
    }

    fn as_degraded(&self) -> Option<&DegradedScene> {
        Some(self)
    }

    fn fingerprint(&self) -> u64 {
        let more = format!("{:x}/{}/{}", self.scene.fingerprint(), self.degradation, self.seed);
        fingerprint(self.scene.as_ref(), more.as_bytes())
    }
}
