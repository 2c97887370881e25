//! What a recording from inside a running localiser writes: photos, results without verdicts, `run.toml`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::Point3;
use posescope::estimator::Failure;
use posescope::localize::{QueryResult, frames_within};
use posescope::run::{
    EstimatesFile, FolderError, Judgement, Judging, Protocol, QueryCamera, RUN_SCHEMA, Reference,
    RunFile, ScenePair, publish, read_run,
};
use posescope::scene::{PixelMaps, write_matches};
use posescope_core::features::FoundMatches;
use posescope_core::{Method, Params};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

use crate::camera::Camera;
use crate::detached::detached;
use crate::frames::Origin;
use crate::localize::{GivenMatches, found};
use crate::scene::Scene;
use crate::{arrays, errors};

/// Checks a photo without keeping it.
#[pyfunction]
pub fn check_photo(photo: &Bound<'_, PyAny>, camera: &Camera) -> PyResult<()> {
    let [width, height] = [camera.intrinsics.width, camera.intrinsics.height];
    arrays::check_photo("photo", photo, (width, height))
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

/// Checks matches without keeping them.
#[pyfunction]
pub fn check_matches(matches: GivenMatches<'_>) -> PyResult<()> {
    found("matches", &matches).map(drop)
}

/// Saves the matches of a query with a reference of a scene as `--matches` reads them.
#[pyfunction]
pub fn save_matches(
    scene: &Scene,
    folder: PathBuf,
    query: &str,
    reference: &str,
    matches: GivenMatches<'_>,
) -> PyResult<()> {
    let FoundMatches { query: points, reference: others, decisions } = found("matches", &matches)?;
    // The queries' photos are written as they are given.
    let maps = [&PixelMaps::default(), &PixelMaps::of(scene.opened.scene.as_ref())];
    write_matches(&folder, (query, &points), (reference, &others), &decisions, maps)
        .map_err(|error| PyOSError::new_err(format!("{}: {error}", folder.display())))
}

/// The whole name of a frame, whose leading zeros may be left out.
#[pyfunction]
pub fn frame_name(scene: &Scene, name: &str) -> PyResult<String> {
    let Origin { opened, frame } = scene.find(name)?;
    Ok(opened.scene.frames()[frame].clone())
}

/// The name of the frame with pose and cloud that is nearest to a pose.
#[pyfunction]
pub fn nearest(scene: &Scene, world_from_camera: &Bound<'_, PyAny>) -> PyResult<Option<String>> {
    let pose = arrays::pose("world_from_camera", world_from_camera)?;
    let (scene, place) = (scene.opened.scene.as_ref(), Point3::from(pose.translation.vector));
    let frames = frames_within(scene, &place, f64::INFINITY, &|_| false);
    Ok(frames.first().map(|&frame| scene.frames()[frame].clone()))
}

/// A result without verdicts, as a line of `results.jsonl`.
#[pyfunction]
pub fn unjudged(
    scene: &Scene,
    query_scene: &str,
    query: &str,
    method: &str,
    world_from_camera: Option<&Bound<'_, PyAny>>,
    truth: Option<&Bound<'_, PyAny>>,
) -> PyResult<String> {
    let method = Method::called(method).map_err(errors::value)?;
    let pose = world_from_camera.map(|pose| arrays::pose("world_from_camera", pose)).transpose()?;
    let truth = truth.map(|truth| arrays::pose("truth", truth)).transpose()?;
    let failure = Failure::NotAnswered {
        answers: method.name().to_owned(),
        missing: format!("pose of {query}"),
    };
    let name = scene.opened.scene.name();
    let size = scene.opened.size();
    let right = Protocol::default().at_size(&size).right;
    let result = QueryResult {
        query_scene: Some(query_scene.to_owned()),
        unit: size.scale.unit(),
        scale: size.scale.metre(),
        per_reference: None,
        ..QueryResult::new(
            name,
            query,
            method,
            0,
            pose.as_ref().ok_or(&failure),
            truth.as_ref(),
            right,
        )
    };
    serde_json::to_string(&result).map_err(|error| errors::internal(&error.to_string()))
}

/// The text of `run.toml`: the poses of `estimates` are those of a method, the queries are photos of another scene, and
/// `matches`, where there are any, are those of `fb`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn run_text(
    scene: &Scene,
    query_scene: &str,
    query_folder: &str,
    method: &str,
    estimates: PathBuf,
    matches: Option<PathBuf>,
    camera: &Camera,
    queries: Vec<String>,
) -> PyResult<String> {
    let method = Method::called(method).map_err(errors::value)?;
    let size = scene.opened.size();
    let params = Params::at_scale(size.scale).to_toml().parse();
    let fb = matches.is_some().then_some(Method::FB);
    let run = RunFile {
        schema: RUN_SCHEMA.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scenes: vec![scene.opened.argument.clone()],
        shard: None,
        protocol: Protocol {
            query_scene: vec![query_folder.to_owned()],
            references: vec![Reference::Chosen(posescope::localize::Selection::Nearest(1))],
            estimates: vec![EstimatesFile { method, path: estimates }],
            methods: [Some(method), fb].into_iter().flatten().collect(),
            matches,
            ..Protocol::default().at_size(&size)
        },
        inputs: BTreeMap::new(),
        paths: BTreeMap::new(),
        pairs: vec![ScenePair {
            scene_index: 0,
            query_index: Some(0),
            scene: scene.opened.scene.name().to_owned(),
            query_scene: query_scene.to_owned(),
            camera: QueryCamera::from(camera.intrinsics),
            cameras: Vec::new(),
            drawn: queries.clone(),
            queries,
            times_s: Vec::new(),
            references: Vec::new(),
        }],
        params: params.map_err(|error: toml::de::Error| errors::internal(&error.to_string()))?,
    };
    toml::to_string(&run).map_err(|error| errors::internal(&error.to_string()))
}

/// Writes summary, `junit.xml` and `report.html` of a run folder.
#[pyfunction]
pub fn summarise(py: Python<'_>, folder: PathBuf) -> PyResult<()> {
    let written = detached(py, None, |_| -> Result<(), FolderError> {
        let run = read_run(&folder)?;
        let judgement = Judgement::of(&folder, &run, &Judging::default(), |_| Vec::new())?;
        publish(&folder, &judgement)
    })?;
    written.map_err(|error| PyOSError::new_err(error.to_string()))
}
