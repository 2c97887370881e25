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

    /// References are being chosen by appearance; `looked_at` counts the candidates up to the present one.
    fn choosing(&mut self, looked_at: usize, candidates: usize) {
        let _ = (looked_at, candidates);
    }

    /// The ranking of the references comes next.
    fn begin_retrieval(&mut self) {}

    /// A method begins on one of the problems; its events go to [`Sink::accept`].
    fn begin_method(&mut self, problem: usize, method: Method) {
        let _ = (problem, method);
    }

    /// The method's result, and how long its stages took.
    fn end_method(&mut self, result: &QueryResult, times: &StageTimes) {
        let _ = (result, times);
    }

    /// A method's poses for several problems are fused next.
    fn begin_fusion(&mut self, method: Method) {
        let _ = method;
    }

    /// The fused result.
    fn end_fusion(&mut self, result: &QueryResult) {
        let _ = result;
    }

    /// Remedies for a wrong result are being tried. They emit no events.
    fn explaining(&mut self, result: &QueryResult, tried: usize, remedies: usize) {
        let _ = (result, tried, remedies);
    }

    /// The result once more, now with what would have helped.
    fn explained(&mut self, result: &QueryResult) {
        let _ = result;
    }

    /// A flag that asks for a call of [`Sink::attend`] even without an event.
    fn attention(&self) -> Option<Arc<AtomicBool>> {
        None
    }
}

/// Calls [`Sink::attend`] if the flag is up, between steps without events.
pub(super) fn checkpoint(observer: &mut dyn LocalizeObserver) -> Result<(), Cancelled> {
    let attention = observer.attention();
    Trace::watched(observer, attention.as_deref()).checkpoint()
}

/// An observer that ignores everything.
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
