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

/// The value between the pixels, linearly; beyond the border that of the nearest pixel.
pub fn linear(image: &FloatImage, x: f32, y: f32) -> f32 {
    let (last_x, last_y) = ((image.width() - 1) as f32, (image.height() - 1) as f32);
    let (x, y) = (x.clamp(0.0, last_x), y.clamp(0.0, last_y));
    let (left, top) = (x.floor(), y.floor());
    let (right, bottom) = ((left + 1.0).min(last_x), (top + 1.0).min(last_y));
    let at = |x: f32, y: f32| image.get_pixel(x as u32, y as u32).0[0];
    let (along, down) = (x - left, y - top);
    let above = at(left, top) + along * (at(right, top) - at(left, top));
    let below = at(left, bottom) + along * (at(right, bottom) - at(left, bottom));
    above + down * (below - above)
}

/// The grey value less the mean of its surroundings, in their standard deviations.
fn local_contrast(photo: &GrayImage, smoothed: &FloatImage, sigma: f64) -> FloatImage {
    let (mean, deviation) = surroundings(photo, sigma);
    let scale = 1.0 / SQUARE as f32;
    FloatImage::from_fn(photo.width(), photo.height(), |x, y| {
        let place = |pixel: u32| (pixel as f32 + 0.5) * scale - 0.5;
        let (u, v) = (place(x), place(y));
        let above = smoothed.get_pixel(x, y).0[0] - linear(&mean, u, v);
        let deviations = above / (linear(&deviation, u, v) + MIN_DEVIATION);
        let share = (deviations / MAX_DEVIATIONS).clamp(-1.0, 1.0);
        Luma([127.5 + 127.5 * share])
    })
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
