//! Scene formats. See [`Scene`] for what a scene is.
//!
//! A scene that wraps another one forwards the unchanged methods with [`inner_scene!`](crate::inner_scene).
//!
//! A new format is one file, its `mod` line and its entry in [`ALL`].

mod cloud_file;
mod colmap;
mod depth_image;
mod described;
mod estimates;
mod exif;
mod file_scene;
mod folder;
mod frame_list;
mod frame_names;
mod gps;
mod kitti;
mod kitti_format;
mod kitti_raw;
pub mod layout;
mod lens;
mod lines;
mod loose;
mod map_blocks;
mod model_view;
mod pair_matches;
mod photo_file;
mod pose_text;
mod recalibrated;
mod retriever;
mod robotcar;
mod seven_scenes;
mod time_unit;
mod trajectory;
mod transforms;
mod tum;
mod view_crop;

use std::path::{Path, PathBuf};

pub use posescope_core::scene::{
    CachedScene, CloudFacts, DegradedScene, FrameStore, Lengths, MapFacts, PixelMap, Scene,
    SceneError, SceneFormat, SceneSize, degraded, frame_range,
};
pub use posescope_street as street;

use posescope_core::image::MAX_PIXELS;
use posescope_core::text::expect_name;

use crate::camera::Intrinsics;
use crate::geometry::Pose;

pub use cloud_file::is_decoding;
pub use estimates::read_estimates;
pub use frame_list::{FRAME_LIST, FRAME_LIST_SCHEMA};
pub use gps::located;
pub use loose::{CameraArgument, LoosePhotos};
pub use pair_matches::{MatchFolder, PixelMaps, write_matches};
pub use recalibrated::Recalibrated;
pub use retriever::{IndexOptions, NoIndex, Retriever, cache_file};

/// Every format, in the order in which they are tried.
pub const ALL: &[SceneFormat] = &[
    street::ENTRY,
    kitti::ENTRY,
    kitti_raw::ENTRY,
    robotcar::ENTRY,
    tum::ENTRY,
    seven_scenes::ENTRY,
    colmap::ENTRY,
    transforms::ENTRY,
    frame_list::ENTRY,
    described::ENTRY,
];

/// The format of a scene: the named one, or the first that recognises it.
pub fn format_of(argument: &str, format: Option<&str>) -> Option<&'static SceneFormat> {
    match format {
        Some(name) => ALL.iter().find(|entry| entry.name == name),
        None => ALL.iter().find(|entry| (entry.recognizes)(argument)),
    }
}

/// Opens a scene. Its format is detected from its content; `format` overrides that.
///
/// # Errors
/// [`SceneError`] names the file, the line and what was expected.
pub fn open(argument: &str, format: Option<&str>) -> Result<Box<dyn Scene>, SceneError> {
    let known = || {
        let names: Vec<&str> = ALL.iter().map(|entry| entry.name).collect();
        names.join(", ")
    };
    let entry = format_of(argument, format).ok_or_else(|| match format {
        Some(name) => SceneError::UnknownFormat { format: name.to_owned(), known: known() },
        None => {
            let argument = argument.to_owned();
            if Path::new(&argument).exists() {
                let (known, hint) = (known(), hint(Path::new(&argument)));
                SceneError::NotRecognized { argument, known, hint }
            } else {
                SceneError::NotFound { argument }
            }
        }
    });
    let scene = (entry?.open)(argument)?;
    sound(argument, scene.as_ref())?;
    Ok(scene)
}

/// The calibration file of a scene, for clouds that are moved in the camera's frame.
///
/// # Errors
/// A format whose calibration is in no file, and files that cannot be read.
pub fn recalibrated(
    argument: &str,
    format: Option<&str>,
    camera_from_stated: &Pose,
) -> Result<Recalibrated, SceneError> {
    let made = match format_of(argument, format).map(|entry| entry.name) {
        Some("kitti") => kitti::recalibrated,
        Some("kitti-raw") => kitti_raw::recalibrated,
        Some("toml") => described::recalibrated,
        _ => {
            let expected = "a scene of KITTI, KITTI raw or scene.toml expected: others have no file with the scanner's \
                            place";
            return Err(SceneError::expected(argument, expected));
        }
    };
    made(argument, camera_from_stated)
}

