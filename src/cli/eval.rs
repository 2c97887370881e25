//! `posescope eval`: an experiment over many queries, into a run folder.

mod again;
mod step_summary;
mod sweep;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use posescope::localize::{QueryResult, Ranking, Selection};
use posescope::measure::{
    Change, Gate, KnownFailures, Report, RunComparison, read_rows, write_report,
};
use posescope::method::Method;
use posescope::params::Params;
use posescope::report::write_html;
use posescope::run::{
    Draw, Execution, Experiment, PaperProtocol, RUN_SCHEMA, RunError, RunFile, RunFolder,
    ScenePair, Scenes, defaults, inputs, merge,
};
use posescope::scene::{self, Retriever, Scene};
use posescope::session::command_line;

use super::args::{EvalArgs, check_known};
use super::diff;
use super::event_export::EventExport;
use super::failure::CliError;
use super::failures::FailureRecordings;
use super::interrupt::Interrupt;
use super::output;
use super::run::use_threads;
use super::table;
use super::terminal::Terminal;

/// Runs the command.
pub fn eval(args: &EvalArgs, terminal: &Terminal) -> Result<(), CliError> {
    use_threads(args.protocol.threads)?;
    if args.merge.is_empty() {
        let gated: Vec<Method> = args.gate.iter().map(Gate::method).collect();
        let others: Vec<Method> = args
            .protocol
            .estimates
            .iter()
            .map(|file| file.method)
            .collect();
        check_known(&gated, &others)?;
    }
    // Before anything is run for a list that nobody can read.
    known_failures(args)?;
    if let Some(before) = &args.failed
        && !again::has_failed(before)?
    {
        eprintln!("No query failed in {}", before.display());
        return Ok(());
    }
    let folder = args.out.clone().unwrap_or_else(|| default_folder(args));
    if let Some(sweep) = &args.sweep {
        return sweep::sweep(args, sweep, &folder, terminal);
    }
    let run = if args.merge.is_empty() {
        execute(args, &folder, terminal)?
    } else {
        let run = merge(&args.merge, &folder)?;
        FailureRecordings::merge(&args.merge, &folder, args, &run)?;
        run
    };
    finish(args, &folder, &run, terminal)
}

/// What is asked, and of which scenes.
struct Asked {
    run: RunFile,
    scenes: Scenes,
    params: Params,
}

/// Beside each other below `runs`, named after what is asked.
fn default_folder(args: &EvalArgs) -> PathBuf {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    let mut name: String = args.scenes.join("-").chars().map(plain).collect();
    if let Some(experiment) = args.experiment {
        name = format!("{name}-{experiment}").to_lowercase();
    }
    if let Some(failed) = &args.failed {
        let run = failed.file_name().unwrap_or_default().to_string_lossy();
        name = format!("{run}-failed");
    }
    if let Some(sweep) = &args.sweep {
        name = format!("{name}-{}", sweep.key());
    }
    if let Some(shard) = args.shard {
        name = format!("{name}-{}-of-{}", shard.number, shard.of);
    }
    Path::new("runs").join(name.trim_matches('-'))
}

fn execute(args: &EvalArgs, folder: &Path, terminal: &Terminal) -> Result<RunFile, CliError> {
    let asked = match &args.failed {
        Some(before) => again::asked(args, before)?,
        None => asked(args)?,
    };
    let Asked {
        run,
        scenes,
        params,
    } = asked;
    let scenes = scenes.as_asked(&run.protocol)?;
    let indices = indices(args, &run, &scenes, &params)?;
    // A file of events that cannot be opened leaves no run folder behind, unless it is to lie in that.
    let opened = |is_inside: bool| {
        let file = args.events.as_deref();
        let file = file.filter(|file| file.starts_with(folder) == is_inside);
        file.map(EventExport::after).transpose()
    };
    let outside = opened(false)?;
    let mut run_folder = if args.resume {
        RunFolder::resume(folder, &run)?
    } else {
        RunFolder::create(folder, &run)?
    };
    let events = outside.map_or_else(|| opened(true), |events| Ok(Some(events)))?;
    if let Some(events) = events.as_ref().filter(|_| !args.resume) {
        events.clear()?;
    }
    let bar = terminal.bar(run.items().count() as u64);
    bar.set_position(run_folder.done() as u64);
    let interrupt = Interrupt::listen();
    let mut observer = FailureRecordings::new(
        args,
        &run_folder,
        &run,
        &params,
        bar.clone(),
        interrupt.clone(),
        events,
    )?;
    let execution = Execution {
        run: &run,
        scenes: &scenes,
        params: &params,
        indices: &indices,
    };
    let outcome = execution.run_remaining(&mut run_folder, &mut observer);
    bar.finish_and_clear();
    let told = observer.close();
    match outcome {
        Err(RunError::Cancelled(_)) if interrupt.is_raised() => {
            let (done, all) = (run_folder.done(), run.items().count());
            Err(CliError::Interrupted(format!(
                "{done} of {all} queries are done; go on with: {}",
                resuming()
            )))
        }
        outcome => {
            outcome?;
            told?;
            Ok(run)
        }
    }
}

