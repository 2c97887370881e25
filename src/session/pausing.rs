//! Pausing a run between two of its events.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::breakpoint::Breakpoints;
use super::loaded::Loaded;
use super::message::Message;
use super::run::Part;
use crate::event::{Event, StageEnded};
use crate::geometry::Pose;
use crate::localize::{LocalizeObserver, QueryResult, StageTimes};
use crate::method::Method;
use crate::problem::Problem;
use crate::trace::{Cancelled, Record, Sink};

/// How a run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunMode {
    /// It does not: it waits behind the next event, or within a loop that tells nothing.
    Paused,
    /// It runs to the next event.
    StepInto,
    /// It runs behind the stage that begins here, or to the next event.
    StepOver,
    /// It runs to the end of the stage around it.
    StepOut,
    /// It runs to the next breakpoint, or to the end.
    Running,
}

/// What whoever steps through the run holds: the mode, the breakpoints, whether to cancel.
pub(super) struct Control {
    state: Mutex<ControlState>,
    changed: Condvar,
    /// Raised with every change, so that a run without events notices it too.
    pub(super) attention: Arc<AtomicBool>,
}

/// What is asked of the run at present.
struct ControlState {
    mode: RunMode,
    /// Counts the calls of [`Control::set_mode`], so that two equal steps are two.
    mode_changes: u64,
    breakpoints: Breakpoints,
    cancelled: bool,
}

impl Control {
    pub(super) fn new(mode: RunMode, breakpoints: Breakpoints) -> Self {
        Self {
            state: Mutex::new(ControlState {
                mode,
                mode_changes: 0,
                breakpoints,
                cancelled: false,
            }),
            changed: Condvar::new(),
            attention: Arc::new(AtomicBool::new(false)),
        }
    }

    pub(super) fn set_mode(&self, mode: RunMode) {
        let mut state = self.lock();
        state.mode = mode;
        state.mode_changes += 1;
        self.notify(state);
    }

    pub(super) fn set_breakpoints(&self, breakpoints: Breakpoints) {
        let mut state = self.lock();
        state.breakpoints.replace(breakpoints);
        self.notify(state);
    }

    /// The flag is set under the mutex of the condition, or a worker that is about to wait would
    /// miss the call that wakes it.
    pub(super) fn cancel(&self) {
        let mut state = self.lock();
        state.cancelled = true;
        self.notify(state);
    }

