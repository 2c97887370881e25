//! Repeatable randomness on lattices: integer hashes, value noise and its anti-aliased sum.
//!
//! Everything here is built from integer hashes and the four basic operations, so that the same
//! bytes come out on every platform.

use nalgebra::{Point2, Point3, Vector2};

/// A well mixed hash of one word (the finaliser of MurmurHash3).
#[inline]
pub(super) fn mix(word: u32) -> u32 {
    let word = (word ^ (word >> 16)).wrapping_mul(0x85EB_CA6B);
    let word = (word ^ (word >> 13)).wrapping_mul(0xC2B2_AE35);
    word ^ (word >> 16)
}

const X: u32 = 0x9E37_79B1;
const Y: u32 = 0x85EB_CA77;
const Z: u32 = 0xC2B2_AE3D;
const SEED: u32 = 0x27D4_EB2F;

/// A hash of a lattice point.
#[inline]
pub(super) fn hash3(x: i32, y: i32, z: i32, seed: u32) -> u32 {
    let [x, y, z] = [(x, X), (y, Y), (z, Z)].map(|(at, factor)| terms(at, factor)[0]);
    mix((x ^ y ^ z).wrapping_add(seed.wrapping_mul(SEED)))
}

/// A hash of a lattice point of the plane.
#[inline]
pub(super) fn hash2(x: i32, y: i32, seed: u32) -> u32 {
    hash3(x, y, 0, seed)
}

/// The `stream`-th independent hash derived from `seed`.
#[inline]
pub(super) fn derive(seed: u32, stream: u32) -> u32 {
    mix(seed ^ mix(stream.wrapping_add(0x68BC_21EB)))
}

/// A hash as a number in 0 … 1.
#[inline]
pub(super) fn unit(hash: u32) -> f64 {
    f64::from(hash) * (1.0 / 4_294_967_296.0)
}

/// A nearly normal deviate (sum of six uniform ones; bounded by ±4.2 σ) of variance 1.
#[inline]
pub(super) fn normal(hash: u32) -> f64 {
    let bits = (u64::from(hash) << 32) | u64::from(mix(hash ^ 0xA511_E9B3));
    let sum: u64 = (0..6).map(|k| (bits >> (10 * k)) & 0x3FF).sum();
    (sum as f64 / 1023.0 - 3.0) * std::f64::consts::SQRT_2
}

/// The integer below `x`, several times as fast as [`f64::floor`] on the base x86-64 target.
#[inline]
pub(super) fn floor(x: f64) -> i32 {
    let truncated = x as i32;
    truncated - i32::from(x < f64::from(truncated))
}

#[inline]
fn cell(x: f64) -> (i32, f64) {
    let index = floor(x);
    (index, x - f64::from(index))
}

#[inline]
fn ease(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

#[inline]
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

#[inline]
fn signed(hash: u32) -> f64 {
    // As unit(hash) · 2 − 1, whose first product is exact.
    f64::from(hash) * (1.0 / 2_147_483_648.0) - 1.0
}

/// The terms of [`hash3`] for a coordinate and the next.
#[inline]
fn terms(coordinate: i32, factor: u32) -> [u32; 2] {
    let term = coordinate.cast_unsigned().wrapping_mul(factor);
    [term, term.wrapping_add(factor)]
}

/// Smooth noise along a line, −1 … 1, lattice spacing 1.
pub(super) fn value1(x: f64, seed: u32) -> f64 {
    let (i, t) = cell(x);
    lerp(signed(hash2(i, 0, seed)), signed(hash2(i + 1, 0, seed)), ease(t))
}

/// Smooth noise in the plane, −1 … 1, lattice spacing 1.
#[inline]
pub(super) fn value2(x: f64, y: f64, seed: u32) -> f64 {
    let ((i, tx), (j, ty)) = (cell(x), cell(y));
    let (tx, ty) = (ease(tx), ease(ty));
    let ([x0, x1], [y0, y1]) = (terms(i, X), terms(j, Y));
    let seed = seed.wrapping_mul(SEED);
    let [a, b, c, d] =
        [x0 ^ y0, x1 ^ y0, x0 ^ y1, x1 ^ y1].map(|word| signed(mix(word.wrapping_add(seed))));
    lerp(lerp(a, b, tx), lerp(c, d, tx), ty)
}

/// Smooth noise in space, −1 … 1, lattice spacing 1.
#[inline]
pub(super) fn value3(p: &Point3<f64>, seed: u32) -> f64 {
    let ((i, tx), (j, ty), (k, tz)) = (cell(p.x), cell(p.y), cell(p.z));
    let (tx, ty, tz) = (ease(tx), ease(ty), ease(tz));
    let ([x0, x1], [y0, y1], [z0, z1]) = (terms(i, X), terms(j, Y), terms(k, Z));
    let seed = seed.wrapping_mul(SEED);
    let layer = |z: u32| {
        let [a, b, c, d] = [x0 ^ y0, x1 ^ y0, x0 ^ y1, x1 ^ y1]
            .map(|word| signed(mix((word ^ z).wrapping_add(seed))));
        lerp(lerp(a, b, tx), lerp(c, d, tx), ty)
    };
    lerp(layer(z0), layer(z1), tz)
}

/// How much of a surface one pixel covers \[m\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    /// Extent along the surface's horizontal direction and across it.
    pub(super) along: Vector2<f64>,
    /// How far aside, to the right and up, one sees of what lies a metre behind the surface \[m\].
    pub(super) slant: Vector2<f64>,
    /// Least extent in any direction.
    pub(super) minor: f64,
    /// Greatest extent in any direction.
    pub(super) major: f64,
}

