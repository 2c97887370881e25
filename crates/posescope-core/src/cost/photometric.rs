//! The robust photometric error of PM (paper, appendix B, "direct photometric matching").

use fearless_simd::{Level, dispatch};

use super::lesser_half::LesserHalfFinder;
use super::median::MedianFinder;
use super::{
    Cost, Entry, Evaluator, Explanation, ExplanationKind, IntensityPair, LesserHalf, MakesCost,
    SearchRule, SmoothCost, Tallying,
};
use crate::describe::parameters;
use crate::image::{FloatImage, GrayImage, gaussian_smoothed};
use crate::memo::{Key, key};

/// PM's cost among all costs.
pub(super) const ENTRY: Entry = Entry {
    name: "pm",
    about: "squared difference of grey values, the worse half ignored",
    sees: "grey value",
    explains: ExplanationKind::Weights,
    similarity: None,
    params: || Box::new(PhotometricParams::default()),
};

parameters! {
    /// Parameters of the photometric cost.
    #[derive(Clone, Debug, PartialEq)]
    pub struct PhotometricParams {
        /// Standard deviation of the Gaussian that smooths the query.
        pub sigma_px: f64 = number("sigma", "px", 0.0..=20.0),
        /// The power of the squared difference E in the weighted mean: 1 averages it; 2 is the
        /// paper's literal formula, which squares E once more.
        pub power: usize = count("power", "", 1..=2),
        /// How the pose of least cost is found: over the grid, or from the reference pose downhill.
        pub search: SearchRule = choice("search"),
    }
}

impl Default for PhotometricParams {
    fn default() -> Self {
        Self { sigma_px: 1.5, power: 1, search: SearchRule::Grid }
    }
}

impl MakesCost for PhotometricParams {
    fn make(&self) -> Box<dyn Cost> {
        Box::new(Photometric::new(self))
    }
}

/// RSE(I_Q, I_S) = 1/λ Σ w E^power with E = (I_Q − I_S)², w = 1 where E ≤ median(E), λ = Σ w.
#[derive(Clone, Debug)]
pub struct Photometric {
    params: PhotometricParams,
}

/// Which pixels the photometric cost counted.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotometricWeights {
    /// The power of E in the weighted mean.
    pub power: usize,
    /// θ, the median of E \[grey values²\].
    pub threshold: f32,
    /// Per pair, whether E ≤ θ.
    pub counted: Vec<bool>,
}

impl Photometric {
    /// The cost with these parameters.
    pub fn new(params: &PhotometricParams) -> Self {
        Self { params: params.clone() }
    }
}

impl Photometric {
    /// The mean of E^power over the errors E ≤ θ, of which there is one at least.
    ///
    /// Eight sums are added at once, each of every eighth error, and no addition waits for the last. Errors
    /// are rounded so that all sums are exact; those that are squared again are not, and what is added to
    /// what depends on nothing but their order.
    #[inline(always)]
    fn mean_up_to(&self, threshold: f32, errors: &[f32]) -> f64 {
        const SUMS: usize = 8;
        let squared_again = self.params.power == 2;
        let mut sums = [0.0_f64; SUMS];
        let mut counted = [0_u32; SUMS];
        for some in errors.chunks(SUMS) {
            for ((&error, sum), counted) in some.iter().zip(&mut sums).zip(&mut counted) {
                let counts = error <= threshold;
                let error = f64::from(if counts { error } else { 0.0 });
                *sum += if squared_again { error * error } else { LesserHalf::rounded(error) };
                // A view has no 2³² pixels; a check would keep the eight from being added at once.
                *counted = counted.wrapping_add(u32::from(counts));
            }
        }
        sums.iter().sum::<f64>() / f64::from(counted.iter().sum::<u32>())
    }
}

/// The lower median; `None` of nothing. Leaves `values` partly sorted, which is why it takes time
/// linear in their number.
fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len().checked_sub(1)? / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    Some(*median)
}

impl Cost for Photometric {
    fn query_channel(&self, photo: &GrayImage) -> FloatImage {
        gaussian_smoothed(photo, self.params.sigma_px)
    }

    fn query_channel_key(&self) -> Key {
        key(("grey", self.params.sigma_px))
    }

    fn evaluate(&self, pairs: &[IntensityPair]) -> Option<f64> {
        let errors: Vec<f32> = pairs.iter().map(IntensityPair::squared_difference).collect();
        let threshold = median(&mut errors.clone())?;
        Some(self.mean_up_to(threshold, &errors))
    }

    fn evaluator(&self) -> Evaluator<'_> {
        let level = Level::new();
        let mut medians = MedianFinder::new();
        // Errors that are squared again are not added exactly, so that their order has a part in it.
        if self.params.power == 2 {
            let mut errors = Vec::new();
            return Evaluator::Pairs(Box::new(move |pairs| {
                errors.clear();
                errors.extend(pairs.iter().map(IntensityPair::squared_difference));
                let threshold = medians.lower_median(&errors)?;
                Some(dispatch!(level, _simd => self.mean_up_to(threshold, &errors)))
            }));
        }
        let mut halves = LesserHalfFinder::new();
        Evaluator::SquaredDifferences(Box::new(move |errors| {
            if let Some((counted, sum)) = halves.find(errors) {
                return Some(sum / f64::from(counted));
            }
            let threshold = medians.lower_median(errors)?;
            Some(dispatch!(level, _simd => self.mean_up_to(threshold, errors)))
        }))
    }

    fn tallying(&self) -> Option<Tallying> {
        (self.params.power == 1).then_some(Tallying::LesserHalf)
    }

    fn descended(&self) -> Option<SmoothCost> {
        (self.params.search == SearchRule::Descent).then_some(SmoothCost::Differences)
    }

    fn explain(&self, pairs: &[IntensityPair]) -> Option<Explanation> {
        let mut errors: Vec<f32> = pairs.iter().map(IntensityPair::squared_difference).collect();
        let threshold = median(&mut errors)?;
        Some(Explanation::Weights(PhotometricWeights {
            power: self.params.power,
            threshold,
            counted: pairs.iter().map(|pair| pair.squared_difference() <= threshold).collect(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_differences(differences: &[f32]) -> Vec<IntensityPair> {
        differences.iter().map(|&d| IntensityPair { query: 100.0 + d, synthetic: 100.0 }).collect()
    }

    #[test]
    fn the_worse_half_does_not_count() {
        let pairs = with_differences(&[1.0, -2.0, 3.0, 50.0, -90.0]);
        let cost = Photometric::new(&PhotometricParams::default());
        let expected = (1.0 + 4.0 + 9.0) / 3.0;
        assert_eq!(cost.evaluate(&pairs), Some(expected));
        let Some(Explanation::Weights(weights)) = cost.explain(&pairs) else {
            panic!("the photometric cost explains itself");
        };
        assert_eq!(weights.threshold, 9.0);
        assert_eq!(weights.counted, [true, true, true, false, false]);
    }

    #[test]
    fn the_literal_formula_squares_once_more() {
        let pairs = with_differences(&[1.0, 2.0, 3.0]);
        let cost = Photometric::new(&PhotometricParams { power: 2, ..Default::default() });
        assert_eq!(cost.evaluate(&pairs), Some((1.0 + 16.0) / 2.0));
    }

    #[test]
    fn a_brighter_query_costs_the_square_of_the_shift() {
        let pairs = with_differences(&[7.0; 100]);
        let cost = Photometric::new(&PhotometricParams::default());
        assert_eq!(cost.evaluate(&pairs), Some(49.0));
    }
}
