//! Scoring many hypotheses on a processor of another kind, such as a graphics card.
//!
//! A [`Device`] does not compute costs. For each hypothesis it answers with whole numbers, a [`Tally`],
//! and both the device and the threads end in the same formula, [`Tallying`]: numbers that are equal give
//! costs that are equal to the last bit. Nothing that is reported depends on that alone. Of every batch
//! some hypotheses are scored on the threads as well, and what a search reports always is
//! ([`ScoredLattice::settle`](crate::grid::ScoredLattice::settle)); a device that disagrees is not asked
//! again.

use std::fmt::Debug;
use std::sync::{Arc, OnceLock};

use super::{ColoredPoint, ProjectionRows, Score};
use crate::cost::{Entropies, LesserHalf, Tallying};
use crate::method::Method;

/// What scores many hypotheses at once, beside the threads of the processor. Which results it gives must
/// not depend on it.
pub trait Device: Send + Sync + Debug {
    /// How many of so many hypotheses to hand over at a time; `None` where the threads are to score them:
    /// they are too few to be worth it, or there is no such device (any more).
    fn batch(&self, hypotheses: usize) -> Option<usize>;

    /// Takes over what all hypotheses of a query have in common; `None` where that is more than the device
    /// can take.
    fn load(&self, workload: &Workload<'_>) -> Option<Box<dyn Loaded>>;

    /// The device's numbers were not those of the threads: it is not to be asked again.
    fn distrust(&self);

    /// A method scores its hypotheses on the threads, whatever the device could do; `why` goes on after its
    /// name. To be said where somebody asked for the device.
    fn left_out(&self, method: Method, why: &str);
}

/// What all hypotheses of a query have in common, on a device.
pub trait Loaded: Send + Sync {
    /// A tally for each projection, in their order, and `None` for one that the device cannot decide
    /// exactly; `None` for all where the device was lost.
    fn tally(&self, projections: &[ProjectionRows]) -> Option<Vec<Option<Tally>>>;
}

/// What all hypotheses of a query have in common.
#[derive(Clone, Copy, Debug)]
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
    /// What is wanted of the pixels that are covered.
    pub tallying: Tallying,
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
    pub(super) fn score(&self, tallying: &Tallying) -> Score {
        match (self, *tallying) {
            (Self::Counts(counts), Tallying::Counts { bins, cost }) => Score {
                cost: cost(&Entropies::of(counts, bins)),
                covered: counts.iter().sum(),
            },
            (Self::LesserHalf { covered, half }, _) => Score {
                cost: half.mean(),
                covered: *covered,
            },
            (Self::Counts(_), Tallying::LesserHalf) => Score {
                cost: None,
                covered: 0,
            },
        }
    }
}

/// The device of this process, as the pool of threads is one.
static IN_USE: OnceLock<Arc<dyn Device>> = OnceLock::new();

/// Has everybody in this process score on this device where that is worth it. Results do not depend on it.
/// `false` where another was named before.
pub fn use_device(device: Arc<dyn Device>) -> bool {
    IN_USE.set(device).is_ok()
}

/// The device that [`use_device`] named.
pub(super) fn device_in_use() -> Option<Arc<dyn Device>> {
    IN_USE.get().cloned()
}

/// Tells the device in use that a method does without it.
pub(crate) fn leave_out(method: Method, why: &str) {
    if let Some(device) = device_in_use() {
        device.left_out(method, why);
    }
}