impl Footprint {
    /// What is left of the contrast of a texture whose grains are `grain` metres wide.
    ///
    /// A pixel that is long in one direction only averages few grains: their contrast falls with
    /// the square root of their number. Grains finer than the pixel in both directions vanish.
    #[inline]
    pub(super) fn contrast(&self, grain: f64) -> f64 {
        let resolved = (2.0 - 2.0 * self.minor / grain).clamp(0.0, 1.0);
        if self.major > grain { resolved * (grain / self.major).sqrt() } else { resolved }
    }
}

/// Contrast of an octave that is not worth its time.
const UNSEEN: f64 = 0.02;

/// Ratio of the grains of successive octaves.
const LACUNARITY: f64 = 2.3;

/// Sum of octaves of [`value2`]: grain widths `grain`, `grain / 2.3`, …; each octave `gain` times
/// as strong as the one before; octaves finer than the pixel are left out. Roughly −1 … 1.
pub(super) fn octaves(
    p: Point2<f64>,
    grain: f64,
    count: u32,
    gain: f64,
    footprint: &Footprint,
    seed: u32,
) -> f64 {
    let (mut sum, mut grain, mut amplitude) = (0.0, grain, 1.0);
    let mut p = p / grain;
    for octave in 0..count {
        let contrast = footprint.contrast(grain);
        if contrast <= UNSEEN {
            break;
        }
        let noise = value2(p.x, p.y, seed.wrapping_add(octave));
        sum += amplitude * contrast * noise;
        amplitude *= gain;
        grain *= 1.0 / LACUNARITY;
        p *= LACUNARITY;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn normal_deviates_have_mean_0_and_variance_1() {
        let samples: Vec<f64> = (0..20_000).map(|i| normal(mix(i))).collect();
        let mean = samples.iter().sum::<f64>() / 20_000.0;
        let variance = samples.iter().map(|x| x * x).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.03, "{mean}");
        assert!((variance - 1.0).abs() < 0.04, "{variance}");
    }

    #[test]
    fn grains_below_the_pixel_have_no_contrast() {
        let footprint = Footprint {
            along: Vector2::new(0.1, 0.4),
            slant: Vector2::zeros(),
            minor: 0.1,
            major: 0.4,
        };
        assert_eq!(footprint.contrast(0.1), 0.0);
        assert_eq!(footprint.contrast(10.0), 1.0);
        assert!(footprint.contrast(0.2) < 1.0);
    }

    proptest! {
        #[test]
        fn floor_agrees_with_the_standard_one(x in -1e6..1e6) {
            prop_assert_eq!(f64::from(floor(x)), f64::floor(x));
        }

        #[test]
        fn noise_is_bounded_and_continuous(x in -50.0..50.0, y in -50.0..50.0) {
            let here = value2(x, y, 7);
            prop_assert!((-1.0..=1.0).contains(&here));
            prop_assert!((here - value2(x + 1e-6, y, 7)).abs() < 1e-4);
            prop_assert!(value3(&Point3::new(x, y, x), 7).abs() <= 1.0);
        }
    }
}
