//! Scenes of a few frames that are in memory.

use image::{DynamicImage, RgbImage};
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::geometry::Pose;
use posescope::image::Photo;
use posescope::scene::street::Traversal;
use posescope::scene::{Scene, SceneError};

/// A photo, its camera, its pose `world_from_camera` where that is known, and the cloud in the camera's frame.
#[derive(Clone)]
pub struct Frame {
    pub photo: RgbImage,
    pub intrinsics: Intrinsics,
    pub pose: Option<Pose>,
    pub cloud: Cloud,
}

impl Frame {
    /// A frame of a drive.
    pub fn of(drive: &Traversal, frame: usize) -> Self {
        Self::seen_from(drive, frame, &drive.world_from_camera(frame))
    }

    /// A frame of a drive from another pose. The cloud stays that of the frame.
    pub fn seen_from(drive: &Traversal, frame: usize, world_from_camera: &Pose) -> Self {
        let points = drive.cloud(frame).into_iter().map(|point| point.position);
        Self {
            photo: drive.image_from(frame, world_from_camera),
            intrinsics: drive.intrinsics(),
            pose: Some(*world_from_camera),
            cloud: Cloud { points: points.collect() },
        }
    }

    /// A frame of any scene.
    pub fn read(scene: &dyn Scene, frame: usize) -> Result<Self, SceneError> {
        let photo = scene.photo(frame)?;
        let gray = || DynamicImage::ImageLuma8(photo.gray.clone()).to_rgb8();
        Ok(Self {
            photo: photo.color.clone().unwrap_or_else(gray),
            intrinsics: scene.intrinsics(frame),
            pose: scene.pose(frame),
            cloud: scene.cloud(frame)?,
        })
    }

    /// A scene of this frame alone, which has this name in it.
    pub fn named(self, name: &str) -> Frames {
        Frames { name: "", names: vec![name.to_owned()], frames: vec![self] }
    }
}

/// Frames as a scene.
pub struct Frames {
    name: &'static str,
    names: Vec<String>,
    frames: Vec<Frame>,
}

impl Frames {
    /// A scene whose frames are called as it is, with their number.
    pub fn new(name: &'static str, frames: Vec<Frame>) -> Self {
        let names = (0..frames.len()).map(|number| format!("{name} {number}"));
        Self { name, names: names.collect(), frames }
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