    fn notify(&self, state: MutexGuard<'_, ControlState>) {
        self.attention.store(true, Ordering::Release);
        drop(state);
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, ControlState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the worker holds: it passes every event on and waits where the [`Control`] asks it to.
pub(super) struct PausingObserver {
    control: Arc<Control>,
    outbox: Sender<Message>,
    wake: Arc<dyn Fn() + Send + Sync>,
    /// Where the run waits next in the present mode.
    pause_at: PauseAt,
    /// The change of mode that `pause_at` was made for.
    seen_mode_change: u64,
    /// The event that was passed on last, as the stepping sees it.
    last: Option<EventPosition>,
    begun: Instant,
    /// How long it has waited for somebody.
    waited: Duration,
}

/// Where an event is among the stages.
#[derive(Clone, Copy)]
struct EventPosition {
    depth: usize,
    boundary: StageBoundary,
}

/// Whether an event begins a stage, ends one, or is inside.
#[derive(Clone, Copy, PartialEq)]
enum StageBoundary {
    StageStarts,
    StageEnds,
    Inside,
}

/// When to wait next, breakpoints aside.
#[derive(Clone, Copy, PartialEq)]
enum PauseAt {
    NextEvent,
    /// The end of a stage at this depth or further out.
    EndOfStage(usize),
    Never,
}

impl EventPosition {
    fn of(record: &Record) -> Self {
        Self {
            depth: record.depth,
            boundary: match record.event {
                Event::StageStarted(_) => StageBoundary::StageStarts,
                Event::StageEnded(_) => StageBoundary::StageEnds,
                _ => StageBoundary::Inside,
            },
        }
    }
}

impl PauseAt {
    /// `from` is where the run stands when it is told to go on; `None` before the first event.
    fn new(mode: RunMode, from: Option<EventPosition>) -> Self {
        match (mode, from) {
            (RunMode::Running, _) => Self::Never,
            (RunMode::Paused | RunMode::StepInto, _) | (_, None) => Self::NextEvent,
            (RunMode::StepOver, Some(position)) => match position.boundary {
                StageBoundary::StageStarts => Self::EndOfStage(position.depth),
                StageBoundary::StageEnds | StageBoundary::Inside => Self::NextEvent,
            },
            (RunMode::StepOut, Some(position)) => match position.boundary {
                // Whoever stands at the end of a stage wants out of the one around it.
                StageBoundary::StageEnds => Self::EndOfStage(position.depth.saturating_sub(1)),
                StageBoundary::StageStarts | StageBoundary::Inside => {
                    Self::EndOfStage(position.depth)
                }
            },
        }
    }

    fn is_reached(self, record: &Record) -> bool {
        match self {
            Self::NextEvent => true,
            Self::EndOfStage(depth) => {
                matches!(record.event, Event::StageEnded(StageEnded { .. }))
                    && record.depth <= depth
            }
            Self::Never => false,
        }
    }
}

impl PausingObserver {
    pub(super) fn new(
        control: Arc<Control>,
        outbox: Sender<Message>,
        wake: Arc<dyn Fn() + Send + Sync>,
    ) -> Self {
        let (mode, seen_mode_change) = {
            let state = control.lock();
            (state.mode, state.mode_changes)
        };
        Self {
            control,
            outbox,
            wake,
            pause_at: PauseAt::new(mode, None),
            seen_mode_change,
            last: None,
            begun: Instant::now(),
            waited: Duration::ZERO,
        }
    }

    /// Sends to the session. A session that is gone has cancelled.
    pub(super) fn send(&self, message: Message) -> Result<(), Cancelled> {
        self.outbox.send(message).map_err(|_| Cancelled)?;
        (self.wake)();
        Ok(())
    }

    /// How long the run has worked, without the time it waited for somebody.
    fn worked(&self) -> Duration {
        self.begun.elapsed().saturating_sub(self.waited)
    }

    /// Waits for a mode to go on in. To pause is none.
    fn wait(&mut self) -> Result<(), Cancelled> {
        let since = Instant::now();
        let answer = self.wait_for_mode();
        self.waited += since.elapsed();
        answer
    }

    fn wait_for_mode(&mut self) -> Result<(), Cancelled> {
        let control = Arc::clone(&self.control);
        let mut state = control.lock();
        while !state.cancelled
            && (state.mode_changes == self.seen_mode_change || state.mode == RunMode::Paused)
        {
            state = control
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        if state.cancelled {
            return Err(Cancelled);
        }
        self.take_over_mode(&state);
        Ok(())
    }

    /// Takes over a new mode, if one was set.
    fn take_over_mode(&mut self, state: &ControlState) {
        if state.mode_changes != self.seen_mode_change {
            self.seen_mode_change = state.mode_changes;
            self.pause_at = PauseAt::new(state.mode, self.last);
        }
    }
}

/// Nobody to tell means that the session was dropped, which the next event answers.
impl LocalizeObserver for PausingObserver {
    fn begin_query(&mut self, _index: usize, problems: &[Problem], truth: Option<&Pose>) {
        let loaded = Loaded {
            problems: problems.to_vec(),
            truth: truth.copied(),
        };
        let _ = self.send(Message::Loaded(Arc::new(loaded)));
    }

    fn begin_retrieval(&mut self) {
        let _ = self.send(Message::Began(Part::Retrieval));
    }

    fn choosing(&mut self, looked_at: usize, candidates: usize) {
        let _ = self.send(Message::Ranking {
            looked_at,
            candidates,
        });
    }

    fn begin_method(&mut self, problem: usize, method: Method) {
        let _ = self.send(Message::Began(Part::Reference(method, problem)));
    }

    fn end_method(&mut self, result: &QueryResult, times: &StageTimes) {
        let _ = self.send(Message::Ended {
            result: Box::new(result.clone()),
            times: Some(times.clone()),
        });
    }

    fn begin_fusion(&mut self, method: Method) {
        let _ = self.send(Message::Began(Part::Fusion(method)));
    }

    fn end_fusion(&mut self, result: &QueryResult) {
        let _ = self.send(Message::Ended {
            result: Box::new(result.clone()),
            times: None,
        });
    }

    fn explaining(&mut self, result: &QueryResult, tried: usize, remedies: usize) {
        let _ = self.send(Message::Explaining {
            method: result.method,
            tried,
            remedies,
        });
    }

    fn explained(&mut self, result: &QueryResult) {
        let _ = self.send(Message::Explained(Box::new(result.clone())));
    }

    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(Arc::clone(&self.control.attention))
    }
}

impl Sink for PausingObserver {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        self.send(Message::Told(Box::new(record.clone()), self.worked()))?;
        let breakpoint = {
            let control = Arc::clone(&self.control);
            let mut state = control.lock();
            // A mode that was set before this event starts from the event before it.
            self.take_over_mode(&state);
            self.last = Some(EventPosition::of(record));
            if state.cancelled {
                return Err(Cancelled);
            }
            state.breakpoints.reached(record)
        };
        if breakpoint.is_none() && !self.pause_at.is_reached(record) {
            return Ok(());
        }
        self.send(Message::Waits { breakpoint })?;
        self.wait()?;
        self.send(Message::Goes)
    }

    /// A run that was told to pause need not come to its next event first. One that told nothing yet
    /// does, so that there is something to look at.
    fn attend(&mut self) -> Result<(), Cancelled> {
        let control = Arc::clone(&self.control);
        let is_paused = {
            let state = control.lock();
            if state.cancelled {
                return Err(Cancelled);
            }
            self.take_over_mode(&state);
            state.mode == RunMode::Paused
        };
        if is_paused && self.last.is_some() {
            self.send(Message::Waits { breakpoint: None })?;
            self.wait()?;
            self.send(Message::Goes)?;
        }
        Ok(())
    }
}
