//! Those who follow queries being localised.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{QueryResult, StageTimes};
use crate::event::KindSet;
use crate::geometry::Pose;
use crate::method::Method;
use crate::problem::Problem;
use crate::trace::{Cancelled, Record, Sink, Trace};

/// Somebody who watches queries being localised: a recording, a progress bar, nobody.
pub trait Watch: Sink {
    /// A query begins, with one problem per reference.
    fn begin_query(&mut self, index: usize, problems: &[Problem], truth: Option<&Pose>) {
        let _ = (index, problems, truth);
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

    /// A flag that is raised when [`Sink::attend`] is to be called although nothing was told.
    fn attention(&self) -> Option<Arc<AtomicBool>> {
        None
    }
}

/// Between two steps that tell nothing: calls [`Sink::attend`] where the flag is up.
pub(super) fn checkpoint(watch: &mut dyn Watch) -> Result<(), Cancelled> {
    let attention = watch.attention();
    match &attention {
        Some(flag) => Trace::watched(watch, flag).checkpoint(),
        None => Ok(()),
    }
}

/// Nobody watches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwatched;

impl Sink for Unwatched {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }
}

impl Watch for Unwatched {}
