//! `posescope run`: queries × references × methods, each told to the recording.

use std::time::Duration;

use posescope::estimator;
use posescope::localize::{
    Chooser, Localizer, QueryResult, Ranking, References, Request, Selection, Unwatched,
};
use posescope::method::Method;
use posescope::params::Params;
use posescope::run::default_failure_radius_m;
use posescope::scene::{self, Retriever, Scene};
use posescope::session::{Breakpoints, StopAtBreakpoint};
use posescope::sink::rerun::{Identity, Recorder, Targets};

use super::args::RunArgs;
use super::audience::Audience;
use super::failure::CliError;
use super::output::{self, JsonLines};
use super::terminal::Terminal;
use super::{params, table};

/// What is asked of every query.
struct Plan<'a> {
    args: &'a RunArgs,
    params: &'a Params,
    localizer: Localizer<'a>,
}

/// One query, as its position in its scene, with its references.
struct Task {
    query: usize,
    references: References,
}

/// Runs the command.
pub fn run(args: &RunArgs, terminal: &Terminal) -> Result<(), CliError> {
    use_threads(args.job.threads)?;
    let params = params::resolve(&args.job.config)?;
    let references = scene::open(&args.scene, args.job.format.as_deref())?;
    let others = match &args.job.queries {
        Some(queries) => Some(scene::open(queries, args.job.format.as_deref())?),
        None => None,
    };
    let queries = others.as_deref().unwrap_or(references.as_ref());
    let plan = Plan {
        args,
        params: &params,
        localizer: Localizer::new(references.as_ref(), queries, &params, args.job.seed),
    };
    let tasks = plan.tasks()?;
    let mut json = match &args.json {
        Some(path) => Some(JsonLines::create(path)?),
        None => None,
    };
    let mut results = Vec::new();
    let methods = plan.methods();
    let estimates = tasks.iter().map(|task| task.references.frames.len());
    let bar = terminal.bar((estimates.sum::<usize>() * methods.len()) as u64);
    let mut audience = Audience::new(bar.clone(), plan.recorder(&tasks)?);
    if !args.job.breakpoints.is_empty() {
        let breakpoints = Breakpoints::new(args.job.breakpoints.iter().cloned());
        audience.stop = Some(StopAtBreakpoint::new(breakpoints));
    }
    let outcome = tasks.iter().enumerate().try_for_each(|(index, task)| {
        let request = Request {
            radius_m: args.job.radius,
            references: task.references.clone(),
            fusions: args.job.fusion.clone(),
            setting: None,
        };
        plan.localizer.localize(
            index,
            task.query,
            &[request],
            &methods,
            &mut audience,
            |result, times| {
                let written = json.as_mut().map_or(Ok(()), |json| json.write(&result));
                results.push((result, times.total()));
                written
            },
        )
    });
    bar.finish_and_clear();

    // Whatever went wrong, what was computed is shown and the recording is closed.
    let shown = plan.show(&results, terminal);
    let reached = audience.stop.as_ref().and_then(StopAtBreakpoint::reached);
    if let (Some(breakpoint), false) = (reached, terminal.is_quiet()) {
        eprintln!("Stopped at {breakpoint}");
    }
    let closed = audience.recorder.map_or(Ok(()), Recorder::close);
    match outcome {
        Ok(()) | Err(CliError::Stopped(_)) => {}
        Err(error) => return Err(error),
    }
    closed?;
    shown?;
    if let (Some(path), false) = (&args.recording.save, terminal.is_quiet()) {
        eprintln!("Recording: {0} (open it with `rerun {0}`)", path.display());
    }
    Ok(())
}

/// Restricts parallel work to a number of threads.
pub fn use_threads(threads: Option<std::num::NonZeroUsize>) -> Result<(), CliError> {
    let Some(threads) = threads else {
        return Ok(());
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.get())
        .build_global()
        .map_err(|error| CliError::Usage(error.to_string()))
}

impl Plan<'_> {
    fn failure_radius_m(&self) -> f64 {
        default_failure_radius_m(self.localizer.references().name())
    }

    fn show(
        &self,
        results: &[(QueryResult, Duration)],
        terminal: &Terminal,
    ) -> Result<(), CliError> {
        if terminal.is_quiet() || results.is_empty() {
            return Ok(());
        }
        let table = table::results(results, self.failure_radius_m());
        if self.args.json.as_deref().is_some_and(output::is_stdout) {
            eprintln!("{table}");
            return Ok(());
        }
        output::print(&table)
    }

    /// In the order of the registry, each once.
    fn methods(&self) -> Vec<Method> {
        estimator::methods()
            .filter(|method| self.args.job.method.contains(method))
            .collect()
    }

    fn tasks(&self) -> Result<Vec<Task>, CliError> {
        let args = self.args;
        let (references, queries) = (self.localizer.references(), self.localizer.queries());
        let wanted = if args.all {
            (0..queries.frames().len()).collect()
        } else {
            args.query
                .iter()
                .map(|name| queries.find(name))
                .collect::<Result<Vec<_>, _>>()?
        };
        let named = args
            .job
            .reference
            .iter()
            .map(|name| references.find(name))
            .collect::<Result<Vec<_>, _>>()?;
        let index = match args.job.references {
            Selection::Retrieved(_) if named.is_empty() => Some(Retriever::find(
                args.job.index.as_deref(),
                references,
                &args.scene,
                self.params,
            )?),
            _ => None,
        };
        let chooser = Chooser {
            localizer: &self.localizer,
            params: self.params,
            selection: args.job.references,
            radius_m: args.job.reach_m(),
            seed: args.job.seed,
            index: index.as_ref().map(|index| index as &dyn Ranking),
        };
        wanted
            .into_iter()
            .map(|query| {
                let references = if named.is_empty() {
                    self.chosen(&chooser, query)?
                } else {
                    named.clone().into()
                };
                Ok(Task { query, references })
            })
            .collect()
    }

    fn chosen(&self, chooser: &Chooser<'_>, query: usize) -> Result<References, CliError> {
        let chosen = chooser.choose(query, &|_| false, &mut Unwatched)?;
        if chosen.frames.is_empty() {
            let name = &self.localizer.queries().frames()[query];
            return Err(CliError::NoReference(format!(
                "{}: no frame with pose and scan within {} m of query {name}; \
                 raise --radius or --prior, or name one with --reference",
                self.localizer.references().name(),
                self.args.job.reach_m()
            )));
        }
        Ok(chosen)
    }

    fn recorder(&self, tasks: &[Task]) -> Result<Option<Recorder>, CliError> {
        let recording = &self.args.recording;
        let targets = Targets {
            save: recording.save.clone(),
            connect: recording.connect.clone(),
            spawn: recording.spawn,
            serve: recording.serve,
        };
        if targets.is_none() {
            return Ok(None);
        }
        let names = |scene: &dyn Scene, frames: &mut dyn Iterator<Item = usize>| {
            frames.map(|frame| scene.frames()[frame].clone()).collect()
        };
        let references = tasks.iter().flat_map(|task| task.references.frames.iter());
        let (from, of) = (self.localizer.references(), self.localizer.queries());
        let identity = Identity {
            scene: from.name().to_owned(),
            queries: names(of, &mut tasks.iter().map(|task| task.query)),
            references: names(from, &mut references.copied()),
            configuration: self.params.to_toml(),
            seed: self.args.job.seed,
            failure_radius_m: self.failure_radius_m(),
        };
        Ok(Some(Recorder::open(&targets, &identity, &self.methods())?))
    }
}
