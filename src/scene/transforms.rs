//! `transforms.json` of nerfstudio, instant-ngp, Polycam and Record3D: a camera and a list of photos with poses.
//!
//! Poses are camera to world, with the camera axes of OpenGL: x right, y up, z backwards. The centre of the first pixel is
//! (0.5, 0.5), here (0, 0). The cloud of a frame is its depth image, or the part of `ply_file_path` that it sees. That file
//! is in the world of the poses: an `applied_transform` is applied to both already.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use nalgebra::{Matrix3x4, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use posescope_core::files;
use serde::Deserialize;

use super::file_scene::{Clouds, Develop, FileScene, Frame};
use super::folder::{Bounds, folder_name, within};
use super::frame_names::names_of;
use super::lens::{Distortion, developed_camera, pinhole};
use super::map_blocks::MapBlocks;
use super::model_view::in_view_of_any_scale;
use super::{Lengths, Scene, SceneError, SceneFormat, lines, photo_file};
use super::{cloud_file, depth_image};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::{Pose, pose_from_matrix};

pub(super) const ENTRY: SceneFormat = SceneFormat {
    name: "transforms",
    about: "nerfstudio, instant-ngp, Polycam, Record3D: a transforms.json, or the folder with it",
    recognizes: |argument| file_of(Path::new(argument)).is_some(),
    open: |argument| {
        let path = Path::new(argument);
        open(&file_of(path).unwrap_or_else(|| path.join(FILES[0])))
    },
};

/// The names of the file, the second as of synthetic scenes.
const FILES: [&str; 2] = ["transforms.json", "transforms_train.json"];

/// The extensions that a photo may have if the file names none.
const ENDINGS: [&str; 5] = ["png", "jpg", "jpeg", "PNG", "JPG"];

/// The points beside the file that nerfstudio writes.
const SPARSE: &str = "sparse_pc.ply";

fn file_of(argument: &Path) -> Option<PathBuf> {
    let name = argument.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    if name.starts_with("transforms") && name.ends_with(".json") && argument.is_file() {
        return Some(argument.to_owned());
    }
    FILES.map(|file| argument.join(file)).into_iter().find(|path| path.is_file())
}

#[derive(Deserialize)]
struct Content {
    #[serde(flatten)]
    camera: CameraEntry,
    frames: Vec<FrameEntry>,
    ply_file_path: Option<String>,
    /// The depth of a value of 1 \[m\].
    depth_unit_scale_factor: Option<f64>,
}

#[derive(Deserialize)]
struct FrameEntry {
    file_path: String,
    transform_matrix: Vec<Vec<f64>>,
    depth_file_path: Option<String>,
    #[serde(flatten)]
    camera: CameraEntry,
}

/// A camera, for all frames or for one.
#[derive(Clone, Default, Deserialize)]
struct CameraEntry {
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    k5: Option<f64>,
    k6: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

impl CameraEntry {
    /// What is stated for a frame, or else for all.
    fn or(self, all: &Self) -> Self {
        let Self { camera_model, is_fisheye, fl_x, fl_y, cx, cy, w, h, .. } = self;
        let Self { camera_angle_x, camera_angle_y, k1, k2, k3, k4, k5, k6, p1, p2, .. } = self;
        // A focal length of its own is not that of an angle for all.
        let has_focal = fl_x.is_some() || camera_angle_x.is_some();
        let of_all = |own: Option<f64>, all: Option<f64>| if has_focal { own } else { own.or(all) };
        Self {
            camera_model: camera_model.or_else(|| all.camera_model.clone()),
            is_fisheye: is_fisheye.or(all.is_fisheye),
            fl_x: of_all(fl_x, all.fl_x),
            fl_y: of_all(fl_y, all.fl_y),
            camera_angle_x: of_all(camera_angle_x, all.camera_angle_x),
            camera_angle_y: of_all(camera_angle_y, all.camera_angle_y),
            cx: cx.or(all.cx),
            cy: cy.or(all.cy),
            w: w.or(all.w),
            h: h.or(all.h),
            k1: k1.or(all.k1),
            k2: k2.or(all.k2),
            k3: k3.or(all.k3),
            k4: k4.or(all.k4),
            k5: k5.or(all.k5),
            k6: k6.or(all.k6),
            p1: p1.or(all.p1),
            p2: p2.or(all.p2),
        }
    }

    /// The camera of a photo of this size \[px\].
    fn taken(&self, (width, height): (u32, u32)) -> Result<(Intrinsics, Distortion), String> {
        for (side, stated, found) in [("w", self.w, width), ("h", self.h, height)] {
            if stated.is_some_and(|stated| stated != f64::from(found)) {
                let stated = stated.unwrap_or_default();
                return Err(format!(
                    "photos of the size in the file expected, but {side} is {stated} and the photo has {found} pixels"
                ));
            }
        }
        let of_angle = |angle: f64, side: u32| f64::from(side) / 2.0 / (angle / 2.0).tan();
        let fx = self.fl_x.or_else(|| Some(of_angle(self.camera_angle_x?, width)));
        let fx = fx.ok_or("a focal length fl_x or an angle camera_angle_x expected, none found")?;
        let fy = self.fl_y.or_else(|| Some(of_angle(self.camera_angle_y?, height))).unwrap_or(fx);
        let centre = |stated: Option<f64>, side: u32| stated.unwrap_or(f64::from(side) / 2.0) - 0.5;
        let camera = [fx, fy, centre(self.cx, width), centre(self.cy, height)];
        Ok((pinhole(camera, (width, height))?, self.distortion()?))
    }

