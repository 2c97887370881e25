//! 1 − NMI, less what chance gives.

use crate::cost::{Entropies, MIN_ENTROPY};

/// 1 − NMI of the counts of a joint histogram, `bins` × `bins`, rows the query's. `corrected` takes its
/// chance level off the information first; `None` where both images are constant.
///
/// Two images that have nothing to do with each other share (b_Q − 1)(b_S − 1)/2N nat on average, with
/// b occupied bins of N pixels (Miller, *Note on the Bias of Information Estimates*, 1955; Roulston,
/// Physica D 125, 1999). Without the correction a pose that covers few pixels looks informed. With it the
/// cost of what is worse than chance lies above 1.
pub fn corrected_distance(counts: &[u32], bins: usize, corrected: bool) -> Option<f64> {
    let entropies = Entropies::of(counts, bins);
    let larger = entropies.query.max(entropies.synthetic);
    if larger <= MIN_ENTROPY {
        return None;
    }
    let by_chance = if corrected { chance_level(counts, bins) } else { 0.0 };
    Some(1.0 - (entropies.mutual_information() - by_chance) / larger)
}

/// Information that independent images of these counts share on average \[nat\].
fn chance_level(counts: &[u32], bins: usize) -> f64 {
    let mut columns = vec![0_u32; bins];
    let (mut rows, mut pixels) = (0_u32, 0_u64);
    for row in counts.chunks(bins) {
        let mut sum = 0;
        for (column, &count) in columns.iter_mut().zip(row) {
            *column += count;
            sum += count;
        }
        rows += u32::from(sum > 0);
        pixels += u64::from(sum);
    }
    let columns = columns.iter().filter(|&&count| count > 0).count();
    let free = f64::from(rows.saturating_sub(1)) * columns.saturating_sub(1) as f64;
    free / (2.0 * pixels.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64;

    /// The counts of independent, even values.
    fn independent(pixels: usize, bins: usize, seed: u64) -> Vec<u32> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut counts = vec![0; bins * bins];
        for _ in 0..pixels {
            counts[rng.random_range(0..bins) * bins + rng.random_range(0..bins)] += 1;
        }
        counts
    }

    #[test]
    fn independent_images_cost_one_however_few_their_pixels() {
        for pixels in [1_500, 10_000] {
            let mean = |corrected| {
                let costs = (0..200).map(|seed| {
                    let counts = independent(pixels, 16, seed);
                    corrected_distance(&counts, 16, corrected).expect("textured")
                });
                costs.sum::<f64>() / 200.0
            };
            assert!((mean(true) - 1.0).abs() < 2e-3, "{pixels}: {}", mean(true));
            assert!(mean(false) < 0.998, "{pixels}: {}", mean(false));
        }
    }

    #[test]
    fn equal_images_cost_what_the_correction_takes_and_constants_have_no_cost() {
        let mut counts = vec![0; 256];
        for bin in 0..16 {
            counts[bin * 16 + bin] = 100;
        }
        let larger = 16.0_f64.ln();
        let expected = 15.0 * 15.0 / 3200.0 / larger;
        let cost = corrected_distance(&counts, 16, true).expect("textured");
        assert!((cost - expected).abs() < 1e-12);
        assert!(corrected_distance(&counts, 16, false).expect("textured").abs() < 1e-12);
        let mut constant = vec![0; 256];
        constant[37] = 200;
        assert_eq!(corrected_distance(&constant, 16, true), None);
    }
}
