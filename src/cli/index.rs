//! `posescope index`: the retrieval index of a scene.

use std::collections::BTreeSet;
use std::path::Path;

use posescope::retrieval::{BuildError, BuildProgress, Index, IndexError};
use posescope::run::{ScenePair, is_same, read_run};
use posescope::scene::{self, IndexOptions, NoIndex, Retriever, Scene};

use super::args::IndexArgs;
use super::failure::CliError;
use super::terminal::Terminal;

/// Runs the command. An index that is up to date is kept.
pub fn index(args: &IndexArgs, terminal: &Terminal) -> Result<(), CliError> {
    let params = args.config.resolve()?;
    let scene = scene::open(&args.scene, args.format.as_deref())?;
    let path = match &args.out {
        Some(path) => path.clone(),
        None => Retriever::default_path(scene.as_ref(), &args.scene).ok_or(NoIndex::NoFolder)?,
    };
    let options =
        IndexOptions { words: params.index.words, every: args.every.get(), seed: args.seed };
    let without = excluded(scene.as_ref(), &args.scene, &args.without)?;
    let request = Retriever::request(scene.as_ref(), &options, &without, &params);
    if !args.force {
        let there = Index::open(&path, params.retrieval.checks);
        match there.and_then(|index| index.check_request(&request)) {
            Ok(()) => {
                terminal.say(|| format!("{}: up to date; --force rebuilds it", path.display()));
                return Ok(());
            }
            Err(IndexError::NotFound { .. }) => {}
            // An index may be overwritten; any other file may be valuable.
            Err(
                error @ (IndexError::Stale { .. }
                | IndexError::Damaged { .. }
                | IndexError::Version { .. }),
            ) => terminal.say(|| format!("{error}; rebuilding it")),
            Err(error) => return Err(CliError::Usage(format!("{error}; --force replaces it"))),
        }
    }
    let bar = terminal.bar(0);
    let built = Retriever::build(scene.as_ref(), &path, &request, &params, |progress| {
        let BuildProgress { step, done, total, .. } = progress;
        bar.set_message(step.name());
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let summary = built.map_err(|error| match error {
        BuildError::Frame(error) => CliError::Scene(error),
        BuildError::Io { path, source } => CliError::Io { path, source },
        BuildError::TooFewDescriptors { .. } => {
            CliError::Usage(format!("{}: {error}; lower --set index.words", scene.name()))
        }
    })?;
    terminal.say(|| {
        format!(
            "{} frames{}, {} features, {} words, {:.1} MB: {}",
            summary.frames,
            match without.len() {
                0 => String::new(),
                excluded => format!(" without {excluded}"),
            },
            summary.features,
            summary.words,
            summary.bytes as f64 / 1e6,
            path.display()
        )
    });
    Ok(())
}

/// The frames of the scene to leave out: the named ones, and the queries of runs. `argument` is the scene's.
fn excluded(
    scene: &dyn Scene,
    argument: &str,
    named: &[String],
) -> Result<BTreeSet<usize>, CliError> {
    let mut frames = BTreeSet::new();
    for name in named {
        let folder = Path::new(name);
        if !folder.is_dir() {
            frames.insert(scene.find(name)?);
            continue;
        }
        let run = read_run(folder)?;
        // A scene that is no folder here, as a built-in one, is known by its name.
        let is_its = |pair: &&ScenePair| match run.query_argument(pair) {
            Some(queries) if Path::new(queries).exists() => is_same(queries, argument),
            _ => pair.query_scene == scene.name(),
        };
        for pair in run.pairs.iter().filter(is_its) {
            for query in pair.drawn.iter().chain(&pair.queries) {
                frames.insert(scene.find(query)?);
            }
        }
    }
    Ok(frames)
}
