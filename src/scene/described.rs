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

mod correction;
mod pattern;
mod poses;

use std::mem::discriminant;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use image::metadata::Orientation;
use nalgebra::{Matrix3x4, Point3, Translation3};
use posescope_core::files;
use serde::Deserialize;
use toml::Spanned;

use self::correction::{Turn, Units, axes};
use self::poses::{DescribedPoses, FramePoses};
use super::cloud_file::{self, MapCloud, Note};
use super::file_scene::{Clouds, Develop, FileScene, Frame};
use super::folder::{Bounds, folder_name, stem, warn_without_poses, within};
use super::frame_names::names_of;
use super::lens::{Distortion, developed_camera, pinhole};
use super::map_blocks::MapBlocks;
use super::recalibrated::Recalibrated;
use super::{
    CloudFacts, Scene, SceneError, SceneFormat, depth_image, lines, photo_file, view_crop,
};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::{Pose, matrix_from_pose, pose_from_matrix};

const FILE: &str = "scene.toml";

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "toml",
    about: "anything else: a scene.toml (or another .toml file), or the folder with it, that names images, poses, \
            camera and cloud (PLY, PCD, LAS, LAZ, E57, PTS, PTX, text, depth images)",
    recognizes: |argument| description_of(Path::new(argument)).is_file(),
    open: |argument| open(&description_of(Path::new(argument))),
};

