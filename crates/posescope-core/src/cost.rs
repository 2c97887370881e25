//! Costs of the direct methods: how badly a synthetic view fits the query. Lower is better, always.
//!
//! A cost says what it wants to see of a photo, a [channel](Cost::query_channel), and compares the
//! query's with the synthetic view's pixel by pixel where the view exists. It knows no pose. What is
//! too little to judge has no cost, which is not the same as a high one.
//!
//! A new cost is one file, its `mod` line and its entry in [`ALL`]. It is then a method of its own, of
//! the same name, reachable from the command line, the window and the recordings: a direct estimator
//! is a cost with a search.

mod evaluator;
mod joint_histogram;
mod lesser_half;
mod median;
mod mutual_information;
mod orientation;
mod photometric;
mod tallying;

use std::fmt;

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64;

pub use evaluator::{CostOf, Evaluator};
pub use joint_histogram::{
    Entropies, JointHistogram, LEAST_ENTROPY, MOST_BYTE_BINS, bin, byte_bin, count_pairs,
    put_into_bins,
};
pub use mutual_information::{MutualInformation, MutualInformationParams};
pub use orientation::{Orientation, OrientationParams};
pub use photometric::{Photometric, PhotometricParams, PhotometricWeights};

pub use tallying::{LesserHalf, Tallying};

use crate::describe::{Describe, choice};
use crate::image::{FloatImage, GrayImage, cubic_interpolated};
use crate::memo::{Key, key};

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
pub type BinPair = Pair<u8>;

/// The pairs with the synthetic values dealt out anew: what two images give that have nothing to do with
/// each other, and the same values.
pub fn shuffled(pairs: &[IntensityPair], seed: u64) -> Vec<IntensityPair> {
    let mut values: Vec<f32> = pairs.iter().map(|pair| pair.synthetic).collect();
    values.shuffle(&mut Pcg64::seed_from_u64(seed));
    let dealt = pairs.iter().zip(values);
    dealt.map(|(pair, synthetic)| IntensityPair { synthetic, ..*pair }).collect()
}

/// A robust dissimilarity of two images over the pixels they share.
pub trait Cost: Send + Sync {
    /// What the cost looks at in the query, each pixel 0 … 255.
    fn query_channel(&self, photo: &GrayImage) -> FloatImage;

    /// What [`Self::query_channel`] makes: all that it depends on beside the photo.
    fn query_channel_key(&self) -> Key;

    /// What the cloud is coloured with before views of it are rendered: the value 0 … 255 at a place
    /// between the pixels of the reference photo \[px\]. Its grey values by cubic convolution, unless
    /// the cost wants something else.
    fn reference_channel<'a>(
        &self,
        photo: &'a GrayImage,
    ) -> Box<dyn Fn(f32, f32) -> f32 + Sync + 'a> {
        Box::new(|x, y| cubic_interpolated(photo, x, y))
    }

    /// What [`Self::reference_channel`] makes: all that it depends on beside the photo. Costs of equal
    /// keys share one coloured cloud.
    fn reference_channel_key(&self) -> Key {
        key("grey")
    }

    /// The cost over the pairs; `None` where they decide nothing (no pair, constant image).
    fn evaluate(&self, pairs: &[IntensityPair]) -> Option<f64>;

    /// The same cost for one hypothesis after another. One that needs less than all pairs, or memory
    /// of its own, says so here; the answers are those of [`Self::evaluate`], bit for bit.
    fn evaluator(&self) -> Evaluator<'_> {
        Evaluator::Pairs(Box::new(|pairs| self.evaluate(pairs)))
    }

    /// The whole numbers that decide the cost, and how, so that a [device](crate::render::Device) can find
    /// them; `None` where only the pairs do. The cost is that of [`Self::evaluate`], bit for bit.
    fn tallying(&self) -> Option<Tallying> {
        None
    }

    /// The smooth cost that is descended instead of searching a grid for the least of this one; `None` for
    /// the grid.
    fn descended(&self) -> Option<SmoothCost> {
        None
    }

    /// Why the cost of these pairs is what it is; `None` where there is no cost, and for a cost that
    /// has nothing of the kind to show.
    fn explain(&self, pairs: &[IntensityPair]) -> Option<Explanation> {
        let _ = pairs;
        None
    }
}

/// What a cost was made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Explanation {
    /// Which residuals counted.
    Weights(PhotometricWeights),
    /// How the values of both images fall together.
    JointHistogram(JointHistogram),
}

/// Which kind of [`Explanation`] a cost gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExplanationKind {
    /// [`Explanation::Weights`].
    Weights,
    /// [`Explanation::JointHistogram`].
    JointHistogram,
}

