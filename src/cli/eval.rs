//! `posescope eval`: localises many queries into a run folder.

mod again;
mod ending;
mod step_summary;
mod sweep;

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Component, Path, PathBuf};

use posescope::doctor::mistake;
use posescope::fusion::Fusion;
use posescope::localize::{QueryResult, Ranking, Selection};
use posescope::measure::{
    Change, Finding, Gate, KnownFailures, Report, RunComparison, StoredSummary, failing_scenes,
    of_examination, read_rows, write_report,
};
use posescope::method::Method;
use posescope::params::Params;
use posescope::report::{PICTURES, write_html};
use posescope::run::{
    Draw, Execution, FolderError, Preset, Protocol, RUN_SCHEMA, RunError, RunFile, RunFolder,
    ScenePair, Scenes, Sweep, content, defaults, inputs, known, labels, merge, read_run,
};
use posescope::scene::{Retriever, SceneSize};
use posescope::session::command_line;

use self::ending::ending;
use super::args::{EvalArgs, EvalCommand, JudgingArgs};
use super::compare;
use super::event_export::EventExport;
use super::failure::CliError;
use super::failures::{self, FailureRecordings};
use super::opened;
use super::output;
use super::run::JSON_LINES;
use super::terminal::Terminal;

/// Recorded failures by default.
const KEPT_FAILURES: usize = 20;

pub fn eval(args: &EvalArgs, terminal: &Terminal) -> Result<(), CliError> {
    if let Some(EvalCommand::Merge(args)) = &args.command {
        let run = merge(&args.parts, &args.out)?;
        let kept = args.judging.keep_failures.unwrap_or(KEPT_FAILURES);
        failures::merge(&args.parts, &args.out, kept, &run)?;
        let summaries = args.parts.iter().map(|part| StoredSummary::read(part));
        let mut examined: Vec<Finding> = Vec::new();
        for one in
            summaries.collect::<Result<Vec<_>, _>>()?.into_iter().flat_map(|part| part.doctor)
        {
            if !examined.contains(&one) {
                examined.push(one);
            }
        }
        return finish(&args.judging, None, &args.out, &run, &examined, terminal);
    }
    let protocol = args.protocol.over(Protocol::default())?;
    let gated: Vec<Method> = args.judging.gate.iter().map(Gate::method).collect();
    let others: Vec<Method> = protocol.estimates.iter().map(|file| file.method).collect();
    known(&gated, &others)?;
    // An unreadable list fails before anything is run.
    known_failures(&args.judging)?;
    if let Some(before) = &args.rerun_failed
        && !again::has_failed(before)?
    {
        terminal.say(|| format!("No query failed in {}", before.display()));
        return Ok(());
    }
    let folder = folder(args)?;
    if let Some(sweep) = &args.sweep {
        return sweep::sweep(args, sweep, &folder, terminal);
    }
    let Executed { run, scenes } = execute(args, None, &folder, terminal)?;
    let again = args.rerun_failed.as_deref();
    let examined = examined(&run, &scenes, &folder)?;
    finish(&args.judging, again, &folder, &run, &examined, terminal)
}

/// The folder of a run.
pub fn folder(args: &EvalArgs) -> Result<PathBuf, CliError> {
    match &args.out {
        Some(out) => Ok(out.clone()),
        None => Ok(default_folder(args, &args.protocol.over(Protocol::default())?)),
    }
}

/// Indexes by scene, and the names and hashes of their files.
type Indices = (Vec<Box<dyn Ranking>>, Vec<(String, String)>);

/// A run that is about to start.
struct PlannedRun {
    run: RunFile,
    scenes: Scenes,
    params: Params,
}

/// A run that is complete, with its scenes.
struct Executed {
    run: RunFile,
    scenes: Scenes,
}

/// What `posescope doctor` says of scenes whose queries fail often. A part of a run asks about each scene: how often its
/// queries fail is known only when all parts are there.
fn examined(run: &RunFile, scenes: &Scenes, folder: &Path) -> Result<Vec<Finding>, CliError> {
    let rows = read_rows(folder)?;
    let failing = failing_scenes(&rows.iter().collect::<Vec<_>>());
    let mut examined = Vec::new();
    for (at, scene) in scenes.references.iter().enumerate() {
        let pair = run.pairs.iter().find(|pair| pair.scene_index == at);
        let is_asked = |label: &&str| run.shard.is_some() || failing.contains(*label);
        let Some(label) = pair.map(|pair| pair.scene.as_str()).filter(is_asked) else {
            continue;
        };
        // Nobody asked for it, so it costs no report.
        match catch_unwind(AssertUnwindSafe(|| mistake(scene.as_ref()))) {
            Ok(Ok(found)) => {
                examined.extend(found.map(|found| of_examination(label, &found)));
            }
            Ok(Err(error)) => log::warn!("`posescope doctor` cannot examine {label}: {error}"),
            Err(_) => log::warn!("`posescope doctor` cannot examine {label}"),
        }
    }
    Ok(examined)
}

