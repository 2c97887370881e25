//! 1 − normalised mutual information, the cost of MI (paper, section 2.4).

use super::{Cost, Explanation, IntensityPair};
use crate::describe::parameters;

parameters! {
    /// Parameters of the mutual-information cost.
    #[derive(Clone, Debug, PartialEq)]
    pub struct MutualInformationParams {
        /// Standard deviation of the Gaussian that smooths the query.
        pub sigma_px: f64 = number("sigma", "px", 0.0..=20.0),
        /// Bins per axis of the joint histogram, over 0 … 255.
        ///
        /// 8 to 32 are equal on real pairs; 64 is unstable where few pixels are covered.
        pub bins: usize = count("bins", "", 2..=256),
    }
}

impl Default for MutualInformationParams {
    fn default() -> Self {
        Self {
            sigma_px: 1.5,
            bins: 16,
        }
    }
}

/// 1 − NMI, NMI = (H(S) + H(Q) − H(S,Q)) / max(H(S), H(Q)), the marginals from the joint histogram.
#[derive(Clone, Debug)]
pub struct MutualInformation {
    params: MutualInformationParams,
}

/// How often each pair of grey values occurs, and the entropies that follow \[nat\].
#[derive(Clone, Debug, PartialEq)]
pub struct JointHistogram {
    /// Bins per axis.
    pub bins: usize,
    /// Counts, `bins` × `bins`; rows are the query's bins, columns the synthetic view's.
    pub counts: Vec<u32>,
    /// H(I_Q).
    pub query_entropy: f64,
    /// H(I_S).
    pub synthetic_entropy: f64,
    /// H(I_S, I_Q).
    pub joint_entropy: f64,
}

impl JointHistogram {
    /// Counts the pairs; values fall into `bins` equal intervals of 0 … 255, 255 into the last one.
    pub fn of(pairs: &[IntensityPair], bins: usize) -> Self {
        let mut counts = vec![0_u32; bins * bins];
        for pair in pairs {
            counts[cell(pair, bins)] += 1;
        }
        let rows = counts.chunks(bins).map(|row| row.iter().sum());
        let columns = (0..bins).map(|column| counts.iter().skip(column).step_by(bins).sum());
        Self {
            bins,
            query_entropy: entropy(rows, pairs.len()),
            synthetic_entropy: entropy(columns, pairs.len()),
            joint_entropy: entropy(counts.iter().copied(), pairs.len()),
            counts,
        }
    }

    /// The position in [`Self::counts`] of the cell that a pair falls into.
    pub fn cell(&self, pair: &IntensityPair) -> usize {
        cell(pair, self.bins)
    }

    /// ln p(q, s) / (p(q) p(s)) of each cell \[nat\]: what a pair in it says about whether the images
    /// belong together. Its mean over all pairs is their mutual information. 0 where no pair is.
    pub fn pointwise(&self) -> Vec<f64> {
        let Self { bins, counts, .. } = self;
        let sum = |cells: &mut dyn Iterator<Item = &u32>| cells.map(|&c| f64::from(c)).sum::<f64>();
        let rows: Vec<f64> = counts
            .chunks(*bins)
            .map(|row| sum(&mut row.iter()))
            .collect();
        let columns: Vec<f64> = (0..*bins)
            .map(|column| sum(&mut counts.iter().skip(column).step_by(*bins)))
            .collect();
        let all: f64 = rows.iter().sum();
        counts
            .iter()
            .enumerate()
            .map(|(cell, &count)| match count {
                0 => 0.0,
                _ => (f64::from(count) * all / (rows[cell / bins] * columns[cell % bins])).ln(),
            })
            .collect()
    }

    /// NMI in 0 … 1, normalised by the larger entropy; `None` where both images are constant.
    pub fn normalized_mutual_information(&self) -> Option<f64> {
        let larger = self.query_entropy.max(self.synthetic_entropy);
        let shared = self.query_entropy + self.synthetic_entropy - self.joint_entropy;
        (larger > 0.0).then(|| (shared / larger).clamp(0.0, 1.0))
    }
}

fn cell(pair: &IntensityPair, bins: usize) -> usize {
    let scale = bins as f32 / 256.0;
    let bin = |value: f32| ((value * scale) as usize).min(bins - 1);
    bin(pair.query) * bins + bin(pair.synthetic)
}

/// H = log n − (Σ c log c) / n, with n = Σ c \[nat\].
fn entropy(counts: impl Iterator<Item = u32>, total: usize) -> f64 {
    if total == 0 {
        return 0.0;
    }
    let sum: f64 = counts
        .filter(|&count| count > 1)
        .map(|count| f64::from(count) * f64::from(count).ln())
        .sum();
    let total = total as f64;
    (total.ln() - sum / total).max(0.0)
}

impl MutualInformation {
    /// The cost with these parameters.
    pub fn new(params: &MutualInformationParams) -> Self {
        Self {
            params: params.clone(),
        }
    }
}

impl Cost for MutualInformation {
    fn query_smoothing_px(&self) -> f64 {
        self.params.sigma_px
    }

    fn evaluate(&self, pairs: &[IntensityPair]) -> Option<f64> {
        let histogram = JointHistogram::of(pairs, self.params.bins);
        Some(1.0 - histogram.normalized_mutual_information()?)
    }

    fn explain(&self, pairs: &[IntensityPair]) -> Option<Explanation> {
        let histogram = JointHistogram::of(pairs, self.params.bins);
        histogram.normalized_mutual_information()?;
        Some(Explanation::MutualInformation(histogram))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(values: impl IntoIterator<Item = (f32, f32)>) -> Vec<IntensityPair> {
        values
            .into_iter()
            .map(|(query, synthetic)| IntensityPair { query, synthetic })
            .collect()
    }

    fn cost(values: &[IntensityPair]) -> Option<f64> {
        MutualInformation::new(&MutualInformationParams::default()).evaluate(values)
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
        let sum: f64 = pairs
            .iter()
            .map(|pair| pointwise[histogram.cell(pair)])
            .sum();
        let shared =
            histogram.query_entropy + histogram.synthetic_entropy - histogram.joint_entropy;
        assert!(shared > 0.5 && (sum / 500.0 - shared).abs() < 1e-9);
    }

    #[test]
    fn entropies_of_a_fair_coin() {
        let coin = pairs([(0.0, 10.0), (255.0, 10.0), (0.0, 200.0), (255.0, 200.0)]);
        let histogram = JointHistogram::of(&coin, 16);
        let bit = 2.0_f64.ln();
        assert!((histogram.query_entropy - bit).abs() < 1e-12);
        assert!((histogram.synthetic_entropy - bit).abs() < 1e-12);
        assert!((histogram.joint_entropy - 2.0 * bit).abs() < 1e-12);
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
    fn a_constant_pair_of_images_has_no_cost_and_one_constant_image_the_worst() {
        assert_eq!(cost(&pairs([(9.0, 200.0); 50])), None);
        let constant_view = pairs((0..256).map(|v| (v as f32, 128.0)));
        assert_eq!(cost(&constant_view), Some(1.0));
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
