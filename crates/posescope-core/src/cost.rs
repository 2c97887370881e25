//! Costs of the direct methods: how badly a synthetic view fits the query. Lower is better, always.
//!
//! A cost says what it wants to see of a photo, a [channel](Cost::query_channel), and compares the
//! query's with the synthetic view's pixel by pixel where the view exists. It knows no pose. What is
//! too little to judge has no cost, which is not the same as a high one.
//!
//! A new cost is one file, its `mod` line and its entry in [`ALL`]. It is then a method of its own, of
//! the same name, reachable from the command line, the window and the recordings: a direct estimator
//! is a cost with a search.

mod joint_histogram;
mod lesser_half;
mod mutual_information;
mod orientation;
mod photometric;
mod statistic;

use std::fmt;

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64;

pub use joint_histogram::{
    Entropies, JointHistogram, LEAST_ENTROPY, MOST_BYTE_BINS, bin, byte_bin, count_pairs,
};
pub use lesser_half::{LesserHalf, LesserHalfFinder};
pub use mutual_information::MutualInformation;
pub use orientation::Orientation;
pub use photometric::Photometric;
pub use statistic::{CostOfPairs, Explanation, ExplanationKind, PhotometricWeights, Statistic};

use crate::describe::{About, Describe, Field, choice};
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

    /// What decides the cost of the covered pixels, and how. The threads, a
    /// [device](crate::render::Device) and the explanation all follow from it.
    fn statistic(&self) -> Statistic<'_>;
}

/// How a direct method finds the pose of least cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SearchRule {
    /// It scans a coarse-to-fine grid, as the paper does.
    #[default]
    Grid,
    /// It refines many minima of a coarse grid in six freedoms, as `mi6` does.
    Starts,
    /// It goes down from the reference pose by derivatives, as the methods do that the paper takes its
    /// costs from.
    Descent,
}

choice!(SearchRule: Grid = "grid", Starts = "starts", Descent = "descent");

/// A cost whose parameters describe themselves.
pub trait RegisteredCost: Cost + Describe + fmt::Debug {
    /// The same cost once more.
    fn boxed(&self) -> Box<dyn RegisteredCost>;
}

impl<C: Cost + Describe + Clone + fmt::Debug + 'static> RegisteredCost for C {
    fn boxed(&self) -> Box<dyn RegisteredCost> {
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
    /// Whether it can be descended too: then how it is searched is a parameter, `search`.
    pub is_smooth: bool,
    /// What the cost is one minus of, where it is made of a joint histogram.
    pub similarity: Option<Similarity>,
    /// The cost with its default parameters.
    pub make: fn() -> Box<dyn RegisteredCost>,
}

impl Entry {
    /// How it explains itself, if it does.
    pub fn explains(&self) -> Option<ExplanationKind> {
        (self.make)().statistic().explains()
    }
}

/// Every cost.
pub const ALL: &[Entry] = &[photometric::ENTRY, mutual_information::ENTRY, orientation::ENTRY];

/// A registered cost with its parameters, and how it is searched.
#[derive(Debug)]
pub struct CostSetting {
    /// The cost.
    pub cost: Box<dyn RegisteredCost>,
    /// How its minimum is found.
    pub search: SearchRule,
    is_smooth: bool,
}

impl CostSetting {
    /// The default setting of a cost.
    pub fn new(entry: &Entry) -> Self {
        let search = SearchRule::default();
        Self { cost: (entry.make)(), search, is_smooth: entry.is_smooth }
    }
}

impl Describe for CostSetting {
    fn fields(&mut self) -> Vec<Field<'_>> {
        let mut fields = self.cost.fields();
        if self.is_smooth {
            let doc = "How the pose of least cost is found: over the grid, from many starts, or from the reference \
                       pose downhill.";
            let about = About { name: "search", unit: "", doc };
            fields.push(Field::choice(about, &mut self.search));
        }
        fields
    }
}

impl Clone for CostSetting {
    fn clone(&self) -> Self {
        Self { cost: self.cost.boxed(), ..*self }
    }
}

/// The setting of every cost, in the order of [`ALL`].
#[derive(Clone, Debug)]
pub struct CostSettings(Vec<CostSetting>);

impl CostSettings {
    /// Names of the groups, with their parameters.
    pub fn groups(&mut self) -> impl Iterator<Item = (&'static str, &mut dyn Describe)> {
        let settings = self.0.iter_mut().map(|setting| setting as &mut dyn Describe);
        ALL.iter().map(|entry| entry.name).zip(settings)
    }

    /// The setting of a registered cost.
    pub fn of(&self, entry: &Entry) -> Option<&CostSetting> {
        let place = ALL.iter().position(|known| known.name == entry.name)?;
        self.0.get(place)
    }
}

impl Default for CostSettings {
    fn default() -> Self {
        Self(ALL.iter().map(CostSetting::new).collect())
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
