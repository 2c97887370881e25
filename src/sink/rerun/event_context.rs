//! The context of a recorded event: its reference, problem and estimator.

use super::scene::Origin;
use crate::method::Method;
use crate::problem::Problem;

/// The context of a recorded event.
pub(super) struct EventContext<'a> {
    /// The position of the reference among those of the query.
    pub(super) reference: usize,
    /// The problem being solved.
    pub(super) problem: &'a Problem,
    /// The emitting estimator; inside a hybrid, the one that it runs.
    pub(super) method: Method,
    /// The estimator's hypotheses in earlier runs, after which the timeline `eval` continues.
    pub(super) evals: i64,
    /// The place drawn at (0, 0, 0).
    pub(super) origin: Origin,
}
