//! Costs of the direct methods: how badly a synthetic view fits the query. Lower is better, always.
//!
//! A cost compares grey values pixel by pixel where the synthetic view exists. It knows no pose and
//! no image. What is too little to judge has no cost, which is not the same as a high one.
//!
//! A new cost is one file, its `mod` line and its entry in [`ALL`].

mod mutual_information;
mod photometric;

pub use mutual_information::{JointHistogram, MutualInformation, MutualInformationParams};
pub use photometric::{Photometric, PhotometricParams, PhotometricWeights};

use crate::params::Params;

/// What the query and the synthetic view show at one covered pixel, each 0 … 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntensityPair {
    /// The (smoothed) query I_Q.
    pub query: f32,
    /// The synthetic view I_S.
    pub synthetic: f32,
}

/// A robust dissimilarity of two images over the pixels they share.
pub trait Cost: Send + Sync {
    /// Standard deviation of the Gaussian that smooths the query beforehand \[px\].
    fn query_smoothing_px(&self) -> f64;

    /// The cost over the pairs; `None` where they decide nothing (no pair, constant image).
    fn evaluate(&self, pairs: &[IntensityPair]) -> Option<f64>;

    /// Why the cost of these pairs is what it is; `None` where there is no cost.
    fn explain(&self, pairs: &[IntensityPair]) -> Option<Explanation>;
}

/// What a cost was made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Explanation {
    /// Which residuals counted.
    Photometric(PhotometricWeights),
    /// How the grey values of both images fall together.
    MutualInformation(JointHistogram),
}

/// A cost's place in the registry.
pub struct Entry {
    /// Short name.
    pub name: &'static str,
    /// One phrase.
    pub about: &'static str,
    /// Makes the cost from the parameters.
    pub new: fn(&Params) -> Box<dyn Cost>,
}

/// Every cost.
pub const ALL: &[Entry] = &[
    Entry {
        name: "photometric",
        about: "squared difference of grey values, the worse half ignored",
        new: |params| Box::new(Photometric::new(&params.pm)),
    },
    Entry {
        name: "mutual_information",
        about: "1 − mutual information normalised by the larger entropy",
        new: |params| Box::new(MutualInformation::new(&params.mi)),
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pairs(values: &[(f32, f32)]) -> Vec<IntensityPair> {
        values
            .iter()
            .map(|&(query, synthetic)| IntensityPair { query, synthetic })
            .collect()
    }

    #[test]
    fn no_pair_has_no_cost() {
        let params = Params::default();
        for entry in ALL {
            let cost = (entry.new)(&params);
            assert_eq!(cost.evaluate(&[]), None, "{}", entry.name);
            assert_eq!(cost.explain(&[]), None, "{}", entry.name);
        }
    }

    #[test]
    fn equal_images_cost_nothing_and_shuffled_ones_much_more() {
        let equal: Vec<_> = (0..4000u32)
            .map(|i| {
                let value = (i.wrapping_mul(2_654_435_761) >> 24) as f32;
                (value, value)
            })
            .collect();
        let shuffled: Vec<_> = (0..equal.len())
            .map(|i| (equal[i].0, equal[(i * 1237 + 11) % equal.len()].1))
            .collect();
        for entry in ALL {
            let cost = (entry.new)(&Params::default());
            let at_equal = cost.evaluate(&pairs(&equal)).expect("textured");
            let at_shuffled = cost.evaluate(&pairs(&shuffled)).expect("textured");
            assert!(at_equal.abs() < 1e-9, "{}: {at_equal}", entry.name);
            assert!(at_shuffled > 0.5, "{}: {at_shuffled}", entry.name);
        }
    }

    proptest! {
        #[test]
        fn a_cost_is_finite_not_negative_and_explained_where_it_exists(
            values in prop::collection::vec((0.0_f32..=255.0, 0.0_f32..=255.0), 0..200)
        ) {
            for entry in ALL {
                let cost = (entry.new)(&Params::default());
                let pairs = pairs(&values);
                let value = cost.evaluate(&pairs);
                prop_assert_eq!(value.is_some(), cost.explain(&pairs).is_some());
                if let Some(value) = value {
                    prop_assert!(value.is_finite() && value >= 0.0, "{} {}", entry.name, value);
                }
            }
        }
    }
}
