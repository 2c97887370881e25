//! `posescope view`: the window, or without a display a recording of the same run.

use std::path::Path;
use std::sync::Arc;

use posescope::app::{self, KnownResults, Opener, Results, Setup, WindowError};
use posescope::localize::QueryResult;
use posescope::measure::StoredSummary;
use posescope::run::{ConfigError, RunFile, ScenePair, read_run, results_of_pair};
use posescope::scene::{Scene, why_no_cloud};
use posescope::session::{IndexFile, Job, RunMode, Task, TaskScenes, none_near};

use super::args::{RunArgs, ViewArgs};
use super::defaults;
use super::failure::CliError;
use super::opened::{self, OpenedTask};
use super::run;
use super::stderr::tell;
use super::terminal::Terminal;

/// Opens the window, or without a display records the run.
pub fn view(args: &ViewArgs, terminal: &Terminal, opener: Opener) -> Result<(), CliError> {
    let (setup, results) = setup(args)?;
    let headless = setup.clone();
    match app::open(setup, results, args.screenshot.window, opener) {
        Ok(()) => Ok(()),
        Err(
            error @ (WindowError::NoDisplay | WindowError::NoAdapter(_) | WindowError::Failed(_)),
        ) => record_instead(&headless, &error, terminal),
    }
}

/// Records the same run.
fn record_instead(setup: &Setup, why: &WindowError, terminal: &Terminal) -> Result<(), CliError> {
    let query = setup.query_name();
    let recording = setup.folder.join(format!("{}.rrd", query.replace('/', "-")));
    std::fs::create_dir_all(&setup.folder).map_err(CliError::io(&setup.folder))?;
    tell(&format!("posescope: {why}; recording {} instead", recording.display()));
    let mut arguments = vec!["posescope".to_owned()];
    arguments.extend(setup.arguments());
    arguments.extend(["--save".to_owned(), recording.display().to_string()]);
    let args = RunArgs::parse(arguments)?;
    run::run(&args, terminal)
}

/// The setup of the window, and the results that are known already.
pub fn setup(args: &ViewArgs) -> Result<(Setup, KnownResults), CliError> {
    let folder = Path::new(&args.scene);
    Ok(if folder.join("run.toml").is_file() {
        of_a_run(args, folder)?
    } else if args.before.is_some() {
        return Err(CliError::Usage(format!(
            "--before compares two runs, but {} is not a run folder; name one instead of a scene",
            args.scene
        )));
    } else {
        (of_a_scene(args)?, KnownResults::default())
    })
}

/// The results of a run folder for a pair of scenes. Prints how many results belong to other scenes.
fn results_of(
    folder: &Path,
    run: &RunFile,
    pair: &ScenePair,
    queries: &dyn Scene,
) -> Result<Results, CliError> {
    let (results, elsewhere) = results_of_pair(folder, run, pair, queries)?;
    if elsewhere > 0 {
        let (references, queries) = (&pair.scene, &pair.query_scene);
        tell(&format!(
            "posescope: {}: {elsewhere} results of other scenes are not shown; the window shows queries of \
             {queries} with references of {references}",
            folder.display()
        ));
    }
    Ok(results)
}

fn of_a_scene(args: &ViewArgs) -> Result<Setup, CliError> {
    let named: Vec<String> = args.query.iter().cloned().collect();
    let OpenedTask { task, scenes, queries: named, .. } =
        opened::open(&args.task, &args.scene, &named, &|| false)?;
    let offered = (0..scenes.queries.frames().len()).collect();
    let references = task.protocol.named_references();
    let references = references.map(|name| scenes.references.find(name));
    let chosen = references.collect::<Result<Vec<_>, _>>()?;
    let mut setup = setup_of(task, scenes, offered, chosen);
    begin_at(args, named.first().copied(), &mut setup)?;
    Ok(setup)
}

fn setup_of(task: Task, scenes: TaskScenes, offered: Vec<usize>, chosen: Vec<usize>) -> Setup {
    let job = Job {
        references: scenes.references,
        queries: scenes.queries,
        query: 0,
        chosen: chosen.into(),
        index: Arc::new(IndexFile::of(&task)),
        task,
        frames: Arc::default(),
    };
    Setup { job, offered, mode: RunMode::Running, folder: defaults::FOLDER.into() }
}

