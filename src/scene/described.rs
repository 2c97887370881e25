//! `scene.toml`: anything else, described in a few lines.
//!
//! ```toml
//! images = "photos/*.jpg"
//! poses = "poses.txt"          # TUM (time tx ty tz qx qy qz qw) or KITTI (3 × 4 matrices)
//! cloud = "map.laz"            # one for all, in the frame of the poses
//!
//! [camera]
//! fx = 1200.5
//! fy = 1200.5
//! cx = 959.5                   # pixel centres at integers
//! cy = 539.5
//! ```
//!
//! All files are in the folder of `scene.toml` or below it.

mod pattern;
mod poses;

use std::mem::discriminant;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use nalgebra::{Matrix3x4, Point3};
use serde::Deserialize;
use toml::Spanned;

use self::poses::FramePoses;
use super::cloud_file::{self, MapCloud, Note};
use super::file_scene::{Clouds, Develop, FileScene, Frame};
use super::folder::{folder_name, stem, warn_without_poses, within};
use super::frame_names::names_of;
use super::lens::{Distortion, developed_camera, pinhole};
use super::map_blocks::MapBlocks;
use super::{CloudFacts, Scene, SceneError, SceneFormat, lines, photo_file, view_crop};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::{Pose, pose_from_matrix};

const FILE: &str = "scene.toml";

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "toml",
    about: "anything else: a scene.toml, or the folder with it, that names images, poses, camera and \
            cloud (PLY, PCD, LAS, LAZ, E57, PTS, PTX, text)",
    recognizes: |argument| description_of(Path::new(argument)).is_file(),
    open: |argument| open(&description_of(Path::new(argument))),
};

fn description_of(argument: &Path) -> PathBuf {
    match argument.file_name() {
        Some(name) if name == FILE => argument.to_owned(),
        _ => argument.join(FILE),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    /// The name of the scene in results; by default that of its folder.
    name: Option<Spanned<String>>,
    /// The photos: a path whose last part may contain `*`.
    images: Spanned<String>,
    /// The file with the poses. Without it, all frames are queries.
    poses: Option<Spanned<String>>,
    pose: Option<Spanned<PoseMeaning>>,
    camera: Spanned<CameraDescription>,
    /// One cloud for all frames.
    cloud: Option<Spanned<String>>,
    /// A cloud per frame.
    clouds: Option<CloudsDescription>,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum PoseMeaning {
    WorldFromCamera,
    CameraFromWorld,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table [camera] with fx, fy, cx and cy")]
struct CameraDescription {
    #[serde(default)]
    model: LensModel,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    k1: f64,
    #[serde(default)]
    k2: f64,
    #[serde(default)]
    p1: f64,
    #[serde(default)]
    p2: f64,
    #[serde(default)]
    k3: f64,
    #[serde(default)]
    k4: f64,
    #[serde(default)]
    k5: f64,
    #[serde(default)]
    k6: f64,
}

/// What the coefficients of a lens mean.
#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum LensModel {
    /// OpenCV's `k1 k2 p1 p2 k3 k4 k5 k6`.
    #[default]
    OpenCv,
    /// OpenCV's equidistant model, `k1 k2 k3 k4`.
    Fisheye,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CloudsDescription {
    /// The clouds: a path whose last part has `*` in place of the image's name.
    files: Spanned<String>,
    /// The coordinate frame of the clouds.
    #[serde(default)]
    frame: CloudFrame,
    /// From the scanner's frame: a 3 × 4 matrix, row by row.
    camera_from_cloud: Option<Spanned<[f64; 12]>>,
}

/// The coordinate frame of clouds per frame.
#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum CloudFrame {
    #[default]
    Camera,
    World,
}

/// The file with its text, for errors that name a line.
struct Source {
    path: PathBuf,
    text: String,
}

impl Source {
    fn folder(&self) -> &Path {
        match self.path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        }
    }

    fn error_at(&self, at: usize, expected: &str) -> SceneError {
        let before = &self.text.as_bytes()[..at.min(self.text.len())];
        SceneError::line(
            &self.path,
            before.iter().filter(|byte| **byte == b'\n').count() + 1,
            expected.replace('\n', " "),
        )
    }

    fn error<T>(&self, value: &Spanned<T>, expected: &str) -> SceneError {
        self.error_at(value.span().start, expected)
    }

    fn file(&self, name: &Spanned<String>) -> Result<PathBuf, SceneError> {
        let path = within(self.folder(), name.get_ref())
            .map_err(|expected| self.error(name, &expected))?;
        if !path.is_file() {
            let expected = format!("an existing file expected, `{}` found", path.display());
            return Err(self.error(name, &expected));
        }
        Ok(path)
    }

    /// The files that a pattern names, in the order of their names.
    fn files(&self, name: &Spanned<String>) -> Result<Vec<PathBuf>, SceneError> {
        let pattern = within(self.folder(), name.get_ref())
            .map_err(|expected| self.error(name, &expected))?;
        let files = pattern::files(&pattern)?;
        if files.is_empty() {
            let expected = format!(
                "a pattern of existing files expected, no file matches `{}`",
                pattern.display()
            );
            return Err(self.error(name, &expected));
        }
        Ok(files)
    }
}

fn open(path: &Path) -> Result<Box<dyn Scene>, SceneError> {
    let source = Source { path: path.to_owned(), text: lines::read_text(path)? };
    let description: Description = toml::from_str(&source.text).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        source.error_at(at, error.message())
    })?;
    let photos = source.files(&description.images)?;
    let (intrinsics, develop) = camera(&source, &description.camera, &photos)?;
    let file_names = photos.iter().map(|photo| photo.file_name().unwrap_or_default());
    let file_names: Vec<String> =
        file_names.map(|name| name.to_string_lossy().into_owned()).collect();
    let names = names_of(&file_names);
    let (poses, is_inverted) = match &description.poses {
        Some(name) => poses::read(&source.file(name)?, &names)?,
        None => {
            warn_without_poses(path, "poses");
            (vec![FramePoses::default(); photos.len()], false)
        }
    };
    let meaning = description.pose.as_ref().map(Spanned::get_ref);
    if let (true, Some(PoseMeaning::WorldFromCamera), Some(pose)) =
        (is_inverted, meaning, &description.pose)
    {
        let expected = "`camera_from_world` or no `pose` expected, since the format of the poses has this direction";
        return Err(source.error(pose, expected));
    }
    let invert = meaning == Some(&PoseMeaning::CameraFromWorld) && !is_inverted;
    let clouds = clouds(&source, &description, &photos)?;
    let name = match &description.name {
        Some(name) if !name.get_ref().trim().is_empty() => name.get_ref().clone(),
        Some(name) => return Err(source.error(name, "a name expected, an empty one found")),
        None => format!("toml/{}", folder_name(source.folder())),
    };
    let frames = photos
        .into_iter()
        .zip(poses)
        .zip(names)
        .map(|((photo, FramePoses { pose, time_s }), name)| Frame {
            name,
            develop: develop.clone(),
            world_from_camera: pose.map(|pose| if invert { pose.inverse() } else { pose }),
            time_s,
            ..Frame::new(photo, intrinsics)
        })
        .collect();
    Ok(Box::new(FileScene::new(name, frames, clouds)))
}

