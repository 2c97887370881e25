//! What recordings and the window show of photos, synthetic views and histograms, as pictures.

use image::{DynamicImage, GrayImage, ImageBuffer, Luma, Pixel, Rgb, RgbImage};

use crate::cost::{IntensityPair, JointHistogram, PhotometricWeights};
use crate::image::Photo;
use crate::palette;
use crate::render::SyntheticView;

/// Differences from −64 to 64 grey values have colours of their own; greater ones look like these.
const RESIDUAL_RANGE: f64 = 64.0;

/// A photo, in colour where it has any.
pub(crate) fn photo(photo: &Photo) -> DynamicImage {
    match &photo.color {
        Some(color) => DynamicImage::ImageRgb8(color.clone()),
        None => DynamicImage::ImageLuma8(GrayImage::clone(&photo.gray)),
    }
}

/// Both photos on one canvas, the query above the reference, with the row at which the reference
/// begins.
///
/// Above each other, because photos of cars are wide: beside each other they would be 2482 pixels
/// wide for KITTI, and half as large in the same view. A camera that moves ahead also shifts
/// features more sideways than up, so that true matches are nearly upright lines.
pub(crate) fn stacked(query: &Photo, reference: &Photo) -> (RgbImage, u32) {
    let (query, reference) = (photo(query).into_rgb8(), photo(reference).into_rgb8());
    let top = query.height() + 4;
    let width = query.width().max(reference.width());
    let mut canvas = RgbImage::from_pixel(width, top + reference.height(), Rgb([255; 3]));
    image::imageops::replace(&mut canvas, &query, 0, 0);
    image::imageops::replace(&mut canvas, &reference, 0, i64::from(top));
    (canvas, top)
}

/// The synthetic view in its grey values.
pub(crate) fn synthetic(view: &SyntheticView) -> GrayImage {
    let values = view
        .pixels
        .iter()
        .map(|pixel| Luma([gray(pixel.intensity)]));
    painted(view, Luma([0]), values)
}

/// Query minus synthetic view: blue where the query is darker, orange where it is brighter.
pub(crate) fn residual(view: &SyntheticView, pairs: &[IntensityPair]) -> RgbImage {
    let values = pairs.iter().map(|pair| {
        Rgb(palette::diverging(
            f64::from(pair.query - pair.synthetic) / RESIDUAL_RANGE,
        ))
    });
    let background = Rgb(palette::NOTHING);
    painted(view, background, values)
}

/// Which pixels the photometric cost counted: white; those it ignored: grey.
pub(crate) fn weights(view: &SyntheticView, weights: &PhotometricWeights) -> GrayImage {
    let values = weights
        .counted
        .iter()
        .map(|&counted| Luma([if counted { 255 } else { 90 }]));
    painted(view, Luma([0]), values)
}

/// How often grey values meet: the synthetic view's to the right, the query's upwards.
///
/// The colour is ln(1 + count) against that of all pairs in one cell, the same range for every view;
/// with the counts themselves a few cells would be all that can be seen.
pub(crate) fn joint_histogram(histogram: &JointHistogram) -> RgbImage {
    let side = histogram.bins as u32;
    let all: f64 = histogram.counts.iter().copied().map(f64::from).sum();
    RgbImage::from_fn(side, side, |x, y| {
        let cell = (side - 1 - y) * side + x;
        let count = f64::from(histogram.counts[cell as usize]);
        Rgb(palette::viridis(count.ln_1p() / all.max(1.0).ln_1p()))
    })
}

/// A picture of the covered pixels' values.
///
/// A view covers a few per cent of the image, and would all but vanish in a small panel. So every
/// covered pixel also lends its value to uncovered neighbours, the nearest surface in front; the
/// covered pixels themselves stay exact.
fn painted<P: Pixel<Subpixel = u8>>(
    view: &SyntheticView,
    background: P,
    values: impl Iterator<Item = P>,
) -> ImageBuffer<P, Vec<u8>> {
    let mut picture = ImageBuffer::from_pixel(view.width, view.height, background);
    let mut covered: Vec<_> = view.pixels.iter().zip(values).collect();
    covered.sort_by(|a, b| b.0.depth.total_cmp(&a.0.depth));
    for (pixel, value) in &covered {
        let (x, y) = (pixel.index % view.width, pixel.index / view.width);
        for row in y.saturating_sub(1)..(y + 2).min(view.height) {
            for column in x.saturating_sub(1)..(x + 2).min(view.width) {
                picture.put_pixel(column, row, *value);
            }
        }
    }
    for (pixel, value) in covered {
        picture.put_pixel(pixel.index % view.width, pixel.index / view.width, value);
    }
    picture
}

fn gray(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::SplattedPixel;

    #[test]
    fn a_covered_pixel_keeps_its_value_and_the_nearer_one_spreads_over_the_farther() {
        let pixel = |index, depth, intensity| SplattedPixel {
            index,
            depth,
            intensity,
        };
        let view = SyntheticView {
            width: 5,
            height: 1,
            pixels: vec![pixel(1, 2.0, 50.0), pixel(3, 9.0, 70.0)],
        };
        let values = view.pixels.iter().map(|p| Luma([gray(p.intensity)]));
        let picture = painted(&view, Luma([0]), values);
        assert_eq!(picture.as_raw(), &[50, 50, 50, 70, 70]);
    }

    #[test]
    fn the_canvas_stacks_photos_of_different_sizes() {
        let photo = |w, h| Photo::from_gray(GrayImage::new(w, h));
        let (canvas, top) = stacked(&photo(20, 10), &photo(30, 8));
        assert_eq!((canvas.dimensions(), top), ((30, 22), 14));
    }
}
