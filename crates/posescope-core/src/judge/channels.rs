//! What a photo shows, three ways.

use image::imageops::blur;
use image::{GenericImageView as _, Luma};

use super::params::{Channels, JudgeParams};
use crate::image::{FloatImage, GrayImage, gaussian_smoothed};

/// Standard deviations from the mean of its surroundings at which a grey value is as dark or bright as
/// contrast goes.
const MAX_DEVIATIONS: f32 = 2.5;

/// What is added to the standard deviation of the surroundings, so that the noise of a flat wall is no
/// contrast \[grey value\].
const MIN_DEVIATION: f32 = 4.0;

/// The gradient at which edges are as strong as they go \[grey value per px\].
const MAX_EDGE: f32 = 60.0;

/// The side of the squares whose means stand for the surroundings \[px\].
const SQUARE: u32 = 4;

/// The channels of one photo, each 0 … 255, of its smoothed grey values.
pub fn channel_images(photo: &GrayImage, params: &JudgeParams) -> Vec<FloatImage> {
    let smoothed = gaussian_smoothed(photo, params.sigma_px);
    let contrast = || local_contrast(photo, &smoothed, params.contrast_sigma_px);
    match params.channels {
        Channels::Intensity => vec![smoothed],
        Channels::Contrast => vec![contrast()],
        Channels::Gradient => vec![edges(&smoothed)],
        Channels::Three => vec![contrast(), edges(&smoothed), smoothed],
    }
}

/// A place between two neighbours of a row or column.
#[derive(Clone, Copy)]
struct Between {
    first: usize,
    second: usize,
    /// How far from the first to the second.
    share: f32,
}

impl Between {
    /// The place among so many; beyond the border the nearest one.
    fn of(place: f32, count: u32) -> Self {
        let last = (count - 1) as f32;
        let place = place.clamp(0.0, last);
        // Not negative, so what is cut off is what lies beyond the first.
        let first = place as u32 as f32;
        let second = (first + 1.0).min(last);
        Self { first: first as usize, second: second as usize, share: place - first }
    }

    fn value(self, row: &[f32]) -> f32 {
        let first = row[self.first];
        first + self.share * (row[self.second] - first)
    }

    /// The two rows of an image.
    fn rows(self, image: &FloatImage) -> [&[f32]; 2] {
        let width = image.width() as usize;
        [self.first, self.second].map(|row| &image.as_raw()[row * width..(row + 1) * width])
    }
}

/// The value at a place between the pixels of two rows.
fn between([above, below]: [&[f32]; 2], along: Between, down: Between) -> f32 {
    let above = along.value(above);
    above + down.share * (along.value(below) - above)
}

/// The value between the pixels, linearly; beyond the border that of the nearest pixel.
pub fn linear(image: &FloatImage, x: f32, y: f32) -> f32 {
    let down = Between::of(y, image.height());
    between(down.rows(image), Between::of(x, image.width()), down)
}

/// The grey value less the mean of its surroundings, in their standard deviations.
fn local_contrast(photo: &GrayImage, smoothed: &FloatImage, sigma: f64) -> FloatImage {
    let (mean, deviation) = surroundings(photo, sigma);
    let scale = 1.0 / SQUARE as f32;
    let place = |pixel: u32| (pixel as f32 + 0.5) * scale - 0.5;
    let (width, height) = photo.dimensions();
    let columns: Vec<Between> = (0..width).map(|x| Between::of(place(x), mean.width())).collect();
    let mut contrast = smoothed.clone();
    for (y, row) in (0..height).zip(contrast.chunks_mut(columns.len().max(1))) {
        let down = Between::of(place(y), mean.height());
        let (means, spreads) = (down.rows(&mean), down.rows(&deviation));
        for (value, &along) in row.iter_mut().zip(&columns) {
            let above = *value - between(means, along, down);
            let deviations = above / (between(spreads, along, down) + MIN_DEVIATION);
            *value = 127.5 + 127.5 * (deviations / MAX_DEVIATIONS).clamp(-1.0, 1.0);
        }
    }
    contrast
}

