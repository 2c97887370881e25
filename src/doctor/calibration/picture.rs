//! Depth edges on a photo, as stated and as found.

use image::imageops;
use nalgebra::Point2;

use super::search::{Frame, Values};
use crate::doctor::picture::dot;
use crate::image::RgbImage;
use crate::palette;
use crate::scene::Scene;

/// The photo of the frame with the most depth edges, twice: with the edges as stated above, and as found below.
pub(super) fn before_and_after(scene: &dyn Scene, frames: &[Frame], found: &Values) -> RgbImage {
    let most = frames.iter().max_by_key(|frame| frame.edges.len());
    let Some((frame, photo)) = most.and_then(|most| Some((most, scene.photo(most.at).ok()?)))
    else {
        return RgbImage::default();
    };
    let dark = image::DynamicImage::ImageLuma8(imageops::brighten(&photo.gray, -40)).into_rgb8();
    let (width, height) = dark.dimensions();
    let mut picture = RgbImage::new(width, 2 * height);
    let radius = i64::from(width / 900);
    for (row, values) in [Values::zeros(), *found].iter().enumerate() {
        let mut canvas = dark.clone();
        for (pixel, depth) in frame.seen(values) {
            let at: Point2<i64> = pixel.map(|part| part.round() as i64);
            dot(&mut canvas, at, radius, palette::turbo(1.0 - (depth / 40.0).clamp(0.0, 1.0)));
        }
        imageops::replace(&mut picture, &canvas, 0, row as i64 * i64::from(height));
    }
    picture
}
