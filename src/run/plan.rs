//! The plan of an evaluation. What can be refused is refused before the first query.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::config::{ConfigError, with_config};
use super::draw::{Draw, DrawError};
use super::inputs::{content, inputs};
use super::map_check::{MapFit, fit_of_map, mistake_line};
use super::outputs::{JSON_LINES, OutputError, refuse_in_folder, refuse_to_replace};
use super::preset::Preset;
use super::protocol::{Protocol, ProtocolError, defaults, known};
use super::run_file::{RUN_SCHEMA, RunFile, Shard};
use super::run_folder::{FolderError, read_run};
use super::scene_pair::{ScenePair, is_called};
use super::scene_paths::labels;
use super::scenes::Scenes;
use super::survey_file::{SurveyError, SurveyFile, SurveyFrom, survey_of};
use crate::estimator;
use crate::fusion::Fusion;
use crate::localize::{QueryResult, Ranking, Selection};
use crate::measure::{Gate, KnownFailures, read_rows};
use crate::method::Method;
use crate::params::Params;
use crate::scene::{NoIndex, Retriever, SceneError, SceneSize};
use posescope_core::survey::Survey;

/// What an evaluation is asked to do.
pub struct EvaluationRequest<'a> {
    /// The scenes of the references, as arguments. Those of `rerun_failed` come from its run.
    pub scenes: &'a [String],
    /// The names of the queries; all drawn frames if empty.
    pub queries: &'a [String],
    /// The references of queries, by name, where each query has its own.
    pub pairs: &'a BTreeMap<String, Vec<String>>,
    /// The settings, over those that the scenes have by default.
    pub protocol: &'a dyn Fn(Protocol) -> Result<Protocol, ProtocolError>,
    /// A TOML file of parameters, or `paper`.
    pub config: Option<&'a Path>,
    /// Parameters, each as `KEY=VALUE`.
    pub assignments: &'a [String],
    /// The part of the run.
    pub shard: Option<Shard>,
    /// A run whose failed queries are repeated.
    pub rerun_failed: Option<&'a Path>,
    /// How the run will be judged.
    pub judging: &'a Judging,
    /// Whether a map is surveyed: confidence is as it was fitted, at any scale.
    pub is_survey: bool,
    /// The run folder.
    pub folder: &'a Path,
    /// The file of events.
    pub events: Option<&'a Path>,
}

/// How a run is judged.
#[derive(Clone, Debug, Default)]
pub struct Judging {
    /// What must hold.
    pub gates: Vec<Gate>,
    /// Failures that are known.
    pub known: KnownFailures,
    /// The run that it is compared with.
    pub before: Option<PathBuf>,
    /// Whether only its queries are compared: they are repeated ones of that run.
    pub only_repeated: bool,
}

/// What an evaluation will do.
pub struct Plan {
    /// The description of the run.
    pub run: RunFile,
    /// Its scenes.
    pub scenes: Scenes,
    /// Its parameters, as in the description.
    pub params: Params,
    /// The indexes for [`Selection::Retrieved`], by the position of the references' scene.
    pub indices: Vec<Box<dyn Ranking>>,
    /// The size of the first scene.
    pub size: SceneSize,
    /// The survey that confidence follows.
    pub survey: Option<SurveyFile>,
}

/// Why an evaluation does not start.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// An option is wrong.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    /// A parameter is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// There are no queries.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// A run or a list cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// There is no index.
    #[error(transparent)]
    Index(#[from] NoIndex),
    /// A survey does not fit.
    #[error(transparent)]
    Survey(#[from] SurveyError),
    /// A file must not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The request contradicts itself.
    #[error(transparent)]
    Refused(#[from] Refusal),
}

/// What an evaluation cannot be asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// A scene twice.
    #[error("the scene {label} is given twice, as {argument}; give it once")]
    SceneTwice {
        /// The scene.
        label: String,
        /// Its second argument.
        argument: String,
    },
    /// Queries whose references are sought around a place that is not known.
    #[error(
        "the position of query {query} is not known, so its nearest references are not; choose them by looks with \
         --reference matches:K or retrieve:K, name them, or say where the queries are with --gps"
    )]
    Position {
        /// The first such query.
        query: String,
    },
    /// Another number of indexes than of scenes.
    #[error(
        "--index is given {indexes} times for {scenes} scenes; give one per scene, in the same order"
    )]
    Indexes {
        /// The number of indexes.
        indexes: usize,
        /// The number of scenes.
        scenes: usize,
    },
    /// A gate on a method that is not run.
    #[error("--gate '{gate}' is about {method}, which is not run; add it to --method")]
    Gate {
        /// The gate.
        gate: String,
        /// Its method.
        method: Method,
    },
}

