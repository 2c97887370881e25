//! The median of many numbers, one set after another.

use fearless_simd::{Level, dispatch};

/// Bits of a number that do not decide its bin: each octave has 32 bins.
const IGNORED_BITS: u32 = 18;
/// All numbers below have one bin. Of squared differences of grey values such are few.
const LEAST: f32 = 1.0 / 256.0;
const FIRST: u32 = LEAST.to_bits() >> IGNORED_BITS;
pub(super) const BINS: usize = 32 * 24 + 2;

/// Counts are kept in so many tables: neighbours often fall into the same bin, and a count that was just
/// written would have to be waited for.
const TABLES: usize = 4;

/// Finds medians in time linear in the numbers and without asking for memory each time.
///
/// The numbers are counted in bins that grow with them, so only those in the median's own bin, some
/// three in a hundred, are compared with each other.
pub(super) struct MedianFinder {
    level: Level,
    bins: Vec<u16>,
    counts: [[u32; BINS]; TABLES],
    candidates: Vec<f32>,
}

impl MedianFinder {
    pub fn new() -> Self {
        Self {
            level: Level::new(),
            bins: Vec::new(),
            counts: [[0; BINS]; TABLES],
            candidates: Vec::new(),
        }
    }

    /// The lower median of numbers ≥ 0; `None` of nothing.
    pub fn lower_median(&mut self, values: &[f32]) -> Option<f32> {
        let middle = values.len().checked_sub(1)? / 2;
        let bins = &mut self.bins;
        dispatch!(self.level, _simd => put_into_bins(values, bins));
        self.count();
        let [first, second, third, fourth] = &self.counts;
        let mut before = 0;
        let of_median = (0..BINS).position(|bin| {
            let count = (first[bin] + second[bin] + third[bin] + fourth[bin]) as usize;
            let within = middle < before + count;
            before += if within { 0 } else { count };
            within
        })?;
        let (bins, candidates) = (&self.bins, &mut self.candidates);
        candidates.clear();
        dispatch!(self.level, _simd => take_of(of_median as u16, bins, values, candidates));
        let place = middle - before;
        let (_, median, _) = self.candidates.select_nth_unstable_by(place, f32::total_cmp);
        Some(*median)
    }

    fn count(&mut self) {
        let [first, second, third, fourth] = &mut self.counts;
        for table in [&mut *first, &mut *second, &mut *third, &mut *fourth] {
            table.fill(0);
        }
        let (fours, rest) = self.bins.as_chunks::<TABLES>();
        // There are no 2³² numbers, and checks would cost a tenth of the time.
        let put = |table: &mut [u32; BINS], bin: u16| {
            let count = &mut table[usize::from(bin)];
            *count = count.wrapping_add(1);
        };
        for &[a, b, c, d] in fours {
            put(first, a);
            put(second, b);
            put(third, c);
            put(fourth, d);
        }
        for &bin in rest {
            put(first, bin);
        }
    }
}

#[inline(always)]
fn put_into_bins(values: &[f32], bins: &mut Vec<u16>) {
    bins.resize(values.len(), 0);
    for (of_value, &value) in bins.iter_mut().zip(values) {
        *of_value = bin(value);
    }
}

/// Adds the values of one bin. Few groups of sixteen hold one, and telling so takes a few instructions.
#[inline(always)]
fn take_of(wanted: u16, bins: &[u16], values: &[f32], taken: &mut Vec<f32>) {
    const GROUP: usize = 16;
    for (bins, values) in bins.chunks(GROUP).zip(values.chunks(GROUP)) {
        // Not `any`, which would stop early and so compare one by one.
        if bins.iter().fold(false, |found, &bin| found | (bin == wanted)) {
            let members = bins.iter().zip(values);
            taken.extend(members.filter(|(bin, _)| **bin == wanted).map(|(_, value)| value));
        }
    }
}

/// The bin of a number ≥ 0. The bits of such numbers are in the order of the numbers.
#[inline(always)]
pub(super) fn bin(value: f32) -> u16 {
    let octaves = (value.to_bits() >> IGNORED_BITS).saturating_sub(FIRST);
    octaves.min(BINS as u32 - 1) as u16
}

/// The least number of a bin; of the first, 0.
pub(super) fn least_of_bin(bin: u16) -> f32 {
    match bin {
        0 => 0.0,
        _ => f32::from_bits((u32::from(bin) + FIRST) << IGNORED_BITS),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn by_sorting(values: &[f32]) -> Option<f32> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f32::total_cmp);
        sorted.get(values.len().checked_sub(1)? / 2).copied()
    }

    proptest! {
        #[test]
        fn the_median_is_that_of_the_sorted_numbers(
            sets in prop::collection::vec(
                prop::collection::vec(
                    prop_oneof![0.0_f32..1e-3, 0.0_f32..300.0, 0.0_f32..1e6, Just(0.0), Just(49.0)],
                    0..60,
                ),
                1..4,
            )
        ) {
            let mut finder = MedianFinder::new();
            for values in sets {
                prop_assert_eq!(finder.lower_median(&values), by_sorting(&values));
            }
        }
    }
}
