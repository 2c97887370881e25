//! Run folders: what a recording makes of one, and what is made of any.

use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;

use posescope::localize::Selection;
use posescope::measure::{ExportError, Format, Gate, export};
use posescope::run::{
    EstimatesFile, FolderError, Judgement, Judging, Protocol, QueryCamera, RUN_SCHEMA,
    RecordingNames, Reference, RunFile, ScenePair, Scenes, publish, read_run,
};
use posescope::scene::SceneSize;
use posescope_core::{Method, Params};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

use crate::camera::Camera;
use crate::detached::detached;
use crate::errors;
use crate::held::Held;
use crate::localize::Judging as Judged;
use crate::scene::Scene;
use crate::travel::{self, Parts};

/// The scene of a recording's references, or arrays where it has none.
pub struct Place<'a> {
    /// Its name in results.
    pub name: &'a str,
    /// How large it is.
    pub size: SceneSize,
}

impl<'a> Place<'a> {
    /// That of a scene.
    pub fn of(scene: Option<&'a Scene>) -> Self {
        match scene {
            Some(scene) => Self { name: scene.opened.scene.name(), size: scene.opened.size() },
            None => Self { name: Held::ARRAYS, size: SceneSize::PAPER },
        }
    }

    /// How queries are judged there.
    pub fn protocol(&self, right: Option<&str>) -> PyResult<Protocol> {
        let mut protocol = Protocol::default().at_size(&self.size);
        if let Some(right) = right {
            protocol.right = right.parse().map_err(|why| errors::value(format!("right: {why}")))?;
        }
        Ok(protocol)
    }
}

/// A query of a recording: its name, its camera, and its time \[s\].
type Recorded<'py> = (String, PyRef<'py, Camera>, Option<f64>);

/// Checks what a recording is asked to judge by.
#[pyfunction]
pub fn check_judging(
    scene: Option<&Scene>,
    method: &str,
    radius: Option<f64>,
    right: Option<&str>,
) -> PyResult<()> {
    Method::called(method).map_err(errors::value)?;
    if let Some(radius) = radius.filter(|radius| !(radius.is_finite() && *radius > 0.0)) {
        return Err(errors::value(format!(
            "radius: a finite number above 0 expected, {radius} given"
        )));
    }
    Place::of(scene).protocol(right).map(drop)
}

/// The text of `run.toml` of a recording in a folder: the poses of `poses.txt` are those of a method, the queries are the
/// photos in `queries`, the references are those of the scene or in `references`, and the matches, where there are any,
/// are those of `fb`.
#[pyfunction]
pub fn run_text(
    scene: Option<&Scene>,
    query_scene: &str,
    folder: PathBuf,
    method: &str,
    judging: Judged,
    has_matches: bool,
    queries: Vec<Recorded<'_>>,
) -> PyResult<String> {
    let Judged(radius, right, explain) = judging;
    let method = Method::called(method).map_err(errors::value)?;
    let place = Place::of(scene);
    let mut protocol = place.protocol(right.as_deref())?;
    protocol.radii_m = radius.map_or(protocol.radii_m, |radius| vec![radius]);
    let text = |path: PathBuf| path.to_string_lossy().into_owned();
    let cameras: Vec<QueryCamera> =
        queries.iter().map(|(_, camera, _)| QueryCamera::from(camera.intrinsics)).collect();
    let times: Option<Vec<f64>> = queries.iter().map(|(_, _, time)| *time).collect();
    let names: Vec<String> = queries.into_iter().map(|(name, ..)| name).collect();
    let pair = cameras.first().map(|&camera| ScenePair {
        scene_index: 0,
        query_index: Some(0),
        scene: place.name.to_owned(),
        query_scene: query_scene.to_owned(),
        camera,
        cameras: if cameras.iter().all(|one| *one == camera) {
            Vec::new()
        } else {
            cameras.clone()
        },
        drawn: names.clone(),
        queries: names.clone(),
        times_s: times.unwrap_or_default(),
        references: Vec::new(),
    });
    let params = Params::at_scale(place.size.scale).to_toml().parse();
    let fb = has_matches.then_some(Method::FB);
    let run = RunFile {
        schema: RUN_SCHEMA.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scenes: vec![match scene {
            Some(scene) => scene.opened.argument.clone(),
            None => text(folder.join("references")),
        }],
        shard: None,
        protocol: Protocol {
            query_scene: vec![text(folder.join("queries"))],
            references: vec![Reference::Chosen(Selection::Nearest(1))],
            estimates: vec![EstimatesFile { method, path: folder.join("poses.txt") }],
            methods: [Some(method), fb].into_iter().flatten().collect(),
            matches: has_matches.then(|| folder.join("matches")),
            explain,
            ..protocol
        },
        inputs: BTreeMap::new(),
        paths: BTreeMap::new(),
        pairs: pair.into_iter().collect(),
        params: params.map_err(|error: toml::de::Error| errors::internal(&error.to_string()))?,
    };
    toml::to_string(&run).map_err(|error| errors::internal(&error.to_string()))
}

