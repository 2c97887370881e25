//! `posescope run`: localises queries and prints the results.

use std::cell::OnceCell;
use std::path::PathBuf;
use std::time::Duration;

use posescope::estimator;
use posescope::localize::{
    ChoiceError, Chooser, Localizer, QueryResult, Ranking, References, Request, Selection,
};
use posescope::method::Method;
use posescope::run::{
    JSON_LINES, frame_pairs_line, mistake_line, refuse_to_replace, survey_line, warn_of_unseen_map,
};
use posescope::scene::{Retriever, Scene, frame_range, why_no_cloud};
use posescope::session::{Breakpoints, StopAtBreakpoint, Task, none_near};
use posescope::sink::rerun::{Identity, Recorder, Targets};
use posescope::sink::{EventExport, SceneNames};

use super::args::RunArgs;
use super::failure::CliError;
use super::interrupt::Interrupt;
use super::match_export::MatchExport;
use super::observer::CliObserver;
use super::opened::{self, OpenedTask};
use super::output::{self, JsonLines};
use super::stderr::tell;
use super::story::story;
use super::table;
use super::terminal::Terminal;

/// How every query is localised.
struct Plan<'a> {
    args: &'a RunArgs,
    task: &'a Task,
    localizer: Localizer<'a>,
}

/// One query, as its position in its scene, with its references.
type PlannedQuery = (usize, References);

