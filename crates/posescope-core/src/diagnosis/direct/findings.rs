//! What is found out about one search is the same for whoever ended in it: a hybrid that fell back to a
//! direct method, and that method itself.

use std::sync::Arc;

use super::{Place, SearchedCost};
use crate::descent::DescentParams;
use crate::diagnosis::{Diagnosis, trust};
use crate::estimator;
use crate::geometry::Pose;
use crate::grid::{GridParams, Offset};
use crate::memo::{Exact, Key, MemoId, Remembered};
use crate::render::RenderParams;

/// What does not depend on who asks.
pub(super) struct Findings {
    /// The best pose near the truth that the search could have reached.
    pub near: Option<Place>,
    /// Another camera explains the query better.
    pub camera: Option<Diagnosis>,
    /// What made the search end in the wrong place.
    pub causes: Vec<Diagnosis>,
}

impl Remembered for Findings {
    fn heap_bytes(&self) -> usize {
        /// A sentence and a few numbers with their names.
        const OF_A_VERDICT: usize = 1 << 10;
        (self.causes.len() + usize::from(self.camera.is_some())) * OF_A_VERDICT
    }
}

/// What findings depend on beside the query.
#[derive(PartialEq, Eq, Hash)]
struct FindingsKey {
    reference: MemoId,
    cost: Key,
    render: Exact<RenderParams>,
    grid: Exact<GridParams>,
    descent: Exact<DescentParams>,
    /// Radius, tolerance, least coverage, and costs of the result.
    numbers: Exact<[f64]>,
    truth: Exact<Pose>,
    /// The result.
    place: Exact<Offset>,
    seed: u64,
}

impl SearchedCost<'_, '_> {
    /// The findings about this search, remembered with the query or made now.
    pub(super) fn recalled(&self, make: impl FnOnce() -> Findings) -> Arc<Findings> {
        match self.key() {
            Some(key) => self.subject.problem.query.memo.recall(key, make).value,
            None => Arc::new(make()),
        }
    }

    /// `None` where nothing is remembered of the reference, or of a cost that is not registered.
    fn key(&self) -> Option<FindingsKey> {
        let subject = self.subject;
        let (problem, params) = (subject.problem, subject.params);
        let responsible = trust::responsible(subject.method, subject.outcome);
        let entry = estimator::find(responsible)?.cost()?;
        let numbers = [
            problem.uncertainty_radius_m,
            subject.tolerance.translation_m,
            subject.tolerance.rotation_deg,
            f64::from(self.least_covered()),
            self.summary.best,
            self.summary.shuffled.unwrap_or(f64::NAN),
        ];
        Some(FindingsKey {
            reference: problem.reference.memo.id()?,
            cost: Key::new((entry.name, params.costs.of(entry)?.key())),
            render: Exact::of(&params.render),
            grid: Exact::of(&params.grid),
            descent: Exact::of(&params.descent),
            numbers: Exact::of(numbers.as_slice()),
            truth: Exact::of(&self.truth),
            place: Exact::of(&self.minimum.offset),
            seed: problem.random_seed("shuffled truth"),
        })
    }
}