/// The camera of the undistorted photos.
fn camera(
    source: &Source,
    described: &Spanned<CameraDescription>,
    photos: &[PathBuf],
) -> Result<(Intrinsics, Option<Arc<dyn Develop>>), SceneError> {
    let camera = described.get_ref();
    let (stored, first) = photo_file::common_size(photos)?;
    let turned = photo_file::turned_size(stored, photo_file::orientation(first));
    let size = if turned != stored && fits_turned(camera, stored, first) { turned } else { stored };
    let numbers = [camera.fx, camera.fy, camera.cx, camera.cy];
    let error = |why: String| source.error(described, &why);
    let taken = pinhole(numbers, size).map_err(error)?;
    let CameraDescription { k1, k2, p1, p2, k3, k4, k5, k6, .. } = *camera;
    let distortion = match camera.model {
        LensModel::OpenCv => Distortion::brown([k1, k2, k3, k4, k5, k6], [p1, p2]),
        LensModel::Fisheye if [p1, p2, k5, k6] == [0.0; 4] => Distortion::fisheye([k1, k2, k3, k4]),
        LensModel::Fisheye => {
            return Err(error(
                "a fisheye camera with the coefficients k1 k2 k3 k4 expected".to_owned(),
            ));
        }
    };
    developed_camera(taken, distortion).map_err(error)
}

/// Whether the centre of a camera is that of a photo whose EXIF data exchange width and height, rather than that of
/// the stored image.
fn fits_turned(camera: &CameraDescription, (width, height): (u32, u32), photo: &Path) -> bool {
    /// The share of a photo's size by which one of both must fit better.
    const CLEAR: f64 = 0.02;
    let off = |width: u32, height: u32| {
        let aside = (camera.cx + 0.5) / f64::from(width) - 0.5;
        let above = (camera.cy + 0.5) / f64::from(height) - 0.5;
        aside.abs().max(above.abs())
    };
    let (stored, turned) = (off(width, height), off(height, width));
    if (stored - turned).abs() < CLEAR {
        log::warn!(
            "{}: the EXIF orientation is ignored, here and in other photos of the scene: the centre of the camera \
             fits the stored image and the turned one",
            photo.display()
        );
    } else if turned < stored {
        log::info!(
            "{}: turned as its EXIF orientation says, since the centre of the camera is that of the turned photo",
            photo.display()
        );
    }
    turned + CLEAR <= stored
}

fn clouds(
    source: &Source,
    description: &Description,
    photos: &[PathBuf],
) -> Result<DescribedClouds, SceneError> {
    let mut clouds = DescribedClouds { place: source.path.clone(), ..DescribedClouds::default() };
    match (&description.cloud, &description.clouds) {
        (Some(name), None) => {
            clouds.place = source.file(name)?;
            clouds.map = Some(OnceLock::new());
        }
        (None, Some(described)) => {
            (clouds.files, clouds.camera_from_cloud) = per_frame(source, described, photos)?;
        }
        (None, None) => {}
        (Some(name), Some(_)) => {
            return Err(source.error(name, "either `cloud` or `clouds` expected, both found"));
        }
    }
    Ok(clouds)
}