pub fn run(args: &RunArgs, terminal: &Terminal) -> Result<(), CliError> {
    let comparing = OnceCell::new();
    let opened = opened::open(&args.task, &args.scene, &args.query, &|| {
        let bar = comparing.get_or_init(|| terminal.bar(1));
        bar.set_message("Comparing clouds and photos of this map, once");
        true
    });
    if let Some(bar) = comparing.get() {
        bar.finish_and_clear();
    }
    let OpenedTask { task, scenes, queries: wanted, size, survey } = opened?;
    let queries = scenes.queries.as_ref();
    if wanted.is_empty() && !args.all {
        return Err(CliError::Usage(format!(
            "--query FRAME, --query PHOTO or --all expected; frames of {}: {}",
            queries.name(),
            frame_range(queries)
        )));
    }
    let references = scenes.references.as_ref();
    let localizer = Localizer::new(references, queries, &task.params, task.protocol.seed);
    let plan = Plan { args, task: &task, localizer: task.protocol.configured(localizer)? };
    plan.check_outputs()?;
    let wanted = if args.all { (0..queries.frames().len()).collect() } else { wanted };
    let interrupt = Interrupt::listen();
    let has_index = matches!(task.protocol.selection(), Selection::Retrieved(_));
    let mut observer = CliObserver::new(terminal.bar(0), interrupt.clone());
    observer.index_for = Some(args.scene.clone()).filter(|_| !has_index && !terminal.is_quiet);
    let tasks = plan.queries(wanted, &mut observer);
    observer.bar.finish_and_clear();
    let tasks = match tasks {
        Err(CliError::Choice(ChoiceError::Cancelled(_))) if interrupt.is_raised() => {
            return Err(CliError::Interrupted("no query is finished".to_owned()));
        }
        tasks => tasks?,
    };
    if let Some(line) = opened::size_line(&size, &task.protocol, &task.params) {
        terminal.say(|| line);
    }
    if let Some(mistake) = &task.params.mistake_of_map {
        log::warn!("{}", mistake_line(references, mistake));
    }
    if let Some(file) = &survey {
        terminal.say(|| survey_line(file));
    } else if let Some(pairs) = &task.params.frame_pairs {
        terminal.say(|| frame_pairs_line(&args.scene, pairs));
    }
    let camera = tasks.first().map(|&(query, _)| queries.intrinsics(query));
    let misfit = |camera| opened::misfit(&size, &task.protocol, &task.params, &camera);
    if let Some(warning) = camera.and_then(misfit) {
        log::warn!("{warning}");
    }
    if !args.task.protocol.has("references")
        && matches!(task.protocol.selection(), Selection::Random(_))
    {
        let reach_m = task.reach_m();
        let words = format!(
            "References are drawn at random within {reach_m} m of the query; --reference names others"
        );
        terminal.say(|| size.scale.unit().words(&words));
    }
    if task.photos.is_some() {
        plan.warn_of_copies(&tasks)?;
    } else if task.query_scene().is_none() {
        for (query, _) in tasks.iter().filter(|(query, of)| of.frames.contains(query)) {
            let name = scenes.references.frames()[*query].as_str();
            log::warn!(
                "{name} is its own reference: the result says nothing; name another --reference"
            );
        }
    }
    let mut json = args.json.as_deref().map(JsonLines::create).transpose()?;
    let mut results = Vec::new();
    let methods = &task.protocol.methods;
    let estimates = tasks.iter().map(|(_, references)| references.frames.len());
    let estimates_planned = estimates.sum::<usize>() * methods.len();
    observer.bar = terminal.bar(estimates_planned as u64);
    observer.recorder = plan.recorder(&tasks)?;
    if let Some(folder) = &args.export_matches {
        observer.export = Some(MatchExport::to(folder, queries, references)?);
    }
    if let Some(path) = &args.events {
        let mut events = EventExport::to(path)?;
        let name = |scene: &dyn Scene| scene.name().to_owned();
        let references = name(references);
        events.name_scenes(SceneNames {
            query: Some(name(queries)).filter(|query| *query != references),
            references,
        });
        observer.events = Some(events);
    }
    if !task.breakpoints.is_empty() {
        let breakpoints = Breakpoints::new(task.breakpoints.iter().cloned());
        observer.stop = Some(StopAtBreakpoint::new(breakpoints));
    }
    let outcome = tasks.iter().enumerate().try_for_each(|(index, (query, references))| {
        let request = Request {
            radius_m: task.radius_m(),
            references: references.clone(),
            fusions: task.protocol.fusions.clone(),
            setting: None,
        };
        let localized = plan.localizer.localize(
            index,
            *query,
            &[request],
            methods,
            &mut observer,
            |result, times| {
                let written = json.as_mut().map_or(Ok(()), |json| json.write(&result));
                results.push((result, times.total()));
                written
            },
        );
        // A stopped query keeps its events so far.
        if let Some(events) = &mut observer.events {
            events.end_query();
        }
        localized
    });
    observer.bar.finish_and_clear();

    warn_of_unseen_map(references, results.iter().map(|(result, _)| result));
    // After an error, finished results are still shown and the recording is closed.
    let shown = plan.show(&results, terminal);
    let reached = observer.stop.as_ref().and_then(StopAtBreakpoint::reached);
    if let Some(breakpoint) = reached {
        terminal.say(|| format!("Stopped at {breakpoint}"));
    }
    let is_interrupted = interrupt.is_raised();
    // Only files are left to close: the next Ctrl-C kills the process.
    interrupt.release();
    let closed = observer.recorder.map_or(Ok(()), Recorder::close);
    let exported = observer.events.map_or(Ok(()), EventExport::close);
    match outcome {
        Err(CliError::Stopped(_)) if is_interrupted => {
            closed?;
            shown?;
            let (done, all) = (results.len(), estimates_planned);
            return Err(CliError::Interrupted(format!("{done} of {all} results are done")));
        }
        Ok(()) | Err(CliError::Stopped(_)) => {}
        Err(error) => return Err(error),
    }
    closed?;
    exported?;
    if let (Some(export), Some(folder)) = (observer.export, &args.export_matches) {
        let written = export.close()?;
        terminal.say(|| format!("Matches: {} ({written} pairs)", folder.display()));
    }
    shown?;
    if let Some(path) = &args.recording.save {
        terminal.say(|| format!("Recording: {0} (open it with `rerun {0}`)", path.display()));
    }
    Ok(())
}

