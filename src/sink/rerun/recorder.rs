//! The recorder: a sink that has a run recorded on a thread of its own.

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

/// So many tasks wait for the thread at most: a synthetic view that waits keeps a megabyte or two.
const WAITING: usize = 64;

/// One thing to record.
type Task = Box<dyn FnOnce(&mut Recording) + Send>;

/// Puts runs into a Rerun recording, one query after the other.
///
/// Pictures are packed and rows are written on a thread of the recorder, while the run goes on; a run that is much
/// faster waits for it. What is recorded follows from what the run tells alone, not from when it does.
///
/// A recording that breaks does not break the run: the recorder remembers its first error, wants no
/// more events and reports the error when it is closed.
pub struct Recorder {
    writer: Option<Writer>,
    /// Whether the recording takes nothing more.
    is_broken: Arc<AtomicBool>,
    /// The estimators that told all they tell of the query at work, by reference.
    recorded: BTreeSet<(usize, Method)>,
    reference: usize,
    /// Whether the method at work is a hybrid that only repeats what its parts told.
    is_repetition: bool,
}

/// The thread and the way to it.
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
        let told = Arc::clone(&is_broken);
        let thread = thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || record(recording, waiting, &told))
            .map_err(RecordError::Thread)?;
        Ok(Self {
            writer: Some(Writer { tasks, thread }),
            is_broken,
            recorded: BTreeSet::new(),
            reference: 0,
            is_repetition: false,
        })
    }

    /// With the pages of a lesson, which the layout leaves room for.
    pub fn with_pages(self) -> Self {
        self.tell(Recording::leave_room_for_pages);
        self
    }

    /// Shows a page of a lesson, as Markdown, from here on.
    pub fn show_page(&mut self, markdown: &str) {
        let markdown = markdown.to_owned();
        self.tell(move |recording| recording.show_page(&markdown));
    }

    /// Completes the recording.
    ///
    /// # Errors
    /// The first error of the whole run.
    pub fn close(mut self) -> Result<(), RecordError> {
        self.finish().map_or(Ok(()), Recording::close)
    }

    /// Waits until all that was told is recorded.
    fn finish(&mut self) -> Option<Recording> {
        let Writer { tasks, thread } = self.writer.take()?;
        drop(tasks);
        Some(
            thread
                .join()
                .unwrap_or_else(|panic| panic::resume_unwind(panic)),
        )
    }

    fn tell(&self, task: impl FnOnce(&mut Recording) + Send + 'static) {
        if let Some(writer) = &self.writer {
            // A thread that is gone says why when it is joined.
            writer.tasks.send(Box::new(task)).ok();
        }
    }

    fn is_broken(&self) -> bool {
        self.is_broken.load(Ordering::Relaxed)
    }
}

/// What is told becomes rows, in its order.
fn record(mut recording: Recording, tasks: Receiver<Task>, is_broken: &AtomicBool) -> Recording {
    for task in tasks {
        task(&mut recording);
        is_broken.store(recording.is_broken(), Ordering::Relaxed);
    }
    recording
}

/// A run that ends early leaves behind what it told.
impl Drop for Recorder {
    fn drop(&mut self) {
        if let Some(Writer { tasks, thread }) = self.writer.take() {
            drop(tasks);
            // While another panic is on its way this one would end the process without a word.
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
        // Decided once: while a hybrid runs, its own parts are recorded one after the other.
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
