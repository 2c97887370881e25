//! One query against one reference, or against several at once.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::diagnosis::{Evidence, Subject, confidence};
use crate::estimator::{self, Estimator, Failure, JointReference, Outcome, estimate_jointly};
use crate::fusion::Share;
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::trace::{Cancelled, Trace};

/// Localises the query of a problem. A query without a pose is an outcome too, which says why.
///
/// The answer depends on the problem, the method and the parameters, never on the number of threads.
/// A method that this crate does not have gives a [`Failure::UnknownMethod`], and a parameter outside its range a
/// [`Failure::Parameter`]. To run your own estimator or cost, call [`localize_by`].
pub fn localize(problem: &Problem, method: Method, params: &Params) -> Outcome {
    localize_traced(problem, method, params, &mut Trace::off())
        .unwrap_or_else(|Cancelled| unreachable!("a trace that is off cancels nothing"))
}

/// Localises as [`localize`] does, and emits every decision to a trace, which does not change the answer.
///
/// # Errors
/// [`Cancelled`] when a sink asks the run to stop.
pub fn localize_traced(
    problem: &Problem,
    method: Method,
    params: &Params,
    trace: &mut Trace<'_>,
) -> Result<Outcome, Cancelled> {
    let problem = &*problem.prepared();
    let least = estimator::find(method).map_or(0.0, |entry| entry.least_probability(params));
    if least == 0.0 {
        return estimate_traced(problem, method, params, trace);
    }
    let mut evidence = Evidence::default();
    let outcome =
        trace.heard_by(&mut evidence, |trace| estimate_traced(problem, method, params, trace))?;
    let subject = Subject::new(problem, method, params, &outcome, &evidence);
    Ok(confidence::accepted(&subject, None))
}

/// What the method's estimator answers. A pose is not refused yet for a low confidence.
///
/// # Errors
/// [`Cancelled`] when a sink asks the run to stop.
pub(super) fn estimate_traced(
    problem: &Problem,
    method: Method,
    params: &Params,
    trace: &mut Trace<'_>,
) -> Result<Outcome, Cancelled> {
    let Some(entry) = estimator::find(method) else {
        return Ok(Outcome::failed(Failure::unknown(method)));
    };
    match params.check() {
        Ok(()) => localize_by(entry.make(params).as_ref(), problem, trace),
        Err(error) => Ok(Outcome::failed(error.into())),
    }
}

/// Localises with your own estimator, as [`localize_traced`] does. A panic in it is the outcome
/// [`Failure::Internal`].
///
/// # Errors
/// [`Cancelled`] when a sink asks the run to stop.
pub fn localize_by(
    estimator: &dyn Estimator,
    problem: &Problem,
    trace: &mut Trace<'_>,
) -> Result<Outcome, Cancelled> {
    caught(|| estimator.estimate(&problem.prepared(), trace))
        .unwrap_or_else(|failure| Ok(Outcome::failed(failure)))
}

/// Localises one query against several references at once. Returns the share of each in the pose too. A
/// method that takes one at a time fails with [`Failure::NotJoint`]; a panic is a [`Failure::Internal`].
///
/// # Errors
/// [`Cancelled`] when a sink asks the run to stop.
pub(super) fn localize_jointly(
    references: &[JointReference<'_>],
    method: Method,
    params: &Params,
    trace: &mut Trace<'_>,
) -> Result<(Result<Pose, Failure>, Vec<Share>), Cancelled> {
    if let Err(error) = params.check() {
        return Ok((Err(error.into()), Vec::new()));
    }
    caught(|| estimate_jointly(method, params, references, trace))
        .unwrap_or_else(|failure| Ok((Err(failure), Vec::new())))
}

/// What is returned, or the failure that a panic is.
fn caught<T>(body: impl FnOnce() -> T) -> Result<T, Failure> {
    catch_unwind(AssertUnwindSafe(body))
        .map_err(|panic| Failure::Internal { message: words_of(panic.as_ref()) })
}

/// What a panic said, on one line.
pub fn words_of(panic: &(dyn Any + Send)) -> String {
    let words = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("a panic without a message");
    words.replace('\n', " ")
}