impl Plan<'_> {
    /// A photo that is one of the scene's own would be localised against itself.
    fn warn_of_copies(&self, tasks: &[PlannedQuery]) -> Result<(), CliError> {
        let (from, of) = (self.localizer.references(), self.localizer.queries());
        for (query, references) in tasks {
            let query = of.query(*query)?;
            for &reference in &references.frames {
                let reference = from.query(reference)?;
                if reference.photo().gray == query.photo().gray {
                    log::warn!(
                        "{} is the same photo as the reference {}: the result says nothing; name another --reference",
                        query.name(),
                        reference.name()
                    );
                }
            }
        }
        Ok(())
    }

    /// Refuses outputs before the first of them is opened, which empties its file.
    fn check_outputs(&self) -> Result<(), CliError> {
        let scenes: Vec<&str> =
            self.task.query_scene().into_iter().chain([self.task.scene.as_str()]).collect();
        let files = [
            ("--json", &self.args.json, &JSON_LINES[..]),
            ("--events", &self.args.events, &JSON_LINES[..]),
            ("--save", &self.args.recording.save, &["rrd"][..]),
        ];
        for (option, path, extensions) in files {
            if let Some(path) = path {
                refuse_to_replace(option, path, extensions, scenes.iter().copied())?;
            }
        }
        if self.args.export_matches.is_none() {
            return Ok(());
        }
        self.check_features()
    }

    /// Only FB has matches to write.
    fn check_features(&self) -> Result<(), CliError> {
        let mut methods = self.task.protocol.methods.iter().copied();
        let has_features = |method: Method| {
            let hybrid = estimator::find(method).and_then(posescope::estimator::Entry::hybrid);
            method == Method::FB || hybrid.is_some_and(|parts| parts.first == Method::FB)
        };
        if methods.any(has_features) {
            Ok(())
        } else {
            Err(CliError::Usage(
                "--export-matches writes the matches of fb, which does not run; add --method fb"
                    .to_owned(),
            ))
        }
    }

    fn show(
        &self,
        results: &[(QueryResult, Duration)],
        terminal: &Terminal,
    ) -> Result<(), CliError> {
        if terminal.is_quiet || results.is_empty() {
            return Ok(());
        }
        let width = terminal.width();
        let table = table::results(results, width);
        let text = table + &story(results, width);
        if self.args.json.as_deref().is_some_and(output::is_stdout) {
            tell(text.trim_end());
            return Ok(());
        }
        output::print(&text.trim_end())
    }

    fn queries(
        &self,
        wanted: Vec<usize>,
        observer: &mut CliObserver,
    ) -> Result<Vec<PlannedQuery>, CliError> {
        let (task, protocol) = (self.task, &self.task.protocol);
        let references = self.localizer.references();
        let named = protocol
            .named_references()
            .map(|name| references.find(name))
            .collect::<Result<Vec<_>, _>>()?;
        let index = match protocol.selection() {
            Selection::Retrieved(_) if named.is_empty() => Some(Retriever::find(
                protocol.index.first().map(PathBuf::as_path),
                references,
                &task.scene,
                &task.params,
            )?),
            _ => None,
        };
        let index = index.as_ref().map(|index| index as &dyn Ranking);
        let chooser = protocol.chooser(&self.localizer, task.reach_m(), index);
        wanted
            .into_iter()
            .map(|query| {
                let references = if named.is_empty() {
                    self.chosen(&chooser, query, observer)?
                } else {
                    named.clone().into()
                };
                Ok((query, references))
            })
            .collect()
    }

    fn chosen(
        &self,
        chooser: &Chooser<'_>,
        query: usize,
        observer: &mut CliObserver,
    ) -> Result<References, CliError> {
        let chosen = chooser.choose(query, &|_| false, observer)?;
        if chosen.frames.is_empty() {
            if let Some(why) = why_no_cloud(self.localizer.references()) {
                let scene = self.localizer.references().name();
                return Err(CliError::Unusable(format!("{scene}: no frame has a cloud: {why}")));
            }
            let (references, queries) = (self.localizer.references(), self.localizer.queries());
            let why = none_near(references, queries, query, self.task.reach_m());
            let words = format!("{}: {why}", references.name());
            return Err(CliError::Unusable(self.task.params.scale.unit().words(&words)));
        }
        Ok(chosen)
    }

    fn recorder(&self, tasks: &[PlannedQuery]) -> Result<Option<Recorder>, CliError> {
        let recording = &self.args.recording;
        let targets = Targets {
            save: recording.save.clone(),
            connect: recording.connect.clone(),
            spawn: recording.spawn,
        };
        if targets.is_none() {
            return Ok(None);
        }
        let names = |scene: &dyn Scene, frames: &mut dyn Iterator<Item = usize>| {
            frames.map(|frame| scene.frames()[frame].clone()).collect()
        };
        let references = tasks.iter().flat_map(|(_, references)| &references.frames);
        let (from, of) = (self.localizer.references(), self.localizer.queries());
        let identity = Identity {
            queries: names(of, &mut tasks.iter().map(|(query, _)| *query)),
            references: names(from, &mut references.copied()),
            ..Identity::of(from, of, &self.task.params, &self.task.protocol)
        };
        let methods = &self.task.protocol.methods;
        Ok(Some(Recorder::open(&targets, &identity, methods)?))
    }
}
