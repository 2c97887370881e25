//! The grey values of photos with 16 bits. Cameras often use a small part of their range.

use std::path::Path;

use image::DynamicImage;
use image::buffer::ConvertBuffer as _;

use super::decode;
use crate::image::{GrayImage, Photo, RgbImage};

/// The photos that decide the range.
const SAMPLE: usize = 8;
/// The share of the darkest and of the brightest values that do not count: pixels that are broken.
const STRAY: f64 = 0.001;

/// The values of 16 bits that become 0 and 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) struct GrayRange {
    pub low: u16,
    pub high: u16,
}

impl GrayRange {
    const FULL: Self = Self { low: 0, high: u16::MAX };

    /// The range of photos, from some of them, evenly from first to last. Photos that cannot be read do not count.
    pub fn of<'a>(photos: impl ExactSizeIterator<Item = &'a Path>) -> Self {
        let step = photos.len().div_ceil(SAMPLE).max(1);
        let mut counts = vec![0_u64; 1 << 16];
        for path in photos.step_by(step) {
            if let Ok(image) = decode(path) {
                for value in values(&image) {
                    counts[usize::from(*value)] += 1;
                }
            }
        }
        Self::of_counts(&counts)
    }

    /// The range of a histogram.
    fn of_counts(counts: &[u64]) -> Self {
        let stray = counts.iter().sum::<u64>() as f64 * STRAY;
        let is_beyond_stray = |sum: &mut u64, value: usize| {
            *sum += counts[value];
            *sum as f64 > stray
        };
        let (mut darker, mut brighter) = (0, 0);
        let low = (0..counts.len()).find(|value| is_beyond_stray(&mut darker, *value));
        let high = (0..counts.len()).rev().find(|value| is_beyond_stray(&mut brighter, *value));
        let (Some(low), Some(high)) = (low, high) else {
            return Self::FULL;
        };
        // Values from near 0 on use the lower bits: 12 of them, for example.
        if low < high / 2 || low == high {
            let bits = (usize::BITS - high.leading_zeros()).max(8);
            return Self { low: 0, high: ((1_u32 << bits) - 1) as u16 };
        }
        Self { low: low as u16, high: high as u16 }
    }

    /// Whether it is all that 16 bits have.
    pub fn is_full(self) -> bool {
        self == Self::FULL
    }

    fn scaled(self, value: u16) -> u8 {
        let [low, high] = [self.low, self.high].map(u32::from);
        let across = high - low;
        let above = u32::from(value).clamp(low, high) - low;
        ((255 * above + across / 2) / across) as u8
    }
}

/// The values of an image with 16 bits, without those of its transparency where they stand apart.
fn values(image: &DynamicImage) -> &[u16] {
    match image {
        DynamicImage::ImageLuma16(image) => image.as_raw(),
        DynamicImage::ImageRgb16(image) => image.as_raw(),
        _ => &[],
    }
}

/// The photo of a decoded image. `range` is asked for if its values have 16 bits.
pub(in crate::scene) fn photo(image: DynamicImage, range: impl FnOnce() -> GrayRange) -> Photo {
    let opaque = match image {
        DynamicImage::ImageLumaA16(image) => DynamicImage::ImageLuma16(image.convert()),
        DynamicImage::ImageRgba16(image) => DynamicImage::ImageRgb16(image.convert()),
        other => other,
    };
    let range = if values(&opaque).is_empty() { GrayRange::FULL } else { range() };
    match opaque {
        DynamicImage::ImageLuma16(image) if !range.is_full() => {
            let scaled = image.as_raw().iter().map(|value| range.scaled(*value)).collect();
            let gray = GrayImage::from_raw(image.width(), image.height(), scaled);
            Photo::from_gray(gray.unwrap_or_default())
        }
        DynamicImage::ImageRgb16(image) if !range.is_full() => {
            let scaled = image.as_raw().iter().map(|value| range.scaled(*value)).collect();
            let color = RgbImage::from_raw(image.width(), image.height(), scaled);
            Photo::from_color(color.unwrap_or_default())
        }
        image if image.color().has_color() => Photo::from_color(image.into_rgb8()),
        image => Photo::from_gray(image.into_luma8()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Luma};

    fn range(values: impl Iterator<Item = usize>) -> GrayRange {
        let mut counts = vec![0; 1 << 16];
        values.for_each(|value| counts[value] += 1);
        GrayRange::of_counts(&counts)
    }

    #[test]
    fn a_range_is_that_of_the_bits_in_use_or_of_the_values() {
        let twelve = GrayRange { low: 0, high: 4095 };
        assert_eq!(range((0..10_000).map(|at| 16 * (at % 256))), twelve);
        // Broken pixels change nothing.
        assert_eq!(range((0..10_000).map(|at| at % 4000).chain([65_535; 5])), twelve);
        assert_eq!(range((0..10_000).map(|at| 257 * (at % 256))), GrayRange::FULL);
        assert_eq!(range(std::iter::empty()), GrayRange::FULL);
        let thermal = range((0..30_000).map(|at| 29_000 + at % 1500));
        assert!(
            thermal.low.abs_diff(29_000) < 5 && thermal.high.abs_diff(30_500) < 5,
            "{thermal:?}"
        );
        assert_eq!(thermal.scaled(0), 0);
        assert_eq!(thermal.scaled(29_750), 128);
        assert_eq!(thermal.scaled(u16::MAX), 255);
    }

    #[test]
    fn twelve_bits_give_the_photo_that_eight_bits_give() {
        let gray = GrayImage::from_fn(64, 32, |x, y| Luma([(3 * x + y) as u8]));
        let twelve: ImageBuffer<Luma<u16>, Vec<u16>> = ImageBuffer::from_fn(64, 32, |x, y| {
            Luma([(u32::from(gray.get_pixel(x, y).0[0]) * 4095 / 255) as u16])
        });
        let scaled = photo(twelve.into(), || GrayRange { low: 0, high: 4095 });
        let pairs = scaled.gray.as_raw().iter().zip(gray.as_raw());
        assert!(pairs.into_iter().all(|(a, b)| a.abs_diff(*b) <= 1));
        let same = photo(gray.clone().into(), || panic!("8 bits have no range"));
        assert_eq!(same.gray, gray);
    }
}
