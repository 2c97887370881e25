//! Which estimators were recorded: a hybrid repeats what its parts did.

use std::collections::BTreeSet;

use crate::estimator;
use crate::method::Method;

/// The estimators of a query that were recorded, by reference.
#[derive(Default)]
pub(super) struct Recorded(BTreeSet<(usize, Method)>);

impl Recorded {
    /// Notes that an estimator began. Returns whether it is the first time.
    pub(super) fn insert(&mut self, reference: usize, method: Method) -> bool {
        self.0.insert((reference, method))
    }

    /// Whether a method is a hybrid of which both parts were recorded before.
    pub(super) fn are_all_of(&self, reference: usize, method: Method) -> bool {
        let was_recorded = |method| self.0.contains(&(reference, method));
        let parts = estimator::find(method).and_then(|entry| entry.hybrid());
        parts.is_some_and(|parts| was_recorded(parts.first) && was_recorded(parts.second))
    }
}
