//! Scenes of a few frames that are in memory.

use image::RgbImage;
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::geometry::Pose;
use posescope::image::Photo;
use posescope::scene::{Scene, SceneError};

/// A frame with all there is to it.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The photo.
    pub photo: RgbImage,
    /// Its camera.
    pub intrinsics: Intrinsics,
    /// `world_from_camera`, where it is told.
    pub pose: Option<Pose>,
    /// The cloud in the camera's frame.
    pub cloud: Cloud,
}

/// Frames as a scene.
pub struct Frames {
    name: &'static str,
    names: Vec<String>,
    frames: Vec<Frame>,
}

impl Frames {
    /// A scene of these frames, each named `prefix` and its number.
    pub fn new(name: &'static str, prefix: &str, frames: Vec<Frame>) -> Self {
        Self {
            name,
            names: (0..frames.len()).map(|k| format!("{prefix}{k}")).collect(),
            frames,
        }
    }
}

impl Scene for Frames {
    fn name(&self) -> &str {
        self.name
    }

    fn frames(&self) -> &[String] {
        &self.names
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        self.frames[frame].intrinsics
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.frames[frame].pose
    }

    fn time_s(&self, _frame: usize) -> Option<f64> {
        None
    }

    fn has_cloud(&self, frame: usize) -> bool {
        !self.frames[frame].cloud.is_empty()
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        Ok(Photo::from_color(self.frames[frame].photo.clone()))
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        Ok(self.frames[frame].cloud.clone())
    }
}
