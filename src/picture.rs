//! Pictures of photos, synthetic views and histograms, for recordings, reports and the window.

use image::{DynamicImage, GrayImage, ImageBuffer, Luma, Pixel, Rgb, RgbImage};

use crate::cost::Explanation;
use crate::cost::IntensityPair;
use crate::cost::JointHistogram;
use crate::grid::ScoredLattice;
use crate::image::Photo;
use crate::palette;
use crate::render::Comparison;
use crate::render::{SplattedPixel, SyntheticView};

/// The range of differences with distinct colours \[grey values\].
pub(crate) const RESIDUAL_RANGE: f64 = 64.0;

/// The side of the tiles of [`preference`] \[px\]; two views rarely cover the same single pixels.
const TILE: u32 = 24;

/// The grey values of pixels that the photometric cost ignored and counted.
pub(crate) const WEIGHT_GRAYS: [u8; 2] = [90, 255];

/// A photo, in colour if it has any.
pub(crate) fn photo(photo: &Photo) -> DynamicImage {
    match &photo.color {
        Some(color) => DynamicImage::ImageRgb8(color.clone()),
        None => DynamicImage::ImageLuma8(GrayImage::clone(&photo.gray)),
    }
}

/// Both photos on one canvas, the query above the reference, and the first row of the reference. In colour if one
/// of them is.
///
/// They are stacked because car photos are wide: side by side they would be 2482 pixels wide for KITTI, and half
/// as large in the same view. A camera that moves forward also shifts features more sideways than vertically, so
/// true matches are nearly vertical lines.
pub(crate) fn stacked(query: &Photo, reference: &Photo) -> (DynamicImage, u32) {
    let top = row_below(query);
    let canvas = match (&query.color, &reference.color) {
        (None, None) => one_above_the_other(&query.gray, &reference.gray, top, Luma([255])).into(),
        _ => {
            let [query, reference] = [query, reference].map(|photo_of| photo(photo_of).into_rgb8());
            one_above_the_other(&query, &reference, top, Rgb([255; 3])).into()
        }
    };
    (canvas, top)
}

/// The first row of the photo below this one.
pub(crate) fn row_below(query: &Photo) -> u32 {
    query.gray.height() + 4
}

fn one_above_the_other<P: Pixel>(
    upper: &ImageBuffer<P, Vec<P::Subpixel>>,
    lower: &ImageBuffer<P, Vec<P::Subpixel>>,
    top: u32,
    ground: P,
) -> ImageBuffer<P, Vec<P::Subpixel>> {
    let width = upper.width().max(lower.width());
    let mut canvas = ImageBuffer::from_pixel(width, top + lower.height(), ground);
    image::imageops::replace(&mut canvas, upper, 0, 0);
    image::imageops::replace(&mut canvas, lower, 0, i64::from(top));
    canvas
}

/// The synthetic view in its grey values.
pub(crate) fn synthetic(view: &SyntheticView) -> GrayImage {
    Painter::new(view).synthetic()
}

/// The view in its grey values over the darkened query, which is bluish where nothing covers it.
pub(crate) fn over(query: &GrayImage, view: &SyntheticView) -> RgbImage {
    const GROUND: f64 = 0.5;
    let synthetic = synthetic(view);
    let mut covered = vec![false; (view.width * view.height) as usize];
    for pixel in &view.pixels {
        covered[pixel.index as usize] = true;
    }
    RgbImage::from_fn(view.width, view.height, |x, y| {
        let ground = f64::from(query.get_pixel(x, y).0[0]) * GROUND;
        let painted = f64::from(synthetic.get_pixel(x, y).0[0]);
        let is_painted = painted > 0.0 || covered[(y * view.width + x) as usize];
        let [red, green, blue] =
            if is_painted { [painted; 3] } else { [0.75 * ground, 0.85 * ground, ground] };
        Rgb([red as u8, green as u8, blue as u8])
    })
}

