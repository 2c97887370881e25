//! For posescope's own crates: may change in any version.
//!
//! The contract between an estimator and its observers.
//!
//! An estimator is a straight-line function that emits what it does:
//!
//! ```
//! use posescope_core::event::{Stage, ProjectedCloud};
//! use posescope_core::trace::{Cancelled, Trace};
//!
//! fn estimate(trace: &mut Trace<'_>) -> Result<usize, Cancelled> {
//!     trace.stage(Stage::DepthLift, |trace| {
//!         let in_view = 3;
//!         trace.emit(|| ProjectedCloud { points: 5, in_view })?;
//!         Ok(in_view)
//!     })
//! }
//! assert_eq!(estimate(&mut Trace::off()), Ok(3));
//! ```
//!
//! The closure runs only if a sink wants that kind of event, so building an image inside costs nothing
//! in a run without a sink. A sink may block, which pauses the run, or return [`Cancelled`], which `?`
//! carries out of the estimator. Listening never changes the answer.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use arrayvec::ArrayVec;

use crate::event::{DebugEvent, Event, KindSet, Stage, StageEnded, StageStarted};
use crate::method::Method;

/// The observer asked the run to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the run was cancelled")]
pub struct Cancelled;

/// Estimators within each other that a [`Record`] knows of: a hybrid and its part are two.
const MAX_METHODS: usize = 3;

/// The estimators that run within each other, the outermost first.
pub type OpenMethods = ArrayVec<Method, MAX_METHODS>;

/// One event with its place in the run.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Record {
    /// Position among the events of the run, from 0. Events that no sink wants count too, except those that a run emits
    /// only if a sink wants them: what an earlier run has computed already, and pictures beside the search.
    pub index: u64,
    /// How many stages are open around the event; a stage's own start and end count it.
    pub depth: usize,
    /// The estimators whose stages are open; an estimator's own start and end count it.
    #[serde(skip)]
    pub methods: OpenMethods,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}

/// An observer of a run.
pub trait Sink: Send {
    /// The kinds of event this sink wants now. Stage events come in any case.
    ///
    /// Asked at the start, and again whenever the run attends to its observer.
    fn wanted(&self) -> KindSet {
        KindSet::ALL
    }

    /// Takes one event. May block.
    ///
    /// # Errors
    /// [`Cancelled`] ends the run.
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled>;

    /// Called when the run notices that its attention flag is up.
    ///
    /// # Errors
    /// [`Cancelled`] ends the run.
    fn attend(&mut self) -> Result<(), Cancelled> {
        Ok(())
    }
}

/// What an estimator emits its events to.
pub struct Trace<'a> {
    observer: Option<Observer<'a>>,
}

struct Observer<'a> {
    sink: &'a mut dyn Sink,
    attention: Option<&'a AtomicBool>,
    wanted: KindSet,
    /// The index of the next event.
    next: u64,
    depth: usize,
    methods: OpenMethods,
    /// Whether the innermost open stage used a result of an earlier run.
    reused: bool,
}

impl<'a> Trace<'a> {
    /// No sink, no thread, no allocation.
    pub const fn off() -> Self {
        Self { observer: None }
    }

    /// Every wanted event goes to `sink`, on the caller's thread.
    pub fn to(sink: &'a mut dyn Sink) -> Self {
        Self::watched(sink, None)
    }

    /// A trace as [`Self::to`] makes it. While `attention` is raised, the next event or checkpoint calls
    /// [`Sink::attend`], wanted or not, and lowers the flag.
    pub fn watched(sink: &'a mut dyn Sink, attention: Option<&'a AtomicBool>) -> Self {
        let wanted = sink.wanted();
        Self {
            observer: Some(Observer {
                sink,
                attention,
                wanted,
                next: 0,
                depth: 0,
                methods: OpenMethods::new(),
                reused: false,
            }),
        }
    }

