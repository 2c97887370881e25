//! What a session is asked to run, and the thread that runs it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::thread;

use super::gate::{Control, Gate};
use super::index_file::IndexFile;
use super::message::Message;
use crate::fusion;
use crate::localize::{
    ChoiceError, Chooser, LocalizeError, Localizer, QueryResult, Ranking, References, Request,
    Selection, Watch, words_of,
};
use crate::method::Method;
use crate::params::Params;
use crate::scene::{FrameStore, NoIndex, Scene};

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
    /// How they are chosen where there are none yet.
    pub selection: Option<Selection>,
    /// What a choice by looks asks.
    pub index: Arc<IndexFile>,
    /// The methods to run, in this order, each on every reference.
    pub methods: Vec<Method>,
    /// What to make of several references.
    pub fusions: Vec<&'static fusion::Entry>,
    /// The parameters of all methods.
    pub params: Params,
    /// How far the query may be from a reference \[m\].
    pub uncertainty_radius_m: f64,
    /// How far from the query's known position references are chosen \[m\]; without it, within the
    /// radius.
    pub prior_m: Option<f64>,
    /// Seed of every random choice.
    pub seed: u64,
    /// Where frames are remembered, with all that is worked out about them, for the next job too.
    pub frames: Arc<FrameStore>,
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
    /// Nobody said which references to take.
    #[error("no reference is chosen for query {query}")]
    NoneNamed {
        /// The query frame's name.
        query: String,
    },
    /// No frame is near enough to be a reference.
    #[error(
        "no frame with pose and scan within {radius_m} m of query {query}; raise the radius or \
         choose references by hand"
    )]
    NoneNear {
        /// The query frame's name.
        query: String,
        /// The radius.
        radius_m: f64,
    },
}

impl JobError {
    /// Whether the watcher asked the job to stop.
    pub fn is_cancelled(&self) -> bool {
        matches!(
            self,
            Self::Localize(LocalizeError::Cancelled(_)) | Self::Choice(ChoiceError::Cancelled(_))
        )
    }
}

/// Starts the worker. Nobody joins it: it ends by itself, or at the next event or checkpoint after a
/// cancel.
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
                Ok(Err(error)) if error.is_cancelled() => Message::Cancelled,
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
        let scenes = (
            self.frames.of(&self.references),
            self.frames.of(&self.queries),
        );
        let localizer = Localizer::at_hand(scenes, &self.params, self.seed);
        let chosen = self.choose(&localizer, watch)?;
        on_choice(&chosen);
        let request = Request {
            radius_m: self.uncertainty_radius_m,
            references: chosen,
            fusions: self.fusions.clone(),
            setting: None,
        };
        let mut results = Vec::new();
        let keep = |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        localizer.localize(0, self.query, &[request], &self.methods, watch, keep)?;
        Ok(results)
    }

    fn choose(
        &self,
        localizer: &Localizer<'_>,
        watch: &mut dyn Watch,
    ) -> Result<References, JobError> {
        if !self.chosen.frames.is_empty() {
            return Ok(self.chosen.clone());
        }
        let query = || self.queries.frames()[self.query].clone();
        let Some(selection) = self.selection else {
            return Err(JobError::NoneNamed { query: query() });
        };
        let index = match selection {
            Selection::Retrieved(_) => {
                Some(self.index.open(self.references.as_ref(), &self.params)?)
            }
            _ => None,
        };
        let radius_m = self.prior_m.unwrap_or(self.uncertainty_radius_m);
        let chooser = Chooser {
            localizer,
            params: &self.params,
            selection,
            radius_m,
            seed: self.seed,
            index: index.as_deref().map(|index| index as &dyn Ranking),
        };
        let chosen = chooser.choose(self.query, &|_| false, watch)?;
        if chosen.frames.is_empty() {
            return Err(JobError::NoneNear {
                query: query(),
                radius_m,
            });
        }
        Ok(chosen)
    }
}