/// Why no frame of a scene has a cloud, where its reader knows more than that.
pub fn why_no_cloud(scene: &dyn Scene) -> Option<String> {
    let frames = scene.frames().len();
    if frames == 0 || (0..frames).any(|frame| scene.has_cloud(frame)) {
        return None;
    }
    match scene.cloud(0).err()? {
        SceneError::NoCloud { hint, .. } => Some(hint).filter(|hint| hint != file_scene::NO_CLOUD),
        _ => None,
    }
}

/// Checks what each format promises: names that can be printed, and cameras that see something.
fn sound(argument: &str, scene: &dyn Scene) -> Result<(), SceneError> {
    /// Half of the photo's width or height in focal lengths; 60 is a view of 178°.
    const HALF_VIEW: std::ops::Range<f64> = 1e-4..60.0;
    /// How many photos the centre may be away: parts of larger photos have it outside.
    const FARTHEST_CENTRE: f64 = 100.0;
    let frames = scene.frames();
    let mut names = std::iter::once(scene.name()).chain(frames.iter().map(String::as_str));
    names.try_for_each(expect_name).map_err(|why| SceneError::expected(argument, why))?;
    let mut is_warned = false;
    for (frame, name) in frames.iter().enumerate() {
        let Intrinsics { fx, fy, cx, cy, width, height } = scene.intrinsics(frame);
        let is_placed =
            scene.pose(frame).is_none_or(|pose| pose.translation.vector.iter().all(lines::is_near));
        if !is_placed {
            let farthest = lines::FARTHEST;
            let expected =
                format!("a position within {farthest:e} of 0 expected, frame {name} has another");
            return Err(SceneError::expected(argument, expected));
        }
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            let expected = format!(
                "a camera of at most {MAX_PIXELS} pixels expected, frame {name} has {width}x{height}"
            );
            return Err(SceneError::expected(argument, expected));
        }
        let is_inside =
            (0.0..f64::from(width)).contains(&cx) && (0.0..f64::from(height)).contains(&cy);
        if !is_inside && !is_warned {
            log::warn!(
                "{argument}: the centre {cx:.1}, {cy:.1} of frame {name} is outside of its photo of {width}x{height} \
                 pixels; is the camera that of photos of this size?"
            );
            is_warned = true;
        }
        for (focal, side) in [(fx, width), (fy, height)] {
            if !HALF_VIEW.contains(&(f64::from(side) / 2.0 / focal)) {
                let expected = format!(
                    "a focal length that suits {side} px expected, frame {name} has {focal:?} px"
                );
                return Err(SceneError::expected(argument, expected));
            }
        }
        for (centre, side) in [(cx, width), (cy, height)] {
            if centre.abs() > FARTHEST_CENTRE * f64::from(side) {
                let expected =
                    format!("a centre that suits {side} px expected, frame {name} has {centre:?}");
                return Err(SceneError::expected(argument, expected));
            }
        }
    }
    Ok(())
}

/// What to try where a folder is no scene: a scene inside it, such as a sequence of a data set.
fn hint(folder: &Path) -> String {
    const DEPTH: usize = 1;
    match scene_within(folder, DEPTH) {
        Some(scene) => format!("`{}` inside it is a scene", scene.display()),
        None => "describe your own photos, poses and clouds in a scene.toml, as docs/scenes.md shows, or name \
                 the format with --format"
            .to_owned(),
    }
}

/// The first folder inside this one, or so many levels deeper, that a format recognises.
fn scene_within(folder: &Path, depth: usize) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?.filter_map(Result::ok);
    let mut inside: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    inside.sort();
    let is_scene = |path: &&PathBuf| {
        path.to_str().is_some_and(|name| ALL.iter().any(|entry| (entry.recognizes)(name)))
    };
    let here = inside.iter().find(is_scene).cloned();
    here.or_else(|| inside.iter().find_map(|path| scene_within(path, depth.checked_sub(1)?)))
}
