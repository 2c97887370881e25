//! The lesser half of many errors: how many they are, and their sum.

use fearless_simd::{Level, Simd, SimdBase as _, SimdFloat as _, dispatch, f32x8, i32x8};

/// The power of the errors E in a mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Power {
    /// E itself.
    One,
    /// E².
    Two,
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
    pub const MAX_UNITS: u64 = 1 << 53;

    /// An error rounded to units of 2⁻¹⁶ grey values²: sums of such numbers are exact, so that the order of
    /// the pixels has no part in a cost. It moves the cost of some thousand pixels by some 10⁻⁷.
    #[inline(always)]
    pub fn rounded(error: f64) -> f64 {
        (error + ROUNDING) - ROUNDING
    }

    /// Whether errors that are rounded to units and have this sum were added exactly.
    fn is_exact(sum: f64) -> bool {
        sum < Self::MAX_UNITS as f64 / UNITS
    }

    /// The mean of the errors that count; `None` where none does.
    pub fn mean(&self) -> Option<f64> {
        (self.counted > 0).then(|| self.sum as f64 / UNITS / f64::from(self.counted))
    }
}

/// Numbers that are looked at to guess the median, about.
const SAMPLE: usize = 256;
/// The share of the sample on each side of its median that tells how close the numbers lie: one in this many.
const BESIDE: usize = 16;
/// How often the guess is corrected by counting what lies below it.
const CORRECTIONS: usize = 2;
/// Numbers around the last guess that are compared with each other: a share of all, and some more.
const SHARE_AROUND: f32 = 0.0025;
const MORE_AROUND: f32 = 32.0;

/// Finds number and sum of the numbers up to their lower median, one set after another.
///
/// The median is guessed from a sample, and the guess corrected by counting what lies below. Then what lies clearly
/// below is added, and what lies around, a few numbers in a thousand, is put in order. That reads all numbers three
/// times, some eight at a time, and is exact however good the guess.
pub struct LesserHalfFinder {
    level: Level,
    sample: Vec<f32>,
    /// Numbers around the guess, and room for as many as there are.
    around: Vec<f32>,
}

impl Default for LesserHalfFinder {
    fn default() -> Self {
        Self { level: Level::new(), sample: Vec::new(), around: Vec::new() }
    }
}

impl LesserHalfFinder {
    /// The mean of the numbers ≥ 0 up to their lower median; `None` of nothing.
    pub fn mean(&mut self, values: &[f32]) -> Option<f64> {
        let found = self.find(values).map(|(counted, sum)| sum / f64::from(counted));
        found.or_else(|| mean_of_lesser_half(values, Power::One))
    }

    /// How many of some numbers ≥ 0 are no greater than their lower median, and the sum of these, each
    /// [rounded](LesserHalf::rounded) to a unit: exact, so that no order has a part in it. `None` where the guess was
    /// bad, the sum is too large to be exact, or there are no numbers.
    fn find(&mut self, values: &[f32]) -> Option<(u32, f64)> {
        let middle = values.len().checked_sub(1)? / 2;
        let (mut median, mut density) = self.guess(values, middle);
        let level = self.level;
        let mut last: Option<(f32, f32)> = None;
        for _ in 0..CORRECTIONS {
            let below = dispatch!(level, simd => count_below(simd, values, median)) as f32;
            if let Some((value, before)) = last {
                let measured = (below - before) / (median - value);
                if measured > 0.0 && measured.is_finite() {
                    density = measured;
                }
            }
            last = Some((median, below));
            median = (median + (middle as f32 - below) / density).max(0.0);
        }
        let reach = (SHARE_AROUND * values.len() as f32 + MORE_AROUND) / density;
        let range = [median - reach, median + reach];
        // One more, where what is not around is written.
        if self.around.len() <= values.len() {
            self.around.resize(values.len() + 1, 0.0);
        }
        let mut around = Around { range, values: &mut self.around, count: 0 };
        let (below, sum) = dispatch!(level, _simd => add_below(values, &mut around));
        let place = middle.checked_sub(below as usize)?;
        let around = &mut around.values[..around.count];
        if place >= around.len() {
            return None;
        }
        let (lesser, median, equal) = around.select_nth_unstable_by(place, f32::total_cmp);
        let median = *median;
        let equal = equal.iter().filter(|&&value| value <= median).count();
        let units = |value: f32| LesserHalf::rounded(f64::from(value));
        let sum = sum
            + lesser.iter().map(|&value| units(value)).sum::<f64>()
            + units(median) * (1 + equal) as f64;
        let counted = below + (lesser.len() + 1 + equal) as u32;
        LesserHalf::is_exact(sum).then_some((counted, sum))
    }