    /// Emits one event, if a sink wants its kind.
    ///
    /// # Errors
    /// [`Cancelled`] when the observer asked the run to stop.
    #[inline]
    pub fn emit<E: DebugEvent>(&mut self, make: impl FnOnce() -> E) -> Result<(), Cancelled> {
        let Some(observer) = &mut self.observer else {
            return Ok(());
        };
        observer.attend_if_asked()?;
        if observer.wanted.contains(E::KIND) {
            observer.deliver(make().into())?;
        } else {
            observer.next += 1;
        }
        Ok(())
    }

    /// Whether a sink wants this kind of event now. For events that are kept to be emitted again;
    /// [`Self::emit`] asks by itself.
    pub fn wants<E: DebugEvent>(&self) -> bool {
        self.observer.as_ref().is_some_and(|observer| observer.wanted.contains(E::KIND))
    }

    /// Lets the observer pause or stop the run in long loops without events.
    ///
    /// # Errors
    /// [`Cancelled`] when the observer asked the run to stop.
    #[inline]
    pub fn checkpoint(&mut self) -> Result<(), Cancelled> {
        match &mut self.observer {
            Some(observer) => observer.attend_if_asked(),
            None => Ok(()),
        }
    }

    /// Says whether the stage's result is from an earlier run.
    pub fn note_reuse(&mut self, reused: bool) {
        if let Some(observer) = &mut self.observer {
            observer.reused = reused;
        }
    }

    /// Runs `body` as a named part of the estimator, which an observer can step over and out of. A panic in `body` ends the
    /// stage and goes on.
    ///
    /// # Errors
    /// The errors of `body`, and [`Cancelled`].
    pub fn stage<T, X: From<Cancelled>>(
        &mut self,
        stage: Stage,
        body: impl FnOnce(&mut Self) -> Result<T, X>,
    ) -> Result<T, X> {
        let Some(observer) = &mut self.observer else {
            return body(self);
        };
        observer.attend_if_asked()?;
        let around = observer.methods.len();
        observer.open_stage(stage);
        // A sink that cancels at the start of a stage has still seen it begin, so it sees it end.
        if let Err(cancelled) = observer.deliver(StageStarted { stage }.into()) {
            let _ = observer.end_stage(stage, false, around);
            return Err(cancelled.into());
        }
        let outcome = catch_unwind(AssertUnwindSafe(|| body(self)));
        let succeeded = matches!(outcome, Ok(Ok(_)));
        let delivered = match &mut self.observer {
            Some(observer) => observer.end_stage(stage, succeeded, around),
            None => Ok(()),
        };
        let outcome = outcome.unwrap_or_else(|panic| resume_unwind(panic));
        if succeeded {
            delivered?;
        }
        outcome
    }

    /// Runs `body` with a second sink, which gets the events that it wants before the trace's own sink.
    ///
    /// # Errors
    /// The errors of `body`.
    pub fn heard_by<T, X>(
        &mut self,
        second: &mut dyn Sink,
        body: impl FnOnce(&mut Trace<'_>) -> Result<T, X>,
    ) -> Result<T, X> {
        let Some(observer) = &mut self.observer else {
            return body(&mut Trace::to(second));
        };
        let mut both = Fanout::new(vec![second, &mut *observer.sink]);
        let mut inner = Trace {
            observer: Some(Observer {
                wanted: both.wanted(),
                sink: &mut both,
                attention: observer.attention,
                next: observer.next,
                depth: observer.depth,
                methods: observer.methods.clone(),
                reused: false,
            }),
        };
        let outcome = catch_unwind(AssertUnwindSafe(|| body(&mut inner)));
        if let Some(inner) = inner.observer {
            observer.next = inner.next;
        }
        // The sink may have been attended to meanwhile.
        observer.wanted = observer.sink.wanted();
        outcome.unwrap_or_else(|panic| resume_unwind(panic))
    }

    /// Runs `body` with a trace of its own, whose events go to `sink` alone. The sink of this trace may still pause or stop
    /// the run.
    ///
    /// # Errors
    /// The errors of `body`.
    pub(crate) fn aside<T, X>(
        &mut self,
        sink: &mut dyn Sink,
        body: impl FnOnce(&mut Trace<'_>) -> Result<T, X>,
    ) -> Result<T, X> {
        let Some(observer) = &mut self.observer else {
            return body(&mut Trace::to(sink));
        };
        let mut quiet = Quiet(&mut *observer.sink);
        let mut both = Fanout::new(vec![sink, &mut quiet]);
        let outcome = body(&mut Trace::watched(&mut both, observer.attention));
        // The sink may have been attended to meanwhile.
        observer.wanted = observer.sink.wanted();
        outcome
    }
}

/// Keeps events from a sink, which may still pause or stop the run.
struct Quiet<'a>(&'a mut dyn Sink);

impl Sink for Quiet<'_> {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.0.attend()
    }
}