fn asked(args: &EvalArgs) -> Result<Asked, CliError> {
    let params = args.protocol.config.resolve()?;
    let scenes = Scenes {
        references: open_all(&args.scenes, args)?,
        queries: open_all(&args.queries, args)?,
    };
    Ok(Asked {
        run: describe(args, &scenes, &params)?,
        scenes,
        params,
    })
}

/// The command line that goes on with this run.
fn resuming() -> String {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    if !words.iter().any(|word| word == "--resume") {
        words.push("--resume".to_owned());
    }
    command_line(&words)
}

fn open_all(arguments: &[String], args: &EvalArgs) -> Result<Vec<Arc<dyn Scene>>, CliError> {
    let format = args.protocol.format.as_deref();
    let scenes = arguments
        .iter()
        .map(|scene| scene::open(scene, format).map(Arc::from));
    Ok(scenes.collect::<Result<_, _>>()?)
}

/// Ranked references need an index of each scene.
fn indices(
    args: &EvalArgs,
    run: &RunFile,
    scenes: &Scenes,
    params: &Params,
) -> Result<Vec<Box<dyn Ranking>>, CliError> {
    let Selection::Retrieved(_) = run.protocol.references else {
        return Ok(Vec::new());
    };
    let (files, scenes) = (&args.index, &scenes.references);
    if !files.is_empty() && files.len() != scenes.len() {
        return Err(CliError::Usage(format!(
            "--index is given {} times for {} scenes; each needs its own, in the same order",
            files.len(),
            scenes.len()
        )));
    }
    let named = scenes.iter().zip(&run.scenes);
    named
        .enumerate()
        .map(|(number, (scene, argument))| {
            let file = files.get(number).map(PathBuf::as_path);
            let index = Retriever::find(file, scene.as_ref(), argument, params)?;
            Ok(Box::new(index) as Box<dyn Ranking>)
        })
        .collect()
}

/// What is asked, with everything that was left open filled in.
fn describe(args: &EvalArgs, scenes: &Scenes, params: &Params) -> Result<RunFile, CliError> {
    let defaults = defaults(args.experiment);
    let first = scenes.references.first();
    let scene_name = first.map(|scene| scene.name()).unwrap_or_default();
    let paper = args.paper.unwrap_or(PaperProtocol::of_scene(scene_name));
    let mut protocol = args.protocol.over(defaults.protocol)?;
    let is_single = protocol.references.count() == 1;
    if is_single && args.protocol.fusion.is_empty() && args.experiment != Some(Experiment::Multi) {
        protocol.fusions = Vec::new();
    }
    if args.experiment == Some(Experiment::Large) {
        protocol.prior_m = protocol.prior_m.or(Some(paper.prior_m()));
    }
    let radii_m = match args.radius.as_slice() {
        [] => defaults.radii_m.to_vec(),
        wanted => wanted.to_vec(),
    };
    let share = args.queries_share.unwrap_or(defaults.share);
    let draw = Draw {
        share,
        limit: args.limit.map(|limit| limit as usize),
        only: &args.only,
        seed: protocol.seed,
    };
    let table = params.to_toml().parse();
    let inputs = inputs(&protocol)?;
    Ok(RunFile {
        schema: RUN_SCHEMA.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scenes: args.scenes.clone(),
        queries: args.queries.clone(),
        format: args.protocol.format.clone(),
        experiment: args.experiment,
        protocol,
        radii_m,
        share,
        limit: args.limit.map(|limit| limit as usize),
        failure_radius_m: args
            .failure_radius
            .unwrap_or_else(|| paper.failure_radius_m()),
        shard: args.shard,
        pairs: pairs(&draw, scenes)?,
        inputs,
        params: table.unwrap_or_else(|error| unreachable!("we wrote it ourselves: {error}")),
    })
}