/// A folder below `runs`, named after scenes and options.
fn default_folder(args: &EvalArgs, protocol: &Protocol) -> PathBuf {
    let scenes: Vec<String> = args.scenes.iter().map(|scene| plain_name(scene)).collect();
    let mut name = scenes.join("-");
    if let Some(preset) = protocol.preset {
        name = format!("{name}-{preset}").to_lowercase();
    }
    if let Some(failed) = &args.rerun_failed {
        let run = failed.file_name().unwrap_or_default().to_string_lossy();
        name = format!("{run}-failed");
    }
    if let Some(sweep) = &args.sweep {
        name = format!("{name}-{}", sweep.key());
    }
    if let Some(shard) = args.shard {
        name = format!("{name}-{}-of-{}", shard.number, shard.of);
    }
    Path::new("runs").join(name)
}

/// A scene's argument as the name of a folder. `.` and `..` have the names of their folders.
fn plain_name(argument: &str) -> String {
    let path = Path::new(argument);
    let folder = path.canonicalize().ok().filter(|_| path.file_name().is_none());
    let own = folder.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy());
    let name = own.as_deref().unwrap_or(argument);
    let plain: String = name.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    match plain.trim_matches('-') {
        "" => "scene".to_owned(),
        plain => plain.to_owned(),
    }
}

fn execute(
    args: &EvalArgs,
    swept: Option<(&Sweep, &str)>,
    folder: &Path,
    terminal: &Terminal,
) -> Result<Executed, CliError> {
    let PlannedRun { run, scenes, params } = match &args.rerun_failed {
        Some(before) => again::plan(args, before)?,
        None => plan(args, swept, terminal)?,
    };
    let scenes = scenes.with_protocol(&run.protocol)?;
    let (indices, contents) = indices(&run, &scenes, &params)?;
    let run = RunFile { inputs: run.inputs.into_iter().chain(contents).collect(), ..run };
    check(&args.judging, &run)?;
    if let Some(path) = &args.events {
        let absolute = |path: &Path| std::path::absolute(path).map_err(CliError::io(path));
        let (file, folder) = (normal(&absolute(path)?), normal(&absolute(folder)?));
        if file.starts_with(folder) {
            return Err(CliError::Usage(format!(
                "--events {}: a file outside the run folder expected; the folder may hold nothing but the run",
                path.display()
            )));
        }
        let scenes = run.scenes.iter().chain(&run.protocol.query_scene).map(String::as_str);
        let scenes: Vec<&str> = scenes.collect();
        output::refuse_to_replace("--events", path, &JSON_LINES, &scenes)?;
    }
    let events = args.events.as_deref().map(EventExport::after).transpose()?;
    let mut run_folder = if args.resume {
        RunFolder::resume(folder, &run)?
    } else {
        RunFolder::create(folder, &run)?
    };
    if let Some(events) = events.as_ref().filter(|_| !args.resume) {
        events.clear()?;
    }
    let bar = terminal.bar(run.items().count() as u64);
    bar.set_position((run_folder.done() - run_folder.unread().len()) as u64);
    let interrupt = terminal.interrupt();
    let kept = if args.sweep.is_some() { 0 } else { KEPT_FAILURES };
    let kept = args.judging.keep_failures.unwrap_or(kept);
    let mut observer = FailureRecordings::new(
        kept,
        &run_folder,
        &run,
        &params,
        bar.clone(),
        interrupt.clone(),
        events,
    )?;
    let execution = Execution { run: &run, scenes: &scenes, params: &params, indices: &indices };
    let outcome = execution.run_remaining(&mut run_folder, &mut observer);
    bar.finish_and_clear();
    let closed = observer.close();
    match outcome {
        Err(RunError::Cancelled(_)) if interrupt.is_raised() => {
            let (done, all) = (run_folder.done(), run.items().count());
            Err(CliError::Interrupted(format!(
                "{done} of {all} queries done; continue with: {}",
                resuming()
            )))
        }
        outcome => {
            outcome?;
            closed?;
            Ok(Executed { run, scenes })
        }
    }
}

