//! Holding a run back between two events.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::breakpoint::Breakpoints;
use super::loaded::Loaded;
use super::message::Message;
use super::run::Part;
use crate::event::{Event, StageEnded};
use crate::geometry::Pose;
use crate::localize::{QueryResult, StageTimes, Watch};
use crate::method::Method;
use crate::problem::Problem;
use crate::trace::{Cancelled, Record, Sink};

/// How a run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunMode {
    /// Not at all: it waits behind the next event, or within a loop that tells nothing.
    Paused,
    /// To the next event.
    StepInto,
    /// Behind the stage that begins here, or to the next event.
    StepOver,
    /// To the end of the stage around it.
    StepOut,
    /// To the next breakpoint, or to the end.
    Running,
}

/// The watcher's end: what is wanted of the run.
pub(super) struct Control {
    wishes: Mutex<Wishes>,
    changed: Condvar,
    /// Raised with every change, so that a run without events notices it too.
    pub(super) attention: Arc<AtomicBool>,
}

struct Wishes {
    mode: RunMode,
    /// Counts the calls of [`Control::set_mode`], so that two equal steps are two.
    orders: u64,
    breakpoints: Breakpoints,
    cancelled: bool,
}

impl Control {
    pub(super) fn new(mode: RunMode, breakpoints: Breakpoints) -> Self {
        Self {
            wishes: Mutex::new(Wishes {
                mode,
                orders: 0,
                breakpoints,
                cancelled: false,
            }),
            changed: Condvar::new(),
            attention: Arc::new(AtomicBool::new(false)),
        }
    }

    pub(super) fn set_mode(&self, mode: RunMode) {
        let mut wishes = self.wishes();
        wishes.mode = mode;
        wishes.orders += 1;
        self.tell(wishes);
    }

    pub(super) fn set_breakpoints(&self, breakpoints: Breakpoints) {
        let mut wishes = self.wishes();
        wishes.breakpoints.replace(breakpoints);
        self.tell(wishes);
    }

    /// The flag is set under the mutex of the condition, or a worker that is about to wait would
    /// miss the call that wakes it.
    pub(super) fn cancel(&self) {
        let mut wishes = self.wishes();
        wishes.cancelled = true;
        self.tell(wishes);
    }

    fn tell(&self, wishes: MutexGuard<'_, Wishes>) {
        self.attention.store(true, Ordering::Release);
        drop(wishes);
        self.changed.notify_all();
    }