/// A file of another name is a second description of the same folder.
fn description_of(argument: &Path) -> PathBuf {
    if argument.extension().is_some_and(|extension| extension == "toml") && argument.is_file() {
        argument.to_owned()
    } else {
        argument.join(FILE)
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
    /// The axes of the poses' cameras.
    axes: Option<Spanned<String>>,
    /// The camera in the frame of the body whose poses the file has: a 3 × 4 matrix, row by row.
    body_from_camera: Option<Spanned<[f64; 12]>>,
    /// The unit of poses and clouds.
    unit: Option<Spanned<Units>>,
    /// How the images in files must be turned.
    orientation: Option<Spanned<Turn>>,
    /// The value of a metre in depth images.
    depth_per_metre: Option<Spanned<f64>>,
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
    fn read(path: &Path) -> Result<Self, SceneError> {
        Bounds::Layout.check(path)?;
        Ok(Self { path: path.to_owned(), text: lines::read_text(path, files::DESCRIPTION)? })
    }

    fn description(&self) -> Result<Description, SceneError> {
        toml::from_str(&self.text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            self.error_at(at, error.message())
        })
    }

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
            lines::excerpt_of(&expected.replace('\n', " "), 400),
        )
    }

    fn error<T>(&self, value: &Spanned<T>, expected: &str) -> SceneError {
        self.error_at(value.span().start, expected)
    }

    /// What a value means, if it is there.
    fn read_value<T, R>(
        &self,
        value: Option<&Spanned<T>>,
        read: impl Fn(&T) -> Result<R, String>,
    ) -> Result<Option<R>, SceneError> {
        let read = value.map(|value| read(value.get_ref()).map_err(|why| self.error(value, &why)));
        read.transpose()
    }

    fn file(&self, name: &Spanned<String>) -> Result<PathBuf, SceneError> {
        let path = within(self.folder(), name.get_ref())
            .map_err(|expected| self.error(name, &expected))?;
        if !path.is_file() {
            let expected = format!("an existing file expected, `{}` found", path.display());
            return Err(self.error(name, &expected));
        }
        Bounds::Folder(self.folder().to_owned()).check(&path)?;
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
    let source = Source::read(path)?;
    let description = source.description()?;
    let photos = source.files(&description.images)?;
    let turned = source.read_value(description.orientation.as_ref(), Turn::orientation)?;
    let (intrinsics, develop) = camera(&source, &description.camera, &photos, turned)?;
    let file_names = photos.iter().map(|photo| photo.file_name().unwrap_or_default());
    let file_names: Vec<String> =
        file_names.map(|name| name.to_string_lossy().into_owned()).collect();
    let names = names_of(&file_names);
    let body_from_camera =
        source.read_value(description.body_from_camera.as_ref(), pose_of_rows)?;
    let DescribedPoses { poses, is_inverted, is_of_body } = match &description.poses {
        Some(name) => poses::read(&source.file(name)?, &names)?,
        None => {
            warn_without_poses(path, "poses");
            DescribedPoses {
                poses: vec![FramePoses::default(); photos.len()],
                ..Default::default()
            }
        }
    };
    if is_of_body && body_from_camera.is_none() {
        log::warn!(
            "{}: the poses of an EuRoC file are those of the body, and are taken as those of the camera; give the first \
             three rows of the camera's T_BS (sensor.yaml) as `body_from_camera = [12 numbers]`",
            path.display()
        );
    }
    let meaning = description.pose.as_ref().map(Spanned::get_ref);
    if let (true, Some(PoseMeaning::WorldFromCamera), Some(pose)) =
        (is_inverted, meaning, &description.pose)
    {
        let expected = "`camera_from_world` or no `pose` expected, since the format of the poses has this direction";
        return Err(source.error(pose, expected));
    }
    let invert = meaning == Some(&PoseMeaning::CameraFromWorld) && !is_inverted;
    let turn = source.read_value(description.axes.as_ref(), |text| axes(text))?;
    let [unit_m, clouds_unit_m] =
        source.read_value(description.unit.as_ref(), Units::metres)?.unwrap_or([1.0, 1.0]);
    if let (Some(axes), Some(_)) = (&description.axes, body_from_camera) {
        let expected = "either `axes` or `body_from_camera` expected, both found";
        return Err(source.error(axes, expected));
    }
    let turn = turn.map(|turn| Pose::from_parts(Translation3::identity(), turn));
    let posed_from_camera = turn.or(body_from_camera);
    let world_from_camera = |read: Pose| {
        let mut pose = if invert { read.inverse() } else { read };
        pose.translation.vector *= unit_m;
        posed_from_camera.map_or(pose, |posed_from_camera| pose * posed_from_camera)
    };
    let clouds =
        DescribedClouds { unit_m: clouds_unit_m, ..clouds(&source, &description, &photos)? };
    if let (Some(depth), true) =
        (&description.depth_per_metre, develop.is_some() || turned.is_some())
    {
        let expected = "photos without distortion and `orientation` expected, since depth images belong to them pixel \
                        by pixel";
        return Err(source.error(depth, expected));
    }
    let name = match &description.name {
        Some(name) if !name.get_ref().trim().is_empty() => name.get_ref().clone(),
        Some(name) => return Err(source.error(name, "a name expected, an empty one found")),
        None if path.ends_with(FILE) => format!("toml/{}", folder_name(source.folder())),
        None => format!("toml/{}/{}", folder_name(source.folder()), stem(path)),
    };
    let frames = photos
        .into_iter()
        .zip(poses)
        .zip(names)
        .map(|((photo, FramePoses { pose, time_s }), name)| Frame {
            name,
            develop: develop.clone(),
            world_from_camera: pose.map(world_from_camera),
            time_s,
            turned,
            ..Frame::new(photo, intrinsics)
        })
        .collect();
    let bounds = Bounds::Folder(source.folder().to_owned());
    Ok(Box::new(FileScene::new(name, frames, clouds).within(bounds)))
}

/// The camera of the undistorted photos, whose files are turned as said.
fn camera(
    source: &Source,
    described: &Spanned<CameraDescription>,
    photos: &[PathBuf],
    turned: Option<Orientation>,
) -> Result<(Intrinsics, Option<Arc<dyn Develop>>), SceneError> {
    let camera = described.get_ref();
    let (stored, first) = photo_file::common_size(photos)?;
    let by_exif = photo_file::turned_size(stored, photo_file::orientation(first));
    let size = match turned {
        Some(turned) => photo_file::turned_size(stored, turned),
        None if by_exif != stored && fits_turned(camera, stored, first) => by_exif,
        None => stored,
    };
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
    if let (Some(value), None) = (&description.depth_per_metre, &description.clouds) {
        return Err(
            source.error(value, "depth images in `files` of [clouds] expected, no [clouds] found")
        );
    }
    match (&description.cloud, &description.clouds) {
        (Some(name), None) => {
            clouds.place = source.file(name)?;
            clouds.map = Some(OnceLock::new());
        }
        (None, Some(described)) => {
            (clouds.files, clouds.camera_from_cloud) = per_frame(source, described, photos)?;
            clouds.depth = depth(source, description, described, &clouds.files)?;
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
            Some(pose_of_rows(matrix.get_ref()).map_err(|why| source.error(matrix, &why))?)
        }
    };
    Ok((clouds, camera_from_cloud))
}

