//! Descriptors for tests.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::features::Descriptor;

/// Descriptors of unit norm in random directions.
pub fn random_descriptors(count: usize, seed: u64) -> Vec<Descriptor> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..count).map(|_| normalized(std::array::from_fn(|_| rng.random_range(-1.0..1.0)))).collect()
}

/// Descriptors of unit norm near the centres, dealt out to them in turn; `spread` is the greatest
/// deviation of a number.
pub fn around(centres: &[Descriptor], count: usize, spread: f32, seed: u64) -> Vec<Descriptor> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|i| {
            let centre = centres[i % centres.len()];
            normalized(centre.map(|value| value + rng.random_range(-spread..spread)))
        })
        .collect()
}

fn normalized(descriptor: Descriptor) -> Descriptor {
    let norm = descriptor.iter().map(|value| value * value).sum::<f32>();
    descriptor.map(|value| value / norm.sqrt())
}
