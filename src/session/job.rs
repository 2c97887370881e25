//! What a session is asked to run, and the thread that runs it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::thread;

use super::at_hand::AtHand;
use super::gate::{Control, Gate};
use super::run::Part;
use crate::evaluate::{LocalizeError, Localizer, QueryResult, Request, StageTimes, words_of};
use crate::event::Method;
use crate::fusion;
use crate::geometry::Pose;
use crate::params::Params;
use crate::problem::Problem;
use crate::scene::Scene;
use crate::trace::Record;

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
    /// What to make of several references.
    pub fusions: Vec<&'static fusion::Entry>,
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
    Began(Part),
    Told(Box<Record>),
    Waits {
        breakpoint: Option<String>,
    },
    Goes,
    Ended {
        result: Box<QueryResult>,
        times: Option<StageTimes>,
    },
    Finished,
    Cancelled,
    Broke(String),
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
            let outcome = catch_unwind(AssertUnwindSafe(|| job.work(&mut gate)));
            let last_words = match outcome {
                Ok(Ok(())) => Message::Finished,
                Ok(Err(LocalizeError::Cancelled(_))) => Message::Cancelled,
                Ok(Err(error)) => Message::Broke(error.to_string()),
                Err(panic) => {
                    Message::Broke(format!("internal error: {}", words_of(panic.as_ref())))
                }
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

impl Job {
    fn work(&self, gate: &mut Gate) -> Result<(), LocalizeError> {
        let before = self.at_hand.as_deref();
        let scene = |scene| AtHand { scene, before };
        let references = scene(self.references.as_ref());
        let queries = scene(self.queries.as_ref());
        let localizer = Localizer::new(&references, &queries, &self.params, self.seed);
        let request = Request {
            radius_m: self.uncertainty_radius_m,
            references: self.reference_frames.clone().into(),
            fusions: self.fusions.clone(),
            setting: None,
        };
        // The gate has told every result on the way.
        let done = |_, _| Ok(());
        localizer.localize(0, self.query, &[request], &self.methods, gate, done)
    }
}
