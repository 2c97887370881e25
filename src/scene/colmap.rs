//! COLMAP: a sparse model, text or binary, with its images.
//!
//! Images are undistorted when they are read. In COLMAP the centre of the first pixel is (0.5, 0.5), here (0, 0).
//! A model has no absolute scale: its unit is called metres.
//!
//! The cloud of a frame contains only the points that it observes. A point in view without an observation is often
//! occluded, which cannot be detected in a sparse cloud. Only where no frame observes any point, each gets those in view.

mod binary;
mod camera;
mod model;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

pub(super) use self::camera::ModelCamera;
use self::model::ModelImage;
pub(super) use self::text::{CAMERA_COLUMNS, camera_of_line, image_of_line, lines_of_images};
use super::file_scene::{Clouds, FileScene, Frame};
use super::folder::{entries, folder_name, stem, within};
use super::frame_names::names_of;
use super::lens::developed_camera;
use super::model_view::in_view_of_any_scale;
use super::{Lengths, Scene, SceneError, SceneFormat};
use crate::cloud::Cloud;

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "colmap",
    about: "COLMAP: a folder with cameras, images and points3D as .bin or .txt, in it or in sparse/0, \
            sparse/1 … (the largest), and the photos in images",
    recognizes: |argument| !models(Path::new(argument)).is_empty(),
    open: |argument| open(Path::new(argument)),
};

/// A folder with a model, and the extension of its files.
struct Place {
    folder: PathBuf,
    extension: &'static str,
}

impl Place {
    /// A folder with a model. Like COLMAP, prefers the binary form.
    fn of(folder: PathBuf) -> Option<Self> {
        let is_there = |extension: &&str| {
            let files =
                ["cameras", "images"].map(|file| folder.join(format!("{file}.{extension}")));
            files.iter().all(|file| file.is_file())
        };
        let extension = ["bin", "txt"].into_iter().find(is_there)?;
        Some(Self { folder, extension })
    }

    fn images(&self) -> PathBuf {
        self.folder.join(format!("images.{}", self.extension))
    }

    /// The number of images; 0 if the file cannot be read.
    fn count_images(&self) -> u64 {
        let count = match self.extension {
            "bin" => binary::count_images(&self.images()),
            _ => text::count_images(&self.images()),
        };
        count.unwrap_or(0)
    }
}

/// The models of a folder: the one in it, or those in its numbered folders or in those of `sparse`, where the mapper
/// leaves one for each part that it could not join, or the one in `sparse`.
fn models(folder: &Path) -> Vec<Place> {
    if let Some(place) = Place::of(folder.to_owned()) {
        return vec![place];
    }
    let numbered = |parent: PathBuf| {
        let entries = entries(&parent).unwrap_or_default().into_iter();
        let numbered = entries.filter_map(|path| Some((stem(&path).parse::<u32>().ok()?, path)));
        let mut numbered: Vec<(u32, PathBuf)> = numbered.collect();
        numbered.sort();
        let places: Vec<Place> =
            numbered.into_iter().filter_map(|(_, path)| Place::of(path)).collect();
        (!places.is_empty()).then_some(places)
    };
    let sparse = folder.join("sparse");
    let alone = || Some(vec![Place::of(folder.join("sparse"))?]);
    numbered(sparse).or_else(|| numbered(folder.to_owned())).or_else(alone).unwrap_or_default()
}

/// The model with the most images; a warning names the others.
fn largest(mut models: Vec<Place>) -> Option<Place> {
    if models.len() < 2 {
        return models.pop();
    }
    let counts: Vec<u64> = models.iter().map(Place::count_images).collect();
    let at = (0..models.len()).max_by_key(|&at| (counts[at], std::cmp::Reverse(at)))?;
    let named = |at: usize| format!("{} ({} images)", models[at].folder.display(), counts[at]);
    let others: Vec<String> = (0..models.len()).filter(|other| *other != at).map(named).collect();
    log::warn!(
        "{} is read, the largest of {} models; the others are left out, and open by their own names: {}",
        named(at),
        models.len(),
        others.join(", ")
    );
    Some(models.swap_remove(at))
}