/// Starts with the named query, that of the demonstration, or the first that has a reference.
fn begin_at(args: &ViewArgs, named: Option<usize>, setup: &mut Setup) -> Result<(), CliError> {
    let has_reference = |setup: &Setup, query| {
        setup.task.protocol.is_by_hand() || !setup.candidates(query).is_empty()
    };
    let is_demo = args.scene == defaults::SCENE
        && args.query.is_none()
        && setup.task.query_scene().is_none()
        && !args.task.protocol.has("references");
    setup.query = match named {
        _ if is_demo => {
            setup.chosen = vec![setup.references.find(defaults::REFERENCE)?].into();
            setup.queries.find(defaults::QUERY)?
        }
        Some(query) => query,
        None => {
            let offered = setup.offered.iter().copied();
            let mut usable = offered.filter(|&query| has_reference(setup, query));
            usable.next().unwrap_or(0)
        }
    };
    if has_reference(setup, setup.query) {
        return Ok(());
    }
    if let Some(why) = why_no_cloud(setup.references.as_ref()) {
        return Err(CliError::Unusable(format!("{}: no frame has a cloud: {why}", args.scene)));
    }
    let (references, queries) = (setup.references.as_ref(), setup.queries.as_ref());
    let why = none_near(references, queries, setup.query, setup.task.reach_m());
    let words = format!("{}: {why}", args.scene);
    Err(CliError::Unusable(setup.task.params.scale.unit().words(&words)))
}

/// Refuses options that change the queries, which a run folder determines.
fn refuse_other_queries(args: &ViewArgs) -> Result<(), CliError> {
    args.task.refuse_many_queries()?;
    let given = [
        ("--query-scene", args.task.protocol.has("query_scene")),
        ("--camera", args.task.camera.is_some()),
    ];
    match given.iter().find(|(_, is_given)| *is_given) {
        Some((option, _)) => Err(CliError::Usage(format!(
            "{option} cannot be used with a run folder, which has its own queries; name a scene instead"
        ))),
        None => Ok(()),
    }
}

/// The queries of a run with its results, starting at the first failure.
fn of_a_run(args: &ViewArgs, folder: &Path) -> Result<(Setup, KnownResults), CliError> {
    let file = read_run(folder)?;
    let Some(pair) = file.pairs.first() else {
        return Err(CliError::Unusable(format!("{}: the run has no scenes", folder.display())));
    };
    let scene_argument = file.scenes[pair.scene_index].clone();
    refuse_other_queries(args)?;
    let mut protocol = args.task.protocol.over(file.protocol.clone())?;
    let other = pair.query_index.and_then(|_| file.query_argument(pair));
    protocol.query_scene = other.map(str::to_owned).into_iter().collect();
    protocol.limit = None;
    protocol.preset = None;
    protocol.failure_radius_m = None;
    protocol.radii_m.truncate(1);
    let mut task =
        Task { protocol, breakpoints: args.task.breakpoints.clone(), ..Task::of(scene_argument) };
    let scenes = task.open(&|_| None)?;
    let (references, queries) = (scenes.references.as_ref(), scenes.queries.as_ref());
    let params = file
        .params()
        .map_err(|source| ConfigError::File { path: folder.join("run.toml"), source })?;
    task.params = args.task.config.over(params)?;
    let results_of = |folder: &Path, run: &RunFile| -> Result<Results, CliError> {
        let mut results = results_of(folder, run, pair, queries)?;
        for result in results.values_mut().flatten() {
            *result = result.clone().graded(task.protocol.right);
        }
        Ok(results)
    };
    let results = results_of(folder, &file)?;
    let before = args.before.as_deref().map(|before| results_of(before, &read_run(before)?));
    let before = before.transpose()?;
    let has_failed = |(_, results): &(&usize, &Vec<QueryResult>)| {
        results.iter().any(|result| result.is_suspect())
    };
    let first = results.iter().find(has_failed).or_else(|| results.iter().next());
    let query = match (&args.query, first) {
        (Some(name), _) => queries.find(name)?,
        (None, Some((query, _))) => *query,
        (None, None) => 0,
    };
    let of_run = results.get(&query).and_then(|results| results.first());
    let named: Vec<&str> = task.protocol.named_references().collect();
    let of_run = of_run.iter().flat_map(|result| &result.references);
    let of_run = of_run.map(String::as_str).filter(|_| named.is_empty());
    let chosen = named.iter().copied().chain(of_run);
    let chosen = chosen.map(|name| references.find(name));
    let chosen = chosen.collect::<Result<Vec<_>, _>>()?;
    let mut setup = setup_of(task, scenes, results.keys().copied().collect(), chosen);
    setup.query = query;
    let known =
        KnownResults { now: results, before, examined: StoredSummary::read(folder)?.doctor };
    Ok((setup, known))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::super::args::{Arguments, Command};
    use super::*;

    /// The window opens at the cause, so the run goes on by itself.
    #[test]
    fn the_window_of_a_scene_runs_its_query() {
        let parsed = Arguments::parse_from(["posescope", "view", "street", "--query", "589"]);
        let Some(Command::View(args)) = parsed.command else {
            panic!("another command");
        };
        let (setup, _) = setup(&args).expect("a built-in scene");
        assert_eq!(setup.mode, RunMode::Running);
    }
}