/// Mean and standard deviation of the grey values around each square of the photo.
fn surroundings(photo: &GrayImage, sigma: f64) -> (FloatImage, FloatImage) {
    let squares = |of: &dyn Fn(f32) -> f32| {
        let (width, height) = photo.dimensions();
        let image = FloatImage::from_fn(width.div_ceil(SQUARE), height.div_ceil(SQUARE), |x, y| {
            let (left, top) = (x * SQUARE, y * SQUARE);
            let square = photo.view(left, top, SQUARE.min(width - left), SQUARE.min(height - top));
            let sum: f32 = square.pixels().map(|(_, _, pixel)| of(f32::from(pixel.0[0]))).sum();
            Luma([sum / (square.width() * square.height()) as f32])
        });
        blur(&image, sigma as f32 / SQUARE as f32)
    };
    let mean = squares(&|value| value);
    let mut deviation = squares(&|value| value * value);
    for (square, mean) in deviation.pixels_mut().zip(mean.pixels()) {
        square.0[0] = (square.0[0] - mean.0[0] * mean.0[0]).max(0.0).sqrt();
    }
    (mean, deviation)
}

/// The logarithm of the gradient's magnitude, by central differences.
fn edges(smoothed: &FloatImage) -> FloatImage {
    let (width, height) = smoothed.dimensions();
    let max_log = (1.0 + MAX_EDGE).ln();
    FloatImage::from_fn(width, height, |x, y| {
        let at = |x: u32, y: u32| smoothed.get_pixel(x, y).0[0];
        let along = at((x + 1).min(width - 1), y) - at(x.saturating_sub(1), y);
        let down = at(x, (y + 1).min(height - 1)) - at(x, y.saturating_sub(1));
        let magnitude = 0.5 * along.hypot(down);
        Luma([(255.0 * (1.0 + magnitude).ln() / max_log).min(255.0)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_between_pixels_are_on_the_line_and_those_beyond_the_border_are_of_the_nearest() {
        // A plane, so that all between is linear.
        let image = FloatImage::from_fn(5, 4, |x, y| Luma([10.0 * x as f32 - 3.0 * y as f32]));
        for (x, y) in [(0.0, 0.0), (1.5, 2.25), (3.75, 0.5), (4.0, 3.0)] {
            assert!((linear(&image, x, y) - (10.0 * x - 3.0 * y)).abs() < 1e-4, "{x} {y}");
        }
        assert_eq!(linear(&image, -2.0, 1.0), linear(&image, 0.0, 1.0));
        assert_eq!(linear(&image, 9.0, 7.5), linear(&image, 4.0, 3.0));
        let one = FloatImage::from_pixel(1, 1, Luma([7.0]));
        assert_eq!(linear(&one, 0.3, -1.0), 7.0);
    }

    #[test]
    fn contrast_is_that_of_the_place_and_none_where_all_is_even() {
        // Dark to the left and light to the right, by the same step at both brightnesses of the photo.
        let photo =
            |low: u8| GrayImage::from_fn(64, 32, |x, _| Luma([low + if x < 32 { 0 } else { 60 }]));
        let contrast = |photo: &GrayImage| {
            let smoothed = gaussian_smoothed(photo, 1.0);
            local_contrast(photo, &smoothed, 8.0)
        };
        let (dim, bright) = (contrast(&photo(20)), contrast(&photo(150)));
        assert!(dim.get_pixel(28, 16).0[0] < 100.0 && dim.get_pixel(36, 16).0[0] > 155.0);
        for (a, b) in dim.pixels().zip(bright.pixels()) {
            assert!((a.0[0] - b.0[0]).abs() < 0.5);
        }
        let even = contrast(&GrayImage::from_pixel(20, 10, Luma([90])));
        assert!(even.pixels().all(|pixel| (pixel.0[0] - 127.5).abs() < 0.5));
    }
}