    fn wishes(&self) -> MutexGuard<'_, Wishes> {
        self.wishes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The worker's end: passes every event on and waits where it was asked to.
pub(super) struct Gate {
    control: Arc<Control>,
    outbox: Sender<Message>,
    wake: Arc<dyn Fn() + Send + Sync>,
    /// What the present order waits for.
    until: Until,
    /// The order that `until` was made for.
    order: u64,
    /// The event that was passed on last, as the stepping sees it.
    last: Option<Place>,
}

/// Where an event is among the stages.
#[derive(Clone, Copy)]
struct Place {
    depth: usize,
    kind: PlaceKind,
}

#[derive(Clone, Copy, PartialEq)]
enum PlaceKind {
    StageStarts,
    StageEnds,
    Inside,
}

/// When to wait next, breakpoints aside.
#[derive(Clone, Copy, PartialEq)]
enum Until {
    NextEvent,
    /// The end of a stage at this depth or further out.
    EndOfStage(usize),
    Never,
}

impl Place {
    fn of(record: &Record) -> Self {
        Self {
            depth: record.depth,
            kind: match record.event {
                Event::StageStarted(_) => PlaceKind::StageStarts,
                Event::StageEnded(_) => PlaceKind::StageEnds,
                _ => PlaceKind::Inside,
            },
        }
    }
}

impl Until {
    /// `from` is where the run stands when it is told to go on; `None` before the first event.
    fn new(mode: RunMode, from: Option<Place>) -> Self {
        match (mode, from) {
            (RunMode::Running, _) => Self::Never,
            (RunMode::Paused | RunMode::StepInto, _) | (_, None) => Self::NextEvent,
            (RunMode::StepOver, Some(place)) => match place.kind {
                PlaceKind::StageStarts => Self::EndOfStage(place.depth),
                PlaceKind::StageEnds | PlaceKind::Inside => Self::NextEvent,
            },
            (RunMode::StepOut, Some(place)) => match place.kind {
                // Whoever stands at the end of a stage wants out of the one around it.
                PlaceKind::StageEnds => Self::EndOfStage(place.depth.saturating_sub(1)),
                PlaceKind::StageStarts | PlaceKind::Inside => Self::EndOfStage(place.depth),
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

impl Gate {
    pub(super) fn new(
        control: Arc<Control>,
        outbox: Sender<Message>,
        wake: Arc<dyn Fn() + Send + Sync>,
    ) -> Self {
        let (mode, order) = {
            let wishes = control.wishes();
            (wishes.mode, wishes.orders)
        };
        Self {
            control,
            outbox,
            wake,
            until: Until::new(mode, None),
            order,
            last: None,
        }
    }

    /// Tells the watcher. A watcher who is gone has cancelled.
    pub(super) fn tell(&self, message: Message) -> Result<(), Cancelled> {
        self.outbox.send(message).map_err(|_| Cancelled)?;
        (self.wake)();
        Ok(())
    }

    /// Waits for an order to go on. To pause is none.
    fn wait(&mut self) -> Result<(), Cancelled> {
        let control = Arc::clone(&self.control);
        let mut wishes = control.wishes();
        while !wishes.cancelled && (wishes.orders == self.order || wishes.mode == RunMode::Paused) {
            wishes = control
                .changed
                .wait(wishes)
                .unwrap_or_else(PoisonError::into_inner);
        }
        if wishes.cancelled {
            return Err(Cancelled);
        }
        self.listen(&wishes);
        Ok(())
    }

    /// Takes over a new order, if there is one.
    fn listen(&mut self, wishes: &Wishes) {
        if wishes.orders != self.order {
            self.order = wishes.orders;
            self.until = Until::new(wishes.mode, self.last);
        }
    }
}

/// Nobody to tell means that the session was dropped, which the next event answers.
impl Watch for Gate {
    fn begin_query(&mut self, _index: usize, problems: &[Problem], truth: Option<&Pose>) {
        let loaded = Loaded {
            problems: problems.to_vec(),
            truth: truth.copied(),
        };
        let _ = self.tell(Message::Loaded(Arc::new(loaded)));
    }

    fn begin_retrieval(&mut self) {
        let _ = self.tell(Message::Began(Part::Retrieval));
    }

    fn begin_method(&mut self, problem: usize, method: Method) {
        let _ = self.tell(Message::Began(Part::Reference(method, problem)));
    }

    fn end_method(&mut self, result: &QueryResult, times: &StageTimes) {
        let _ = self.tell(Message::Ended {
            result: Box::new(result.clone()),
            times: Some(times.clone()),
        });
    }

    fn begin_fusion(&mut self, method: Method) {
        let _ = self.tell(Message::Began(Part::Fusion(method)));
    }

    fn end_fusion(&mut self, result: &QueryResult) {
        let _ = self.tell(Message::Ended {
            result: Box::new(result.clone()),
            times: None,
        });
    }

    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(Arc::clone(&self.control.attention))
    }
}

impl Sink for Gate {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        self.tell(Message::Told(Box::new(record.clone())))?;
        let breakpoint = {
            let control = Arc::clone(&self.control);
            let mut wishes = control.wishes();
            // An order that came before this event starts from the event before it.
            self.listen(&wishes);
            self.last = Some(Place::of(record));
            if wishes.cancelled {
                return Err(Cancelled);
            }
            wishes.breakpoints.reached(record)
        };
        if breakpoint.is_none() && !self.until.is_reached(record) {
            return Ok(());
        }
        self.tell(Message::Waits { breakpoint })?;
        self.wait()?;
        self.tell(Message::Goes)
    }

    /// A run that was told to pause need not come to its next event first. One that told nothing yet
    /// does, so that there is something to look at.
    fn attend(&mut self) -> Result<(), Cancelled> {
        let control = Arc::clone(&self.control);
        let is_paused = {
            let wishes = control.wishes();
            if wishes.cancelled {
                return Err(Cancelled);
            }
            self.listen(&wishes);
            wishes.mode == RunMode::Paused
        };
        if is_paused && self.last.is_some() {
            self.tell(Message::Waits { breakpoint: None })?;
            self.wait()?;
            self.tell(Message::Goes)?;
        }
        Ok(())
    }
}
