//! Sharp patterns, filtered over the pixel: steps, bars, rectangles, stripes and glyphs.
//!
//! Every function returns a coverage 0 … 1: the share of the pixel that the shape fills.

use super::noise::{floor, hash2};

/// Share of a pixel of extent `width` around `x` on the positive side of 0.
#[inline]
pub(super) fn step(x: f64, width: f64) -> f64 {
    (x / width + 0.5).clamp(0.0, 1.0)
}

/// The bar from `low` to `high`.
#[inline]
pub(super) fn bar(x: f64, low: f64, high: f64, width: f64) -> f64 {
    (step(x - low, width) - step(x - high, width)).max(0.0)
}

/// An axis-parallel rectangle `[u0, v0, u1, v1]`.
#[inline]
pub(super) fn rectangle(u: f64, v: f64, [u0, v0, u1, v1]: [f64; 4], width: (f64, f64)) -> f64 {
    bar(u, u0, u1, width.0) * bar(v, v0, v1, width.1)
}

/// Bars of `filled` metres that begin at every multiple of `period`, box-filtered exactly.
#[inline]
pub(super) fn stripes(x: f64, period: f64, filled: f64, width: f64) -> f64 {
    let integral = |x: f64| {
        let periods = f64::from(floor(x / period));
        periods * filled + (x - periods * period).min(filled)
    };
    ((integral(x + 0.5 * width) - integral(x - 0.5 * width)) / width).clamp(0.0, 1.0)
}

/// Ink of letter-like shapes: cells as high as `height`, 0.7 times as wide, each a random 4 × 5
/// bitmap with an empty margin. The line of letters begins at `u` = 0, `v` = 0.
pub(super) fn glyphs(u: f64, v: f64, height: f64, width: f64, seed: u32) -> f64 {
    /// Share of ink in a glyph cell; what is seen where letters are too small to be resolved.
    const MEAN_INK: f64 = 0.38;
    if !(0.0..height).contains(&v) {
        return 0.0;
    }
    let sharpness = (1.6 - 4.0 * width / height).clamp(0.0, 1.0);
    if sharpness == 0.0 {
        return MEAN_INK;
    }
    let (column, row) = (u / (0.7 * height) * 5.0, v / height * 6.0);
    let (cell, column) = (floor(column / 5.0), floor(column).rem_euclid(5));
    let row = floor(row);
    let letter = hash2(cell, 0, seed);
    let space = letter & 7 == 0;
    let inked = !space && column < 4 && row < 5 && letter >> (8 + column * 5 + row) & 1 == 1;
    // A vertical stem makes the bitmap look like a letter rather than like noise.
    let stem = !space && row < 5 && column == (letter >> 4 & 1).cast_signed() * 3;
    let ink = f64::from(u8::from(inked || stem));
    MEAN_INK + (ink - MEAN_INK) * sharpness
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_bar_thinner_than_the_pixel_covers_its_share_of_it() {
        assert!((bar(0.0, -0.05, 0.05, 1.0) - 0.1).abs() < 1e-12);
        assert_eq!(bar(0.0, -5.0, 5.0, 1.0), 1.0);
        assert_eq!(bar(9.0, -5.0, 5.0, 1.0), 0.0);
    }

    proptest! {
        #[test]
        fn unresolved_stripes_show_their_mean(x in -10.0..10.0) {
            prop_assert!((stripes(x, 0.1, 0.03, 20.0) - 0.3).abs() < 0.01);
        }

        #[test]
        fn resolved_stripes_are_on_or_off(k in -50_i32..50, t in 0.05..0.95_f64) {
            let x = f64::from(k) + t;
            let expected = f64::from(u8::from(t < 0.5));
            if (t - 0.5).abs() > 0.01 {
                prop_assert_eq!(stripes(x, 1.0, 0.5, 1e-3).round(), expected);
            }
        }
    }
}
