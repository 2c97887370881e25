//! The recorder: a sink that records a run on its own thread.

use std::collections::BTreeSet;
use std::panic;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use super::recording::Recording;
use super::{Identity, RecordError, Targets};
use crate::estimator;
use crate::event::{Event, Kind, KindSet, Stage};
use crate::geometry::Pose;
use crate::localize::{LocalizeObserver, QueryResult, StageTimes};
use crate::method::Method;
use crate::problem::Problem;
use crate::trace::{Cancelled, Record, Sink};

/// The most tasks in the queue: enough for a search to go on while photos are encoded. About thirty of them are
/// synthetic views, which take one or two megabytes each.
const WAITING: usize = 256;

/// One thing to record.
type Task = Box<dyn FnOnce(&mut Recording) + Send>;

/// Records runs for the Rerun viewer, one query after the other.
///
/// Pictures are encoded and rows written on the recorder's thread while the run continues; a much faster run waits
/// for it. The recording depends only on the events of the run, not on their timing.
///
/// A failing recording does not fail the run: the recorder keeps its first error, ignores further events and
/// reports the error when it is closed.
pub struct Recorder {
    writer: Option<Writer>,
    /// Whether the recording has failed.
    is_broken: Arc<AtomicBool>,
    /// The estimators whose events of the current query are complete, by reference.
    recorded: BTreeSet<(usize, Method)>,
    reference: usize,
    /// Whether the current method is a hybrid that only repeats the events of its parts.
    is_repetition: bool,
}

/// The thread and the channel to it.
struct Writer {
    tasks: SyncSender<Task>,
    thread: JoinHandle<Recording>,
}

impl Recorder {
    /// Opens the targets of a run with these methods.
    ///
    /// # Errors
    /// [`RecordError`] names the target that cannot be opened.
    pub fn open(
        targets: &Targets,
        identity: &Identity,
        methods: &[Method],
    ) -> Result<Self, RecordError> {
        let recording = Recording::open(targets, identity, methods)?;
        let is_broken = Arc::new(AtomicBool::new(recording.is_broken()));
        let (tasks, waiting) = sync_channel(WAITING);
        let shared = Arc::clone(&is_broken);
        let thread = thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || record(recording, waiting, &shared))
            .map_err(RecordError::Thread)?;
        Ok(Self {
            writer: Some(Writer { tasks, thread }),
            is_broken,
            recorded: BTreeSet::new(),
            reference: 0,
            is_repetition: false,
        })
    }

    /// Reserves room for the pages of a lesson in the layout.
    pub fn with_pages(self) -> Self {
        self.tell(|recording| recording.has_pages = true);
        self
    }

    /// Turns to the next page of a lesson, whose words are known later.
    pub fn turn_page(&mut self) {
        self.tell(Recording::turn_page);
    }

    /// Shows pages of a lesson, as Markdown, each where it was turned to.
    pub fn show_pages(&mut self, pages: Vec<String>) {
        self.tell(move |recording| recording.show_pages(pages));
    }

    /// Completes the recording.
    ///
    /// # Errors
    /// The first error of the whole run.
    pub fn close(mut self) -> Result<(), RecordError> {
        let Some(Writer { tasks, thread }) = self.writer.take() else {
            return Ok(());
        };
        drop(tasks);
        thread.join().unwrap_or_else(|panic| panic::resume_unwind(panic)).close()
    }

    fn tell(&self, task: impl FnOnce(&mut Recording) + Send + 'static) {
        if let Some(writer) = &self.writer {
            // If the thread has panicked, joining it reports why.
            writer.tasks.send(Box::new(task)).ok();
        }
    }

    fn is_broken(&self) -> bool {
        self.is_broken.load(Ordering::Relaxed)
    }
}

/// Records the tasks in order.
fn record(mut recording: Recording, tasks: Receiver<Task>, is_broken: &AtomicBool) -> Recording {
    for task in tasks {
        task(&mut recording);
        is_broken.store(recording.is_broken(), Ordering::Relaxed);
    }
    recording
}

/// A run that ends early keeps its recorded events.
impl Drop for Recorder {
    fn drop(&mut self) {
        if let Some(Writer { tasks, thread }) = self.writer.take() {
            drop(tasks);
            // A second panic while unwinding would abort the process silently.
            thread.join().ok();
        }
    }
}

impl LocalizeObserver for Recorder {
    fn begin_query(&mut self, query_index: usize, problems: &[Problem], truth: Option<&Pose>) {
        self.recorded.clear();
        self.is_repetition = false;
        let (problems, truth) = (problems.to_vec(), truth.copied());
        self.tell(move |recording| recording.begin_query(query_index, problems, truth));
    }

    fn begin_method(&mut self, reference_index: usize, method: Method) {
        self.reference = reference_index;
        // Decided once: while the hybrid runs, its parts are added to `recorded`.
        let parts = estimator::find(method).and_then(|entry| entry.hybrid());
        let was_recorded = |method| self.recorded.contains(&(reference_index, method));
        self.is_repetition =
            parts.is_some_and(|parts| was_recorded(parts.first) && was_recorded(parts.second));
        self.tell(move |recording| recording.begin_method(reference_index, method));
    }

    fn end_method(&mut self, result: &QueryResult, _times: &StageTimes) {
        let result = result.clone();
        self.tell(move |recording| recording.end_method(&result));
    }

    fn explained(&mut self, result: &QueryResult) {
        let result = result.clone();
        self.tell(move |recording| recording.explained(&result));
    }

    fn begin_fusion(&mut self, method: Method) {
        self.begin_method(0, method);
    }

    fn end_fusion(&mut self, result: &QueryResult) {
        self.end_method(result, &StageTimes::default());
    }
}

impl Sink for Recorder {
    fn wanted(&self) -> KindSet {
        if self.is_broken() {
            KindSet::NONE
        } else if self.is_repetition {
            KindSet::of(&[Kind::BranchTaken])
        } else {
            KindSet::ALL
        }
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if self.is_broken() {
            return Ok(());
        }
        let teller = record.methods.last();
        let is_repeated =
            teller.is_some_and(|method| self.recorded.contains(&(self.reference, *method)));
        if let Event::StageEnded(ended) = &record.event
            && let Stage::Estimator(method) = ended.stage
        {
            self.recorded.insert((self.reference, method));
        }
        let record = record.clone();
        self.tell(move |recording| recording.accept(&record, is_repeated));
        Ok(())
    }
}