    fn distortion(&self) -> Result<Distortion, String> {
        let [k1, k2, k3, k4] = [self.k1, self.k2, self.k3, self.k4].map(|k| k.unwrap_or(0.0));
        let p = [self.p1, self.p2].map(|p| p.unwrap_or(0.0));
        let unknown = [("k5", self.k5), ("k6", self.k6)];
        let unknown = unknown.into_iter().find(|(_, k)| k.is_some_and(|k| k != 0.0));
        let model = self.camera_model.as_deref().unwrap_or("OPENCV");
        let is_fisheye = self.is_fisheye.unwrap_or(false) || model == "OPENCV_FISHEYE";
        if is_fisheye {
            return match p {
                [0.0, 0.0] if unknown.is_none() => Ok(Distortion::fisheye([k1, k2, k3, k4])),
                _ => Err("a fisheye camera with the coefficients k1 k2 k3 k4 expected".to_owned()),
            };
        }
        if !["OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE"]
            .contains(&model)
        {
            let model = lines::excerpt(model);
            return Err(format!(
                "camera_model OPENCV, PINHOLE or OPENCV_FISHEYE expected, `{model}` found"
            ));
        }
        // In OpenCV k4 is the first coefficient of a divisor, in nerfstudio that of the eighth power.
        let fourth = self.k4.filter(|k4| *k4 != 0.0).map(|k4| ("k4", k4));
        if let Some((name, k)) = fourth.or(unknown.and_then(|(name, k)| Some((name, k?)))) {
            return Err(format!("a camera with k1 k2 k3 p1 p2 expected, {name} = {k} found"));
        }
        Ok(Distortion::brown([k1, k2, k3, 0.0, 0.0, 0.0], p))
    }
}

/// The pose of a camera whose axes are those of OpenGL.
fn pose(rows: &[Vec<f64>]) -> Result<Pose, String> {
    let is_matrix = (3..=4).contains(&rows.len()) && rows.iter().all(|row| row.len() == 4);
    let has_last = rows.get(3).is_none_or(|last| last[..] == [0.0, 0.0, 0.0, 1.0]);
    if !is_matrix || !has_last {
        return Err(
            "a transform_matrix of 3 x 4 or 4 x 4 numbers, with the last row 0 0 0 1, expected"
                .to_owned(),
        );
    }
    let matrix = Matrix3x4::from_fn(|row, column| rows[row][column]);
    let world_from_opengl = pose_from_matrix(&matrix).map_err(|error| error.to_string())?;
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Ok(world_from_opengl * Pose::from_parts(Translation3::identity(), half_turn))
}

fn open(path: &Path) -> Result<Box<dyn Scene>, SceneError> {
    Bounds::Layout.check(path)?;
    let content: Content = serde_json::from_str(&lines::read_text(path, files::TABLE)?)
        .map_err(|error| SceneError::line(path, error.line().max(1), error.to_string()))?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let error = |name: &str, why: String| SceneError::expected(path, format!("{name}: {why}"));
    let listed = content.frames.len();
    let mut entries = Vec::with_capacity(listed);
    for entry in content.frames {
        let photo = within(folder, &entry.file_path).map_err(|why| error("file_path", why))?;
        if let Some(photo) = existing(&photo) {
            entries.push((photo, entry));
        }
    }
    if entries.is_empty() {
        let expected = format!("photos that exist expected in `frames`, none of {listed} found");
        return Err(SceneError::expected(path, expected));
    }
    if entries.len() < listed {
        let missing = listed - entries.len();
        log::warn!("{}: {missing} of {listed} photos are missing and are skipped", path.display());
    }
    entries.sort_by_key(|(_, entry)| bare_path(entry));
    let names = names(&entries);
    let mut frames = Vec::with_capacity(entries.len());
    let mut depths = Vec::with_capacity(entries.len());
    for ((photo, entry), name) in entries.into_iter().zip(names) {
        let camera = entry.camera.or(&content.camera);
        let taken = photo_file::dimensions(&photo)?;
        let (taken, distortion) = camera.taken(taken).map_err(|why| error(&name, why))?;
        let (intrinsics, develop): (_, Option<Arc<dyn Develop>>) =
            developed_camera(taken, distortion).map_err(|why| error(&name, why))?;
        let depth = entry.depth_file_path.map(|depth| within(folder, &depth)).transpose();
        let depth = depth.map_err(|why| error(&name, why))?;
        depths.push(depth.filter(|depth| depth.is_file()));
        frames.push(Frame {
            world_from_camera: Some(
                pose(&entry.transform_matrix).map_err(|why| error(&name, why))?,
            ),
            name,
            develop,
            ..Frame::new(photo, intrinsics)
        });
    }
    if let Some(twice) = frames.windows(2).find(|pair| pair[0].name == pair[1].name) {
        let name = &twice[0].name;
        return Err(error(
            name,
            "photos with different names expected, two have this one".to_owned(),
        ));
    }
    let named = content.ply_file_path.as_ref().map(|name| within(folder, name)).transpose();
    let named = named.map_err(|why| error("ply_file_path", why))?;
    let map = named.or_else(|| Some(folder.join(SPARSE))).filter(|map| map.is_file());
    let clouds = TransformsClouds {
        listed_in: path.to_owned(),
        unit_m: content.depth_unit_scale_factor.unwrap_or(0.001),
        map: map.filter(|_| depths.iter().all(Option::is_none)),
        blocks: OnceLock::new(),
        depths,
    };
    let name = format!("transforms/{}", folder_name(folder));
    let bounds = Bounds::Folder(folder.to_owned());
    Ok(Box::new(FileScene::new(name, frames, clouds).within(bounds)))
}

/// A photo, whose name in the file may have no extension.
fn existing(photo: &Path) -> Option<PathBuf> {
    if photo.is_file() {
        return Some(photo.to_owned());
    }
    let with_ending = |ending: &str| PathBuf::from(format!("{}.{ending}", photo.display()));
    ENDINGS.map(with_ending).into_iter().find(|photo| photo.is_file())
}

/// The path of a photo without `./` in front.
fn bare_path(entry: &FrameEntry) -> String {
    entry.file_path.trim_start_matches("./").replace('\\', "/")
}

/// The names of frames: the paths of their photos below the folder that all share, without extension.
fn names(entries: &[(PathBuf, FrameEntry)]) -> Vec<String> {
    let paths: Vec<String> = entries.iter().map(|(_, entry)| bare_path(entry)).collect();
    let folder = |path: &str| path.rfind('/').map_or(0, |at| at + 1);
    let first = &paths[0];
    let shared = (0..=folder(first)).rev().find(|&end| {
        let is_folder = end == 0 || first[..end].ends_with('/');
        is_folder && paths.iter().all(|path| path.get(..end) == first.get(..end))
    });
    let below: Vec<String> =
        paths.iter().map(|path| path[shared.unwrap_or(0)..].to_owned()).collect();
    names_of(&below)
}

struct TransformsClouds {
    listed_in: PathBuf,
    /// The depth image of each frame, if it has one.
    depths: Vec<Option<PathBuf>>,
    /// The depth of a value of 1 \[m\].
    unit_m: f64,
    /// The points of all frames.
    map: Option<PathBuf>,
    blocks: OnceLock<MapBlocks>,
}

impl Clouds for TransformsClouds {
    fn has(&self, index: usize) -> bool {
        self.map.is_some() || self.depths[index].is_some()
    }