/// Writes summary, `junit.xml` and `report.html` of a run folder. Returns which gates failed.
#[pyfunction]
#[pyo3(signature = (folder, gates = Vec::new()))]
pub fn summarise(py: Python<'_>, folder: PathBuf, gates: Vec<String>) -> PyResult<Option<String>> {
    let gates = gates
        .iter()
        .map(|gate| gate.parse::<Gate>().map_err(|why| errors::value(format!("gate: {why}"))));
    let judging = Judging { gates: gates.collect::<PyResult<_>>()?, ..Judging::default() };
    let written = detached(py, None, |_| -> Result<_, FolderError> {
        let run = read_run(&folder)?;
        let judgement = Judgement::of(&folder, &run, &judging, |_| Vec::new())?;
        publish(&folder, &judgement)?;
        Ok(judgement.failures)
    })?;
    let failures = written.map_err(|error| PyOSError::new_err(error.to_string()))?;
    Ok(Some(failures.join("; ")).filter(|words| !words.is_empty()))
}

/// The files of the recordings of some results, each of which is its query and its method.
#[pyfunction]
pub fn recording_files(
    folder: PathBuf,
    results: Vec<(String, String)>,
) -> PyResult<Vec<Option<String>>> {
    let run = read_run(&folder).map_err(|error| errors::folder(&error))?;
    let names = RecordingNames::of(&run);
    let Some(pair) = run.pairs.first() else { return Ok(vec![None; results.len()]) };
    let scenes = [pair.scene.as_str(), pair.query_scene.as_str()];
    let file = |(query, method): (String, String)| {
        let method = Method::called(&method).map_err(errors::value)?;
        Ok(names.file(scenes, &query, method))
    };
    results.into_iter().map(file).collect()
}

/// The poses of a run in the format of another program: each file with its name, which is empty where there is one.
#[pyfunction]
pub fn exported(
    py: Python<'_>,
    folder: PathBuf,
    format: &str,
    method: Option<&str>,
    grade: Option<&str>,
) -> PyResult<Vec<(String, String)>> {
    let format = match format {
        "tum" => Format::Tum,
        "kitti" => Format::Kitti,
        "colmap" => Format::Colmap,
        _ => Format::Vloc,
    };
    let done = detached(py, None, |_| {
        let run = read_run(&folder)?;
        export(&folder, &run, format, &|result| {
            method.is_none_or(|method| result.method.name() == method)
                && grade.is_none_or(|grade| result.grade.word() == grade)
        })
    })?;
    match done {
        Ok(done) => {
            Ok(done.files.into_iter().map(|(name, text)| (name.to_owned(), text)).collect())
        }
        Err(ExportError::Folder(error)) => Err(errors::folder(&error)),
        Err(error) => Err(errors::value(error.to_string())),
    }
}

/// The true pose and the time of each query, by its scene and name.
type QueryFacts = HashMap<(String, String), (Option<Parts>, Option<f64>)>;

/// What is known of the queries of a run: of each, by its scene and name, its true pose and its time \[s\]. Poses are
/// those of the scenes as far as these can be opened.
#[pyfunction]
pub fn query_facts(py: Python<'_>, folder: PathBuf) -> PyResult<QueryFacts> {
    let found = detached(py, None, |_| -> Result<_, FolderError> {
        let run = read_run(&folder)?;
        let protocol = &run.protocol;
        let scenes =
            Scenes::open(&run.scenes, &protocol.query_scene, protocol.format.as_deref()).ok();
        let mut facts = HashMap::new();
        for item in run.items() {
            let scene = scenes.as_ref().map(|scenes| scenes.of_queries(item.pair));
            let frame = scene.and_then(|scene| Some((scene, scene.find(item.query).ok()?)));
            let truth = frame.and_then(|(scene, frame)| scene.pose(frame));
            let time_s = item.time_s.or_else(|| {
                let (scene, frame) = frame?;
                scene.time_s(frame)
            });
            let key = (item.pair.query_scene.clone(), item.query.to_owned());
            facts.insert(key, (truth.as_ref().map(travel::parts), time_s));
        }
        Ok(facts)
    })?;
    found.map_err(|error| errors::folder(&error))
}
