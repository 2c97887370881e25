//! How the values of two images fall together: counts, entropies, and what they share.

use std::sync::LazyLock;

use fearless_simd::{Level, dispatch};

use super::{BinPair, IntensityPair};

/// How often each pair of grey values occurs, and the entropies that follow \[nat\].
#[derive(Clone, Debug, PartialEq)]
pub struct JointHistogram {
    /// Bins per axis.
    pub bins: usize,
    /// Counts, `bins` × `bins`; rows are the query's bins, columns the synthetic view's.
    pub counts: Vec<u32>,
    /// The entropies of the counts.
    pub entropies: Entropies,
}

impl JointHistogram {
    /// Counts the pairs; values fall into `bins` equal intervals of 0 … 255, 255 into the last one.
    ///
    /// # Panics
    /// When `bins` is 0.
    pub fn of(pairs: &[IntensityPair], bins: usize) -> Self {
        let mut counts = vec![0; bins * bins];
        for pair in pairs {
            counts[cell(pair, bins)] += 1;
        }
        Self { bins, entropies: Entropies::of(&counts, bins), counts }
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
        let rows: Vec<f64> = counts.chunks(*bins).map(|row| sum(&mut row.iter())).collect();
        let columns: Vec<f64> =
            (0..*bins).map(|column| sum(&mut counts.iter().skip(column).step_by(*bins))).collect();
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
}

/// The entropy below which an image counts as constant \[nat\]. That of a constant comes out as 0 or, for
/// one number of pixels in fifty, as some 1e-16, whose quotients mean nothing. The least entropy that is
/// one, of a single pixel that differs among a million, is a thousand times as large.
pub const MIN_ENTROPY: f64 = 1e-9;

/// The entropies of two images and of both together \[nat\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entropies {
    /// H(I_Q).
    pub query: f64,
    /// H(I_S).
    pub synthetic: f64,
    /// H(I_S, I_Q).
    pub joint: f64,
}

impl Entropies {
    /// Those of the counts of a joint histogram, `bins` × `bins`.
    pub fn of(counts: &[u32], bins: usize) -> Self {
        let total = counts.iter().sum();
        let rows = counts.chunks(bins).map(|row| row.iter().sum());
        let columns = (0..bins).map(|column| counts.iter().skip(column).step_by(bins).sum());
        Self {
            query: entropy(rows, total),
            synthetic: entropy(columns, total),
            joint: entropy(counts.iter().copied(), total),
        }
    }

    /// NMI in 0 … 1, normalised by the larger entropy; `None` where an image is constant.
    pub fn normalized_mutual_information(&self) -> Option<f64> {
        let smaller = self.query.min(self.synthetic);
        let larger = self.query.max(self.synthetic);
        (smaller > MIN_ENTROPY).then(|| (self.mutual_information() / larger).clamp(0.0, 1.0))
    }

    /// I(Q, S) = H(Q) + H(S) − H(S, Q) \[nat\].
    pub fn mutual_information(&self) -> f64 {
        self.query + self.synthetic - self.joint
    }
}

/// The one of `bins` equal intervals of 0 … 255 that a value falls into; the last one takes 255.
#[inline]
pub fn bin(value: f32, bins: usize) -> usize {
    let scale = bins as f32 / 256.0;
    ((value * scale) as usize).min(bins - 1)
}

/// The most bins that a byte can number.
pub const MAX_BYTE_BINS: usize = 256;

/// As [`bin`], for 256 bins at most.
#[inline]
pub fn byte_bin(value: f32, bins: usize) -> u8 {
    let scale = bins as f32 / 256.0;
    ((value * scale) as u8).min((bins - 1) as u8)
}

/// Counts pairs by the bins `of` both values, in the place of what `counts` held: `bins` × `bins`, rows are the
/// query's.
pub fn count_pairs<P>(pairs: &[P], of: impl Fn(&P) -> BinPair, bins: usize, counts: &mut Vec<u32>) {
    let cells = bins * bins;
    counts.clear();
    counts.resize(cells, 0);
    let level = Level::new();
    match cells {
        ..=256 => dispatch!(level, _simd => count_apart::<_, 256>(pairs, of, bins, counts)),
        257..=1024 => dispatch!(level, _simd => count_apart::<_, 1024>(pairs, of, bins, counts)),
        // Of large tables, adding up several would take longer than that saves.
        _ => {
            for pair in pairs.iter().map(of) {
                counts[usize::from(pair.query) * bins + usize::from(pair.synthetic)] += 1;
            }
        }
    }
}