impl Plan {
    /// Opens the scenes and draws the queries.
    ///
    /// # Errors
    /// [`PlanError`]: whatever would fail after the first query and can be known before.
    pub fn of(request: &EvaluationRequest<'_>) -> Result<Self, PlanError> {
        let given = (request.protocol)(Protocol::default())?;
        let gated: Vec<Method> = request.judging.gates.iter().map(Gate::method).collect();
        let others: Vec<Method> = given.estimates.iter().map(|file| file.method).collect();
        known(&gated, &others)?;
        let Self { mut run, scenes, params, size, survey, .. } = match request.rerun_failed {
            Some(before) => request.of_failed(before)?,
            None => request.of_scenes(&given)?,
        };
        let scenes = scenes.with_protocol(&run.protocol)?;
        refuse_unplaced(&run, &scenes)?;
        let (indices, contents) = indices(&run, &scenes, &params)?;
        run.inputs.extend(contents);
        request.check(&run)?;
        Ok(Self { run, scenes, params, indices, size, survey })
    }
}

impl EvaluationRequest<'_> {
    /// The queries of the scenes.
    fn of_scenes(&self, given: &Protocol) -> Result<Plan, PlanError> {
        // Check the parameters first: opening a large scene takes long.
        with_config(Params::default(), self.config, self.assignments)?;
        let scenes = Scenes::open(self.scenes, &given.query_scene, given.format.as_deref())?;
        let first = scenes.references.first();
        let size = first.map_or(SceneSize::PAPER, |scene| SceneSize::of(scene.as_ref()));
        let survey = self.survey(given, &scenes)?;
        let numbers = match &survey {
            _ if self.is_survey => Survey::unchanged(estimator::methods()),
            Some(file) => file.survey.clone(),
            None => Survey::default(),
        };
        let mut params = Params::at_scale(size.scale);
        params.survey = numbers;
        let MapFit { mistake, frame_pairs } = self.fit_of_map(&scenes);
        params.mistake_of_map = mistake;
        params.frame_pairs = frame_pairs;
        let params = with_config(params, self.config, self.assignments)?;
        let defaults =
            defaults(given.preset, first.map_or("", |scene| scene.name())).at_size(&size);
        let mut protocol = (self.protocol)(defaults.clone())?;
        // The large experiment has the fusion of a run without preset.
        let has_own_fusions = protocol.preset.is_some_and(|one| one != Preset::Large);
        let most = self.pairs.values().map(Vec::len).max().unwrap_or(protocol.reference_count());
        if most > 1 && !has_own_fusions {
            let fusions = Fusion::all().filter(|fusion| fusion.name == "r-wavg").collect();
            protocol = (self.protocol)(Protocol { fusions, ..defaults })?;
        }
        if !self.pairs.is_empty() {
            protocol.select(Selection::Nearest(most));
        }
        let draw = Draw { limit: protocol.limit, only: self.queries, seed: protocol.seed };
        let mut pairs = pairs(&draw, &scenes, self.scenes, &protocol.query_scene)?;
        for pair in &mut pairs {
            self.name_references(pair, &scenes, &protocol)?;
        }
        let run = RunFile {
            schema: RUN_SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scenes: self.scenes.to_vec(),
            shard: self.shard,
            inputs: inputs(&protocol)?,
            paths: BTreeMap::new(),
            protocol,
            pairs,
            params: written(&params),
        };
        Ok(Plan { run, scenes, params, indices: Vec::new(), size, survey })
    }

    /// The survey that confidence follows.
    fn survey(&self, given: &Protocol, scenes: &Scenes) -> Result<Option<SurveyFile>, SurveyError> {
        let from = given.survey.as_ref();
        match (scenes.references.as_slice(), self.scenes) {
            _ if self.is_survey => Ok(None),
            ([scene], [argument]) => survey_of(from, scene.as_ref(), argument),
            (scenes, _) if matches!(from, Some(SurveyFrom::Folder(_))) => {
                Err(SurveyError::Scenes(scenes.len()))
            }
            _ => Ok(None),
        }
    }

    /// What is wrong with the map, or with the first of several that has a mistake, and of one map how closely its frames
    /// fit each other. A run that goes on keeps what it began with.
    fn fit_of_map(&self, scenes: &Scenes) -> MapFit {
        let begun = read_run(self.folder).ok().and_then(|run| run.params().ok());
        if let Some(params) = begun {
            return MapFit { mistake: params.mistake_of_map, frame_pairs: params.frame_pairs };
        }
        let maps = scenes.references.iter().zip(self.scenes);
        let maps = maps.filter(|_| !self.is_survey);
        let mut fits = maps.map(|(scene, argument)| {
            let fit = fit_of_map(scene.as_ref(), argument, || true);
            if let Some(mistake) = &fit.mistake {
                log::warn!("{}", mistake_line(scene.as_ref(), mistake));
            }
            fit
        });
        let first = fits.next().unwrap_or_default();
        let is_one = scenes.references.len() == 1;
        let frame_pairs = first.frame_pairs.filter(|_| is_one);
        let mistake = first.mistake.or_else(|| fits.find_map(|fit| fit.mistake));
        MapFit { mistake, frame_pairs }
    }

    /// Gives each query of a pair its own references, and checks those that are named for all.
    fn name_references(
        &self,
        pair: &mut ScenePair,
        scenes: &Scenes,
        protocol: &Protocol,
    ) -> Result<(), PlanError> {
        let references = scenes.references[pair.scene_index].as_ref();
        let name = |name: &String| -> Result<String, SceneError> {
            let frame = references.find(name)?;
            let name = references.frames()[frame].clone();
            if references.pose(frame).is_none() {
                let scene = references.name().to_owned();
                return Err(SceneError::NoPose { scene, frame: name });
            }
            Ok(name)
        };
        for named in protocol.named_references() {
            name(&named.to_owned())?;
        }
        if self.pairs.is_empty() {
            return Ok(());
        }
        let queries = scenes.of_queries(pair);
        let mut own = BTreeMap::new();
        for (query, names) in self.pairs {
            let names = names.iter().map(name).collect::<Result<Vec<_>, _>>()?;
            own.insert(queries.find(query)?, names);
        }
        let of_query = |query: &String| -> Result<Vec<String>, SceneError> {
            Ok(own.get(&queries.find(query)?).cloned().unwrap_or_default())
        };
        pair.references = pair.queries.iter().map(of_query).collect::<Result<_, _>>()?;
        Ok(())
    }

    /// The failed queries of a run, with other settings.
    fn of_failed(&self, before: &Path) -> Result<Plan, PlanError> {
        let run = read_run(before)?;
        let failed = failed_queries(before)?;
        let params = run
            .params()
            .map_err(|source| ConfigError::File { path: before.join("run.toml"), source })?;
        let params = with_config(params, self.config, self.assignments)?;
        let protocol = (self.protocol)(run.protocol.clone())?;
        let format = protocol.format.as_deref();
        let scenes = Scenes::open(&run.scenes, &protocol.query_scene, format)?;
        let first = scenes.references.first();
        let size = first.map_or(SceneSize::PAPER, |scene| SceneSize::of(scene.as_ref()));
        let is_named = |query: &str| {
            self.queries.is_empty() || self.queries.iter().any(|name| is_called(query, name))
        };
        let pairs = run.pairs.iter().map(|pair| {
            pair.only(|query: &str| {
                let key = [&pair.scene, &pair.query_scene, query].map(str::to_owned);
                failed.contains(&key) && is_named(query)
            })
        });
        let pairs = pairs.filter(|pair| !pair.queries.is_empty()).collect();
        let run = RunFile {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            inputs: inputs(&protocol)?,
            protocol,
            shard: self.shard,
            pairs,
            params: written(&params),
            ..run
        };
        Ok(Plan { run, scenes, params, indices: Vec::new(), size, survey: None })
    }

    /// Refuses before the first query what would fail after the last.
    fn check(&self, run: &RunFile) -> Result<(), PlanError> {
        let methods = &run.protocol.methods;
        let mut gates = self.judging.gates.iter();
        if let Some(gate) = gates.find(|gate| !methods.contains(&gate.method())) {
            return Err(Refusal::Gate { gate: gate.to_string(), method: gate.method() }.into());
        }
        if let Some(before) = &self.judging.before {
            read_rows(before)?;
        }
        if let Some(path) = self.events {
            refuse_in_folder("--events", path, self.folder)?;
            let scenes = run.scenes.iter().chain(&run.protocol.query_scene).map(String::as_str);
            refuse_to_replace("--events", path, &JSON_LINES, scenes)?;
        }
        Ok(())
    }
}

