//! `posescope view`: the window; without a display, the same run as a recording.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use posescope::app::{self, ReferencePick, Setup, WindowError};
use posescope::estimator;
use posescope::localize::{QueryResult, Selection};
use posescope::method::Method;
use posescope::params::Params;
use posescope::run::{default_failure_radius_m, read_results, read_run};
use posescope::scene::{self, Scene};
use posescope::session::{IndexFile, RunMode};

use super::args::{ConfigArgs, JobArgs, RecordingArgs, RunArgs, ViewArgs};
use super::demo_settings::settings as demo_settings;
use super::failure::CliError;
use super::terminal::Terminal;
use super::{params, run};

/// Where the window saves things unless somebody says otherwise.
const FOLDER: &str = "recordings";

/// Opens the window, or says why not and does the headless job.
pub fn view(args: &ViewArgs, mode: RunMode, terminal: &Terminal) -> Result<(), CliError> {
    run::use_threads(args.job.threads)?;
    let setup = setup(args, mode)?;
    let headless = setup.clone();
    match app::open(setup) {
        Ok(()) => Ok(()),
        Err(
            error @ (WindowError::NoDisplay | WindowError::NoAdapter(_) | WindowError::Failed(_)),
        ) => record_instead(args, &headless, &error, terminal),
    }
}

/// The same run, as a recording.
fn record_instead(
    args: &ViewArgs,
    setup: &Setup,
    why: &WindowError,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let query = setup.queries.frames()[setup.query].clone();
    let recording = setup.folder.join(format!("{query}.rrd"));
    std::fs::create_dir_all(&setup.folder).map_err(CliError::io(&setup.folder))?;
    eprintln!(
        "posescope: {why}; recording {} instead",
        recording.display()
    );
    let references = setup.chosen.frames.iter();
    run::run(
        &RunArgs {
            scene: setup.scene_argument.clone(),
            query: vec![query],
            all: false,
            job: JobArgs {
                format: args.job.format.clone(),
                queries: setup.queries_argument.clone(),
                reference: references
                    .map(|&frame| setup.references.frames()[frame].clone())
                    .collect(),
                references: match setup.pick {
                    ReferencePick::By(selection) => selection,
                    ReferencePick::ByHand => args.job.references,
                },
                index: setup.index.file().cloned(),
                radius: setup.uncertainty_radius_m,
                prior: setup.prior_m,
                method: setup.methods.clone(),
                fusion: setup.fusions.clone(),
                seed: setup.seed,
                config: ConfigArgs {
                    config: None,
                    assignments: setup.params.changes(),
                },
                threads: args.job.threads,
                breakpoints: args.job.breakpoints.clone(),
            },
            recording: RecordingArgs {
                save: Some(recording),
                ..RecordingArgs::default()
            },
            json: None,
        },
        terminal,
    )
}

fn setup(args: &ViewArgs, mode: RunMode) -> Result<Setup, CliError> {
    let folder = Path::new(&args.scene);
    let mut setup = match folder.join("run.toml").is_file() {
        true => of_a_run(args, folder)?,
        false => of_a_scene(args)?,
    };
    setup.mode = mode;
    setup.breakpoints = args
        .job
        .breakpoints
        .iter()
        .map(ToString::to_string)
        .collect();
    Ok(setup)
}

fn of_a_scene(args: &ViewArgs) -> Result<Setup, CliError> {
    let references: Arc<dyn Scene> = scene::open(&args.scene, args.job.format.as_deref())?.into();
    let queries: Arc<dyn Scene> = match &args.job.queries {
        Some(queries) => scene::open(queries, args.job.format.as_deref())?.into(),
        None => Arc::clone(&references),
    };
    let named: Vec<usize> = args
        .job
        .reference
        .iter()
        .map(|name| references.find(name))
        .collect::<Result<_, _>>()?;
    let failure_radius_m = default_failure_radius_m(references.name());
    let mut setup = Setup {
        scene_argument: args.scene.clone(),
        offered: (0..queries.frames().len()).collect(),
        references,
        queries_argument: args.job.queries.clone(),
        queries,
        query: 0,
        pick: match named.as_slice() {
            [] => ReferencePick::By(args.job.references),
            _ => ReferencePick::ByHand,
        },
        chosen: named.into(),
        index: Arc::new(IndexFile::new(&args.scene, args.job.index.clone())),
        methods: methods(&args.job.method),
        fusions: args.job.fusion.clone(),
        params: params::resolve(&args.job.config)?,
        uncertainty_radius_m: args.job.radius,
        prior_m: args.job.prior,
        failure_radius_m,
        seed: args.job.seed,
        breakpoints: Vec::new(),
        mode: RunMode::Paused,
        results: BTreeMap::new(),
        folder: PathBuf::from(FOLDER),
    };
    begin_at(args, &mut setup)?;
    Ok(setup)
}