/// Which of two poses each part of the query prefers, tile by tile: orange for the first, blue for the second. The
/// opacity shows the contribution to the difference of the costs. `None` if one of the poses has no cost.
pub(crate) fn preference(
    query: &GrayImage,
    first: &Comparison,
    second: &Comparison,
) -> Option<RgbImage> {
    let (width, height) = query.dimensions();
    let columns = width.div_ceil(TILE);
    let tile = |index: u32| ((index / width) / TILE * columns + (index % width) / TILE) as usize;
    let tiles = (columns * height.div_ceil(TILE)) as usize;
    let mut balance = vec![0.0_f64; tiles];
    let mut covered = [vec![false; tiles], vec![false; tiles]];
    for ((comparison, sign), covered) in
        [(first, 1.0), (second, -1.0)].into_iter().zip(&mut covered)
    {
        let evidence = evidence(comparison)?;
        for (pixel, evidence) in comparison.view.pixels.iter().zip(evidence) {
            let tile = tile(pixel.index);
            balance[tile] += sign * evidence;
            covered[tile] = true;
        }
    }
    // A tile that only one view covers is no comparison.
    for (tile, balance) in balance.iter_mut().enumerate() {
        if !(covered[0][tile] && covered[1][tile]) {
            *balance = 0.0;
        }
    }
    // The strongest tile has the full colour; the square root keeps weaker ones visible.
    let most = balance.iter().fold(0.0_f64, |most, tile| most.max(tile.abs()));
    Some(RgbImage::from_fn(width, height, |x, y| {
        let share = balance[tile(y * width + x)] / most.max(f64::MIN_POSITIVE);
        let color = palette::diverging(share.signum() * share.abs().sqrt());
        let ground = query.get_pixel(x, y).0[0];
        // Neutral tiles show the query unchanged.
        let opacity = 0.75 * share.abs().sqrt();
        Rgb(color.map(|value| {
            let mixed = f64::from(value) * opacity + f64::from(ground) * (1.0 - opacity);
            mixed.round() as u8
        }))
    }))
}

/// The contribution of each covered pixel to the fit. The sum is mutual information \[nat\], or the negative mean
/// squared difference \[grey values²\].
fn evidence(comparison: &Comparison) -> Option<Vec<f64>> {
    let pairs = &comparison.pairs;
    Some(match comparison.explanation.as_ref()? {
        Explanation::JointHistogram(histogram) => {
            let pointwise = histogram.pointwise();
            let share = 1.0 / pairs.len() as f64;
            let of_pair = |pair| share * pointwise[histogram.cell(pair)];
            pairs.iter().map(of_pair).collect()
        }
        Explanation::Weights(weights) => {
            let counted = weights.counted.iter().filter(|counted| **counted).count();
            let share = 1.0 / counted.max(1) as f64;
            let of_pair = |(pair, counts): (&IntensityPair, &bool)| match counts {
                true => -share * f64::from(pair.query - pair.synthetic).powi(2),
                false => 0.0,
            };
            pairs.iter().zip(&weights.counted).map(of_pair).collect()
        }
        _ => return None,
    })
}

/// The cost of each position around the reference, forward up: yellow is lowest, dark blue highest. Positions that
/// cover too little to be eligible are grey, those without a score black.
pub fn surface(surface: &ScoredLattice) -> RgbImage {
    let lattice = &surface.lattice;
    let costs = || (0..surface.scores.len()).filter_map(|cell| surface.eligible_cost(cell));
    let (least, most) =
        (costs().fold(f64::INFINITY, f64::min), costs().fold(f64::NEG_INFINITY, f64::max));
    RgbImage::from_fn(lattice.columns as u32, lattice.rows as u32, |x, y| {
        let row = lattice.rows - 1 - y as usize;
        let cell = row * lattice.columns + x as usize;
        Rgb(match (&surface.scores[cell], surface.eligible_cost(cell)) {
            (None, _) => palette::NOTHING,
            (Some(_), None) => palette::INELIGIBLE,
            (Some(_), Some(cost)) => {
                palette::viridis((most - cost) / (most - least).max(f64::MIN_POSITIVE))
            }
        })
    })
}

