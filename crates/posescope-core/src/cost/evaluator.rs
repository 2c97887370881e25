//! How a cost is found for one hypothesis after another.

use super::{Entropies, IntensityPair, JointHistogram};

/// The cost of one hypothesis: of its pairs, of what is made of each, or of their counts.
pub type CostOf<'a, T> = Box<dyn FnMut(&[T]) -> Option<f64> + Send + 'a>;

/// A cost as the grid search asks for it, some ten thousand times in a row: what it needs to know of
/// the pixels, and the cost of that. It keeps its memory from one hypothesis to the next, and answers
/// what [`Cost::evaluate`](super::Cost::evaluate) answers, bit for bit.
pub enum Evaluator<'a> {
    /// The cost looks at every pair.
    Pairs(CostOf<'a, IntensityPair>),
    /// The cost looks at the squared difference of each pair, [`IntensityPair::squared_difference`], in any order.
    SquaredDifferences(CostOf<'a, f32>),
    /// The cost is one of the joint histogram alone.
    Counts {
        /// Bins per axis, as in [`JointHistogram::of`](super::JointHistogram::of).
        bins: usize,
        /// The cost of the counts, `bins` × `bins`; rows are the query's bins.
        cost: CostOf<'a, u32>,
    },
}

impl Evaluator<'_> {
    /// The evaluator of a cost that is made of the entropies of a joint histogram.
    pub fn of_entropies(bins: usize, cost: fn(&Entropies) -> Option<f64>) -> Self {
        Self::Counts { bins, cost: Box::new(move |counts| cost(&Entropies::of(counts, bins))) }
    }

    /// The cost of pairs.
    pub fn cost(&mut self, pairs: &[IntensityPair]) -> Option<f64> {
        match self {
            Self::Pairs(cost) => cost(pairs),
            Self::SquaredDifferences(cost) => {
                let differences = pairs.iter().map(IntensityPair::squared_difference);
                cost(&differences.collect::<Vec<f32>>())
            }
            Self::Counts { bins, cost } => cost(&JointHistogram::of(pairs, *bins).counts),
        }
    }
}