/// The query that was named, the demonstration's, or the first that has a reference.
fn begin_at(args: &ViewArgs, setup: &mut Setup) -> Result<(), CliError> {
    let has_reference = |setup: &Setup, query| {
        setup.pick == ReferencePick::ByHand || !setup.candidates(query).is_empty()
    };
    let is_demo = args.scene == demo_settings().scene
        && args.job.queries.is_none()
        && args.query.is_none()
        && setup.pick == ReferencePick::By(Selection::Random(1));
    setup.query = match &args.query {
        _ if is_demo => {
            setup.chosen = vec![setup.references.find(&demo_settings().reference)?].into();
            setup.queries.find(&demo_settings().query)?
        }
        Some(name) => setup.queries.find(name)?,
        None => {
            let mut offered = setup.offered.iter().copied();
            offered
                .find(|&query| has_reference(setup, query))
                .unwrap_or(0)
        }
    };
    if has_reference(setup, setup.query) {
        return Ok(());
    }
    Err(CliError::NoReference(format!(
        "{}: no frame with pose and scan within {} m of query {}; raise --radius or name one with \
         --reference",
        args.scene,
        setup.prior_m.unwrap_or(setup.uncertainty_radius_m),
        setup.queries.frames()[setup.query]
    )))
}

/// In the order of the registry, each once.
fn methods(asked: &[Method]) -> Vec<Method> {
    let all = estimator::methods();
    all.filter(|method| asked.contains(method)).collect()
}

/// The queries of a run, with its results; the first failure is looked at first.
fn of_a_run(args: &ViewArgs, folder: &Path) -> Result<Setup, CliError> {
    let file = read_run(folder)?;
    let known: Vec<QueryResult> = read_results(folder)?.collect::<Result<_, _>>()?;
    let Some(pair) = file.pairs.first() else {
        return Err(CliError::NoReference(format!(
            "{}: the run has no scenes",
            folder.display()
        )));
    };
    let scene_argument = file.scenes[pair.scene_index].clone();
    let format = args.job.format.as_deref().or(file.format.as_deref());
    let references: Arc<dyn Scene> = scene::open(&scene_argument, format)?.into();
    let other = file
        .queries
        .iter()
        .find(|argument| {
            let scene = scene::open(argument, format);
            scene.is_ok_and(|scene| scene.name() == pair.query_scene)
        })
        .filter(|_| pair.query_scene != pair.scene);
    let queries: Arc<dyn Scene> = match other {
        Some(argument) => scene::open(argument, format)?.into(),
        None => Arc::clone(&references),
    };
    let mut params = Params::default();
    params
        .merge_toml(&file.params.to_string())
        .map_err(|source| CliError::Config {
            path: folder.join("run.toml"),
            source,
        })?;
    let mut results: BTreeMap<usize, Vec<QueryResult>> = BTreeMap::new();
    for result in known {
        if let Ok(frame) = queries.find(&result.query) {
            results.entry(frame).or_default().push(result);
        }
    }
    let failure_radius_m = file.failure_radius_m;
    let is_failure = |results: &[QueryResult]| {
        let mut results = results.iter();
        results.any(|result| !result.is_success(failure_radius_m))
    };
    let first = results
        .iter()
        .find(|(_, results)| is_failure(results.as_slice()))
        .or_else(|| results.iter().next());
    let query = match (&args.query, first) {
        (Some(name), _) => queries.find(name)?,
        (None, Some((query, _))) => *query,
        (None, None) => 0,
    };
    let reference_frames = results
        .get(&query)
        .and_then(|results| results.first())
        .map_or(&[][..], |result| &result.references)
        .iter()
        .map(|name| references.find(name))
        .collect::<Result<Vec<_>, _>>()?;
    let selection = file.references.parse().map_err(CliError::Usage)?;
    Ok(Setup {
        scene_argument,
        offered: results.keys().copied().collect(),
        references,
        queries_argument: other.cloned(),
        queries,
        query,
        chosen: reference_frames.into(),
        pick: ReferencePick::By(selection),
        index: Arc::new(IndexFile::new(
            &file.scenes[pair.scene_index],
            args.job.index.clone(),
        )),
        methods: file
            .methods
            .iter()
            .filter_map(|name| name.parse::<Method>().ok())
            .collect(),
        fusions: file.fusions(),
        params,
        prior_m: args.job.prior.or(file.prior_m),
        uncertainty_radius_m: file.radii_m.first().copied().unwrap_or(args.job.radius),
        failure_radius_m,
        seed: file.seed,
        breakpoints: Vec::new(),
        mode: RunMode::Paused,
        results,
        folder: PathBuf::from(FOLDER),
    })
}
