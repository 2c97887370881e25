//! 1 − normalised mutual information, the cost of MI (paper, section 2.3).

use super::{Cost, CostEntry, Entropies, QueryChannel, Similarity, Statistic};
use crate::describe::parameters;

/// MI's cost among all costs.
pub(super) const ENTRY: CostEntry = CostEntry {
    name: "mi",
    about: "1 − mutual information normalised by the larger entropy",
    sees: "grey value",
    similarity: Some(Similarity { name: "NMI", formula: "I(Q,S) / max(H(Q), H(S))" }),
    make: || Box::new(MutualInformation::default()),
};

parameters! {
    /// 1 − NMI, NMI = (H(S) + H(Q) − H(S,Q)) / max(H(S), H(Q)), the marginals from the joint histogram.
    #[derive(Clone, Debug, PartialEq)]
    pub struct MutualInformation {
        /// Standard deviation of the Gaussian that smooths the query.
        pub sigma_px: f64 = 1.5 => number("sigma", "px", 0.0..=20.0),
        /// Bins per axis of the joint histogram, over 0 … 255.
        ///
        /// 8 to 32 are equal on real pairs; 64 is unstable where few pixels are covered.
        pub bins: usize = 16 => count("bins", "", 2..=256),
    }
}

impl Cost for MutualInformation {
    fn query_channel(&self) -> QueryChannel<'_> {
        QueryChannel::smoothed(self.sigma_px)
    }

    fn statistic(&self) -> Statistic<'_> {
        Statistic::Histogram { bins: self.bins, cost: distance }
    }
}

/// 1 − NMI; `None` where an image is constant.
fn distance(entropies: &Entropies) -> Option<f64> {
    Some(1.0 - entropies.normalized_mutual_information()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::{IntensityPair, JointHistogram};

    fn pairs(values: impl IntoIterator<Item = (f32, f32)>) -> Vec<IntensityPair> {
        values.into_iter().map(|(query, synthetic)| IntensityPair { query, synthetic }).collect()
    }

    fn cost(values: &[IntensityPair]) -> Option<f64> {
        MutualInformation::default().statistic().cost(values)
    }

    #[test]
    fn white_falls_into_the_last_bin_and_black_into_the_first() {
        let histogram = JointHistogram::of(&pairs([(255.0, 0.0), (0.0, 255.0)]), 16);
        assert_eq!(histogram.counts[15 * 16], 1);
        assert_eq!(histogram.counts[15], 1);
    }

    #[test]
    fn the_mean_over_the_pairs_of_what_each_says_is_their_mutual_information() {
        let pairs = pairs((0..500_u32).map(|i| {
            let value = (i.wrapping_mul(2_654_435_761) >> 24) as f32;
            (value, (0.7 * value + (i % 64) as f32).min(255.0))
        }));
        let histogram = JointHistogram::of(&pairs, 16);
        let pointwise = histogram.pointwise();
        let sum: f64 = pairs.iter().map(|pair| pointwise[histogram.cell(pair)]).sum();
        let shared = histogram.entropies.mutual_information();
        assert!(shared > 0.5 && (sum / 500.0 - shared).abs() < 1e-9);
    }

    #[test]
    fn entropies_of_a_fair_coin() {
        let coin = pairs([(0.0, 10.0), (255.0, 10.0), (0.0, 200.0), (255.0, 200.0)]);
        let histogram = JointHistogram::of(&coin, 16);
        let bit = 2.0_f64.ln();
        assert!((histogram.entropies.query - bit).abs() < 1e-12);
        assert!((histogram.entropies.synthetic - bit).abs() < 1e-12);
        assert!((histogram.entropies.joint - 2.0 * bit).abs() < 1e-12);
        assert_eq!(cost(&coin), Some(1.0));
    }

    #[test]
    fn an_inverted_image_is_as_good_as_the_image() {
        let inverted = pairs((0..256).map(|v| (v as f32, 255.0 - v as f32)));
        assert!(cost(&inverted).expect("textured").abs() < 1e-12);
    }

    #[test]
    fn the_norm_is_the_larger_entropy() {
        // The synthetic view knows one bit of the query's two.
        let half_known = pairs([(0.0, 0.0), (70.0, 0.0), (140.0, 255.0), (210.0, 255.0)]);
        assert!((cost(&half_known).expect("textured") - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_constant_image_has_no_cost() {
        assert_eq!(cost(&pairs([(9.0, 200.0); 50])), None);
        assert_eq!(cost(&pairs((0..256).map(|v| (v as f32, 128.0)))), None);
        assert_eq!(cost(&pairs((0..256).map(|v| (128.0, v as f32)))), None);
    }

    #[test]
    fn independent_images_cost_nearly_one_with_a_bias_of_bins_squared_per_pixel() {
        let independent = |n: u32| {
            pairs((0..n).map(|i| {
                let hash = i.wrapping_mul(2_654_435_761);
                let other = (i ^ 0x5bd1_e995).wrapping_mul(0x85eb_ca6b);
                ((hash >> 24) as f32, (other >> 24) as f32)
            }))
        };
        let few = cost(&independent(1_000)).expect("textured");
        let many = cost(&independent(100_000)).expect("textured");
        assert!(few < many && many > 0.99, "{few} {many}");
    }
}
