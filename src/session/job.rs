//! What a session is asked to run, and the thread that runs it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::thread;

use super::gate::{Control, Gate};
use crate::estimator;
use crate::evaluate::{QueryResult, StageTimes, StageTimings, evaluate};
use crate::event::Method;
use crate::geometry::Pose;
use crate::memo::Memo;
use crate::params::Params;
use crate::problem::{Problem, Query, ReferenceTuple};
use crate::scene::{Scene, SceneError};
use crate::sink::Fanout;
use crate::trace::{Cancelled, Record, Trace};

/// Values that one photo's memo keeps: some settings of each stage, so that going back to the last
/// one costs nothing either.
const REMEMBERED: usize = 64;

/// One query, its references, and what to do with them.
#[derive(Clone)]
pub struct Job {
    /// Where the references are.
    pub references: Arc<dyn Scene>,
    /// Where the query is; often the same scene.
    pub queries: Arc<dyn Scene>,
    /// The query's position in its scene.
    pub query: usize,
    /// The references' positions in theirs.
    pub reference_frames: Vec<usize>,
    /// The methods to run, in this order, each on every reference.
    pub methods: Vec<Method>,
    /// Their parameters.
    pub params: Params,
    /// How far the query may be from a reference \[m\].
    pub uncertainty_radius_m: f64,
    /// Seed of every random choice.
    pub seed: u64,
    /// Frames that an earlier job has read, with all that was worked out about them.
    pub at_hand: Option<Arc<Loaded>>,
}

/// The photos and clouds of a job.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The query and each of its references.
    pub problems: Vec<Problem>,
    /// Where the query camera was, if that is known. The estimators do not see it.
    pub truth: Option<Pose>,
}

/// What the worker says to the session.
pub(super) enum Message {
    Loaded(Arc<Loaded>),
    Began {
        method: Method,
        reference: usize,
    },
    Told(Box<Record>),
    Waits {
        breakpoint: Option<String>,
    },
    Goes,
    Ended {
        result: Box<QueryResult>,
        times: StageTimes,
    },
    Finished,
    Cancelled,
    Broke(String),
}

/// Why a job ends before its time.
enum Stop {
    Cancelled,
    Scene(SceneError),
}

impl From<Cancelled> for Stop {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

impl From<SceneError> for Stop {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

/// Starts the worker. Nobody joins it: it ends by itself, or at the next event after a cancel.
pub(super) fn spawn(
    job: Job,
    control: Arc<Control>,
    outbox: Sender<Message>,
    wake: Arc<dyn Fn() + Send + Sync>,
) {
    let mut gate = Gate::new(Arc::clone(&control), outbox.clone(), Arc::clone(&wake));
    let started = thread::Builder::new()
        .name("estimator".to_owned())
        .spawn(move || {
            let outcome = catch_unwind(AssertUnwindSafe(|| job.work(&control, &mut gate)));
            let last_words = match outcome {
                Ok(Ok(())) => Message::Finished,
                Ok(Err(Stop::Cancelled)) => Message::Cancelled,
                Ok(Err(Stop::Scene(error))) => Message::Broke(error.to_string()),
                Err(panic) => Message::Broke(format!("internal error: {}", words_of(&*panic))),
            };
            // Nobody to tell: the session was dropped.
            let _ = gate.tell(last_words);
        });
    if let Err(error) = started {
        let _ = outbox.send(Message::Broke(format!(
            "no thread could be started: {error}"
        )));
        wake();
    }
}

fn words_of(panic: &(dyn std::any::Any + Send)) -> &str {
    panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("a panic without words")
}

impl Job {
    fn work(&self, control: &Control, gate: &mut Gate) -> Result<(), Stop> {
        let loaded = Arc::new(self.load()?);
        gate.tell(Message::Loaded(Arc::clone(&loaded)))?;
        for &method in &self.methods {
            let estimator = (estimator::entry(method).new)(&self.params);
            for (reference, problem) in loaded.problems.iter().enumerate() {
                gate.tell(Message::Began { method, reference })?;
                let mut timings = StageTimings::default();
                let mut fanout = Fanout::new(vec![&mut timings, gate]);
                let mut trace = Trace::watched(&mut fanout, &control.attention);
                let outcome = estimator.estimate(problem, &mut trace)?;
                let truth = loaded.truth.as_ref();
                let scene = self.references.name();
                let result = evaluate(scene, problem, method, &self.params, &outcome, truth);
                gate.tell(Message::Ended {
                    result: Box::new(result),
                    times: timings.into_times(),
                })?;
            }
        }
        Ok(())
    }

    /// Reads the frames that are not at hand.
    fn load(&self) -> Result<Loaded, SceneError> {
        let name = &self.queries.frames()[self.query];
        let at_hand = self.at_hand.as_deref();
        let known = at_hand.map_or(&[][..], |loaded| &loaded.problems);
        let query = match known.iter().find(|problem| problem.query.name == *name) {
            Some(problem) => Arc::clone(&problem.query),
            None => Arc::new(Query {
                memo: Memo::of(REMEMBERED),
                ..Arc::unwrap_or_clone(self.queries.query(self.query)?)
            }),
        };
        let problems = self
            .reference_frames
            .iter()
            .map(|&frame| {
                let name = &self.references.frames()[frame];
                let reference = match known.iter().find(|known| known.reference.name == *name) {
                    Some(problem) => Arc::clone(&problem.reference),
                    None => Arc::new(ReferenceTuple {
                        memo: Memo::of(REMEMBERED),
                        ..Arc::unwrap_or_clone(self.references.reference(frame)?)
                    }),
                };
                Ok(Problem {
                    query: Arc::clone(&query),
                    reference,
                    uncertainty_radius_m: self.uncertainty_radius_m,
                    seed: self.seed,
                })
            })
            .collect::<Result<_, SceneError>>()?;
        Ok(Loaded {
            problems,
            truth: self.queries.pose(self.query),
        })
    }
}