/// The queries of a run with a result that is wrong or has no pose: by scene of references, scene of queries and name.
///
/// # Errors
/// A result that cannot be read.
pub fn failed_queries(folder: &Path) -> Result<BTreeSet<[String; 3]>, FolderError> {
    let key = |row: QueryResult| {
        let queries = row.query_scene.unwrap_or_else(|| row.scene.clone());
        [row.scene, queries, row.query]
    };
    let rows = read_rows(folder)?.into_iter();
    Ok(rows.filter(|row| row.is_suspect()).map(key).collect())
}

/// Refuses queries whose references would be sought around a place that is not known.
fn refuse_unplaced(run: &RunFile, scenes: &Scenes) -> Result<(), PlanError> {
    let is_around =
        matches!(run.protocol.selection(), Selection::Random(_) | Selection::Nearest(_));
    if !is_around || run.protocol.named_references().next().is_some() {
        return Ok(());
    }
    for pair in run.pairs.iter().filter(|pair| pair.references.is_empty()) {
        let queries = scenes.of_queries(pair);
        for query in &pair.queries {
            if queries.position(queries.find(query)?).is_none() {
                return Err(Refusal::Position { query: query.clone() }.into());
            }
        }
    }
    Ok(())
}

fn written(params: &Params) -> toml::Table {
    let table = params.to_toml().parse();
    table.unwrap_or_else(|error| unreachable!("we wrote it ourselves: {error}"))
}