fn open(folder: &Path) -> Result<Box<dyn Scene>, SceneError> {
    let Some(place) = largest(models(folder)) else {
        return Err(SceneError::expected(
            folder,
            "cameras and images as .bin or .txt expected, here or in sparse/0, none found",
        ));
    };
    let listed_in = place.images();
    let Place { folder: place, extension } = place;
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
    for (id, camera) in model.cameras {
        let developed = camera.and_then(|camera| {
            developed_camera(camera.intrinsics, camera.distortion)
                .map_err(|why| error(format!("camera {id}: {why}")))
        });
        cameras.insert(id, developed);
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
    let mut without_camera: BTreeMap<u32, usize> = BTreeMap::new();
    for (image, name) in images.into_iter().zip(names) {
        let photo = within(&photos, &image.name).map_err(error)?;
        let camera = cameras.get(&image.camera).ok_or_else(|| {
            error(format!(
                "image {}: the id of a camera of the model expected, {} found",
                image.name, image.camera
            ))
        })?;
        let Ok((intrinsics, develop)) = camera else {
            *without_camera.entry(image.camera).or_default() += 1;
            continue;
        };
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
    for (camera, images) in &without_camera {
        if let Some(Err(why)) = cameras.remove(camera) {
            if frames.is_empty() {
                return Err(why);
            }
            log::warn!("{why}; the {images} images of camera {camera} are left out");
        }
    }
    let missing = listed - frames.len() - without_camera.values().sum::<usize>();
    if missing > 0 {
        log::warn!(
            "{}: {missing} of the model's {listed} images are missing and are skipped",
            photos.display()
        );
    }
    let scene = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = format!("colmap/{}", scene_name(&scene, &photos));
    let is_without_tracks = observed.iter().all(Vec::is_empty) && !model.points.is_empty();
    if is_without_tracks {
        log::warn!(
            "{}: points3D has {} points, but no image observes any; each frame gets those in its view",
            place.display(),
            model.points.len()
        );
    }
    let clouds = ModelPoints { points: model.points, observed, is_without_tracks, listed_in };
    Ok(Box::new(FileScene::new(name, frames, clouds)))
}

/// The name of the scene: that of the folder with both model and photos.
fn scene_name(folder: &Path, photos: &Path) -> String {
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
struct ModelPoints {
    /// In the world's frame.
    points: Vec<[f64; 3]>,
    /// The points of each frame, by position.
    observed: Vec<Vec<u32>>,
    /// Whether no frame observes any point; then each gets those in its view.
    is_without_tracks: bool,
    listed_in: PathBuf,
}

impl Clouds for ModelPoints {
    fn has(&self, index: usize) -> bool {
        self.is_without_tracks || !self.observed[index].is_empty()
    }

    fn lengths(&self) -> Lengths {
        Lengths::Model
    }

    fn missing(&self) -> Option<&str> {
        self.points.is_empty().then_some("points3D has no points")
    }

    fn place<'a>(&'a self, _index: usize, _frame: &'a Frame) -> &'a Path {
        &self.listed_in
    }

    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError> {
        let Some(world_from_camera) = frame.world_from_camera else {
            return Ok(Cloud::default());
        };
        let camera_from_world = world_from_camera.inverse();
        let in_camera = |point: &[f64; 3]| camera_from_world * nalgebra::Point3::from(*point);
        if self.is_without_tracks {
            let points = self.points.iter().map(in_camera).collect();
            return Ok(in_view_of_any_scale(points, &frame.intrinsics));
        }
        let points = self.observed[index].iter().map(|&point| &self.points[point as usize]);
        Ok(Cloud { points: points.map(|point| in_camera(point).cast()).collect() })
    }
}
