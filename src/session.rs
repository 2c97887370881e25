//! A run that somebody drives: an estimator on a thread of its own that can be paused, stepped,
//! broken into and stopped.
//!
//! The estimators know nothing of this. An observer of the run, which is one more
//! [`Sink`](crate::trace::Sink), holds the thread back between two events.

mod breakpoint;
mod index_file;
mod job;
mod loaded;
mod message;
mod pausing;
mod run;
mod task;

use std::sync::Arc;
use std::sync::mpsc::{self, Receiver};

use crate::localize::References;

pub use breakpoint::{BreakAt, Breakpoint, BreakpointError, Breakpoints, StopAtBreakpoint};
pub use index_file::IndexFile;
pub use job::{Job, JobError};
pub use loaded::Loaded;
pub use pausing::RunMode;
pub use run::{Explaining, Part, Run, Span, StageBar};
pub use task::{Task, TaskScenes, command_line};

use message::{Message, Outbox};
use pausing::{Command, Control, PausingObserver};

/// What a session is doing.
#[derive(Clone, Debug, PartialEq)]
pub enum RunState {
    /// Photos and clouds are being read.
    Loading,
    /// Events are coming in.
    Running,
    /// The estimator waits behind the last event.
    Paused {
        /// The breakpoint that stopped it, if one did.
        breakpoint: Option<String>,
    },
    /// All that was asked for is done.
    Finished,
    /// It was told to stop.
    Cancelled,
    /// It cannot go on: bad data, or a fault of ours.
    Broken(String),
}

impl RunState {
    /// What has become, in a word or two, of a method that has begun and has no result.
    pub fn of_what_has_begun(&self) -> &'static str {
        match self {
            Self::Loading | Self::Running => "at work",
            Self::Paused { .. } => "paused",
            Self::Finished | Self::Cancelled | Self::Broken(_) => "not finished",
        }
    }
}

/// A run on its own thread, and what it has told so far.
///
/// Dropping a session cancels its run and does not wait for the thread.
pub struct Session {
    control: Control,
    inbox: Receiver<Message>,
    run: Run,
    chosen: Option<References>,
    state: RunState,
}

impl Session {
    /// Starts a job. `wake` is called on the worker's thread whenever there is something new, often;
    /// it must not block.
    pub fn start(
        job: Job,
        mode: RunMode,
        breakpoints: Breakpoints,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Self {
        // Unbounded: a full queue that nobody drains would keep a cancelled worker waiting.
        let (messages, inbox) = mpsc::channel();
        let outbox = Outbox {
            messages,
            wake: Arc::new(wake),
        };
        let (control, observer) = PausingObserver::new(mode, breakpoints, outbox.clone());
        let run = Run::of(&job.task);
        job::spawn(job, observer, outbox);
        Self {
            control,
            inbox,
            run,
            chosen: None,
            state: RunState::Loading,
        }
    }

    /// Takes in what the worker told since the last call. Whether there was anything.
    pub fn drain(&mut self) -> bool {
        let mut is_new = false;
        while let Ok(message) = self.inbox.try_recv() {
            is_new = true;
            match message {
                Message::Chosen(chosen) => {
                    self.run.ranking = None;
                    self.chosen = Some(chosen);
                }
                Message::Ranking {
                    looked_at,
                    candidates,
                } => self.run.ranking = Some([looked_at, candidates]),
                Message::Loaded(loaded) => {
                    self.run.loaded = Some(loaded);
                    self.state = RunState::Running;
                }
                Message::Began(part) => self.run.begin(part),
                Message::Told(record, worked) => {
                    self.run.push(*record, worked);
                    // It was told to go on, or is about to say that it waits.
                    self.state = RunState::Running;
                }
                Message::Waits { breakpoint } => self.state = RunState::Paused { breakpoint },
                Message::Goes => self.state = RunState::Running,
                Message::Ended { result, times } => self.run.end(*result, times),
                Message::Explaining {
                    method,
                    tried,
                    remedies,
                } => self.run.go_on_explaining(method, tried, remedies),
                Message::Explained(result) => self.run.explain(*result),
                Message::Finished => self.state = RunState::Finished,
                Message::Cancelled => self.state = RunState::Cancelled,
                Message::Broke(why) => self.state = RunState::Broken(why),
            }
        }
        is_new
    }

    /// What the run has told so far.
    pub fn run(&self) -> &Run {
        &self.run
    }

    /// The references, once they are chosen.
    pub fn chosen(&self) -> Option<&References> {
        self.chosen.as_ref()
    }

    /// What the session is doing, as of the last [`Self::drain`].
    pub fn state(&self) -> &RunState {
        &self.state
    }

    /// Whether more events may come.
    pub fn is_alive(&self) -> bool {
        matches!(
            self.state,
            RunState::Loading | RunState::Running | RunState::Paused { .. }
        )
    }

    /// Goes on in another way; a paused run goes on at once, a running one pauses soon.
    pub fn set_mode(&self, mode: RunMode) {
        self.control.send(Command::Go(mode));
    }

    /// Replaces the breakpoints.
    pub fn set_breakpoints(&self, breakpoints: Breakpoints) {
        self.control.send(Command::Breakpoints(breakpoints));
    }

    /// Asks the run to stop, and does not wait for it. It says [`RunState::Cancelled`] when it has:
    /// an estimator looks up after 256 hypotheses, one trial or one pass over an image.
    pub fn cancel(&self) {
        self.control.send(Command::Cancel);
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.cancel();
    }
}
