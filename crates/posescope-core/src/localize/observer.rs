//! Observers of queries that are localised.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{QueryResult, StageTimes};
use crate::event::KindSet;
use crate::geometry::Pose;
use crate::method::Method;
use crate::problem::Problem;
use crate::trace::{Cancelled, Record, Sink, Trace};

/// An observer of queries that are localised: a recording, a progress bar, a session.
pub trait LocalizeObserver: Sink {
    /// A query begins, with one problem per reference.
    fn begin_query(&mut self, index: usize, problems: &[Problem], truth: Option<&Pose>) {
        let _ = (index, problems, truth);
    }

    /// References of a query are being chosen by their looks: so many of so many candidates were looked at, or
    /// are now.
    fn choosing(&mut self, looked_at: usize, candidates: usize) {
        let _ = (looked_at, candidates);
    }

    /// How the references were ranked is going to be told.
    fn begin_retrieval(&mut self) {}

    /// A method begins on one of the problems; what it tells goes to [`Sink::accept`].
    fn begin_method(&mut self, problem: usize, method: Method) {
        let _ = (problem, method);
    }

    /// The method's result, and how long its stages took.
    fn end_method(&mut self, result: &QueryResult, times: &StageTimes) {
        let _ = (result, times);
    }

    /// What the method gave for several problems is going to be fused.
    fn begin_fusion(&mut self, method: Method) {
        let _ = method;
    }

    /// The fused result.
    fn end_fusion(&mut self, result: &QueryResult) {
        let _ = result;
    }

    /// A result went wrong, and what would have helped is being looked for: so many of so many
    /// remedies were tried. It tells nothing else.
    fn explaining(&mut self, result: &QueryResult, tried: usize, remedies: usize) {
        let _ = (result, tried, remedies);
    }

    /// A result that was told before, now with what would have helped.
    fn explained(&mut self, result: &QueryResult) {
        let _ = result;
    }

    /// A flag that is raised when [`Sink::attend`] is to be called although nothing was told.
    fn attention(&self) -> Option<Arc<AtomicBool>> {
        None
    }
}

/// Between two steps that tell nothing: calls [`Sink::attend`] where the flag is up.
pub(super) fn checkpoint(observer: &mut dyn LocalizeObserver) -> Result<(), Cancelled> {
    let attention = observer.attention();
    Trace::watched(observer, attention.as_deref()).checkpoint()
}

/// An observer that wants to hear nothing, for queries that nobody watches.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoObserver;

impl Sink for NoObserver {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }
}

impl LocalizeObserver for NoObserver {}
