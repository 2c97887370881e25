//! `evaluate`: plans, runs, judges and publishes as `posescope eval` does.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use posescope::cli::{Compute, ComputeError, with_compute};
use posescope::measure::{Gate, KnownFailures};
use posescope::run::{
    Evaluation, EvaluationRequest, Judgement, Judging, Plan, Protocol, ProtocolError, RunFolder,
    Shard, append_step_summary, examine, publish, step_summary,
};
use posescope::sink::{EventExport, Follower, KEPT_FAILURES, RunRecords};
use posescope_core::Cancelled;
use pyo3::prelude::*;

use crate::detached::{Stop, detached_with};
use crate::errors;

/// Options that take one list, `fb,pm`; others are repeated.
const LISTS: [&str; 3] = ["method", "fusion", "radius"];

/// The options of `posescope eval`, each with its values as text; one without a value has none.
type Options = BTreeMap<String, Vec<String>>;

/// What is evaluated, and how.
struct Request {
    scenes: Vec<String>,
    folder: PathBuf,
    queries: Vec<String>,
    /// The references of each query, where it has its own.
    pairs: BTreeMap<String, Vec<String>>,
    /// The options of the protocol.
    protocol: Options,
    config: Option<PathBuf>,
    assignments: Vec<String>,
    shard: Option<Shard>,
    judging: Judging,
    kept: usize,
    events: Option<PathBuf>,
    resume: bool,
    compute: Compute,
}

impl Request {
    fn of(
        scene: String,
        folder: PathBuf,
        pairs: BTreeMap<String, Vec<String>>,
        options: Options,
    ) -> PyResult<Self> {
        let mut request = Self {
            scenes: vec![scene],
            folder,
            queries: pairs.keys().cloned().collect(),
            pairs,
            protocol: Options::new(),
            config: None,
            assignments: Vec::new(),
            shard: None,
            judging: Judging::default(),
            kept: KEPT_FAILURES,
            events: None,
            resume: false,
            compute: Compute::Auto,
        };
        for (name, texts) in options {
            request.set(name, texts)?;
        }
        Ok(request)
    }

    fn set(&mut self, name: String, texts: Vec<String>) -> PyResult<()> {
        let option = name.as_str();
        match option {
            "query" => self.queries = texts,
            "set" => self.assignments = texts,
            "config" => self.config = Some(one(option, &texts)?),
            "shard" => self.shard = Some(one(option, &texts)?),
            "gate" => {
                let gates = texts.iter().map(|text| parsed::<Gate>(option, text));
                self.judging.gates = gates.collect::<PyResult<_>>()?;
            }
            "known-failures" => {
                let list = KnownFailures::read(&one::<PathBuf>(option, &texts)?);
                self.judging.known = list.map_err(|error| errors::folder(&error))?;
            }
            "baseline" => self.judging.before = Some(one(option, &texts)?),
            "keep-failures" => self.kept = one(option, &texts)?,
            "events" => self.events = Some(one(option, &texts)?),
            "resume" => self.resume = true,
            "compute" => {
                let word: String = one(option, &texts)?;
                let value = Compute::named(&word);
                self.compute = value.map_err(|why| errors::value(format!("{option}: {why}")))?;
            }
            _ => drop(self.protocol.insert(name, texts)),
        }
        Ok(())
    }

    /// The given options, and `defaults` for the rest.
    fn protocol(&self, defaults: Protocol) -> Result<Protocol, ProtocolError> {
        let table = toml::Table::try_from(&defaults);
        let mut table = table.map_err(|error| ProtocolError::Option(error.to_string()))?;
        for (name, texts) in &self.protocol {
            table.insert(name.clone(), value(name, texts)?);
        }
        let protocol = table.try_into::<Protocol>();
        protocol.map_err(|error| ProtocolError::Option(error.message().to_owned()))?.checked()
    }

    fn plan(&self) -> PyResult<Plan> {
        let plan = Plan::of(&EvaluationRequest {
            scenes: &self.scenes,
            queries: &self.queries,
            pairs: &self.pairs,
            protocol: &|defaults| self.protocol(defaults),
            config: self.config.as_deref(),
            assignments: &self.assignments,
            shard: self.shard,
            rerun_failed: None,
            judging: &self.judging,
            is_survey: false,
            folder: &self.folder,
            events: self.events.as_deref(),
        });
        plan.map_err(|error| errors::plan(&error))
    }

    /// Evaluates; returns why the run is not good enough.
    fn evaluate(&self, caller: &mut Caller<'_>) -> PyResult<Option<String>> {
        let (folder, in_folder) = (&self.folder, |error| errors::folder(&error));
        let plan = self.plan()?;
        let events = self.events.as_deref().map(EventExport::after).transpose();
        let events = events.map_err(in_folder)?;
        let mut run_folder = if self.resume {
            RunFolder::resume(folder, &plan.run)
        } else {
            RunFolder::create(folder, &plan.run)
        }
        .map_err(in_folder)?;
        if let Some(events) = events.as_ref().filter(|_| !self.resume) {
            events.clear().map_err(in_folder)?;
        }
        caller.progress.begin(run_folder.done(), plan.run.items().count());
        let records = RunRecords::new(self.kept, &run_folder, &plan, events, caller);
        let mut records = records.map_err(in_folder)?;
        let outcome = Evaluation::run(&plan, &mut run_folder, &mut records);
        let closed = records.close();
        outcome.map_err(|error| errors::run(&error))?;
        closed.map_err(in_folder)?;
        let examine = |rows: &[_]| examine(&plan.run, &plan.scenes, rows);
        let judgement = Judgement::of(folder, &plan.run, &self.judging, examine);
        let judgement = judgement.map_err(in_folder)?;
        let published = publish(folder, &judgement);
        append_step_summary(&step_summary(&plan.run, folder, &judgement));
        published.map_err(in_folder)?;
        if let Some(unread) = &judgement.report.unread {
            let expected = format!("{unread}; replace the file and continue with resume=True");
            return Err(errors::input(&folder.display().to_string(), "", &expected));
        }
        let failures = judgement.failures;
        Ok(Some(failures.join("; ")).filter(|_| !failures.is_empty()))
    }
}

