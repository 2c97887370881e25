//! What a session is asked to run, and the thread that runs it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::thread;

use super::at_hand::AtHand;
use super::gate::{Control, Gate};
use super::index_file::IndexFile;
use super::run::Part;
use super::task::Task;
use crate::geometry::Pose;
use crate::localize::{
    ChoiceError, Chooser, LocalizeError, Localizer, QueryResult, Ranking, References, Request,
    Selection, StageTimes, Watch, words_of,
};
use crate::problem::Problem;
use crate::scene::{NoIndex, Scene};
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
    /// The references, once they are chosen.
    pub chosen: References,
    /// What is asked of the query.
    pub task: Task,
    /// What a choice by looks asks.
    pub index: Arc<IndexFile>,
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

/// Why a job has no results.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// A frame cannot be read, or the job was cancelled.
    #[error(transparent)]
    Localize(#[from] LocalizeError),
    /// References cannot be chosen.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// There is no index to ask.
    #[error(transparent)]
    Index(#[from] NoIndex),
    /// Nobody said which.
    #[error("no reference is chosen for query {query}")]
    NoneNamed {
        /// The query frame's name.
        query: String,
    },
    /// Nothing is near enough.
    #[error(
        "no frame with pose and scan within {radius_m} m of query {query}; raise the radius \
         or the prior, or choose references by hand"
    )]
    NoneNear {
        /// The query frame's name.
        query: String,
        /// How far from the query they were sought \[m\].
        radius_m: f64,
    },
}

/// What the worker says to the session.
pub(super) enum Message {
    Chosen(References),
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
    let choices = outbox.clone();
    let started = thread::Builder::new()
        .name("estimator".to_owned())
        .spawn(move || {
            let on_choice = |chosen: &References| {
                // The session may be gone; the next event finds out.
                let _ = choices.send(Message::Chosen(chosen.clone()));
            };
            let outcome = catch_unwind(AssertUnwindSafe(|| job.work(&mut gate, on_choice)));
            let last_words = match outcome {
                Ok(Ok(_)) => Message::Finished,
                Ok(Err(JobError::Localize(LocalizeError::Cancelled(_)))) => Message::Cancelled,
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
    /// Chooses references where there are none yet, and localises.
    ///
    /// `on_choice` hears which frames the references are before any of them is used. Hands out what
    /// [`Localizer::localize`] does: with a fusion the fused results only.
    ///
    /// # Errors
    /// [`JobError`].
    pub fn work(
        &self,
        watch: &mut dyn Watch,
        on_choice: impl FnOnce(&References),
    ) -> Result<Vec<QueryResult>, JobError> {
        let (task, protocol) = (&self.task, &self.task.protocol);
        let before = self.at_hand.as_deref();
        let scene = |scene| AtHand { scene, before };
        let references = scene(self.references.as_ref());
        let queries = scene(self.queries.as_ref());
        let localizer = Localizer::new(&references, &queries, &task.params, protocol.seed);
        let chosen = self.choose(&localizer)?;
        on_choice(&chosen);
        let request = Request {
            radius_m: task.radius_m,
            references: chosen,
            fusions: protocol.fusions.clone(),
            setting: None,
        };
        let mut results = Vec::new();
        let keep = |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        localizer.localize(0, self.query, &[request], &protocol.methods, watch, keep)?;
        Ok(results)
    }

    fn choose(&self, localizer: &Localizer<'_>) -> Result<References, JobError> {
        if !self.chosen.frames.is_empty() {
            return Ok(self.chosen.clone());
        }
        let query = || self.queries.frames()[self.query].clone();
        let (task, protocol) = (&self.task, &self.task.protocol);
        if task.by_hand {
            return Err(JobError::NoneNamed { query: query() });
        }
        let index = match protocol.references {
            Selection::Retrieved(_) => {
                Some(self.index.open(self.references.as_ref(), &task.params)?)
            }
            _ => None,
        };
        let chooser = Chooser {
            localizer,
            params: &task.params,
            selection: protocol.references,
            radius_m: task.reach_m(),
            seed: protocol.seed,
            index: index.as_deref().map(|index| index as &dyn Ranking),
        };
        let chosen = chooser.choose(self.query, &|_| false)?;
        if chosen.frames.is_empty() {
            return Err(JobError::NoneNear {
                query: query(),
                radius_m: task.reach_m(),
            });
        }
        Ok(chosen)
    }
}