/// Indexes by scene, and the names and hashes of their files.
type Indices = (Vec<Box<dyn Ranking>>, Vec<(String, String)>);

/// The indexes that ranked references need, one per scene.
fn indices(run: &RunFile, scenes: &Scenes, params: &Params) -> Result<Indices, PlanError> {
    let Selection::Retrieved(_) = run.protocol.selection() else {
        return Ok((Vec::new(), Vec::new()));
    };
    let (files, scenes) = (&run.protocol.index, &scenes.references);
    if !files.is_empty() && files.len() != scenes.len() {
        let (indexes, scenes) = (files.len(), scenes.len());
        return Err(Refusal::Indexes { indexes, scenes }.into());
    }
    let (mut indices, mut contents) = (Vec::new(), Vec::new());
    for (number, (scene, argument)) in scenes.iter().zip(&run.scenes).enumerate() {
        let given = files.get(number).map(PathBuf::as_path);
        let index = Retriever::find(given, scene.as_ref(), argument, params)?;
        indices.push(Box::new(index) as Box<dyn Ranking>);
        let used = || Retriever::default_path(scene.as_ref(), argument);
        if let Some(path) = given.map(Path::to_owned).or_else(used) {
            contents.push((format!("index of scene {number}"), content(&path)?));
        }
    }
    Ok((indices, contents))
}

/// Every scene with itself, or every scene of references with every scene of queries. `references` and `queries` are
/// their arguments.
fn pairs(
    draw: &Draw<'_>,
    scenes: &Scenes,
    references: &[String],
    queries: &[String],
) -> Result<Vec<ScenePair>, PlanError> {
    let given = references.iter().chain(queries).map(String::as_str);
    let opened = scenes.references.iter().chain(&scenes.queries);
    let named: Vec<_> = given.zip(opened.map(|scene| scene.name())).collect();
    let labels = labels(&named);
    let (of_references, of_queries) = labels.split_at(references.len());
    for (labels, arguments) in [(of_references, references), (of_queries, queries)] {
        let twice = (1..labels.len()).find(|&at| labels[..at].contains(&labels[at]));
        if let Some(twice) = twice {
            let (label, argument) = (labels[twice].clone(), arguments[twice].clone());
            return Err(Refusal::SceneTwice { label, argument }.into());
        }
    }
    let mut pairs = Vec::new();
    for (scene_index, scene) in scenes.references.iter().enumerate() {
        let label = &of_references[scene_index];
        let itself = scenes.queries.is_empty().then_some((None, scene, label));
        let others = scenes.queries.iter().zip(of_queries).enumerate();
        let others = others.map(|(at, (queries, label))| (Some(at), queries, label));
        for (query_index, queries, query_label) in itself.into_iter().chain(others) {
            pairs.push(ScenePair {
                query_index,
                scene: label.clone(),
                query_scene: query_label.clone(),
                ..draw.pair(scene_index, scene.as_ref(), queries.as_ref())?
            });
        }
    }
    Ok(pairs)
}
