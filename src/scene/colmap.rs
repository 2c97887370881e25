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

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

pub(super) use self::camera::ModelCamera;
use self::model::ModelImage;
pub(super) use self::text::{camera as camera_of_line, image_lines};
use super::file_scene::{Clouds, FileScene, Frame};
use super::folder::{folder_name, within};
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
    let names = frame_names(&images).map_err(error)?;
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

/// The images' names, without folders and extensions as long as they stay unique.
fn frame_names(images: &[ModelImage]) -> Result<Vec<String>, String> {
    let flat = |name: &str| name.replace(['/', '\\'], "-");
    let without_extension = |name: &str| match name.rsplit_once('.') {
        Some((stem, _)) if !stem.is_empty() => stem.to_owned(),
        _ => name.to_owned(),
    };
    let file = |name: &str| name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned();
    let briefest_first: [&dyn Fn(&str) -> String; 3] =
        [&|name| without_extension(&file(name)), &|name| without_extension(&flat(name)), &flat];
    let ways = briefest_first.into_iter();
    ways.map(|brief| images.iter().map(|image| brief(&image.name)).collect())
        .find(|names: &Vec<String>| names.iter().collect::<BTreeSet<_>>().len() == names.len())
        .ok_or_else(|| "images with different names expected, two are the same".to_owned())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;

    fn images(names: &[&str]) -> Vec<ModelImage> {
        let image = |name: &&str| ModelImage {
            name: (*name).to_owned(),
            camera: 1,
            camera_from_world: Pose::identity(),
            observed: Vec::new(),
        };
        names.iter().map(image).collect()
    }

    #[test]
    fn frames_are_called_as_briefly_as_tells_them_apart() {
        let names = |names: &[&str]| frame_names(&images(names));
        assert_eq!(names(&["a/1.jpg", "a/2.5.jpg"]), Ok(vec!["1".to_owned(), "2.5".to_owned()]));
        assert_eq!(names(&["a/1.jpg", "b/1.jpg"]), Ok(vec!["a-1".to_owned(), "b-1".to_owned()]));
        assert_eq!(names(&["1.jpg", "1.png"]), Ok(vec!["1.jpg".to_owned(), "1.png".to_owned()]));
        assert!(names(&["a/1.jpg", "b/1.jpg", "a-1.jpg"]).is_err());
    }
}