    /// The median of a sample, and how many of all numbers lie in an interval around it, over its length.
    fn guess(&mut self, values: &[f32], middle: usize) -> (f32, f32) {
        let step = values.len().div_ceil(SAMPLE);
        let sample = &mut self.sample;
        sample.clear();
        sample.extend(values.iter().step_by(step));
        let (at, reach) = (middle / step, (sample.len() / BESIDE).max(1));
        let (from, to) = (at.saturating_sub(reach), (at + reach).min(sample.len() - 1));
        let high = *sample.select_nth_unstable_by(to, f32::total_cmp).1;
        let median = *sample[..=to].select_nth_unstable_by(at, f32::total_cmp).1;
        let low = *sample[..=at].select_nth_unstable_by(from, f32::total_cmp).1;
        // Many may be equal.
        let length = (high - low).max(1e-4 * high).max(1.0 / 256.0);
        (median, ((to - from).max(1) * step) as f32 / length)
    }
}

#[inline(always)]
fn count_below<S: Simd>(simd: S, values: &[f32], limit: f32) -> u32 {
    const SUMS: usize = 4;
    let (groups, rest) = values.as_chunks::<{ 8 * SUMS }>();
    let all_below = f32x8::splat(simd, limit);
    let [one, none] = [1, 0].map(|number| i32x8::splat(simd, number));
    let mut sums = [none; SUMS];
    for group in groups {
        for (sum, lanes) in sums.iter_mut().zip(group.as_chunks::<8>().0) {
            let is_below = f32x8::from_slice(simd, lanes).simd_lt(all_below);
            *sum += simd.select_i32x8(is_below, one, none);
        }
    }
    let [a, b, c, d] = sums;
    let sums = simd.as_array_i32x8((a + b) + (c + d));
    let rest = rest.iter().filter(|&&value| value < limit);
    sums.iter().sum::<i32>() as u32 + rest.count() as u32
}

/// Numbers in a range: no less than its first end and less than its second.
struct Around<'a> {
    range: [f32; 2],
    /// Room for all numbers and one more.
    values: &'a mut [f32],
    count: usize,
}

impl Around<'_> {
    /// Which numbers are in the range cannot be foreseen: each is written, and the next over it if it is not.
    #[inline(always)]
    fn take(&mut self, values: &[f32]) {
        let [low, high] = self.range;
        for &value in values {
            self.values[self.count] = value;
            self.count += usize::from((value >= low) & (value < high));
        }
    }
}

/// Number and sum of what is less than a range; takes what is in it.
#[inline(always)]
fn add_below(values: &[f32], around: &mut Around<'_>) -> (u32, f64) {
    const SUMS: usize = 16;
    let [low, high] = around.range;
    let mut sums = [0.0_f64; SUMS];
    let mut counted = [0_u32; SUMS];
    let (groups, rest) = values.as_chunks::<SUMS>();
    for group in groups {
        for ((&value, sum), counted) in group.iter().zip(&mut sums).zip(&mut counted) {
            let is_below = value < low;
            *sum += LesserHalf::rounded(f64::from(if is_below { value } else { 0.0 }));
            // There are no 2³² numbers; a check would keep several from being added at once.
            *counted = counted.wrapping_add(u32::from(is_below));
        }
        // Not `any`, which would stop early and so compare one by one.
        let is_near =
            group.iter().fold(false, |found, &value| found | ((value >= low) & (value < high)));
        if is_near {
            around.take(group);
        }
    }
    around.take(rest);
    let below = || rest.iter().filter(|&&value| value < low);
    let sum = below().map(|&value| LesserHalf::rounded(f64::from(value))).sum::<f64>();
    (counted.iter().sum::<u32>() + below().count() as u32, sums.iter().sum::<f64>() + sum)
}

