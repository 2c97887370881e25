//! Work without the interpreter's lock: Ctrl-C stops it, and a panic becomes an exception.

use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use posescope::localize::{LocalizeObserver, QueryResult, StageTimes, words_of};
use posescope_core::event::KindSet;
use posescope_core::{Cancelled, Method, Pose, Problem, Record, Sink};
use pyo3::prelude::*;

use crate::errors;

/// How often Ctrl-C is looked for. Work stops within 50 ms of it.
const PATIENCE: Duration = Duration::from_millis(10);

/// Whether the work was asked to stop.
#[derive(Debug, Default)]
pub struct Stop {
    raised: AtomicBool,
    /// Lowered by a trace once it has checked.
    attention: Arc<AtomicBool>,
}

impl Stop {
    /// Asks the work to stop.
    pub fn raise(&self) {
        self.raised.store(true, Ordering::Relaxed);
        self.attention.store(true, Ordering::Relaxed);
    }

    /// The flag that a trace looks at between its steps.
    pub fn attention(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.attention)
    }

    /// Cancels the caller once it was asked to stop.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.raised.load(Ordering::Relaxed) { Err(Cancelled) } else { Ok(()) }
    }
}

/// Does the work on threads of its own, without the interpreter's lock.
///
/// No thread outlives the call, so that a process may be forked after it.
///
/// # Errors
/// What Ctrl-C raises, and `posescope.InternalError` for a panic.
pub fn detached<T: Send>(
    py: Python<'_>,
    threads: Option<NonZeroUsize>,
    work: impl FnOnce(&Stop) -> T + Send,
) -> PyResult<T> {
    detached_with(py, threads, &Stop::default(), |_| Ok(()), work)
}

/// Does the work as [`detached`] does, and calls `tick` in between.
///
/// # Errors
/// Those of [`detached`], and those of `tick`, which stop the work.
pub fn detached_with<T: Send>(
    py: Python<'_>,
    threads: Option<NonZeroUsize>,
    stop: &Stop,
    mut tick: impl FnMut(Python<'_>) -> PyResult<()> + Send,
    work: impl FnOnce(&Stop) -> T + Send,
) -> PyResult<T> {
    let in_pool = || {
        let threads = threads.or_else(|| thread::available_parallelism().ok());
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.map_or(1, NonZeroUsize::get))
            .build()
            .map_err(|error| error.to_string())?;
        let caught = pool.install(|| {
            catch_unwind(AssertUnwindSafe(|| work(stop)))
                .map_err(|panic| (words_of(panic.as_ref()), errors::place_of_panic()))
        });
        caught.map_err(|(words, place)| format!("{words} ({place})"))
    };
    let mut interrupted = None;
    let outcome = py.detach(|| {
        thread::scope(|scope| {
            let (done, finished) = sync_channel::<()>(0);
            let worker = scope.spawn(move || {
                let outcome = in_pool();
                drop(done);
                outcome
            });
            while finished.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                if interrupted.is_none()
                    && let Err(raised) =
                        Python::attach(|py| py.check_signals().and_then(|()| tick(py)))
                {
                    interrupted = Some(raised);
                    stop.raise();
                }
            }
            worker.join().unwrap_or_else(|panic| Err(words_of(panic.as_ref())))
        })
    });
    match interrupted {
        Some(raised) => Err(raised),
        None => outcome.map_err(|words| errors::internal(&words)),
    }
}

/// Panics, to test what becomes of a panic.
#[pyfunction]
pub fn panic(py: Python<'_>) -> PyResult<()> {
    detached(py, None, |_| unreachable!("a panic on purpose"))
}

/// An observer that is stopped by Ctrl-C.
pub struct Stoppable<'a, O> {
    /// The observer.
    pub observer: &'a mut O,
    /// Whether to stop.
    pub stop: &'a Stop,
}

impl<O: LocalizeObserver> Sink for Stoppable<'_, O> {
    fn wanted(&self) -> KindSet {
        self.observer.wanted()
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        self.observer.accept(record)?;
        self.stop.check()
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.stop.check()
    }
}

impl<O: LocalizeObserver> LocalizeObserver for Stoppable<'_, O> {
    fn begin_query(&mut self, index: usize, problems: &[Problem], truth: Option<&Pose>) {
        self.observer.begin_query(index, problems, truth);
    }

    fn begin_method(&mut self, problem: usize, method: Method) {
        self.observer.begin_method(problem, method);
    }

    fn end_method(&mut self, result: &QueryResult, times: &StageTimes) {
        self.observer.end_method(result, times);
    }

    fn begin_fusion(&mut self, method: Method) {
        self.observer.begin_fusion(method);
    }

    fn end_fusion(&mut self, result: &QueryResult) {
        self.observer.end_fusion(result);
    }

    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(self.stop.attention())
    }
}