/// The joint histogram of grey values: synthetic view to the right, query upwards.
///
/// The colour is ln(1 + count), relative to all pairs in one cell. The range is the same for every view; with
/// linear counts only a few cells would be visible.
pub(crate) fn joint_histogram(histogram: &JointHistogram) -> RgbImage {
    let side = histogram.bins as u32;
    let all: f64 = histogram.counts.iter().copied().map(f64::from).sum();
    RgbImage::from_fn(side, side, |x, y| {
        let cell = (side - 1 - y) * side + x;
        let count = f64::from(histogram.counts[cell as usize]);
        Rgb(palette::viridis(count.ln_1p() / all.max(1.0).ln_1p()))
    })
}

/// Paints pictures of a view's covered pixels.
///
/// A view covers only a few per cent of the image, which is hardly visible in a small panel. Every covered pixel
/// therefore also colours its uncovered neighbours, nearest surface first; covered pixels stay exact.
pub(crate) struct Painter<'a> {
    pub(crate) view: &'a SyntheticView,
    /// The positions of the covered pixels in the view's list, the nearest last.
    order: Vec<usize>,
}

impl<'a> Painter<'a> {
    pub(crate) fn new(view: &'a SyntheticView) -> Self {
        // Positive floats sort like their bits.
        let farthest_first =
            |(place, pixel): (usize, &SplattedPixel)| (!pixel.depth.to_bits(), place as u32);
        let mut order: Vec<(u32, u32)> =
            view.pixels.iter().enumerate().map(farthest_first).collect();
        order.sort_unstable();
        let order = order.into_iter().map(|(_, place)| place as usize).collect();
        Self { view, order }
    }

    /// A picture of values, one per covered pixel, row by row.
    pub(crate) fn paint<V: Copy>(&self, background: V, values: impl Iterator<Item = V>) -> Vec<V> {
        let SyntheticView { width, height, pixels } = self.view;
        let [width, height] = [*width, *height].map(|side| side as usize);
        let mut picture = vec![background; width * height];
        let covered: Vec<(usize, V)> =
            pixels.iter().map(|pixel| pixel.index as usize).zip(values).collect();
        for (index, value) in self.order.iter().filter_map(|&place| covered.get(place)) {
            let (x, y) = (index % width, index / width);
            for row in y.saturating_sub(1)..(y + 2).min(height) {
                let columns = row * width + x.saturating_sub(1)..row * width + (x + 2).min(width);
                picture[columns].fill(*value);
            }
        }
        for (index, value) in covered {
            picture[index] = value;
        }
        picture
    }

    /// The view in its grey values.
    pub(crate) fn synthetic(&self) -> GrayImage {
        let values = self.view.pixels.iter().map(|pixel| gray(pixel.intensity));
        in_gray(self.view, self.paint(0, values))
    }
}

pub(crate) fn in_gray(view: &SyntheticView, values: Vec<u8>) -> GrayImage {
    GrayImage::from_raw(view.width, view.height, values).expect("a value for each pixel")
}

fn gray(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_covered_pixel_keeps_its_value_and_the_nearer_one_spreads_over_the_farther() {
        let pixel = |index, depth, intensity| SplattedPixel { index, depth, intensity };
        let view = SyntheticView {
            width: 5,
            height: 1,
            pixels: vec![pixel(1, 2.0, 50.0), pixel(3, 9.0, 70.0)],
        };
        let values = view.pixels.iter().map(|pixel| gray(pixel.intensity));
        assert_eq!(Painter::new(&view).paint(0, values), [50, 50, 50, 70, 70]);
    }

    #[test]
    fn the_canvas_stacks_photos_of_different_sizes() {
        let photo = |w, h| Photo::from_gray(GrayImage::new(w, h));
        let (canvas, top) = stacked(&photo(20, 10), &photo(30, 8));
        assert_eq!((canvas.width(), canvas.height(), top), (30, 22, 14));
    }
}