/// The depth of a value of 1 in the clouds' files \[m\], if these are depth images.
fn depth(
    source: &Source,
    description: &Description,
    described: &CloudsDescription,
    files: &[Option<PathBuf>],
) -> Result<Option<f64>, SceneError> {
    let are_images = files.iter().flatten().next().is_some_and(|file| photo_file::is_image(file));
    match &description.depth_per_metre {
        Some(value) if !are_images => {
            Err(source.error(value, "depth images in `files` of [clouds] expected, other files found"))
        }
        Some(value) if !(value.get_ref().is_finite() && *value.get_ref() > 0.0) => {
            Err(source.error(value, "the value of a metre in depth images expected, such as 1000"))
        }
        None if are_images => Err(source.error(
            &described.files,
            "these are images: if they are depth images, a line such as `depth_per_metre = 1000` expected above [camera]",
        )),
        Some(_) if described.frame == CloudFrame::World || described.camera_from_cloud.is_some() => {
            Err(source.error(
                &described.files,
                "depth images belong to their photos pixel by pixel: no `frame` or `camera_from_cloud` expected",
            ))
        }
        value => Ok(value.as_ref().map(|value| 1.0 / value.get_ref())),
    }
}

fn pose_of_rows(rows: &[f64; 12]) -> Result<Pose, String> {
    pose_from_matrix(&Matrix3x4::from_row_slice(rows)).map_err(|error| error.to_string())
}

/// The description with another `camera_from_cloud`, or `body_from_camera` where the clouds are in the world's frame.
pub(super) fn recalibrated(argument: &str, change: &Pose) -> Result<Recalibrated, SceneError> {
    let source = Source::read(&description_of(Path::new(argument)))?;
    let description = source.description()?;
    let of_clouds = description.clouds.as_ref().filter(|one| one.frame == CloudFrame::Camera);
    let (name, stated) = match of_clouds {
        Some(_) if description.depth_per_metre.is_some() => {
            let expected =
                "clouds of a scanner expected: depth images belong to their photos pixel by pixel";
            return Err(SceneError::expected(&source.path, expected));
        }
        Some(clouds) => ("camera_from_cloud", clouds.camera_from_cloud.as_ref()),
        None => ("body_from_camera", description.body_from_camera.as_ref()),
    };
    let mut better = match stated {
        Some(stated) => pose_of_rows(stated.get_ref()).map_err(|why| source.error(stated, &why))?,
        None => Pose::identity(),
    };
    if let (None, Some(axes_of_poses)) = (of_clouds, &description.axes) {
        let expected = "`body_from_camera` in place of `axes` expected, to hold a turn and a shift";
        return Err(source.error(axes_of_poses, expected));
    }
    // The map stays, so the cameras move.
    better = if of_clouds.is_some() { change * better } else { better * change.inverse() };
    let numbers = matrix_from_pose(&better).transpose();
    let numbers: Vec<String> = numbers.iter().map(|number| format!("{number:.9}")).collect();
    let value = format!("[{}]", numbers.join(", "));
    let mut text = source.text.clone();
    match (stated, &description.clouds) {
        (Some(stated), _) => text.replace_range(stated.span(), &value),
        (None, Some(clouds)) if of_clouds.is_some() => {
            text.insert_str(clouds.files.span().end, &format!("\n{name} = {value}"));
        }
        (None, _) => text.insert_str(0, &format!("{name} = {value}\n")),
    }
    Ok(Recalibrated { path: source.path, text })
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
    /// The depth of a value of 1 \[m\], if the files are depth images.
    depth: Option<f64>,
    /// The unit of the clouds \[m\].
    unit_m: f64,
    /// What was noticed in the files.
    notes: Mutex<Vec<Note>>,
}

impl DescribedClouds {
    /// Reads a file, and warns of what is noticed in it. The same of other files is not said again.
    fn read_file(&self, path: &Path) -> Result<MapCloud, SceneError> {
        let cloud = cloud_file::read(path)?.in_metres(self.unit_m);
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
            if let Some(unit_m) = self.depth {
                return depth_image::cloud_of(path, &frame.intrinsics, &Pose::identity(), unit_m);
            }
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
