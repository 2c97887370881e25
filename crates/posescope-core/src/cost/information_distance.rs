//! The normalised information distance of grey values.
//!
//! Pascoe, Maddern, Tanner, Piniés, Newman, *NID-SLAM: Robust Monocular SLAM using Normalised
//! Information Distance*, CVPR 2017, equation 3.

use super::{Cost, CostEntry, Entropies, MIN_ENTROPY, QueryChannel, Similarity, Statistic};
use crate::describe::parameters;

/// NID among all costs.
pub(super) const ENTRY: CostEntry = CostEntry {
    name: "nid",
    about: "normalised information distance",
    sees: "grey value",
    similarity: Some(Similarity { name: "shared information", formula: "I(Q,S) / H(Q,S)" }),
    make: || Box::new(InformationDistance::default()),
};

parameters! {
    /// NID = (H(Q,S) − I(Q,S)) / H(Q,S), a metric in 0 … 1.
    #[derive(Clone, Debug, PartialEq)]
    pub struct InformationDistance {
        /// Standard deviation of the Gaussian that smooths the query.
        pub sigma_px: f64 = 1.5 => number("sigma", "px", 0.0..=20.0),
        /// Bins per axis of the joint histogram, over 0 … 255.
        pub bins: usize = 16 => count("bins", "", 2..=256),
    }
}

impl Cost for InformationDistance {
    fn query_channel(&self) -> QueryChannel<'_> {
        QueryChannel::smoothed(self.sigma_px)
    }

    fn statistic(&self) -> Statistic<'_> {
        Statistic::Histogram { bins: self.bins, cost: distance }
    }
}

/// NID; `None` where an image is constant.
fn distance(entropies: &Entropies) -> Option<f64> {
    let share = entropies.mutual_information() / entropies.joint;
    let smaller = entropies.query.min(entropies.synthetic);
    (smaller > MIN_ENTROPY).then(|| 1.0 - share.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::IntensityPair;

    fn cost(values: impl IntoIterator<Item = (f32, f32)>) -> Option<f64> {
        let pair = |(query, synthetic)| IntensityPair { query, synthetic };
        let pairs: Vec<IntensityPair> = values.into_iter().map(pair).collect();
        InformationDistance::default().statistic().cost(&pairs)
    }

    #[test]
    fn an_image_and_its_negative_are_at_no_distance_and_unrelated_ones_at_one() {
        let negative = (0..256).map(|v| (v as f32, 255.0 - v as f32));
        assert!(cost(negative).expect("textured") < 1e-12);
        assert_eq!(cost([(0.0, 10.0), (255.0, 10.0), (0.0, 200.0), (255.0, 200.0)]), Some(1.0));
    }

    #[test]
    fn of_two_bits_one_is_shared() {
        // H(Q,S) = 2 bits, I(Q,S) = 1 bit.
        let half = cost([(0.0, 0.0), (70.0, 0.0), (140.0, 255.0), (210.0, 255.0)]);
        assert!((half.expect("textured") - 0.5).abs() < 1e-12);
    }

    #[test]
    fn it_is_a_metric() {
        // Three images of 60 pixels with few grey values.
        let image = |step: u32| (0..60).map(move |i| ((i * step / 7) % 4 * 60) as f32);
        let apart = |a: u32, b: u32| cost(image(a).zip(image(b))).expect("textured");
        for [a, b, c] in [[1, 2, 3], [3, 1, 2], [2, 3, 1]] {
            assert!(apart(a, c) <= apart(a, b) + apart(b, c) + 1e-12);
            assert!((apart(a, b) - apart(b, a)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_constant_image_has_no_cost() {
        assert_eq!(cost((0..256).map(|v| (v as f32, 128.0))), None);
        assert_eq!(cost((0..256).map(|v| (128.0, v as f32))), None);
    }
}