    fn place<'a>(&'a self, index: usize, _frame: &'a Frame) -> &'a Path {
        let file = self.depths[index].as_deref().or(self.map.as_deref());
        file.unwrap_or(&self.listed_in)
    }

    fn missing(&self) -> Option<&str> {
        let is_any = self.map.is_some() || self.depths.iter().any(Option::is_some);
        (!is_any)
            .then_some("neither ply_file_path nor sparse_pc.ply nor a depth_file_path is there")
    }

    fn is_in_world(&self, index: usize) -> bool {
        self.depths[index].is_none()
    }

    /// Depth images are metric. Models that were made from photos have no scale.
    fn lengths(&self) -> Lengths {
        let has_depths = self.depths.iter().any(Option::is_some);
        if has_depths { Lengths::Metres } else { Lengths::Model }
    }

    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError> {
        if let Some(depth) = &self.depths[index] {
            // Depth images of phones are smaller than their photos; their borders are those of the photos.
            let size = photo_file::dimensions(depth)?;
            let camera = &frame.intrinsics;
            let scale = |photo: u32, image: u32| f64::from(photo) / f64::from(image);
            let (across, down) = (scale(camera.width, size.0), scale(camera.height, size.1));
            // They show what the lens does, and the photos are undistorted.
            let map = frame.develop.as_ref().and_then(|develop| develop.pixel_map());
            return depth_image::points(depth, self.unit_m, |pixel, depth| {
                let in_file =
                    Point2::new(across * (pixel.x + 0.5) - 0.5, down * (pixel.y + 0.5) - 0.5);
                let pixel = map.as_ref().map_or(Some(in_file), |map| map.to_photo(in_file))?;
                Some(camera.unproject(&pixel, depth))
            });
        }
        let (Some(map), Some(world_from_camera)) = (&self.map, &frame.world_from_camera) else {
            return Ok(Cloud::default());
        };
        let blocks = match self.blocks.get() {
            Some(blocks) => blocks,
            None => {
                let read = MapBlocks::new(cloud_file::read(map)?);
                self.blocks.get_or_init(|| read)
            }
        };
        let points: Vec<Point3<f64>> =
            blocks.around_view(world_from_camera, &frame.intrinsics).collect();
        Ok(in_view_of_any_scale(points, &frame.intrinsics))
    }
}
