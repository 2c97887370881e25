//! A scene whose photos are worse than they were taken.

use std::sync::Arc;

use nalgebra::Point3;

use super::{Scene, SceneError, fingerprint};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
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
    match degradation.is_none() {
        true => Arc::clone(taken),
        false => Arc::new(DegradedScene {
            scene: Arc::clone(taken),
            degradation,
            seed,
        }),
    }
}

impl DegradedScene {
    /// What is done to its photos.
    pub fn degradation(&self) -> Degradation {
        self.degradation
    }
}

impl Scene for DegradedScene {
    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let photo = self.scene.photo(frame)?;
        Ok((self.degradation).of(&photo, self.seed, &self.frames()[frame]))
    }

    fn as_degraded(&self) -> Option<&DegradedScene> {
        Some(self)
    }

    fn fingerprint(&self) -> u64 {
        let more = format!(
            "{:x}/{}/{}",
            self.scene.fingerprint(),
            self.degradation,
            self.seed
        );
        fingerprint(self.scene.as_ref(), more.as_bytes())
    }

    fn name(&self) -> &str {
        self.scene.name()
    }

    fn frames(&self) -> &[String] {
        self.scene.frames()
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        self.scene.intrinsics(frame)
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.scene.pose(frame)
    }

    fn position(&self, frame: usize) -> Option<Point3<f64>> {
        self.scene.position(frame)
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        self.scene.time_s(frame)
    }

    fn has_cloud(&self, frame: usize) -> bool {
        self.scene.has_cloud(frame)
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        self.scene.cloud(frame)
    }
}
