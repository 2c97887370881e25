//! What a recording from inside a running localiser checks and writes: photos, clouds, matches, results without verdicts.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::PathBuf;

use nalgebra::Point3;
use posescope::diagnosis::Diagnosis;
use posescope::estimator::Failure;
use posescope::localize::{QueryResult, frames_within};
use posescope::scene::{PixelMaps, SceneError, write_matches};
use posescope_core::features::FoundMatches;
use posescope_core::{Method, Pose};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

use crate::camera;
use crate::folder::Place;
use crate::frames::Reference;
use crate::localize::{GivenMatches, found};
use crate::scene::{Scene, called};
use crate::travel::{self, Parts};
use crate::{arrays, errors};

/// Checks a photo without keeping it.
#[pyfunction]
pub fn check_photo(photo: &Bound<'_, PyAny>, camera: &Bound<'_, PyAny>) -> PyResult<()> {
    let camera = camera::taken("camera", camera)?.intrinsics;
    arrays::check_photo("photo", photo, (camera.width, camera.height))
}

/// Saves a photo as PNG.
#[pyfunction]
pub fn save_photo(py: Python<'_>, photo: &Bound<'_, PyAny>, path: PathBuf) -> PyResult<()> {
    let photo = arrays::photo("photo", photo)?;
    let saved = py.detach(|| match &photo.color {
        Some(color) => color.save(&path),
        None => photo.gray.save(&path),
    });
    saved.map_err(|error| PyOSError::new_err(format!("{}: {error}", path.display())))
}

/// A pose as its position and quaternion x y z w, by which nothing is rounded.
#[pyfunction]
pub fn pose_parts(name: &str, pose: &Bound<'_, PyAny>) -> PyResult<Parts> {
    arrays::pose(name, pose).map(|pose| travel::parts(&pose))
}

/// The parts of a reference's pose.
#[pyfunction]
pub fn reference_parts(reference: &Reference) -> Parts {
    travel::parts(reference.reference.world_from_camera())
}

/// A pose of its parts, as a 4 × 4 array.
#[pyfunction]
pub fn pose_of(py: Python<'_>, parts: Parts) -> PyResult<Bound<'_, PyAny>> {
    arrays::of_pose(py, &travel::pose(parts))
}

/// Checks matches without keeping them.
#[pyfunction]
pub fn check_matches(matches: GivenMatches<'_>) -> PyResult<()> {
    found("matches", &matches).map(drop)
}

/// Saves the matches of a query with a reference as `--matches` reads them.
#[pyfunction]
pub fn save_matches(
    scene: Option<&Scene>,
    folder: PathBuf,
    query: &str,
    reference: &str,
    matches: GivenMatches<'_>,
) -> PyResult<()> {
    let FoundMatches { query: points, reference: others, decisions } = found("matches", &matches)?;
    let of_scene = scene.map(|scene| PixelMaps::of(scene.opened.scene.as_ref()));
    // The queries' photos are written as they are given.
    let maps = [&PixelMaps::default(), &of_scene.unwrap_or_default()];
    write_matches(&folder, (query, &points), (reference, &others), &decisions, maps)
        .map_err(|error| PyOSError::new_err(format!("{}: {error}", folder.display())))
}

/// Saves the cloud of a reference as PLY, in the camera's frame.
#[pyfunction]
pub fn save_cloud(py: Python<'_>, reference: &Reference, path: PathBuf) -> PyResult<()> {
    let points = &reference.reference.cloud().points;
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nend_header\n",
        points.len()
    )
    .into_bytes();
    let numbers = points.iter().flat_map(|point| [point.x, point.y, point.z]);
    ply.extend(numbers.flat_map(f32::to_le_bytes));
    let written = py.detach(|| posescope_core::files::write_whole(&path, &ply));
    written.map_err(|error| PyOSError::new_err(format!("{}: {error}", path.display())))
}

