//! Demosaicing of Bayer images.

use image::{GrayImage, Rgb, RgbImage};

/// The colours of the top-left 2 × 2 pixels, row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pattern {
    Gbrg,
    Rggb,
}

impl Pattern {
    /// The channel of a pixel: 0 red, 1 green, 2 blue.
    pub(super) fn channel(self, x: u32, y: u32) -> usize {
        let tile = match self {
            Self::Gbrg => [[1, 2], [0, 1]],
            Self::Rggb => [[0, 1], [1, 2]],
        };
        tile[(y % 2) as usize][(x % 2) as usize]
    }
}

/// The colour photo. Missing values are bilinearly interpolated, as in the SDK.
pub(super) fn demosaiced(raw: &GrayImage, pattern: Pattern) -> RgbImage {
    let (width, height) = raw.dimensions();
    RgbImage::from_fn(width, height, |x, y| {
        let mut sums = [0_u32; 3];
        let mut weights = [0_u32; 3];
        for ny in y.saturating_sub(1)..=(y + 1).min(height - 1) {
            for nx in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                // 4 at the pixel, 2 beside it, 1 across a corner.
                let weight = 4 >> (x.abs_diff(nx) + y.abs_diff(ny));
                let channel = pattern.channel(nx, ny);
                sums[channel] += weight * u32::from(raw.get_pixel(nx, ny).0[0]);
                weights[channel] += weight;
            }
        }
        let own = pattern.channel(x, y);
        Rgb(std::array::from_fn(|channel| match (channel == own, weights[channel]) {
            (true, _) => raw.get_pixel(x, y).0[0],
            (false, 0) => 0,
            (false, weight) => ((sums[channel] + weight / 2) / weight) as u8,
        }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plain_colour_comes_back_from_both_patterns() {
        let color = Rgb([200, 90, 30]);
        for pattern in [Pattern::Gbrg, Pattern::Rggb] {
            let raw =
                GrayImage::from_fn(7, 6, |x, y| image::Luma([color.0[pattern.channel(x, y)]]));
            assert!(demosaiced(&raw, pattern).pixels().all(|pixel| *pixel == color));
        }
    }

    #[test]
    fn patterns_begin_as_they_are_called() {
        let first =
            |pattern: Pattern| [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| pattern.channel(x, y));
        assert_eq!(first(Pattern::Gbrg), [1, 2, 0, 1]);
        assert_eq!(first(Pattern::Rggb), [0, 1, 1, 2]);
    }
}
