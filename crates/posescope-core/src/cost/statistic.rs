//! What decides a cost.

use std::sync::Arc;

use super::lesser_half::{Power, lower_median, mean_of_lesser_half};
use super::{Entropies, IntensityPair, JointHistogram};

/// What of the covered pixels decides a cost, and how.
#[derive(Clone)]
#[non_exhaustive]
pub enum Statistic<'a> {
    /// The joint histogram of both images.
    Histogram {
        /// Bins per axis, as in [`JointHistogram::of`]. Without bins there is no cost.
        bins: usize,
        /// The cost of the entropies of the counts; `None` where they decide nothing.
        cost: fn(&Entropies) -> Option<f64>,
    },
    /// The errors E = (I_Q − I_S)² up to their lower median: the mean of E^power. E is a number of single
    /// precision, as are the values.
    LesserHalf {
        /// Of the errors.
        power: Power,
    },
    /// All pairs, in the order of the synthetic view's pixels; `None` where they decide nothing. Such a cost is
    /// the slowest: the threads draw every view the plain way.
    Pairs(CostOfPairs<'a>),
}

/// The cost of pairs.
pub type CostOfPairs<'a> = Arc<dyn Fn(&[IntensityPair]) -> Option<f64> + Send + Sync + 'a>;

/// What a cost was made of.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Explanation {
    /// Which residuals counted.
    Weights(PhotometricWeights),
    /// How the values of both images fall together.
    JointHistogram(JointHistogram),
}

/// Which kind of [`Explanation`] a cost gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ExplanationKind {
    /// [`Explanation::Weights`].
    Weights,
    /// [`Explanation::JointHistogram`].
    JointHistogram,
}

/// Which pixels the photometric cost counted.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotometricWeights {
    /// The power of E in the weighted mean.
    pub power: Power,
    /// θ, the median of E \[grey values²\].
    pub threshold: f32,
    /// Per pair, whether E ≤ θ.
    pub counted: Vec<bool>,
}

impl<'a> Statistic<'a> {
    /// [`Self::Pairs`] of a function.
    pub fn of_pairs(cost: impl Fn(&[IntensityPair]) -> Option<f64> + Send + Sync + 'a) -> Self {
        Self::Pairs(Arc::new(cost))
    }

    /// The cost of these pairs; `None` where they decide nothing (no pair, constant image).
    pub fn cost(&self, pairs: &[IntensityPair]) -> Option<f64> {
        match self {
            Self::Histogram { bins: 0, .. } => None,
            &Self::Histogram { bins, cost } => cost(&JointHistogram::of(pairs, bins).entropies),
            &Self::LesserHalf { power } => mean_of_lesser_half(&errors(pairs), power),
            Self::Pairs(cost) => cost(pairs),
        }
    }

    /// Whether whole numbers decide the cost, which any processor can count.
    pub fn is_counted(&self) -> bool {
        matches!(self, Self::Histogram { bins: 1.., .. } | Self::LesserHalf { power: Power::One })
    }

    /// How the cost is explained, if it is.
    pub fn explains(&self) -> Option<ExplanationKind> {
        match self {
            Self::Histogram { .. } => Some(ExplanationKind::JointHistogram),
            Self::LesserHalf { .. } => Some(ExplanationKind::Weights),
            Self::Pairs(_) => None,
        }
    }

    /// Why the cost of these pairs is what it is; `None` where there is no cost or nothing to show.
    pub fn explain(&self, pairs: &[IntensityPair]) -> Option<Explanation> {
        match *self {
            Self::Histogram { bins: 0, .. } => None,
            Self::Histogram { bins, cost } => {
                let histogram = JointHistogram::of(pairs, bins);
                cost(&histogram.entropies)?;
                Some(Explanation::JointHistogram(histogram))
            }
            Self::LesserHalf { power } => {
                let errors = errors(pairs);
                let threshold = lower_median(&errors)?;
                let counted = errors.iter().map(|&error| error <= threshold).collect();
                Some(Explanation::Weights(PhotometricWeights { power, threshold, counted }))
            }
            Self::Pairs(_) => None,
        }
    }
}

fn errors(pairs: &[IntensityPair]) -> Vec<f32> {
    pairs.iter().map(IntensityPair::squared_difference).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_without_bins_gives_no_cost() {
        let pairs = [(0.0, 0.0), (255.0, 255.0)]
            .map(|(query, synthetic)| IntensityPair { query, synthetic });
        let of_bins = |bins| Statistic::Histogram { bins, cost: |of| Some(of.joint) };
        let none = of_bins(0);
        assert_eq!(
            (none.cost(&pairs), none.explain(&pairs), none.is_counted()),
            (None, None, false)
        );
        let two = of_bins(2);
        assert_eq!(two.cost(&pairs), Some(2.0_f64.ln()));
        assert!(two.explain(&pairs).is_some() && two.is_counted());
    }
}