/// The lower median; `None` of nothing.
pub(super) fn lower_median(values: &[f32]) -> Option<f32> {
    let middle = values.len().checked_sub(1)? / 2;
    let mut values = values.to_vec();
    let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    Some(*median)
}

/// The mean of E^power over the errors E up to their lower median; `None` of nothing.
///
/// Errors are rounded so that all sums are exact. Those that are squared again are not, so the sum depends on the
/// order of the errors; it is made of eight, each of every eighth error, so that no addition waits for the last.
pub(super) fn mean_of_lesser_half(errors: &[f32], power: Power) -> Option<f64> {
    const SUMS: usize = 8;
    let threshold = lower_median(errors)?;
    let mut sums = [0.0_f64; SUMS];
    let mut counted = 0;
    for some in errors.chunks(SUMS) {
        for (&error, sum) in some.iter().zip(&mut sums) {
            let counts = error <= threshold;
            let error = f64::from(if counts { error } else { 0.0 });
            *sum += match power {
                Power::One => LesserHalf::rounded(error),
                Power::Two => error * error,
            };
            counted += u32::from(counts);
        }
    }
    Some(sums.iter().sum::<f64>() / f64::from(counted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn by_sorting(values: &[f32]) -> (u32, f64) {
        let mut sorted = values.to_vec();
        sorted.sort_by(f32::total_cmp);
        let median = sorted[(values.len() - 1) / 2];
        let lesser = sorted.iter().filter(|&&value| value <= median);
        let sum = lesser.clone().map(|&value| LesserHalf::rounded(f64::from(value)));
        (lesser.count() as u32, sum.sum())
    }

    proptest! {
        #[test]
        fn number_and_sum_are_those_of_the_sorted_numbers(
            sets in prop::collection::vec(
                prop::collection::vec(
                    prop_oneof![0.0_f32..1e-3, 0.0_f32..300.0, 0.0_f32..65_025.0, Just(0.0), Just(49.0)],
                    1..3000,
                ),
                1..3,
            ),
            baseline: bool,
        ) {
            let level = if baseline { Level::baseline() } else { Level::new() };
            let mut finder = LesserHalfFinder { level, ..LesserHalfFinder::default() };
            for values in sets {
                let expected = by_sorting(&values);
                if let Some((counted, sum)) = finder.find(&values) {
                    prop_assert_eq!((counted, sum.to_bits()), (expected.0, expected.1.to_bits()));
                }
                let mean = Some(expected.1 / f64::from(expected.0));
                prop_assert_eq!(finder.mean(&values), mean);
                prop_assert_eq!(mean_of_lesser_half(&values, Power::One), mean);
            }
        }
    }

    #[test]
    fn it_hardly_ever_guesses_badly() {
        let mut finder = LesserHalfFinder::default();
        let found = (0..200_u32).filter(|&set| {
            let number = |i: u32| {
                let hashed = (i + 7919 * set).wrapping_mul(2_654_435_761);
                let difference = (hashed >> 8) as f32 / 65_536.0;
                difference * difference
            };
            let values: Vec<f32> = (0..2000 + 300 * set).map(number).collect();
            let found = finder.find(&values);
            found.is_none_or(|found| found == by_sorting(&values)) && found.is_some()
        });
        assert!(found.count() >= 190);
    }

    #[test]
    fn what_cannot_be_added_exactly_is_not_added() {
        assert_eq!(LesserHalfFinder::default().find(&[]), None);
        assert_eq!(LesserHalfFinder::default().find(&[1e30; 100]), None);
        assert_eq!(LesserHalfFinder::default().find(&[f32::NAN; 100]), None);
    }

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