/// Every scene with itself, or every scene of references with every one of queries.
fn pairs(draw: &Draw<'_>, scenes: &Scenes) -> Result<Vec<ScenePair>, CliError> {
    let mut pairs = Vec::new();
    for (index, references) in scenes.references.iter().enumerate() {
        let references = references.as_ref();
        if scenes.queries.is_empty() {
            pairs.push(draw.pair(index, references, references)?);
        }
        for queries in &scenes.queries {
            pairs.push(draw.pair(index, references, queries.as_ref())?);
        }
    }
    Ok(pairs)
}

fn known_failures(args: &EvalArgs) -> Result<KnownFailures, CliError> {
    match &args.known_failures {
        Some(path) => Ok(KnownFailures::read(path)?),
        None => Ok(KnownFailures::default()),
    }
}

/// A run with what follows from its results, and why it is not good enough.
struct Judged {
    report: Report,
    known: KnownFailures,
    failures: Vec<String>,
}

impl Judged {
    /// Writes what follows from the results, and holds the gates against them.
    fn of(args: &EvalArgs, folder: &Path, run: &RunFile) -> Result<Self, CliError> {
        let known = known_failures(args)?;
        let report = write_report(folder, run, &args.gate, &known)?;
        let before = args.baseline.as_deref().or(args.failed.as_deref());
        write_html(folder, before, args.pictures(), None)?;
        let failures = report
            .gate_results
            .iter()
            .filter(|gate_result| !gate_result.passed)
            .map(|gate_result| format!("gate `{}` failed: {}", gate_result.gate, gate_result.found))
            .collect();
        Ok(Self {
            report,
            known,
            failures,
        })
    }
}

/// Writes what follows from the results, shows it, and says whether it is good enough.
fn finish(
    args: &EvalArgs,
    folder: &Path,
    run: &RunFile,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let Judged {
        report,
        known,
        mut failures,
    } = Judged::of(args, folder, run)?;
    if !terminal.is_quiet() {
        show(&report, run, terminal.width())?;
        eprintln!("Run: {}", folder.display());
    }
    let mut compared = None;
    if let Some(before) = args.baseline.as_ref().or(args.failed.as_ref()) {
        let comparison = against(before, folder, args.failed.is_some())?;
        if !terminal.is_quiet() {
            output::print(&diff::shown(&comparison, terminal.width()).trim_end())?;
        }
        diff::record(&comparison, (before, folder), None, terminal)?;
        let changes = comparison.differences.iter();
        let broken = changes.filter(|one| one.change == Change::Broken);
        let news = broken.filter(|one| !known.has(&one.after));
        let news = news.count();
        if news > 0 {
            failures.push(format!("{news} queries broken since {}", before.display()));
        }
        compared = Some(comparison);
    }
    step_summary::append(&step_summary::of_run(
        run,
        folder,
        &report,
        compared.as_ref(),
        &failures,
    ));
    if failures.is_empty() {
        return Ok(());
    }
    Err(CliError::NotGoodEnough(failures.join("; ")))
}

fn show(report: &Report, run: &RunFile, width: Option<usize>) -> Result<(), CliError> {
    // The overview of an experiment has a line for every combination.
    let skipped = usize::from(run.experiment.is_some());
    for figures in report.tables.iter().skip(skipped) {
        output::print(&table::figures(figures, width))?;
    }
    for gate_result in &report.gate_results {
        let verdict = if gate_result.passed {
            "passed"
        } else {
            "FAILED"
        };
        output::print(&format!(
            "{verdict}: {}: {}",
            gate_result.gate, gate_result.found
        ))?;
    }
    for line in report.known.lines() {
        output::print(&line)?;
    }
    Ok(())
}

/// What changed since the run before; `only_again` leaves out of it what was not asked again.
fn against(before: &Path, folder: &Path, only_again: bool) -> Result<RunComparison, CliError> {
    let (mut rows_before, rows) = (read_rows(before)?, read_rows(folder)?);
    if only_again {
        let key = |row: &QueryResult| [row.scene.clone(), row.query.clone()];
        let again: BTreeSet<_> = rows.iter().map(key).collect();
        rows_before.retain(|row| again.contains(&key(row)));
    }
    Ok(RunComparison::of(
        &rows_before,
        &rows,
        &RunComparison::TOLERANCE,
    ))
}