/// An option of the protocol as a value of its file.
fn value(name: &str, texts: &[String]) -> Result<toml::Value, ProtocolError> {
    let accepts = |value: &toml::Value| {
        let table = toml::Table::from_iter([(name.to_owned(), value.clone())]);
        table.try_into::<Protocol>().map(drop)
    };
    let is_list = accepts(&toml::Value::Array(Vec::new())).is_ok();
    let split = |text: &String| text.split(',').map(str::to_owned).collect::<Vec<_>>();
    let words: Vec<String> = match (texts, is_list && LISTS.contains(&name)) {
        ([], _) if name == "explain" => vec![Protocol::EXPLAINING_RUNS.to_string()],
        (texts, true) => texts.iter().flat_map(split).collect(),
        (texts, false) => texts.to_vec(),
    };
    let whole = |read: fn(&String) -> toml::Value| {
        let mut values: Vec<toml::Value> = words.iter().map(read).collect();
        match values.pop() {
            Some(one) if !is_list && values.is_empty() => one,
            last => toml::Value::Array(values.into_iter().chain(last).collect()),
        }
    };
    // `70` may be a number or the name of a frame.
    let as_text = whole(|word| toml::Value::String(word.clone()));
    let as_number =
        whole(|word| word.parse().unwrap_or_else(|_| toml::Value::String(word.clone())));
    if accepts(&as_number).is_ok() {
        return Ok(as_number);
    }
    let refused = |error: toml::de::Error| {
        ProtocolError::Option(format!("{}: {}", name.replace('-', "_"), error.message()))
    };
    accepts(&as_text).map_err(refused)?;
    Ok(as_text)
}

/// The one value of an option.
fn one<T: std::str::FromStr<Err: std::fmt::Display>>(
    option: &str,
    texts: &[String],
) -> PyResult<T> {
    match texts {
        [text] => parsed(option, text),
        _ => Err(errors::value(format!("{}: one value expected", option.replace('-', "_")))),
    }
}

fn parsed<T: std::str::FromStr<Err: std::fmt::Display>>(option: &str, text: &str) -> PyResult<T> {
    text.parse().map_err(|why| errors::value(format!("{}: {why}", option.replace('-', "_"))))
}

/// How many queries are done, and of how many.
#[derive(Debug, Default)]
struct Progress {
    done: AtomicU64,
    of: AtomicU64,
}

impl Progress {
    fn begin(&self, done: usize, of: usize) {
        self.done.store(done as u64, Ordering::Relaxed);
        self.of.store(of as u64, Ordering::Relaxed);
    }

    fn now(&self) -> (u64, u64) {
        (self.done.load(Ordering::Relaxed), self.of.load(Ordering::Relaxed))
    }
}

/// Python, which waits for the run.
struct Caller<'a> {
    stop: &'a Stop,
    progress: &'a Progress,
}

impl Follower for Caller<'_> {
    fn done(&mut self, _query: &str) {
        self.progress.done.fetch_add(1, Ordering::Relaxed);
    }

    fn check(&self) -> Result<(), Cancelled> {
        self.stop.check()
    }

    fn attention(&self) -> Arc<AtomicBool> {
        self.stop.attention()
    }
}

/// An exception that passes through the choice of a graphics card.
struct Raised(PyErr);

impl From<ComputeError> for Raised {
    fn from(error: ComputeError) -> Self {
        Self(errors::input("", "", &error.to_string()))
    }
}

/// Evaluates a scene into a run folder. Returns why the run is not good enough.
///
/// `progress` is called with the number of queries that are done, and of all.
#[pyfunction]
pub fn evaluate(
    py: Python<'_>,
    scene: String,
    folder: PathBuf,
    pairs: BTreeMap<String, Vec<String>>,
    options: Options,
    threads: Option<NonZeroUsize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Option<String>> {
    let request = Request::of(scene, folder, pairs, options)?;
    let counted = Progress::default();
    let mut shown = (0, 0);
    let tick = |py: Python<'_>| {
        let now = counted.now();
        if let Some(progress) = progress.as_ref().filter(|_| now != shown) {
            shown = now;
            progress.call1(py, now)?;
        }
        Ok(())
    };
    let failure = detached_with(py, threads, &Stop::default(), tick, |stop| {
        let mut caller = Caller { stop, progress: &counted };
        let evaluate = || request.evaluate(&mut caller).map_err(Raised);
        with_compute(request.compute, evaluate).map_err(|Raised(error)| error)
    })??;
    if let Some(progress) = &progress {
        progress.call1(py, counted.now())?;
    }
    Ok(failure)
}