/// Passes each event to the sinks that want it, in their order.
pub struct Fanout<'a>(Vec<&'a mut dyn Sink>);

impl<'a> Fanout<'a> {
    /// A fanout to all of these sinks.
    pub fn new(sinks: Vec<&'a mut dyn Sink>) -> Self {
        Self(sinks)
    }
}

impl Sink for Fanout<'_> {
    fn wanted(&self) -> KindSet {
        self.0.iter().fold(KindSet::NONE, |all, sink| all.union(sink.wanted()))
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        let is_stage = matches!(record.event, Event::StageStarted(_) | Event::StageEnded(_));
        for sink in &mut self.0 {
            if is_stage || sink.wanted().contains(record.event.kind()) {
                sink.accept(record)?;
            }
        }
        Ok(())
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.0.iter_mut().try_for_each(|sink| sink.attend())
    }
}

impl Observer<'_> {
    #[inline]
    fn attend_if_asked(&mut self) -> Result<(), Cancelled> {
        match self.attention {
            Some(flag) if flag.load(Ordering::Relaxed) => self.attend(flag),
            _ => Ok(()),
        }
    }

    #[cold]
    fn attend(&mut self, flag: &AtomicBool) -> Result<(), Cancelled> {
        flag.store(false, Ordering::Release);
        self.sink.attend()?;
        self.wanted = self.sink.wanted();
        Ok(())
    }

    fn open_stage(&mut self, stage: Stage) {
        self.depth += 1;
        self.reused = false;
        if let Stage::Estimator(method) = stage {
            // Where there is no room for more, the outer ones stay.
            let _ = self.methods.try_push(method);
        }
    }

    /// Emits the end of the innermost stage, and closes it whatever the sink says. `around` counts the
    /// estimators that are open around it.
    fn end_stage(&mut self, stage: Stage, succeeded: bool, around: usize) -> Result<(), Cancelled> {
        let ended = StageEnded { stage, succeeded, reused: std::mem::take(&mut self.reused) };
        let record = self.next_record(ended.into());
        // First, because a sink may panic.
        self.depth -= 1;
        self.methods.truncate(around);
        self.sink.accept(&record)
    }

    fn deliver(&mut self, event: Event) -> Result<(), Cancelled> {
        let record = self.next_record(event);
        self.sink.accept(&record)
    }

    fn next_record(&mut self, event: Event) -> Record {
        let (index, methods) = (self.next, self.methods.clone());
        self.next += 1;
        Record { index, depth: self.depth, methods, event }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{Kind, ProjectedCloud};

    /// Keeps what it gets; stops the run at event number `stop_at`.
    struct RecordingSink {
        wanted: KindSet,
        records: Vec<Record>,
        stop_at: Option<u64>,
        attended: usize,
    }

    impl RecordingSink {
        fn wanting(wanted: KindSet) -> Self {
            Self { wanted, records: Vec::new(), stop_at: None, attended: 0 }
        }
    }

    impl Sink for RecordingSink {
        fn wanted(&self) -> KindSet {
            self.wanted
        }
        fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
            self.records.push(record.clone());
            if self.stop_at == Some(record.index) { Err(Cancelled) } else { Ok(()) }
        }
        fn attend(&mut self) -> Result<(), Cancelled> {
            self.attended += 1;
            Ok(())
        }
    }

    fn two_stages(trace: &mut Trace<'_>) -> Result<(), Cancelled> {
        trace.stage(Stage::DepthLift, |trace| {
            trace.emit(|| ProjectedCloud { points: 2, in_view: 1 })?;
            trace.stage(Stage::Consensus, |_| Ok(()))
        })
    }

    #[test]
    fn an_unwanted_event_is_not_even_built_but_stages_are_told() {
        let mut sink = RecordingSink::wanting(KindSet::NONE);
        let mut trace = Trace::to(&mut sink);
        trace.emit(|| -> ProjectedCloud { panic!("nobody wants this") }).expect("not cancelled");
        two_stages(&mut trace).expect("not cancelled");
        let depths: Vec<_> = sink.records.iter().map(|r| r.depth).collect();
        assert_eq!(depths, [1, 2, 2, 1]);
    }

    #[test]
    fn a_cancelled_run_still_closes_its_stages() {
        let mut sink = RecordingSink::wanting(KindSet::ALL);
        sink.stop_at = Some(1);
        let outcome = two_stages(&mut Trace::to(&mut sink));
        assert_eq!(outcome, Err(Cancelled));
        let last = sink.records.last().expect("some were told");
        assert!(matches!(
            last.event,
            Event::StageEnded(StageEnded { stage: Stage::DepthLift, succeeded: false, .. })
        ));
    }

    #[test]
    fn a_stage_that_is_cancelled_at_its_first_event_is_closed_too() {
        for stop_at in 0..6 {
            let mut sink = RecordingSink::wanting(KindSet::ALL);
            sink.stop_at = Some(stop_at);
            let _ = two_stages(&mut Trace::to(&mut sink));
            let mut open = Vec::new();
            for record in &sink.records {
                match &record.event {
                    Event::StageStarted(started) => open.push((started.stage, record.depth)),
                    Event::StageEnded(ended) => {
                        assert_eq!(open.pop(), Some((ended.stage, record.depth)), "{stop_at}");
                    }
                    _ => {}
                }
            }
            assert_eq!(open, [], "stopped at {stop_at}");
        }
    }

    #[test]
    fn a_panic_ends_its_stages_and_leaves_the_trace_as_it_was() {
        let panicking = |trace: &mut Trace<'_>| -> Result<(), Cancelled> {
            trace.stage(Stage::Estimator(Method::FB), |trace| {
                trace.stage(Stage::DepthLift, |_| panic!("of the estimator"))
            })
        };
        let mut sink = RecordingSink::wanting(KindSet::ALL);
        let mut second = RecordingSink::wanting(KindSet::ALL);
        let mut trace = Trace::to(&mut sink);
        let panic = catch_unwind(AssertUnwindSafe(|| trace.heard_by(&mut second, panicking)));
        let words = panic.expect_err("it panicked").downcast::<&str>().expect("a text");
        assert_eq!(*words, "of the estimator");
        two_stages(&mut trace).expect("not cancelled");
        for sink in [&sink, &second] {
            let ended = sink.records.iter().filter_map(|record| match &record.event {
                Event::StageEnded(ended) => Some((ended.stage, ended.succeeded)),
                _ => None,
            });
            let failed = [(Stage::DepthLift, false), (Stage::Estimator(Method::FB), false)];
            assert_eq!(ended.take(2).collect::<Vec<_>>(), failed);
        }
        let places = sink.records.iter().map(|r| (r.index, r.depth, r.methods.len()));
        let (panicked, after): (Vec<_>, Vec<_>) = places.partition(|place| place.0 < 4);
        assert_eq!(panicked, [(0, 1, 1), (1, 2, 1), (2, 2, 1), (3, 1, 1)]);
        assert_eq!(after, [(4, 1, 0), (5, 1, 0), (6, 2, 0), (7, 2, 0), (8, 1, 0)]);
    }

    #[test]
    fn a_second_sink_hears_what_it_wants_and_the_first_hears_the_same_as_alone() {
        let mut alone = RecordingSink::wanting(KindSet::ALL);
        let told = |trace: &mut Trace<'_>| trace.stage(Stage::Match, two_stages);
        told(&mut Trace::to(&mut alone)).expect("not cancelled");
        let mut first = RecordingSink::wanting(KindSet::ALL);
        let mut second = RecordingSink::wanting(KindSet::of(&[Kind::ProjectedCloud]));
        let mut trace = Trace::to(&mut first);
        trace
            .stage(Stage::Match, |trace| trace.heard_by(&mut second, two_stages))
            .expect("not cancelled");
        let places = |sink: &RecordingSink| {
            let places = sink.records.iter().map(|r| (r.index, r.depth, r.event.kind()));
            places.collect::<Vec<_>>()
        };
        assert_eq!(places(&first), places(&alone));
        assert_eq!(second.records.len(), 5, "four stage events and one that it wants");
        let mut unheard = RecordingSink::wanting(KindSet::ALL);
        Trace::off().heard_by(&mut unheard, two_stages).expect("not cancelled");
        assert_eq!(unheard.records.len(), 5);
    }

    #[test]
    fn raised_attention_reaches_the_sink_once_even_without_a_wanted_event() {
        let mut sink = RecordingSink::wanting(KindSet::NONE);
        let attention = AtomicBool::new(true);
        let mut trace = Trace::watched(&mut sink, Some(&attention));
        for _ in 0..3 {
            trace.checkpoint().expect("not cancelled");
        }
        assert_eq!(sink.attended, 1);
    }

    #[test]
    fn the_number_of_an_event_does_not_depend_on_the_sink() {
        let indices = |wanted, second| {
            let mut sink = RecordingSink::wanting(wanted);
            let mut trace = Trace::to(&mut sink);
            let told = match second {
                Some(wanted) => trace.heard_by(&mut RecordingSink::wanting(wanted), two_stages),
                None => two_stages(&mut trace),
            };
            told.expect("not cancelled");
            two_stages(&mut trace).expect("not cancelled");
            sink.records.iter().map(|r| r.index).collect::<Vec<_>>()
        };
        for second in [None, Some(KindSet::ALL), Some(KindSet::NONE)] {
            assert_eq!(indices(KindSet::ALL, second), [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
            assert_eq!(indices(KindSet::NONE, second), [0, 2, 3, 4, 5, 7, 8, 9]);
        }
    }

    #[test]
    fn a_record_names_the_estimators_around_it() {
        fn nested(trace: &mut Trace<'_>, methods: &[Method]) -> Result<(), Cancelled> {
            match methods {
                [] => two_stages(trace),
                [method, inner @ ..] => {
                    trace.stage(Stage::Estimator(*method), |trace| nested(trace, inner))
                }
            }
        }
        let around = |methods: &[Method]| {
            let mut sink = RecordingSink::wanting(KindSet::NONE);
            let mut trace = Trace::to(&mut sink);
            nested(&mut trace, methods).expect("not cancelled");
            trace
                .stage(Stage::Fuse, |trace| {
                    trace.heard_by(&mut RecordingSink::wanting(KindSet::ALL), |trace| {
                        nested(trace, methods)
                    })
                })
                .expect("not cancelled");
            let depths = sink.records.iter().map(|record| record.methods.len());
            depths.collect::<Vec<_>>()
        };
        let [fb, mi, hy] = [Method::FB, Method::MI, Method::HY];
        let once = [1, 2, 2, 2, 2, 2, 2, 1];
        assert_eq!(around(&[hy, fb]), [&once[..], &[0], &once, &[0]].concat());
        // Those that are deeper than a record knows leave the others as they are.
        let deep = [1, 2, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 2, 1];
        let around = around(&[hy, fb, mi, fb, mi]);
        assert_eq!(around, [&deep[..], &[0], &deep, &[0]].concat());
    }
}