/// Refuses before the first query what would fail after the last.
fn check(args: &JudgingArgs, run: &RunFile) -> Result<(), CliError> {
    let methods = &run.protocol.methods;
    if let Some(gate) = args.gate.iter().find(|gate| !methods.contains(&gate.method())) {
        return Err(CliError::Usage(format!(
            "--gate '{gate}' is about {}, which is not run; add it to --method",
            gate.method()
        )));
    }
    if let Some(baseline) = &args.baseline {
        read_run(baseline)?;
        read_rows(baseline)?;
    }
    Ok(())
}

/// The run that the arguments ask for, with all defaults filled in, at one value of a sweep.
fn plan(
    args: &EvalArgs,
    swept: Option<(&Sweep, &str)>,
    terminal: &Terminal,
) -> Result<PlannedRun, CliError> {
    let given = args.protocol.over(Protocol::default())?;
    args.config.resolve()?;
    let scenes = Scenes::open(&args.scenes, &given.query_scene, given.format.as_deref())?;
    let first = scenes.references.first();
    let size = first.map_or(SceneSize::PAPER, |scene| SceneSize::of(scene.as_ref()));
    let mut params = args.config.over(Params::at_scale(size.scale))?;
    let defaults = defaults(given.preset, first.map_or("", |scene| scene.name()));
    let mut protocol = args.protocol.over(defaults.at_size(&size))?;
    if let Some(line) = opened::size_line(&size, &protocol, &params) {
        terminal.say(|| line);
    }
    let camera = first.filter(|scene| !scene.frames().is_empty()).map(|scene| scene.intrinsics(0));
    if let Some(warning) =
        camera.and_then(|camera| opened::misfit(&size, &protocol, &params, &camera))
    {
        log::warn!("{warning}");
    }
    if protocol.is_by_hand() {
        return Err(CliError::Usage(
            "eval chooses references for each query: --reference takes random:K, nearest:K, matches:K or \
             retrieve:K; `posescope run` takes frames"
                .to_owned(),
        ));
    }
    let has_several = protocol.selection().count() > 1;
    // The large experiment has the fusion of a run without preset.
    let has_own_fusions = protocol.preset.is_some_and(|one| one != Preset::Large);
    if has_several && !args.protocol.has("fusions") && !has_own_fusions {
        protocol.fusions = Fusion::all().filter(|f| f.name == "r-wavg").collect();
    }
    if let Some((sweep, value)) = swept {
        let applied = sweep.apply(value, &mut protocol.degrade, &mut params);
        applied.map_err(|error| CliError::Usage(error.to_string()))?;
    }
    let draw = Draw { limit: protocol.limit, only: &args.query, seed: protocol.seed };
    let pairs = pairs(&draw, &scenes, &args.scenes, &protocol.query_scene)?;
    let run = RunFile {
        schema: RUN_SCHEMA.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scenes: args.scenes.clone(),
        shard: args.shard,
        inputs: inputs(&protocol)?,
        paths: BTreeMap::new(),
        protocol,
        pairs,
        params: written(&params),
    };
    Ok(PlannedRun { run, scenes, params })
}

fn written(params: &Params) -> toml::Table {
    let table = params.to_toml().parse();
    table.unwrap_or_else(|error| unreachable!("we wrote it ourselves: {error}"))
}

/// The command line that continues this run.
fn resuming() -> String {
    let words = std::env::args_os().skip(1);
    let mut words: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
    if !words.iter().any(|word| word == "--resume") {
        words.push("--resume".to_owned());
    }
    command_line(&words)
}

