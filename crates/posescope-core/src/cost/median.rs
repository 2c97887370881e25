//! The median of many numbers, one set after another.

/// Bits of a number that do not decide its bin: each octave has 32 bins.
const IGNORED_BITS: u32 = 18;
/// All numbers below have one bin. Of squared differences of grey values such are few.
const LEAST: f32 = 1.0 / 256.0;
const BINS: usize = 32 * 24 + 2;

/// Finds medians in time linear in the numbers and without asking for memory each time.
///
/// The numbers are counted in bins that grow with them, so only those in the median's own bin, some
/// three in a hundred, are compared with each other.
pub(super) struct MedianFinder {
    counts: Vec<u32>,
    candidates: Vec<f32>,
}

impl MedianFinder {
    pub fn new() -> Self {
        Self {
            counts: vec![0; BINS],
            candidates: Vec::new(),
        }
    }

    /// The lower median of numbers ≥ 0; `None` of nothing.
    pub fn lower_median(&mut self, values: &[f32]) -> Option<f32> {
        let middle = values.len().checked_sub(1)? / 2;
        self.counts.fill(0);
        for &value in values {
            // There are no 2³² numbers, and a check would cost a tenth of the time.
            let count = &mut self.counts[bin(value)];
            *count = count.wrapping_add(1);
        }
        let mut before = 0;
        let of_median = self.counts.iter().position(|&count| {
            let within = middle < before + count as usize;
            before += if within { 0 } else { count as usize };
            within
        })?;
        self.candidates.clear();
        let candidates = values.iter().filter(|&&value| bin(value) == of_median);
        self.candidates.extend(candidates);
        let place = middle - before;
        let (_, median, _) = self
            .candidates
            .select_nth_unstable_by(place, f32::total_cmp);
        Some(*median)
    }
}

/// The bin of a number ≥ 0. The bits of such numbers are in the order of the numbers.
#[inline]
fn bin(value: f32) -> usize {
    let first = LEAST.to_bits() >> IGNORED_BITS;
    let octaves = (value.to_bits() >> IGNORED_BITS).saturating_sub(first);
    (octaves as usize).min(BINS - 1)
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
