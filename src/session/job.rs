//! The job of a session, and the thread that runs it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread;

use super::index_file::IndexFile;
use super::message::Outbox;
use super::pausing::PausingObserver;
use super::run::RunState;
use super::task::Task;
use crate::localize::{
    ChoiceError, LocalizeError, LocalizeObserver, Localizer, QueryResult, Ranking, References,
    Request, Selection, frames_within, is_one_drive, words_of,
};
use crate::scene::{FrameStore, NoIndex, Scene, SceneError};

/// One query, its references, and how to localise it.
#[derive(Clone)]
pub struct Job {
    /// The scene of the references.
    pub references: Arc<dyn Scene>,
    /// The scene of the query, often the same.
    pub queries: Arc<dyn Scene>,
    /// The query's position in its scene.
    pub query: usize,
    /// The references; empty until they are chosen.
    pub chosen: References,
    /// How the query is localised.
    pub task: Task,
    /// The index for retrieval.
    pub index: Arc<IndexFile>,
    /// The cache of frames and everything computed about them, shared between jobs.
    pub frames: Arc<FrameStore>,
}

/// Why a job has no results.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// A frame cannot be read, or the job was cancelled.
    #[error(transparent)]
    Localize(#[from] LocalizeError),
    /// The poses or matches of another system cannot be read.
    #[error(transparent)]
    Foreign(#[from] SceneError),
    /// References cannot be chosen.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// There is no usable index.
    #[error(transparent)]
    Index(#[from] NoIndex),
    /// References must be named, and none is.
    #[error(
        "no reference is chosen for query {0}; choose one, or random:K, nearest:K, matches:K or retrieve:K"
    )]
    NoneNamed(String),
    /// No frame is near enough to be a reference.
    #[error("{0}")]
    NoneNear(String),
}

/// Why no frame is near enough to a query to be a reference, and how far off the nearest one is.
pub fn none_near(
    references: &dyn Scene,
    queries: &dyn Scene,
    query: usize,
    radius_m: f64,
) -> String {
    let name = &queries.frames()[query];
    let nearest = queries.position(query).and_then(|place| {
        let is_query = |frame| is_one_drive(references, queries) && frame == query;
        let within = frames_within(references, &place, f64::INFINITY, &is_query);
        let nearest = *within.first()?;
        Some((&references.frames()[nearest], (references.position(nearest)? - place).norm()))
    });
    let nearest =
        nearest.map(|(frame, away_m)| format!(", and the nearest, {frame}, is {away_m:.1} m away"));
    format!(
        "no frame with a pose and a cloud within {radius_m} m of query {name}{}; raise --radius or --prior, or name a \
         frame with --reference",
        nearest.unwrap_or_default()
    )
}

impl JobError {
    /// Whether the observer cancelled the job.
    pub fn is_cancelled(&self) -> bool {
        matches!(
            self,
            Self::Localize(LocalizeError::Cancelled(_)) | Self::Choice(ChoiceError::Cancelled(_))
        )
    }
}

/// Starts the worker thread. It is never joined: it ends by itself, or at the next event or checkpoint after a
/// cancel.
pub(super) fn spawn(job: Job, mut observer: PausingObserver, outbox: Outbox) {
    let worker = outbox.clone();
    let started = thread::Builder::new().name("estimator".to_owned()).spawn(move || {
        let on_choice = |chosen: &References| {
            let chosen = chosen.clone();
            // If the session is gone, the next event fails.
            let _ = worker.change(|run| {
                run.ranking = None;
                run.chosen = Some(chosen);
            });
        };
        let outcome = catch_unwind(AssertUnwindSafe(|| job.work(0, &mut observer, on_choice)));
        let last = match outcome {
            Ok(Ok(_)) => RunState::Finished,
            Ok(Err(error)) if error.is_cancelled() => RunState::Cancelled,
            Ok(Err(error)) => RunState::Broken(error.to_string()),
            Err(panic) => RunState::Broken(format!("internal error: {}", words_of(panic.as_ref()))),
        };
        // Fails only if the session was dropped.
        let _ = worker.state(last);
    });
    if let Err(error) = started {
        let broken = RunState::Broken(format!("no thread could be started: {error}"));
        let _ = outbox.state(broken);
    }
}

impl Job {
    /// Chooses references if there are none yet, and localises.
    ///
    /// `number` is the index of the query for the observer. `on_choice` gets the references before they are used.
    /// Returns the results of [`Localizer::localize`]: with a fusion, only the fused ones.
    ///
    /// # Errors
    /// [`JobError`].
    pub fn work(
        &self,
        number: usize,
        observer: &mut dyn LocalizeObserver,
        on_choice: impl FnOnce(&References),
    ) -> Result<Vec<QueryResult>, JobError> {
        let (task, protocol) = (&self.task, &self.task.protocol);
        let scenes = (self.frames.of(&self.references), self.frames.of(&self.queries));
        let localizer = Localizer::with_cached_scenes(scenes, &task.params, protocol.seed);
        let localizer = protocol.configured(localizer)?;
        let chosen = self.choose(&localizer, observer)?;
        on_choice(&chosen);
        let request = Request {
            radius_m: task.radius_m(),
            references: chosen,
            fusions: protocol.fusions.clone(),
            setting: None,
        };
        let mut results = Vec::new();
        let keep = |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        localizer.localize(number, self.query, &[request], &protocol.methods, observer, keep)?;
        Ok(results)
    }

    fn choose(
        &self,
        localizer: &Localizer<'_>,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<References, JobError> {
        if !self.chosen.frames.is_empty() {
            return Ok(self.chosen.clone());
        }
        let query = || self.queries.frames()[self.query].clone();
        let (task, protocol) = (&self.task, &self.task.protocol);
        if protocol.is_by_hand() {
            return Err(JobError::NoneNamed(query()));
        }
        let index = match protocol.selection() {
            Selection::Retrieved(_) => {
                Some(self.index.open(self.references.as_ref(), &task.params)?)
            }
            _ => None,
        };
        let index = index.as_deref().map(|index| index as &dyn Ranking);
        let chooser = protocol.chooser(localizer, task.reach_m(), index);
        let chosen = chooser.choose(self.query, &|_| false, observer)?;
        if chosen.frames.is_empty() {
            let (references, queries) = (self.references.as_ref(), self.queries.as_ref());
            return Err(JobError::NoneNear(none_near(
                references,
                queries,
                self.query,
                task.reach_m(),
            )));
        }
        Ok(chosen)
    }
}
