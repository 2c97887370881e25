//! Costs that whole numbers decide, which any processor can count.

use super::Entropies;

/// Which whole numbers of the covered pixels decide a cost.
#[derive(Clone, Copy, Debug)]
pub enum Tallying {
    /// The joint histogram.
    Counts {
        /// Bins per axis, as in [`JointHistogram::of`](super::JointHistogram::of).
        bins: usize,
        /// The cost of the entropies of the counts.
        cost: fn(&Entropies) -> Option<f64>,
    },
    /// The errors E = (I_Q − I_S)² that are at most as large as their lower median. E is a number of single
    /// precision, as are the values. The cost is [`LesserHalf::mean`].
    LesserHalf,
}

/// Number and sum of the errors up to their median.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LesserHalf {
    /// Errors that count.
    pub counted: u32,
    /// Their sum in units of 2⁻¹⁶ grey values², each rounded to such a unit, of two as near to the even one.
    pub sum: u64,
}

/// Adding this number and taking it away rounds what is smaller than 2³⁶ to multiples of 2⁻¹⁶.
const ROUNDING: f64 = 1.5 * (1_u64 << 36) as f64;
const UNITS: f64 = 65_536.0;

impl LesserHalf {
    /// Sums up to this number of units are exact whatever order they are added in, and so are costs.
    pub const MOST_UNITS: u64 = 1 << 53;

    /// An error rounded to units of 2⁻¹⁶ grey values²: sums of such numbers are exact, so that the order of
    /// the pixels has no part in a cost. It moves the cost of some thousand pixels by some 10⁻⁷.
    #[inline(always)]
    pub fn rounded(error: f64) -> f64 {
        (error + ROUNDING) - ROUNDING
    }

    /// Whether errors that are rounded to units and have this sum were added exactly.
    pub(super) fn is_exact(sum: f64) -> bool {
        sum < Self::MOST_UNITS as f64 / UNITS
    }

    /// The mean of the errors that count; `None` where none does.
    pub fn mean(&self) -> Option<f64> {
        (self.counted > 0).then(|| self.sum as f64 / UNITS / f64::from(self.counted))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rounded_errors_are_whole_units_nearby(error in 0.0_f32..65_026.0) {
            let error = f64::from(error);
            let rounded = LesserHalf::rounded(error);
            prop_assert_eq!((rounded * UNITS).fract(), 0.0);
            prop_assert!((rounded - error).abs() <= 0.5 / UNITS);
        }

        #[test]
        fn the_order_of_errors_has_no_part_in_their_sum(
            errors in prop::collection::vec(0.0_f32..65_026.0, 0..200)
        ) {
            let rounded = errors.iter().map(|&error| LesserHalf::rounded(f64::from(error)));
            let (there, back): (f64, f64) = (rounded.clone().sum(), rounded.rev().sum());
            prop_assert_eq!(there.to_bits(), back.to_bits());
        }
    }

    #[test]
    fn of_two_units_as_near_the_even_one_is_taken() {
        let units = |error: f64| LesserHalf::rounded(error) * UNITS;
        assert_eq!([units(0.5 / UNITS), units(1.5 / UNITS)], [0.0, 2.0]);
    }
}
