//! Costs of the direct methods: how badly a synthetic view fits the query. Lower is better, always.
//!
//! A cost says what it wants to see of a photo, a [channel](QueryChannel), and compares the
//! query's with the synthetic view's pixel by pixel where the view exists. It knows no pose. What is
//! too little to judge has no cost, which is not the same as a high one.
//!
//! A new cost is one file, its `mod` line and its entry in [`ALL`]. It is then a method of its own, of
//! the same name, reachable from the command line, the window and the recordings: a direct estimator
//! is a cost with a search.

mod channel;
mod entry;
mod information_distance;
mod joint_histogram;
mod lesser_half;
mod mutual_information;
mod photometric;
mod statistic;

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64;

pub use channel::{QueryChannel, ReferenceChannel, ValueAt};
pub use information_distance::InformationDistance;
pub use joint_histogram::{Entropies, JointHistogram};
pub use lesser_half::Power;
pub use mutual_information::MutualInformation;
pub use photometric::Photometric;
pub use statistic::{CostOfPairs, Explanation, ExplanationKind, PhotometricWeights, Statistic};

#[doc(hidden)]
pub use entry::{CostEntry, CostSetting, CostSettings, RegisteredCost, SearchRule, Similarity};
pub(crate) use joint_histogram::{MAX_BYTE_BINS, MIN_ENTROPY};
#[doc(hidden)]
pub use joint_histogram::{bin, byte_bin, count_pairs};
#[doc(hidden)]
pub use lesser_half::{LesserHalf, LesserHalfFinder};

/// What the query and the synthetic view show at one covered pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pair<T> {
    /// The query I_Q, in the cost's channel.
    pub query: T,
    /// The synthetic view I_S.
    pub synthetic: T,
}

/// The values of both images, each 0 … 255.
pub type IntensityPair = Pair<f32>;

impl IntensityPair {
    /// (I_Q − I_S)² \[grey values²\].
    #[inline(always)]
    pub fn squared_difference(&self) -> f32 {
        let difference = self.query - self.synthetic;
        difference * difference
    }
}

/// The bins of a joint histogram that both values fall into.
#[doc(hidden)]
pub type BinPair = Pair<u8>;

/// The pairs with the synthetic values dealt out anew: what two images give that have nothing to do with
/// each other, and the same values.
pub(crate) fn shuffled<T: Copy>(pairs: &[Pair<T>], seed: u64) -> Vec<Pair<T>> {
    let mut values: Vec<T> = pairs.iter().map(|pair| pair.synthetic).collect();
    values.shuffle(&mut Pcg64::seed_from_u64(seed));
    let dealt = pairs.iter().zip(values);
    dealt.map(|(pair, synthetic)| Pair { synthetic, ..*pair }).collect()
}

/// A robust dissimilarity of two images over the pixels they share.
pub trait Cost: Send + Sync {
    /// What the cost looks at in the query.
    fn query_channel(&self) -> QueryChannel<'_>;

    /// What the cloud is coloured with: grey values, unless the cost wants something else.
    fn reference_channel(&self) -> ReferenceChannel<'_> {
        ReferenceChannel::grey()
    }

    /// What decides the cost of the covered pixels, and how. What scores the poses, on
    /// threads or a graphics card, and the explanation follow from it.
    fn statistic(&self) -> Statistic<'_>;
}

/// Every cost.
#[doc(hidden)]
pub const ALL: &[CostEntry] =
    &[photometric::ENTRY, mutual_information::ENTRY, information_distance::ENTRY];

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pairs(values: &[(f32, f32)]) -> Vec<IntensityPair> {
        values.iter().map(|&(query, synthetic)| IntensityPair { query, synthetic }).collect()
    }

    #[test]
    fn names_are_unique_and_settings_are_equal_to_their_copies() {
        let mut names: Vec<_> = ALL.iter().map(|entry| entry.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), ALL.len());
        let settings = CostSettings::default();
        assert_eq!(settings.clone(), settings);
        for entry in ALL {
            assert!(settings.of(entry).is_some());
        }
    }

    #[test]
    fn no_pair_has_no_cost() {
        for entry in ALL {
            let cost = (entry.make)();
            assert_eq!(cost.statistic().cost(&[]), None, "{}", entry.name);
            assert_eq!(cost.statistic().explain(&[]), None, "{}", entry.name);
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
            let cost = (entry.make)();
            let at_equal = cost.statistic().cost(&pairs(&equal)).expect("textured");
            let at_shuffled = cost.statistic().cost(&pairs(&shuffled)).expect("textured");
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
                let cost = (entry.make)();
                let pairs = pairs(&values);
                let value = cost.statistic().cost(&pairs);
                prop_assert_eq!(value.is_some(), cost.statistic().explain(&pairs).is_some());
                if let Some(value) = value {
                    prop_assert!(value.is_finite() && value >= 0.0, "{} {}", entry.name, value);
                }
            }
        }
    }
}
