//! `posescope run`: queries × references × methods, each told to the recording.

use std::sync::Arc;
use std::time::Duration;

use posescope::estimator;
use posescope::evaluate::{QueryResult, StageTimes, StageTimings, evaluate};
use posescope::event::Method;
use posescope::geometry::Pose;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene::{self, Scene};
use posescope::sink::rerun::{Identity, Recorder, Targets};
use posescope::sink::{Fanout, Progress};
use posescope::trace::{Sink, Trace};

use super::args::RunArgs;
use super::failure::CliError;
use super::output::{self, JsonLines};
use super::select::choose_references;
use super::terminal::Terminal;
use super::{params, table};

/// What is asked of every query.
struct Plan<'a> {
    args: &'a RunArgs,
    params: Params,
    references: Box<dyn Scene>,
    queries: Option<Box<dyn Scene>>,
}

/// One query with its references, as positions in their scenes.
struct Task {
    query: usize,
    references: Vec<usize>,
}

/// Runs the command.
pub fn run(args: &RunArgs, terminal: &Terminal) -> Result<(), CliError> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.get())
            .build_global()
            .map_err(|error| CliError::Usage(error.to_string()))?;
    }
    let plan = Plan {
        args,
        params: params::resolve(&args.config)?,
        references: scene::open(&args.scene, args.format.as_deref())?,
        queries: match &args.queries {
            Some(queries) => Some(scene::open(queries, args.format.as_deref())?),
            None => None,
        },
    };
    let tasks = plan.tasks()?;
    let json = match &args.json {
        Some(path) => Some(JsonLines::create(path)?),
        None => None,
    };
    let mut report = Report {
        json,
        recorder: plan.recorder(&tasks)?,
        results: Vec::new(),
    };

    let runs = tasks
        .iter()
        .map(|task| task.references.len())
        .sum::<usize>()
        * plan.methods().len();
    let bar = terminal.bar(runs as u64);
    let outcome = tasks
        .iter()
        .enumerate()
        .try_for_each(|(index, task)| plan.localize(index, task, &mut report, &bar));
    bar.finish_and_clear();

    // Whatever went wrong, what was computed is shown and the recording is closed.
    let mut shown = Ok(());
    if !terminal.is_quiet() && !report.results.is_empty() {
        let table = table::results(&report.results);
        if args.json.as_deref().is_some_and(output::is_stdout) {
            eprintln!("{table}");
        } else {
            shown = output::print(&table);
        }
    }
    let closed = report.recorder.map_or(Ok(()), Recorder::close);
    outcome?;
    closed?;
    shown?;
    if let (Some(path), false) = (&args.recording.save, terminal.is_quiet()) {
        eprintln!("Recording: {0} (open it with `rerun {0}`)", path.display());
    }
    Ok(())
}

/// Where results go.
struct Report {
    json: Option<JsonLines>,
    recorder: Option<Recorder>,
    results: Vec<(QueryResult, Duration)>,
}

impl Plan<'_> {
    fn query_scene(&self) -> &dyn Scene {
        self.queries.as_deref().unwrap_or(self.references.as_ref())
    }

    /// In the order of the registry, each once.
    fn methods(&self) -> Vec<Method> {
        Method::ALL
            .into_iter()
            .filter(|method| self.args.method.contains(method))
            .collect()
    }

    fn tasks(&self) -> Result<Vec<Task>, CliError> {
        let scene = self.query_scene();
        let queries = if self.args.all {
            (0..scene.frames().len()).collect()
        } else {
            self.args
                .query
                .iter()
                .map(|name| scene.find(name))
                .collect::<Result<Vec<_>, _>>()?
        };
        let named = self
            .args
            .reference
            .iter()
            .map(|name| self.references.find(name))
            .collect::<Result<Vec<_>, _>>()?;
        queries
            .into_iter()
            .map(|query| {
                let references = if named.is_empty() {
                    let same_scene = self.queries.is_none();
                    choose_references(
                        self.args.references,
                        self.references.as_ref(),
                        scene,
                        query,
                        same_scene,
                        self.args.radius,
                        self.args.seed,
                    )?
                } else {
                    named.clone()
                };
                Ok(Task { query, references })
            })
            .collect()
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
        let identity = Identity {
            scene: self.references.name().to_owned(),
            queries: names(self.query_scene(), &mut tasks.iter().map(|task| task.query)),
            references: names(
                self.references.as_ref(),
                &mut tasks
                    .iter()
                    .flat_map(|task| task.references.iter().copied()),
            ),
            configuration: self.params.to_toml(),
            seed: self.args.seed,
        };
        Ok(Some(Recorder::open(&targets, &identity, &self.methods())?))
    }

    fn localize(
        &self,
        index: usize,
        task: &Task,
        report: &mut Report,
        bar: &indicatif::ProgressBar,
    ) -> Result<(), CliError> {
        let scene = self.query_scene();
        let query = scene.query(task.query)?;
        let truth = scene.pose(task.query);
        let problems = task
            .references
            .iter()
            .map(|&reference| {
                Ok(Problem {
                    query: Arc::clone(&query),
                    reference: self.references.reference(reference)?,
                    uncertainty_radius_m: self.args.radius,
                    seed: self.args.seed,
                })
            })
            .collect::<Result<Vec<_>, CliError>>()?;
        if let Some(recorder) = &mut report.recorder {
            recorder.begin_query(index, &problems, truth.as_ref());
        }
        for method in self.methods() {
            for (position, problem) in problems.iter().enumerate() {
                let task = format!("{} ← {}", problem.query.name, problem.reference.name);
                let mut progress = Progress::new(bar.clone(), task);
                if let Some(recorder) = &mut report.recorder {
                    recorder.begin_method(position, method);
                }
                let (result, times) = self.estimate(
                    problem,
                    method,
                    truth.as_ref(),
                    report.recorder.as_mut(),
                    &mut progress,
                );
                if let Some(recorder) = &mut report.recorder {
                    recorder.end_method(&result);
                }
                let written = report
                    .json
                    .as_mut()
                    .map_or(Ok(()), |json| json.write(&result));
                report.results.push((result, times.total()));
                bar.inc(1);
                written?;
            }
        }
        Ok(())
    }

    fn estimate(
        &self,
        problem: &Problem,
        method: Method,
        truth: Option<&Pose>,
        recorder: Option<&mut Recorder>,
        progress: &mut Progress,
    ) -> (QueryResult, StageTimes) {
        let estimator = (estimator::entry(method).new)(&self.params);
        let mut timings = StageTimings::default();
        let mut sinks: Vec<&mut dyn Sink> = vec![&mut timings, progress];
        if let Some(recorder) = recorder {
            sinks.push(recorder);
        }
        let mut fanout = Fanout::new(sinks);
        let outcome = estimator
            .estimate(problem, &mut Trace::to(&mut fanout))
            .unwrap_or_else(|_| unreachable!("no sink of this command cancels a run"));
        let scene = self.references.name();
        let result = evaluate(scene, problem, method, &self.params, &outcome, truth);
        (result, timings.into_times())
    }
}