/// A number that two references share if all of them is equal.
#[pyfunction]
pub fn fingerprint(py: Python<'_>, reference: &Reference) -> u64 {
    let reference = &reference.reference;
    py.detach(|| {
        let mut hasher = DefaultHasher::new();
        let photo = reference.photo();
        match &photo.color {
            Some(color) => color.as_raw().hash(&mut hasher),
            None => photo.gray.as_raw().hash(&mut hasher),
        }
        let pose = travel::parts(reference.world_from_camera()).map(f64::to_bits);
        let points = reference.cloud().points.iter();
        let points = points.flat_map(|point| [point.x, point.y, point.z].map(f32::to_bits));
        (pose, points.collect::<Vec<_>>()).hash(&mut hasher);
        hasher.finish()
    })
}

/// A reference on its own, which belongs to no scene.
#[pyfunction]
pub fn alone(reference: &Reference) -> Reference {
    Reference { reference: reference.reference.clone(), origin: None }
}

/// The whole name of a frame that can be a reference: by its name, or a reference of the scene.
#[pyfunction]
pub fn reference_name(scene: &Scene, reference: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(given) = reference.cast::<Reference>() {
        let origin = given.get().origin.as_ref();
        let is_of_scene = |opened: &crate::scene::Opened| scene.opened.is_same(opened);
        if !origin.is_some_and(|origin| is_of_scene(&origin.opened)) {
            return Err(errors::value(
                "reference: a frame of the recording's scene expected, a reference of arrays or of another scene \
                 given; record them without a scene",
            ));
        }
    }
    let frame = scene.find(&called(reference)?)?.frame;
    let frames = scene.opened.scene.as_ref();
    let name = frames.frames()[frame].clone();
    if frames.pose(frame).is_none() {
        let scene = frames.name().to_owned();
        return Err(errors::scene(&SceneError::NoPose { scene, frame: name }));
    }
    if !frames.has_cloud(frame) {
        let (place, expected) = (format!("frame {name}"), "a reference has a cloud");
        return Err(errors::input(frames.name(), &place, expected));
    }
    Ok(name)
}

/// The name of the frame with pose and cloud that is nearest to a pose.
#[pyfunction]
pub fn nearest(scene: &Scene, pose: Parts) -> Option<String> {
    let (scene, [x, y, z, ..]) = (scene.opened.scene.as_ref(), pose);
    let frames = frames_within(scene, &Point3::new(x, y, z), f64::INFINITY, &|_| false);
    frames.first().map(|&frame| scene.frames()[frame].clone())
}

/// A result without verdicts, as a line of `results.jsonl`: of a query of a scene. `missing` is what the method has not,
/// `unreadable` says what could not be read, and `bug` what panicked.
#[pyfunction]
#[pyo3(signature = (scene, query, method, pose, truth, right, missing = None, unreadable = None, bug = None))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn unjudged(
    scene: Option<&Scene>,
    query: (String, String),
    method: &str,
    pose: Option<Parts>,
    truth: Option<Parts>,
    right: Option<&str>,
    missing: Option<String>,
    unreadable: Option<String>,
    bug: Option<String>,
) -> PyResult<String> {
    let method = Method::called(method).map_err(errors::value)?;
    let (query_scene, query) = query;
    let what = if method == Method::FB { "matches" } else { "pose" };
    let unanswered = Failure::NotAnswered {
        answers: method.name().to_owned(),
        missing: missing.unwrap_or_else(|| format!("{what} of {query}")),
    };
    let broken = unreadable.map(|message| Failure::Unreadable { message });
    let broken = broken.or(bug.map(|message| Failure::Internal { message }));
    let pose: Option<Pose> = pose.map(travel::pose);
    let truth = truth.map(travel::pose);
    let failure = broken.as_ref().unwrap_or(&unanswered);
    let place = Place::of(scene);
    let size = place.size;
    let result = QueryResult::new(
        place.name,
        &query,
        method,
        0,
        pose.as_ref().ok_or(failure),
        truth.as_ref(),
        place.protocol(right)?.right,
    );
    let result = QueryResult {
        query_scene: Some(query_scene),
        unit: size.scale.unit(),
        scale: size.scale.metre(),
        per_reference: None,
        diagnosis: match (&broken, &pose) {
            (Some(broken), Some(_)) => vec![Diagnosis::of_failure(broken)],
            _ => result.diagnosis.clone(),
        },
        ..result
    };
    serde_json::to_string(&result).map_err(|error| errors::internal(&error.to_string()))
}
