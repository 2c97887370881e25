//! COLMAP: a sparse model, text or binary, with its images.
//!
//! Images are undistorted when they are read. In COLMAP the centre of the first pixel is (0.5, 0.5), here (0, 0).
//! A model has no absolute scale: its unit is called metres.
//!
//! The cloud of a frame contains only the points that it observes. A point in view without an observation is often
//! occluded, which cannot be detected in a sparse cloud.

mod binary;
mod camera;
mod model;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

pub(super) use self::camera::ModelCamera;
use self::model::ModelImage;
pub(super) use self::text::{camera as camera_of_line, image_of_line, lines_of_images};
use super::file_scene::{Clouds, FileScene, Frame};
use super::folder::{folder_name, within};
use super::frame_names::names_of;
use super::lens::developed_camera;
use super::{Lengths, Scene, SceneError, SceneFormat};
use crate::cloud::Cloud;

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "colmap",
    about: "COLMAP: a folder with cameras, images and points3D as .bin or .txt, in it or in sparse/0, \
            and the photos in images",
    recognizes: |argument| model_folder(Path::new(argument)).is_some(),
    open: |argument| open(Path::new(argument)),
};

/// The folder of the model, and the extension of its files. Like COLMAP, prefers the binary form.
fn model_folder(folder: &Path) -> Option<(PathBuf, &'static str)> {
    let places = ["", "sparse/0", "sparse"].map(|place| folder.join(place));
    places.into_iter().find_map(|place| {
        let is_there = |extension: &&str| {
            ["cameras", "images"]
                .iter()
                .all(|file| place.join(format!("{file}.{extension}")).is_file())
        };
        let extension = ["bin", "txt"].into_iter().find(is_there)?;
        Some((place, extension))
    })
}

fn open(folder: &Path) -> Result<Box<dyn Scene>, SceneError> {
    let Some((place, extension)) = model_folder(folder) else {
        return Err(SceneError::expected(
            folder,
            "cameras and images as .bin or .txt expected, here or in sparse/0, none found",
        ));
    };
    let listed_in = place.join(format!("images.{extension}"));
    let model = match extension {
        "bin" => binary::read(&place)?,
        _ => text::read(&place)?,
    };
    let error = |expected: String| SceneError::expected(&listed_in, expected);
    let mut images = model.images;
    images.sort_by(|a, b| a.name.cmp(&b.name));
    let photos = photo_folder(&place, &images).ok_or_else(|| {
        error(format!(
            "the photos, such as {}, expected in a folder `images` in the model's folder or up to two levels \
             above it, none found",
            images.first().map_or("", |image| &image.name)
        ))
    })?;
    let mut cameras = BTreeMap::new();
    for (id, camera) in &model.cameras {
        let camera = developed_camera(camera.intrinsics, camera.distortion)
            .map_err(|why| error(format!("camera {id}: {why}")))?;
        cameras.insert(*id, camera);
    }
    let paths: Vec<String> = images.iter().map(|image| image.name.clone()).collect();
    let names = names_of(&paths);
    // Images are in the order of their names.
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        let expected = format!("images with different names expected, two are called {}", twice[0]);
        return Err(error(expected));
    }
    let listed = images.len();
    let mut frames = Vec::with_capacity(listed);
    let mut observed = Vec::with_capacity(listed);
    for (image, name) in images.into_iter().zip(names) {
        let photo = within(&photos, &image.name).map_err(error)?;
        let (intrinsics, develop) = cameras.get(&image.camera).ok_or_else(|| {
            error(format!(
                "image {}: the id of a camera of the model expected, {} found",
                image.name, image.camera
            ))
        })?;
        if photo.is_file() {
            frames.push(Frame {
                name,
                develop: develop.clone(),
                world_from_camera: Some(image.camera_from_world.inverse()),
                ..Frame::new(photo, *intrinsics)
            });
            observed.push(image.observed);
        }
    }
    if frames.len() < listed {
        log::warn!(
            "{}: {} of the model's {listed} images are missing and are skipped",
            photos.display(),
            listed - frames.len()
        );
    }
    let scene = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = format!("colmap/{}", scene_name(&scene, &photos));
    let clouds = ObservedPoints { points: model.points, observed, listed_in };
    Ok(Box::new(FileScene::new(name, frames, clouds)))
}

/// The name of the scene: that of the folder with both model and photos.
fn scene_name(folder: &Path, photos: &Path) -> String {
    let photos = photos.canonicalize().unwrap_or_else(|_| photos.to_owned());
    let holds_photos = |folder: &&Path| photos.starts_with(folder);
    let common = folder.ancestors().find(holds_photos).unwrap_or(folder);
    folder_name(common)
}

/// The folder of the photos: the model's folder, one of two above it, or `images` in one of these.
fn photo_folder(model: &Path, images: &[ModelImage]) -> Option<PathBuf> {
    let model = model.canonicalize().ok()?;
    let places = model.ancestors().take(3);
    let places = places.flat_map(|folder| [folder.join("images"), folder.to_owned()]);
    let holds_any = |place: &PathBuf| {
        let paths = images.iter().flat_map(|i| within(place, &i.name));
        // A project may have thousands of images, so only some are searched.
        paths.take(100).any(|path| path.is_file())
    };
    places.into_iter().find(holds_any)
}

/// The points of the model, with the frames that observe them.
struct ObservedPoints {
    /// In the world's frame.
    points: Vec<[f64; 3]>,
    /// The points of each frame, by position.
    observed: Vec<Vec<u32>>,
    listed_in: PathBuf,
}

impl Clouds for ObservedPoints {
    fn has(&self, index: usize) -> bool {
        !self.observed[index].is_empty()
    }

    fn lengths(&self) -> Lengths {
        Lengths::Model
    }

    fn place<'a>(&'a self, _index: usize, _frame: &'a Frame) -> &'a Path {
        &self.listed_in
    }

    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError> {
        let Some(world_from_camera) = frame.world_from_camera else {
            return Ok(Cloud::default());
        };
        let camera_from_world = world_from_camera.inverse();
        let points = self.observed[index].iter().map(|&point| {
            let in_camera = camera_from_world * nalgebra::Point3::from(self.points[point as usize]);
            in_camera.cast()
        });
        Ok(Cloud { points: points.collect() })
    }
}
