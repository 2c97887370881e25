//! Pauses a run between two events.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use super::breakpoint::Breakpoints;
use super::message::Outbox;
use super::run::{Loaded, Part, Run, RunState};
use crate::event::Event;
use crate::geometry::Pose;
use crate::localize::{LocalizeObserver, QueryResult, StageTimes};
use crate::method::Method;
use crate::problem::Problem;
use crate::trace::{Cancelled, Record, Sink};

/// How a run continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunMode {
    /// It waits after the next event, or inside a loop without events.
    Paused,
    /// It runs to the next event.
    StepInto,
    /// It runs to the end of the stage that begins here, or that this is in; after a stage, to the next event.
    StepOver,
    /// It runs to the end of the surrounding stage.
    StepOut,
    /// It runs to the next breakpoint, or to the end.
    Running,
}

/// A command of the session to its run.
pub(super) enum Command {
    /// Continue in this mode, or pause.
    Go(RunMode),
    /// Stop at these breakpoints from now on.
    Breakpoints(Breakpoints),
    /// End the run.
    Cancel,
}

/// The session's handle on the run.
pub(super) struct Control {
    commands: Sender<Command>,
    /// Raised with every command, so that a run without events notices it too.
    attention: Arc<AtomicBool>,
}

impl Control {
    pub(super) fn send(&self, command: Command) {
        // Fails only if the worker has ended.
        let _ = self.commands.send(command);
        self.attention.store(true, Ordering::Release);
    }
}

/// The worker's side: forwards every event, obeys commands and pauses.
pub(super) struct PausingObserver {
    commands: Receiver<Command>,
    attention: Arc<AtomicBool>,
    outbox: Outbox,
    mode: RunMode,
    breakpoints: Breakpoints,
    is_cancelled: bool,
    /// Where the run pauses next in the current mode.
    pause_at: PauseAt,
    /// The last event, from which a step begins.
    last: Option<Record>,
}

/// Where to pause next, apart from breakpoints.
#[derive(Clone, Copy)]
enum PauseAt {
    NextEvent,
    /// The end of a stage at this depth or further out.
    EndOfStage(usize),
    Never,
}

impl PauseAt {
    /// In a mode that was set after the last event.
    fn new(mode: RunMode, last: Option<&Record>) -> Self {
        match (mode, last) {
            (RunMode::Running, _) => Self::Never,
            (RunMode::StepOver, Some(Record { event, depth, .. }))
                if !matches!(event, Event::StageEnded(_)) =>
            {
                Self::EndOfStage(*depth)
            }
            // At the end of a stage, "out" leaves the surrounding stage.
            (RunMode::StepOut, Some(Record { event: Event::StageEnded(_), depth, .. })) => {
                Self::EndOfStage(depth.saturating_sub(1))
            }
            (RunMode::StepOut, Some(record)) => Self::EndOfStage(record.depth),
            _ => Self::NextEvent,
        }
    }

    fn is_reached(self, record: &Record) -> bool {
        match self {
            Self::NextEvent => true,
            Self::EndOfStage(depth) => {
                matches!(record.event, Event::StageEnded(_)) && record.depth <= depth
            }
            Self::Never => false,
        }
    }
}

impl PausingObserver {
    /// An observer that starts in a mode, and its control.
    pub(super) fn new(mode: RunMode, breakpoints: Breakpoints, outbox: Outbox) -> (Control, Self) {
        let (sender, commands) = channel();
        let attention = Arc::<AtomicBool>::default();
        let control = Control { commands: sender, attention: Arc::clone(&attention) };
        let observer = Self {
            commands,
            attention,
            outbox,
            mode,
            breakpoints,
            is_cancelled: false,
            pause_at: PauseAt::new(mode, None),
            last: None,
        };
        (control, observer)
    }

    /// Ignores that the session is gone: the next event fails then.
    fn change(&self, change: impl FnOnce(&mut Run) + Send + 'static) {
        let _ = self.outbox.change(change);
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Go(mode) => {
                self.mode = mode;
                self.pause_at = PauseAt::new(mode, self.last.as_ref());
            }
            Command::Breakpoints(breakpoints) => self.breakpoints.replace(breakpoints),
            Command::Cancel => self.is_cancelled = true,
        }
    }

    /// Obeys all pending commands.
    fn obey_all(&mut self) -> Result<(), Cancelled> {
        while let Ok(command) = self.commands.try_recv() {
            self.obey(command);
        }
        if self.is_cancelled { Err(Cancelled) } else { Ok(()) }
    }

    /// Waits for a command to continue.
    fn wait(&mut self, breakpoint: Option<String>) -> Result<(), Cancelled> {
        self.outbox.state(RunState::Paused { breakpoint })?;
        let mut goes = false;
        while !goes {
            let command = self.commands.recv().map_err(|_| Cancelled)?;
            goes = matches!(command, Command::Go(mode) if mode != RunMode::Paused);
            self.obey(command);
            if self.is_cancelled {
                return Err(Cancelled);
            }
        }
        self.outbox.state(RunState::Running)
    }
}

impl LocalizeObserver for PausingObserver {
    fn begin_query(&mut self, _index: usize, problems: &[Problem], truth: Option<&Pose>) {
        let loaded = Arc::new(Loaded { problems: problems.to_vec(), truth: truth.copied() });
        self.change(|run| {
            run.loaded = Some(loaded);
            run.state = RunState::Running;
        });
    }

    fn begin_retrieval(&mut self) {
        self.change(|run| run.begin(Part::Retrieval));
    }

    fn choosing(&mut self, looked_at: usize, candidates: usize) {
        self.change(move |run| run.ranking = Some([looked_at, candidates]));
    }

    fn begin_method(&mut self, problem: usize, method: Method) {
        self.change(move |run| run.begin(Part::Reference(method, problem)));
    }

    fn end_method(&mut self, result: &QueryResult, times: &StageTimes) {
        let (result, times) = (result.clone(), times.clone());
        self.change(|run| run.end(result, Some(times)));
    }

    fn begin_fusion(&mut self, method: Method) {
        self.change(move |run| run.begin(Part::Fusion(method)));
    }

    fn end_fusion(&mut self, result: &QueryResult) {
        let result = result.clone();
        self.change(|run| run.end(result, None));
    }

    fn explaining(&mut self, result: &QueryResult, tried: usize, remedies: usize) {
        let method = result.method;
        self.change(move |run| run.go_on_explaining(method, tried, remedies));
    }

    fn explained(&mut self, result: &QueryResult) {
        let result = result.clone();
        self.change(|run| run.explain(result));
    }

    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(Arc::clone(&self.attention))
    }
}

impl Sink for PausingObserver {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        let record_copy = record.clone();
        self.outbox.change(move |run| {
            run.push(record_copy);
            // Either it was resumed, or it reports the pause next.
            run.state = RunState::Running;
        })?;
        // A mode set before this event refers to the previous event.
        self.obey_all()?;
        self.last = Some(record.clone());
        let breakpoint = self.breakpoints.reached(record);
        if breakpoint.is_some() || self.pause_at.is_reached(record) {
            self.wait(breakpoint)?;
        }
        Ok(())
    }

    /// Pauses without waiting for the next event, except before the first one: there would be nothing to show.
    fn attend(&mut self) -> Result<(), Cancelled> {
        self.obey_all()?;
        if self.mode == RunMode::Paused && self.last.is_some() {
            self.wait(None)?;
        }
        Ok(())
    }
}
