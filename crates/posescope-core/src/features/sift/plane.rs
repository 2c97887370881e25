//! Images of real numbers, and the Gaussian that smooths them.

use fearless_simd::{Level, Simd, SimdBase as _, dispatch, f32x8};
use rayon::prelude::*;

/// The shortest side of an image that a Gaussian smooths \[px\].
pub(super) const SMALLEST_SIDE: usize = 16;
/// Standard deviations from its middle at which the Gaussian ends.
const REACH: f64 = 4.0;
/// Rows that a thread smooths at a time. With those that they are made of, they stay in the second-level cache; strips
/// that stay in the first-level cache are no faster.
const ROWS: usize = 16;

/// An image of real numbers, row by row.
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Plane {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height, values: vec![0.0; width * height] }
    }

    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..][..self.width]
    }

    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// Every second pixel of every second row.
    pub(super) fn halved(&self) -> Self {
        let mut half = Self::new(self.width / 2, self.height / 2);
        for (y, to) in half.values.chunks_mut(half.width.max(1)).enumerate() {
            for (to, from) in to.iter_mut().zip(self.row(2 * y).iter().step_by(2)) {
                *to = *from;
            }
        }
        half
    }
}

/// A Gaussian of unit sum.
pub(super) struct Gaussian {
    /// Its values from the middle outwards, at whole pixels.
    weights: Vec<f32>,
}

impl Gaussian {
    /// The Gaussian of this standard deviation \[px\].
    pub(super) fn new(sigma: f64) -> Self {
        // In double precision, so that single precision is the same with all mathematical libraries.
        let reach = (REACH * sigma).ceil().max(1.0) as usize;
        let weight = |away: usize| (-((away * away) as f64) / (2.0 * sigma * sigma)).exp();
        let sum = weight(0) + 2.0 * (1..=reach).map(weight).sum::<f64>();
        Self { weights: (0..=reach).map(|away| (weight(away) / sum) as f32).collect() }
    }

    /// The convolution with an image, whose sides are at least [`SMALLEST_SIDE`] and whose outermost pixels are
    /// repeated.
    pub(super) fn smoothed(&self, image: &Plane) -> Plane {
        let mut smoothed = Plane::new(image.width, image.height);
        let level = Level::new();
        let bands = smoothed.values.par_chunks_mut(ROWS * image.width).enumerate();
        bands.for_each_init(Vec::new, |padded, (band, into)| {
            let top = band * ROWS;
            dispatch!(level, simd => {
                if image.width < 32 {
                    self.smooth::<_, 2>(simd, image, top, into, padded);
                } else {
                    self.smooth::<_, 4>(simd, image, top, into, padded);
                }
            });
        });
        smoothed
    }

    /// Smooths the rows from `top` on, first downwards and then along, `VECTORS` times eight pixels at a time.
    #[inline(always)]
    fn smooth<S: Simd, const VECTORS: usize>(
        &self,
        simd: S,
        image: &Plane,
        top: usize,
        into: &mut [f32],
        padded: &mut Vec<f32>,
    ) {
        let (width, reach, at_once) = (image.width, self.weights.len() - 1, 8 * VECTORS);
        let (rows, stride) = (into.len() / width, width + 2 * reach);
        let start_of = |row: usize| {
            let row = (top + row).saturating_sub(reach).min(image.height - 1);
            row * width
        };
        let starts: Vec<usize> = (0..rows + 2 * reach).map(start_of).collect();
        padded.resize(ROWS * stride, 0.0);
        for (y, row) in padded.chunks_exact_mut(stride).take(rows).enumerate() {
            for x in (0..width).step_by(at_once) {
                // The last of a row overlap with those before.
                let x = x.min(width - at_once);
                let places =
                    |away: usize| [starts[y + reach - away] + x, starts[y + reach + away] + x];
                let to = &mut row[reach + x..][..at_once];
                weigh::<S, VECTORS>(simd, &self.weights, &image.values, places, to);
            }
        }
        let rows = padded.chunks_exact_mut(stride).zip(into.chunks_exact_mut(width));
        for (row, into) in rows {
            let (first, last) = (row[reach], row[reach + width - 1]);
            row[..reach].fill(first);
            row[reach + width..].fill(last);
            for x in (0..width).step_by(at_once) {
                let x = x.min(width - at_once);
                let places = |away: usize| [x + reach - away, x + reach + away];
                let to = &mut into[x..][..at_once];
                weigh::<S, VECTORS>(simd, &self.weights, row, places, to);
            }
        }
    }
}

/// The weighted sum of what begins at the two places for each distance from the middle.
#[inline(always)]
fn weigh<S: Simd, const VECTORS: usize>(
    simd: S,
    weights: &[f32],
    from: &[f32],
    places: impl Fn(usize) -> [usize; 2],
    into: &mut [f32],
) {
    let lanes = |place: usize| from[place..][..8 * VECTORS].as_chunks::<8>().0;
    let mut sums = [f32x8::splat(simd, 0.0); VECTORS];
    let [middle, _] = places(0);
    for (sum, lanes) in sums.iter_mut().zip(lanes(middle)) {
        *sum = f32x8::from_slice(simd, lanes) * weights[0];
    }
    for (away, &weight) in weights.iter().enumerate().skip(1) {
        let [before, behind] = places(away);
        let both = lanes(before).iter().zip(lanes(behind));
        for (sum, (before, behind)) in sums.iter_mut().zip(both) {
            let pair = f32x8::from_slice(simd, before) + f32x8::from_slice(simd, behind);
            *sum += pair * weight;
        }
    }
    for (sum, into) in sums.iter().zip(into.as_chunks_mut::<8>().0) {
        sum.store_slice(into);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the definition of the convolution says.
    fn plainly(image: &Plane, weights: &[f32]) -> Vec<f64> {
        let reach = weights.len() as i64 - 1;
        let at = |x: i64, y: i64| {
            let inside = |place: i64, side: usize| place.clamp(0, side as i64 - 1) as usize;
            f64::from(image.at(inside(x, image.width), inside(y, image.height)))
        };
        let weight = |away: i64| f64::from(weights[away.unsigned_abs() as usize]);
        let (width, height) = (image.width as i64, image.height as i64);
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let places = (-reach..=reach).flat_map(|v| (-reach..=reach).map(move |u| (u, v)));
                places.map(|(u, v)| weight(u) * weight(v) * at(x + u, y + v)).sum()
            })
            .collect()
    }

    #[test]
    fn images_of_all_sizes_are_convolved_as_the_definition_says() {
        for (width, height) in [(16, 16), (17, 40), (31, 19), (32, 33), (45, 16), (300, 18)] {
            let mut image = Plane::new(width, height);
            for (place, value) in image.values.iter_mut().enumerate() {
                *value = (place * 7919 % 251) as f32 / 251.0;
            }
            for sigma in [0.6, 1.2, 3.1] {
                let gaussian = Gaussian::new(sigma);
                let smoothed = gaussian.smoothed(&image);
                let expected = plainly(&image, &gaussian.weights);
                for (value, expected) in smoothed.values.iter().zip(expected) {
                    assert!((f64::from(*value) - expected).abs() < 1e-5, "{width} × {height}");
                }
            }
        }
    }

    #[test]
    fn half_an_image_has_every_second_pixel() {
        let image =
            Plane { width: 5, height: 4, values: (0..20).map(|value| value as f32).collect() };
        let half = image.halved();
        assert_eq!((half.width, half.height), (2, 2));
        assert_eq!(half.values, [0.0, 2.0, 10.0, 12.0]);
    }
}
