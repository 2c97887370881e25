//! Scoring many hypotheses on a processor of another kind, such as a graphics card.
//!
//! A [`Device`] does not compute costs. For each hypothesis it answers with whole numbers, a [`Tally`],
//! and both the device and the threads end in the same formula, [`Statistic`]: numbers that are equal give
//! costs that are equal to the last bit. Nothing that is reported depends on that alone. Of every batch
//! some hypotheses are scored on the threads as well, and what a search reports always is
//! ([`ScoredLattice::settle`](crate::grid::ScoredLattice::settle)); a device that disagrees is not asked
//! again.

use std::fmt::Debug;
use std::sync::{Arc, OnceLock};

use super::{ColoredPoint, ProjectionRows, Score};
use crate::cost::{Entropies, LesserHalf, Statistic};
use crate::method::Method;

/// What scores many hypotheses at once, beside the threads of the processor. Which results it gives must
/// not depend on it.
pub trait Device: Send + Sync + Debug {
    /// The batch size for a number of hypotheses. `None` if the processor should score them: there are too few, or
    /// the device is missing or lost.
    fn batch(&self, hypotheses: usize) -> Option<usize>;

    /// Loads the common data of all hypotheses of a query; `None` if they do not fit into the device.
    fn load(&self, workload: &Workload<'_>) -> Option<Box<dyn Loaded>>;

    /// The device's numbers differ from the processor's: it must not be used again.
    fn distrust(&self);

    /// Warns, if the device was requested, that a method does not use it. `why` completes the sentence "METHOD …".
    fn left_out(&self, method: Method, why: &str);
}

/// The common data of all hypotheses of a query, on a device.
pub trait Loaded: Send + Sync {
    /// The tally of each projection in order, or `None` for one that the device cannot decide exactly. `None` as a
    /// whole if the device was lost.
    fn tally(&self, projections: &[ProjectionRows]) -> Option<Vec<Option<Tally>>>;
}

/// What all hypotheses of a query have in common.
#[derive(Clone, Copy)]
pub struct Workload<'a> {
    /// The points in the reference camera. Of two at the same depth in a pixel the first is seen.
    pub points: &'a [ColoredPoint],
    /// The query, row by row, in the cost's channel: 0 … 255.
    pub query: &'a [f32],
    /// Columns of the query \[px\].
    pub width: u32,
    /// Rows of the query \[px\].
    pub height: u32,
    /// Each point covers all pixels that are at most as many columns and rows from its own \[px\].
    pub reach: u32,
    /// What decides the cost of the pixels that are covered: whole numbers.
    pub statistic: &'a Statistic<'a>,
}

/// What the covered pixels of a hypothesis come to.
#[derive(Clone, Debug, PartialEq)]
pub enum Tally {
    /// The joint histogram: bins × bins counts, rows are the query's bins.
    Counts(Vec<u32>),
    /// The errors up to their median.
    LesserHalf {
        /// All covered pixels.
        covered: u32,
        /// Number and sum of the errors that count.
        half: LesserHalf,
    },
}

impl Tally {
    /// What the hypothesis is worth.
    pub(super) fn score(&self, statistic: &Statistic<'_>) -> Score {
        match (self, statistic) {
            (Self::Counts(counts), &Statistic::Histogram { bins, cost }) => {
                Score { cost: cost(&Entropies::of(counts, bins)), covered: counts.iter().sum() }
            }
            (Self::LesserHalf { covered, half }, _) => {
                Score { cost: half.mean(), covered: *covered }
            }
            (Self::Counts(_), _) => Score { cost: None, covered: 0 },
        }
    }
}

/// The device of this process, as the pool of threads is one.
static IN_USE: OnceLock<Arc<dyn Device>> = OnceLock::new();

/// Sets the device that this process scores on if it is worth it. Results do not depend on it. Returns `false` if
/// a device was set before.
pub fn use_device(device: Arc<dyn Device>) -> bool {
    IN_USE.set(device).is_ok()
}

/// The device set by [`use_device`].
pub(super) fn device_in_use() -> Option<Arc<dyn Device>> {
    IN_USE.get().cloned()
}

/// Reports to the device in use that a method does not use it.
pub(crate) fn leave_out(method: Method, why: &str) {
    if let Some(device) = device_in_use() {
        device.left_out(method, why);
    }
}
