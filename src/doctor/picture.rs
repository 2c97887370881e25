//! A picture of a cloud on its photo.

use image::{Rgb, imageops};
use nalgebra::Point2;

use super::agreement::Seen;
use crate::image::{GrayImage, RgbImage};
use crate::palette;

/// The darkened photo with the points on it, near ones red, far ones blue.
pub(super) fn cloud_on(photo: &GrayImage, seen: &[Seen]) -> RgbImage {
    let mut canvas = image::DynamicImage::ImageLuma8(imageops::brighten(photo, -30)).into_rgb8();
    let mut depths: Vec<f64> = seen.iter().map(|seen| seen.depth).collect();
    depths.sort_by(f64::total_cmp);
    let at = |share: f64| depths.get((share * depths.len() as f64) as usize).copied();
    let (near, far) = (at(0.05).unwrap_or(1.0), at(0.95).unwrap_or(2.0));
    let radius = i64::from(photo.width() / 900);
    let mut far_first: Vec<&Seen> = seen.iter().collect();
    far_first.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    for seen in far_first {
        let share = ((seen.depth / near).ln() / (far / near).ln().max(1e-6)).clamp(0.0, 1.0);
        let place = seen.pixel.map(|part| part.round() as i64);
        dot(&mut canvas, place, radius, palette::turbo(1.0 - share));
    }
    canvas
}

/// Draws a square around a pixel, clipped to the picture.
pub(super) fn dot(canvas: &mut RgbImage, at: Point2<i64>, radius: i64, color: palette::Rgb) {
    for (x, y) in (-radius..=radius).flat_map(|y| (-radius..=radius).map(move |x| (x, y))) {
        if let (Ok(x), Ok(y)) = (u32::try_from(at.x + x), u32::try_from(at.y + y))
            && let Some(pixel) = canvas.get_pixel_mut_checked(x, y)
        {
            *pixel = Rgb(color);
        }
    }
}
