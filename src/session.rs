//! An interactive run: an estimator on its own thread that can be paused, stepped, stopped at breakpoints and
//! cancelled.
//!
//! The estimators know nothing of this. An observer of the run, another [`Sink`](crate::trace::Sink), blocks the
//! thread between two events.

mod breakpoint;
mod index_file;
mod job;
mod job_changes;
mod message;
mod pausing;
mod run;
mod task;

use std::sync::Arc;
use std::sync::mpsc::{self, Receiver};

pub use breakpoint::{Breakpoint, BreakpointError, Breakpoints, StopAtBreakpoint};
pub use index_file::IndexFile;
pub use job::{Job, JobError, none_near};
pub use pausing::RunMode;
pub use run::{Explaining, Loaded, Part, Run, RunState, Span, StageBar};
pub use task::{Task, TaskScenes, command_line};

use message::{Message, Outbox};
use pausing::{Command, Control, PausingObserver};

/// A run on its own thread, and its events so far.
///
/// Dropping a session cancels its run and does not wait for the thread.
pub struct Session {
    control: Control,
    inbox: Receiver<Message>,
    run: Run,
}

impl Session {
    /// Starts a job. `wake` is called on the worker's thread after every message. It is called often and must not
    /// block.
    pub fn start(
        job: Job,
        mode: RunMode,
        breakpoints: Breakpoints,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Self {
        // Unbounded: a full queue that nobody drains would keep a cancelled worker waiting.
        let (messages, inbox) = mpsc::channel();
        let outbox = Outbox { messages, wake: Arc::new(wake) };
        let (control, observer) = PausingObserver::new(mode, breakpoints, outbox.clone());
        let run = Run::of(&job.task);
        job::spawn(job, observer, outbox);
        Self { control, inbox, run }
    }

    /// Takes the worker's messages since the last call. Returns whether there were any.
    pub fn drain(&mut self) -> bool {
        let mut is_new = false;
        while let Ok(change) = self.inbox.try_recv() {
            is_new = true;
            change(&mut self.run);
        }
        is_new
    }

    /// The run so far.
    pub fn run(&self) -> &Run {
        &self.run
    }

    /// What the session is doing, as of the last [`Self::drain`].
    pub fn state(&self) -> &RunState {
        &self.run.state
    }

    /// Whether more events may come.
    pub fn is_alive(&self) -> bool {
        matches!(self.run.state, RunState::Loading | RunState::Running | RunState::Paused { .. })
    }

    /// Changes the mode: a paused run continues at once, a running one pauses soon.
    pub fn set_mode(&self, mode: RunMode) {
        self.control.send(Command::Go(mode));
    }

    /// Replaces the breakpoints.
    pub fn set_breakpoints(&self, breakpoints: Breakpoints) {
        self.control.send(Command::Breakpoints(breakpoints));
    }

    /// Cancels the run without waiting for it. The state becomes [`RunState::Cancelled`] when it has stopped: an
    /// estimator checks after 256 hypotheses, one trial or one pass over an image.
    pub fn cancel(&self) {
        self.control.send(Command::Cancel);
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.cancel();
    }
}
