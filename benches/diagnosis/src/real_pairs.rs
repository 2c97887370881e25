//! Pairs of real photos with scans, where there are any.
//!
//! The data are not part of the project: `POSESCOPE_DATA` names their folder. They are the pair of the
//! paper's authors (KITTI odometry 00, frames 3814 and 3823) and frames of drive 0013 (KITTI raw), 3.6
//! to 10 m apart, in both directions, with the poses that were registered from the scans, which are
//! better than the official ones.

use std::path::Path;

use image::RgbImage;
use image::imageops::{FilterType, resize};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use posescope::cloud::Cloud;
use posescope::geometry::Pose;
use posescope::image::Photo;
use posescope::problem::ReferenceTuple;
use posescope::scene::{self, Scene};

use crate::frames::Frame;

/// Frames that are as far apart as this are a pair \[m\].
const APART_M: std::ops::RangeInclusive<f64> = 3.0..=11.0;

/// A cloud is of another place from here on \[m\].
const FARTHER_M: f64 = 9.0;

/// A query and a reference.
pub struct RealPair {
    /// What it is called.
    pub name: String,
    /// The query; its pose is the truth.
    pub query: Frame,
    /// The reference.
    pub reference: Frame,
    /// The cloud of a frame that is neither, some 9 to 20 m from the reference.
    pub farther_cloud: Option<Cloud>,
    /// A photo of another place, of the query's size.
    pub foreign_photo: RgbImage,
}

/// A scene, and the poses registered for its frames.
const SOURCES: [(&str, &str); 2] = [
    (
        "kitti/sequences/00",
        "derived/kitti_odometry_00_003814_003823.txt",
    ),
    (
        "kitti_raw/2011_09_26/2011_09_26_drive_0013_sync",
        "derived/kitti_raw_2011_09_26_drive_0013.txt",
    ),
];

/// All pairs below `POSESCOPE_DATA`; none where that is not set.
///
/// # Errors
/// A line that says which file cannot be read.
pub fn all() -> Result<Vec<RealPair>, String> {
    let Some(root) = std::env::var_os("POSESCOPE_DATA") else {
        return Ok(Vec::new());
    };
    let path = |below: &str| Path::new(&root).join(below);
    let sources = SOURCES
        .iter()
        .map(|(folder, poses)| frames(&path(folder), &path(poses)))
        .collect::<Result<Vec<_>, _>>()?;
    let others = sources.iter().cycle().skip(1);
    let pairs = sources.iter().zip(others).flat_map(|(frames, others)| {
        let foreign = others.first().map(|(_, frame)| &frame.photo);
        foreign.map_or(Vec::new(), |foreign| pairs_of(frames, foreign))
    });
    Ok(pairs.collect())
}

/// The frames that have a registered pose.
fn frames(folder: &Path, poses: &Path) -> Result<Vec<(String, Frame)>, String> {
    let told = |error: &dyn std::fmt::Display| format!("{}: {error}", folder.display());
    let scene = scene::open(&folder.to_string_lossy(), None).map_err(|error| told(&error))?;
    let text =
        std::fs::read_to_string(poses).map_err(|error| format!("{}: {error}", poses.display()))?;
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let (number, pose) =
                registered(line).ok_or(format!("{}: {line}: no pose", poses.display()))?;
            let name = scene.frames().iter().position(|name| {
                name.parse::<usize>()
                    .is_ok_and(|in_scene| in_scene == number)
            });
            let at = name.ok_or(told(&format!("no frame {number}")))?;
            let frame = read(scene.as_ref(), at, pose).map_err(|error| told(&error))?;
            // Who takes a frame from here may count on it: photo, camera and cloud go together.
            let photo = Photo::from_color(frame.photo.clone());
            let (camera, cloud) = (frame.intrinsics, frame.cloud.clone());
            ReferenceTuple::new(&*scene.frames()[at], photo, camera, pose, cloud)
                .map_err(|error| told(&error))?;
            Ok((scene.frames()[at].clone(), frame))
        })
        .collect()
}

fn read(scene: &dyn Scene, at: usize, pose: Pose) -> Result<Frame, scene::SceneError> {
    let photo = scene.photo(at)?;
    let color = photo
        .color
        .unwrap_or_else(|| image::DynamicImage::ImageLuma8(photo.gray).to_rgb8());
    Ok(Frame {
        photo: color,
        intrinsics: scene.intrinsics(at),
        pose: Some(pose),
        cloud: scene.cloud(at)?,
    })
}

/// A frame's number and its pose, by rows. It is that of camera 0; the colour camera is 6 cm beside it,
/// which changes the poses between frames by less than 2 mm.
fn registered(line: &str) -> Option<(usize, Pose)> {
    let mut words = line.split_whitespace();
    let number = words.next()?.parse().ok()?;
    let m: Vec<f64> = words.map(str::parse).collect::<Result<_, _>>().ok()?;
    let [a, b, c, x, d, e, f, y, g, h, i, z] = m[..] else {
        return None;
    };
    let rotation = Rotation3::from_matrix(&Matrix3::new(a, b, c, d, e, f, g, h, i));
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Some((
        number,
        Pose::from_parts(Translation3::new(x, y, z), rotation),
    ))
}

fn pairs_of(frames: &[(String, Frame)], foreign: &RgbImage) -> Vec<RealPair> {
    let apart = |a: &Frame, b: &Frame| match (a.pose, b.pose) {
        (Some(a), Some(b)) => (a.translation.vector - b.translation.vector).norm(),
        _ => f64::INFINITY,
    };
    let mut pairs = Vec::new();
    for (query_name, query) in frames {
        for (reference_name, reference) in frames {
            if !APART_M.contains(&apart(query, reference)) {
                continue;
            }
            let others = frames
                .iter()
                .filter(|(name, _)| name != query_name && name != reference_name);
            let farther = others
                .map(|(_, other)| (apart(reference, other), other))
                .filter(|(metres, _)| *metres >= FARTHER_M)
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let (width, height) = query.photo.dimensions();
            pairs.push(RealPair {
                foreign_photo: resize(foreign, width, height, FilterType::Triangle),
                name: format!("{query_name} <- {reference_name}"),
                query: query.clone(),
                reference: reference.clone(),
                farther_cloud: farther.map(|(_, other)| other.cloud.clone()),
            });
        }
    }
    pairs
}