/// The indexes that ranked references need, one per scene, and the hashes of their files.
fn indices(run: &RunFile, scenes: &Scenes, params: &Params) -> Result<Indices, CliError> {
    let Selection::Retrieved(_) = run.protocol.selection() else {
        return Ok((Vec::new(), Vec::new()));
    };
    let (files, scenes) = (&run.protocol.index, &scenes.references);
    if !files.is_empty() && files.len() != scenes.len() {
        return Err(CliError::Usage(format!(
            "--index is given {} times for {} scenes; give one per scene, in the same order",
            files.len(),
            scenes.len()
        )));
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
) -> Result<Vec<ScenePair>, CliError> {
    let given: Vec<&str> = references.iter().chain(queries).map(String::as_str).collect();
    let opened = scenes.references.iter().chain(&scenes.queries);
    let named: Vec<_> = given.into_iter().zip(opened.map(|scene| scene.name())).collect();
    let labels = labels(&named);
    let (of_references, of_queries) = labels.split_at(references.len());
    for (labels, arguments) in [(of_references, references), (of_queries, queries)] {
        let twice = (1..labels.len()).find(|&at| labels[..at].contains(&labels[at]));
        if let Some(twice) = twice {
            return Err(CliError::Usage(format!(
                "the scene {} is given twice, as {}; give it once",
                labels[twice], arguments[twice]
            )));
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

fn known_failures(args: &JudgingArgs) -> Result<KnownFailures, CliError> {
    let read = args.known_failures.as_deref().map(KnownFailures::read);
    Ok(read.transpose()?.unwrap_or_default())
}

/// The report of a run, why it fails, and the first of its files that could not be written.
struct Judged {
    report: Report,
    known: KnownFailures,
    failures: Vec<String>,
    written: Result<(), FolderError>,
}

impl Judged {
    /// Writes the reports and checks the gates.
    fn of(
        args: &JudgingArgs,
        again: Option<&Path>,
        folder: &Path,
        run: &RunFile,
        examined: &[Finding],
    ) -> Result<Self, CliError> {
        let known = known_failures(args)?;
        let (report, written) = write_report(folder, run, examined, &args.gate, &known)?;
        let before = args.baseline.as_deref().or(again);
        let written = written.and(write_html(folder, before, PICTURES, None).map(drop));
        let failed = report.gate_results.iter().filter(|one| !one.passed);
        Ok(Self {
            failures: failed
                .map(|one| format!("gate `{}` failed: {}", one.gate, one.found))
                .collect(),
            report,
            known,
            written,
        })
    }
}

/// Writes and prints the reports, and fails if the run is not good enough.
fn finish(
    args: &JudgingArgs,
    again: Option<&Path>,
    folder: &Path,
    run: &RunFile,
    examined: &[Finding],
    terminal: &Terminal,
) -> Result<(), CliError> {
    let Judged { report, known, mut failures, written } =
        Judged::of(args, again, folder, run, examined)?;
    if !terminal.is_quiet {
        let results = read_rows(folder)?;
        let text = ending(run, &report, &results, folder, terminal.width());
        output::print(&text.trim_end())?;
    }
    let mut compared = None;
    if let Some(before) = args.baseline.as_deref().or(again) {
        let comparison = against(before, folder, again.is_some())?;
        if !terminal.is_quiet {
            output::print(&compare::shown(&comparison, terminal.width()).trim_end())?;
        }
        let changes = comparison.differences.iter();
        let broken = changes.filter(|one| one.change == Change::Broken);
        let news = broken.filter(|one| !known.has(&one.after)).count();
        if news > 0 {
            failures.push(format!("{news} queries broken since {}", before.display()));
        }
        compared = Some(comparison);
    }
    let summary = step_summary::of_run(run, folder, &report, compared.as_ref(), &failures);
    step_summary::append(&summary);
    written?;
    good_unless(report.unread.as_slice(), &failures)
}

/// An error if there are failures, or queries whose files cannot be read.
fn good_unless(unread: &[String], failures: &[String]) -> Result<(), CliError> {
    if let Some(unread) = unread.first() {
        let more = failures.iter().map(|failure| format!("; {failure}"));
        let more: String = more.collect();
        return Err(CliError::Unusable(format!(
            "{unread}; replace the file and continue with --resume{more}"
        )));
    }
    if failures.is_empty() {
        return Ok(());
    }
    Err(CliError::NotGoodEnough(failures.join("; ")))
}

/// An absolute path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(normal.pop()),
            Component::CurDir => {}
            part => normal.push(part),
        }
    }
    normal
}

/// The changes since an earlier run; `only_again` restricts them to the repeated queries.
fn against(before: &Path, folder: &Path, only_again: bool) -> Result<RunComparison, CliError> {
    let (mut rows_before, rows) = (read_rows(before)?, read_rows(folder)?);
    if only_again {
        let key =
            |row: &QueryResult| (row.scene.clone(), row.query_scene.clone(), row.query.clone());
        let again: BTreeSet<_> = rows.iter().map(key).collect();
        rows_before.retain(|row| again.contains(&key(row)));
    }
    let tolerance = &RunComparison::TOLERANCE;
    Ok(RunComparison::of(&rows_before, &rows, tolerance))
}