/// The cloud of each photo, and the transform to the camera's frame; `None` if they are in the world's frame.
fn per_frame(
    source: &Source,
    described: &CloudsDescription,
    photos: &[PathBuf],
) -> Result<(Vec<Option<PathBuf>>, Option<Pose>), SceneError> {
    let files = source.files(&described.files)?;
    let of_photo = |photo: &PathBuf| files.iter().find(|file| stem(file) == stem(photo)).cloned();
    let clouds: Vec<_> = photos.iter().map(of_photo).collect();
    if clouds.iter().all(Option::is_none) {
        return Err(source.error(
            &described.files,
            &format!(
                "clouds with the names of their images expected, such as `{}`; `{}` found",
                stem(&photos[0]),
                stem(&files[0])
            ),
        ));
    }
    let camera_from_cloud = match (described.frame, &described.camera_from_cloud) {
        (CloudFrame::World, None) => None,
        (CloudFrame::World, Some(matrix)) => {
            let expected = "either frame = \"world\" or camera_from_cloud expected, both found";
            return Err(source.error(matrix, expected));
        }
        (CloudFrame::Camera, None) => Some(Pose::identity()),
        (CloudFrame::Camera, Some(matrix)) => {
            let pose = pose_from_matrix(&Matrix3x4::from_row_slice(matrix.get_ref()));
            Some(pose.map_err(|error| source.error(matrix, &error.to_string()))?)
        }
    };
    Ok((clouds, camera_from_cloud))
}

#[derive(Default)]
struct DescribedClouds {
    /// The file of the map, or the one that lists the clouds.
    place: PathBuf,
    /// One cloud for all frames, read on first use.
    map: Option<OnceLock<MapBlocks>>,
    /// One file per frame.
    files: Vec<Option<PathBuf>>,
    /// The transform of these files to the camera's frame; `None` if they are in the world's frame.
    camera_from_cloud: Option<Pose>,
    /// What was noticed in the files.
    notes: Mutex<Vec<Note>>,
}

impl DescribedClouds {
    /// Reads a file, and warns of what is noticed in it. The same of other files is not said again.
    fn read_file(&self, path: &Path) -> Result<MapCloud, SceneError> {
        let cloud = cloud_file::read(path)?;
        let mut known = self.notes.lock().unwrap_or_else(PoisonError::into_inner);
        for note in &cloud.notes {
            if !known.iter().any(|other| discriminant(other) == discriminant(note)) {
                let others =
                    if self.map.is_none() { " (other clouds may have some, too)" } else { "" };
                log::warn!("{}: {note}{others}", path.display());
                known.push(note.clone());
            }
        }
        Ok(cloud)
    }
}

impl Clouds for DescribedClouds {
    fn has(&self, index: usize) -> bool {
        self.map.is_some() || self.files.get(index).is_some_and(Option::is_some)
    }

    fn place<'a>(&'a self, index: usize, _frame: &'a Frame) -> &'a Path {
        let file = self.files.get(index).and_then(Option::as_deref);
        file.unwrap_or(&self.place)
    }

    fn is_in_world(&self, _index: usize) -> bool {
        self.map.is_some() || self.camera_from_cloud.is_none()
    }

    fn facts(&self) -> CloudFacts {
        let known = self.notes.lock().unwrap_or_else(PoisonError::into_inner);
        let coarse_step_m = known.iter().find_map(|note| match note {
            Note::Coarse { step, .. } => Some(*step),
            _ => None,
        });
        let map = self.map.as_ref().and_then(OnceLock::get);
        CloudFacts { coarse_step_m, map: map.map(MapBlocks::facts) }
    }

    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError> {
        let path = self.place(index, frame);
        let world_from_camera = || {
            frame.world_from_camera.ok_or_else(|| {
                let name = &frame.name;
                let expected = format!(
                    "a pose of frame {name} expected, since its cloud is in the world frame"
                );
                SceneError::expected(path, expected)
            })
        };
        let Some(map) = &self.map else {
            let camera_from_cloud = match self.camera_from_cloud {
                Some(camera_from_cloud) => camera_from_cloud,
                None => world_from_camera()?.inverse(),
            };
            let cloud = self.read_file(path)?;
            let in_camera = |point: Point3<f64>| (camera_from_cloud * point).cast();
            return Ok(Cloud { points: cloud.positions().map(in_camera).collect() });
        };
        let map = match map.get() {
            Some(map) => map,
            None => {
                let read = MapBlocks::new(self.read_file(path)?);
                map.get_or_init(|| read)
            }
        };
        let points = map.around_view(&world_from_camera()?, &frame.intrinsics);
        Ok(view_crop::in_view(points, &frame.intrinsics))
    }
}