/// How a direct method finds the pose of least cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SearchRule {
    /// It scans a coarse-to-fine grid, as the paper does.
    #[default]
    Grid,
    /// It goes down from the reference pose by derivatives, as the methods do that the paper takes its
    /// costs from.
    Descent,
}

choice!(SearchRule: Grid = "grid", Descent = "descent");

/// What a cost is like that has derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SmoothCost {
    /// Squared differences of values, robustly.
    Differences,
    /// The information distance of a histogram with so many bins per axis.
    Information {
        /// Bins per axis.
        bins: usize,
    },
}

/// Parameters that make a cost.
pub trait MakesCost: Describe + Clone + fmt::Debug + Send + Sync + 'static {
    /// The cost with these parameters.
    fn make(&self) -> Box<dyn Cost>;
}

/// The parameters of any cost: they describe themselves, and make the cost.
pub trait CostParams: Describe + fmt::Debug + Send + Sync {
    /// The cost with these parameters.
    fn cost(&self) -> Box<dyn Cost>;

    /// The same parameters.
    fn boxed(&self) -> Box<dyn CostParams>;
}

impl<P: MakesCost> CostParams for P {
    fn cost(&self) -> Box<dyn Cost> {
        self.make()
    }

    fn boxed(&self) -> Box<dyn CostParams> {
        Box::new(self.clone())
    }
}

/// What two images share, as a number 0 … 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Similarity {
    /// Its abbreviation: `NMI`.
    pub name: &'static str,
    /// What it is, in entropies H and mutual information I of query Q and synthetic view S.
    pub formula: &'static str,
}

/// A cost's place in the registry.
#[derive(Debug)]
pub struct Entry {
    /// The name of the method that searches the pose of least cost, and of the parameters' group.
    pub name: &'static str,
    /// One phrase.
    pub about: &'static str,
    /// What a value of its channel is: `grey value`.
    pub sees: &'static str,
    /// How it explains itself.
    pub explains: ExplanationKind,
    /// What the cost is one minus of, where it is made of a joint histogram.
    pub similarity: Option<Similarity>,
    /// Its parameters with their defaults.
    pub params: fn() -> Box<dyn CostParams>,
}

/// Every cost.
pub const ALL: &[Entry] = &[photometric::ENTRY, mutual_information::ENTRY, orientation::ENTRY];

/// The parameters of every cost, in the order of [`ALL`].
#[derive(Debug)]
pub struct CostSettings(Vec<Box<dyn CostParams>>);

impl CostSettings {
    /// Names of the groups, with their parameters.
    pub fn groups(&mut self) -> impl Iterator<Item = (&'static str, &mut dyn Describe)> {
        ALL.iter()
            .zip(&mut self.0)
            .map(|(entry, params)| (entry.name, params.as_mut() as &mut dyn Describe))
    }

    /// The parameters of a registered cost.
    pub fn of(&self, entry: &Entry) -> Option<&dyn CostParams> {
        let place = ALL.iter().position(|known| known.name == entry.name)?;
        self.0.get(place).map(AsRef::as_ref)
    }
}

impl Default for CostSettings {
    fn default() -> Self {
        Self(ALL.iter().map(|entry| (entry.params)()).collect())
    }
}

impl Clone for CostSettings {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|params| params.boxed()).collect())
    }
}

impl PartialEq for CostSettings {
    fn eq(&self, other: &Self) -> bool {
        key(&self.0) == key(&other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pairs(values: &[(f32, f32)]) -> Vec<IntensityPair> {
        values.iter().map(|&(query, synthetic)| IntensityPair { query, synthetic }).collect()
    }

    /// The cost of the pairs as the grid search asks for it, after that of other pairs.
    fn by_evaluator(cost: &dyn Cost, pairs: &[IntensityPair]) -> Option<f64> {
        let before = &pairs[..pairs.len() / 2];
        let mut evaluator = cost.evaluator();
        evaluator.cost(before);
        evaluator.cost(pairs)
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
            let cost = (entry.params)().cost();
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
            let cost = (entry.params)().cost();
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
                let cost = (entry.params)().cost();
                let pairs = pairs(&values);
                let value = cost.evaluate(&pairs);
                prop_assert_eq!(value.is_some(), cost.explain(&pairs).is_some());
                prop_assert_eq!(value, by_evaluator(cost.as_ref(), &pairs));
                if let Some(value) = value {
                    prop_assert!(value.is_finite() && value >= 0.0, "{} {}", entry.name, value);
                }
            }
        }
    }
}
