//! The robust photometric error of PM (paper, appendix B, "direct photometric matching").

use super::{Cost, CostEntry, Power, QueryChannel, Statistic};
use crate::describe::parameters;

/// PM's cost among all costs.
pub(super) const ENTRY: CostEntry = CostEntry {
    name: "pm",
    about: "squared difference of grey values, the worse half ignored",
    sees: "grey value",
    similarity: None,
    make: || Box::new(Photometric::default()),
};

parameters! {
    /// RSE(I_Q, I_S) = 1/λ Σ w E^power with E = (I_Q − I_S)², w = 1 where E ≤ median(E), λ = Σ w.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Photometric {
        /// Standard deviation of the Gaussian that smooths the query.
        pub sigma_px: f64 = 1.5 => number("sigma", "px", 0.0..=20.0),
        /// The power of the squared difference E in the weighted mean: 1 averages it; 2 is the
        /// paper's literal formula, which squares E once more.
        pub power: usize = 1 => count("power", "", 1..=2),
    }
}

impl Cost for Photometric {
    fn query_channel(&self) -> QueryChannel<'_> {
        QueryChannel::smoothed(self.sigma_px)
    }

    fn statistic(&self) -> Statistic<'_> {
        let power = if self.power == 2 { Power::Two } else { Power::One };
        Statistic::LesserHalf { power }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::{Explanation, IntensityPair};

    fn with_differences(differences: &[f32]) -> Vec<IntensityPair> {
        differences.iter().map(|&d| IntensityPair { query: 100.0 + d, synthetic: 100.0 }).collect()
    }

    #[test]
    fn the_worse_half_does_not_count() {
        let pairs = with_differences(&[1.0, -2.0, 3.0, 50.0, -90.0]);
        let cost = Photometric::default();
        let expected = (1.0 + 4.0 + 9.0) / 3.0;
        assert_eq!(cost.statistic().cost(&pairs), Some(expected));
        let Some(Explanation::Weights(weights)) = cost.statistic().explain(&pairs) else {
            panic!("the photometric cost explains itself");
        };
        assert_eq!(weights.threshold, 9.0);
        assert_eq!(weights.counted, [true, true, true, false, false]);
    }

    #[test]
    fn the_literal_formula_squares_once_more() {
        let pairs = with_differences(&[1.0, 2.0, 3.0]);
        let cost = Photometric { power: 2, ..Default::default() };
        assert_eq!(cost.statistic().cost(&pairs), Some((1.0 + 16.0) / 2.0));
    }

    #[test]
    fn a_brighter_query_costs_the_square_of_the_shift() {
        let pairs = with_differences(&[7.0; 100]);
        let cost = Photometric::default();
        assert_eq!(cost.statistic().cost(&pairs), Some(49.0));
    }
}
