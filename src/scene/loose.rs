//! Loose photos: image files that do not belong to a scene. They have a camera, but no pose.

mod camera;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::metadata::Orientation;
use serde::{Deserialize, Serialize};

pub use camera::CameraArgument;

use super::exif::Exif;
use super::file_scene::{Clouds, FileScene, Frame};
use super::folder::{Bounds, stem};
use super::lens::{developed_camera, pinhole};
use super::{Lengths, Scene, SceneError, photo_file};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;

/// The loose photos of a command line.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoosePhotos {
    /// The files.
    pub paths: Vec<PathBuf>,
    /// Their camera; by default that of each photo's EXIF data.
    pub camera: Option<CameraArgument>,
}

/// What to type if a photo was taken with the camera of a scene's photos of its size. A camera with distortion has more
/// numbers than its scene knows.
fn camera_of_size(scene: &dyn Scene, size: (u32, u32)) -> Option<String> {
    let frames = 0..scene.frames().len();
    let mut cameras = frames.filter(|&frame| scene.pixel_map(frame).is_none());
    let camera = cameras
        .find_map(|at| Some(scene.intrinsics(at)).filter(|one| (one.width, one.height) == size))?;
    let Intrinsics { fx, fy, cx, cy, .. } = camera;
    Some(format!("; that of the scene's photos of this size is --camera {fx},{fy},{cx},{cy}"))
}

impl LoosePhotos {
    /// The name of the photos' scene.
    pub const NAME: &str = "photo";

    /// The name of a photo in results: that of its file, without folder and extension.
    pub fn name(path: &Path) -> String {
        stem(path)
    }

    /// The file of the photo with this name.
    pub fn path_of(&self, name: &str) -> Option<&Path> {
        let mut paths = self.paths.iter();
        paths.find(|path| Self::name(path) == name).map(PathBuf::as_path)
    }

    /// Opens the photos as a scene without poses and clouds. An error may offer the camera of the references.
    ///
    /// # Errors
    /// A file that is not an image, a camera for another image size, a missing camera, or two files with the same name.
    pub fn open(&self, references: Option<&dyn Scene>) -> Result<Arc<dyn Scene>, SceneError> {
        let mut names = BTreeSet::new();
        if let Some(twice) = self.paths.iter().find(|path| !names.insert(Self::name(path))) {
            let name = Self::name(twice);
            let expected = format!("photos with different names expected, two are called {name}");
            return Err(SceneError::expected(twice, expected));
        }
        let frames = self.paths.iter().map(|path| self.frame(path, references));
        let frames = frames.collect::<Result<Vec<_>, _>>()?;
        let name = Self::NAME.to_owned();
        let scene = FileScene::new(name, frames, NoClouds).within(Bounds::Anywhere);
        super::sound(Self::NAME, &scene)?;
        Ok(Arc::new(scene))
    }

    fn frame(&self, path: &Path, references: Option<&dyn Scene>) -> Result<Frame, SceneError> {
        let error = |expected: String| SceneError::expected(path, expected);
        let stored = photo_file::dimensions(path)?;
        let exif = Exif::read(path);
        let turned = exif.orientation();
        let Some(camera) = &self.camera else {
            let (focal_px, how) = exif.focal_px(stored).ok_or_else(|| {
                error(format!(
                    "a focal length in EXIF expected, none found; give the camera as --camera fx,fy,cx,cy, as a camera \
                     line of COLMAP or as its cameras.txt{}",
                    references.and_then(|scene| camera_of_size(scene, stored)).unwrap_or_default()
                ))
            })?;
            log::warn!(
                "{}: focal length {focal_px:.0} px from EXIF ({how}), no distortion; --camera overrides it",
                path.display()
            );
            let (width, height) = photo_file::turned_size(stored, turned);
            let middle = |side: u32| (f64::from(side) - 1.0) / 2.0;
            let camera = [focal_px, focal_px, middle(width), middle(height)];
            let intrinsics = pinhole(camera, (width, height)).map_err(error)?;
            return Ok(Frame { turned: Some(turned), ..Frame::new(path.to_owned(), intrinsics) });
        };
        // The size of the camera decides whether it was calibrated on stored or on turned pixels.
        let upright = photo_file::turned_size(stored, turned);
        let fitting =
            camera.of_photo(path, stored).map(|camera| (Orientation::NoTransforms, camera));
        let (turned, camera) = match fitting {
            Ok(fitting) => {
                if turned != Orientation::NoTransforms {
                    log::warn!(
                        "{}: the EXIF orientation is ignored, since --camera fits the stored image",
                        path.display()
                    );
                }
                fitting
            }
            Err(_) if upright != stored && camera.of_photo(path, upright).is_ok() => {
                (turned, camera.of_photo(path, upright)?)
            }
            Err(error) => return Err(error),
        };
        let (intrinsics, develop) =
            developed_camera(camera.intrinsics, camera.distortion).map_err(error)?;
        Ok(Frame { turned: Some(turned), develop, ..Frame::new(path.to_owned(), intrinsics) })
    }
}

/// Loose photos have no clouds.
struct NoClouds;

impl Clouds for NoClouds {
    fn has(&self, _index: usize) -> bool {
        false
    }

    fn lengths(&self) -> Lengths {
        Lengths::Street
    }

    fn missing(&self) -> Option<&str> {
        Some("loose photos are queries only")
    }

    fn read(&self, _index: usize, _frame: &Frame) -> Result<Cloud, SceneError> {
        Ok(Cloud::default())
    }
}
