//! What a recorded event belongs to: its reference, problem and estimator.

use super::scene::Origin;
use crate::method::Method;
use crate::problem::Problem;

/// What a recorded event belongs to.
pub(super) struct EventContext<'a> {
    /// Position of the reference among those of the query.
    pub(super) reference: usize,
    /// The problem being solved.
    pub(super) problem: &'a Problem,
    /// The estimator that tells; inside the hybrid the one that it runs.
    pub(super) method: Method,
    /// Hypotheses of the estimator in earlier runs: the timeline `eval` goes on where they ended.
    pub(super) evals: i64,
    /// What is drawn at (0, 0, 0).
    pub(super) origin: Origin,
}