/// Counts pairs in several tables of `CELLS` cells, a power of two: neighbours often fall into the same cell, and
/// counted apart, no count waits for the last one. The numbers of many cells are made at once.
#[inline(always)]
fn count_apart<P, const CELLS: usize>(
    pairs: &[P],
    of: impl Fn(&P) -> BinPair,
    bins: usize,
    counts: &mut [u32],
) {
    const AT_A_TIME: usize = 512;
    let mut tables = [[0_u32; CELLS]; 4];
    let mut cells = [0_u16; AT_A_TIME];
    for pairs in pairs.chunks(AT_A_TIME) {
        for (cell, pair) in cells.iter_mut().zip(pairs) {
            let BinPair { query, synthetic } = of(pair);
            *cell = u16::from(query).wrapping_mul(bins as u16).wrapping_add(synthetic.into());
        }
        let [a, b, c, d] = &mut tables;
        // A view has no 2³² pixels, and checks would cost a tenth of the time.
        let put = |table: &mut [u32; CELLS], cell: u16| {
            let count = &mut table[usize::from(cell) % CELLS];
            *count = count.wrapping_add(1);
        };
        let (fours, rest) = cells[..pairs.len()].as_chunks::<4>();
        for &[first, second, third, fourth] in fours {
            put(a, first);
            put(b, second);
            put(c, third);
            put(d, fourth);
        }
        for &cell in rest {
            put(a, cell);
        }
    }
    let [a, b, c, d] = &tables;
    for (cell, count) in counts.iter_mut().enumerate() {
        *count = a[cell] + b[cell] + c[cell] + d[cell];
    }
}

fn cell(pair: &IntensityPair, bins: usize) -> usize {
    bin(pair.query, bins) * bins + bin(pair.synthetic, bins)
}

/// H = log n − (Σ c log c) / n, with n = Σ c \[nat\].
fn entropy(counts: impl Iterator<Item = u32>, total: u32) -> f64 {
    if total == 0 {
        return 0.0;
    }
    let sum: f64 = counts.map(count_log_count).sum();
    let total = f64::from(total);
    (total.ln() - sum / total).max(0.0)
}

/// c log c, from a table for the counts that most cells have.
#[inline]
fn count_log_count(count: u32) -> f64 {
    static TABLE: LazyLock<Vec<f64>> = LazyLock::new(|| (0..4096).map(calculated).collect());
    fn calculated(count: u32) -> f64 {
        match count {
            0 => 0.0,
            _ => f64::from(count) * f64::from(count).ln(),
        }
    }
    let known = TABLE.get(count as usize);
    known.copied().unwrap_or_else(|| calculated(count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bins_are_counted_as_the_values_that_fell_into_them(
            values in prop::collection::vec((0.0_f32..=255.0, 0.0_f32..=255.0), 0..200),
            bins in prop_oneof![Just(2_usize), Just(16), Just(17), Just(32), Just(33), Just(256)],
        ) {
            let pairs: Vec<_> = values
                .iter()
                .map(|&(query, synthetic)| IntensityPair { query, synthetic })
                .collect();
            let binned: Vec<BinPair> = pairs
                .iter()
                .map(|pair| BinPair {
                    query: byte_bin(pair.query, bins),
                    synthetic: byte_bin(pair.synthetic, bins),
                })
                .collect();
            let mut counts = vec![7; 3];
            count_pairs(&binned, |pair| *pair, bins, &mut counts);
            prop_assert_eq!(counts, JointHistogram::of(&pairs, bins).counts);
        }
    }

    proptest! {
        #[test]
        fn a_bin_is_the_same_as_a_byte(bits: u32, bins in 2_usize..=256) {
            let value = f32::from_bits(bits);
            prop_assert_eq!(usize::from(byte_bin(value, bins)), bin(value, bins));
        }
    }

    #[test]
    fn a_constant_has_no_information_whatever_the_number_of_its_pixels() {
        let mut not_zero = 0;
        for count in 1..=5_000_u32 {
            let mut counts = vec![0; 256];
            counts[37] = count;
            let entropies = Entropies::of(&counts, 16);
            not_zero += u32::from(entropies.query > 0.0);
            assert_eq!(entropies.normalized_mutual_information(), None, "{count}");
        }
        assert!(not_zero > 0, "the counts that come out as 1e-16 are among them");
        let mut one_differs = vec![0; 256];
        (one_differs[37], one_differs[38]) = (1_000_000, 1);
        let entropies = Entropies::of(&one_differs, 16);
        assert!(entropies.synthetic > 1_000.0 * MIN_ENTROPY);
    }

    #[test]
    fn a_count_has_one_logarithm_be_it_in_the_table_or_not() {
        for count in [2_u32, 4095, 4096, 1 << 20] {
            let count_as_real = f64::from(count);
            assert_eq!(count_log_count(count), count_as_real * count_as_real.ln());
        }
        assert_eq!(count_log_count(0), 0.0);
        assert_eq!(count_log_count(1), 0.0);
    }
}
