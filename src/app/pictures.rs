//! Pictures of synthetic views for the window: residuals, weights and contributions.

use image::{GrayImage, RgbImage};

use crate::cost::{IntensityPair, JointHistogram, PhotometricWeights};
use crate::palette;
use crate::picture::{Painter, RESIDUAL_RANGE, WEIGHT_GRAYS, in_gray};
use crate::render::SyntheticView;

/// The range of contributions to mutual information with distinct colours \[nat\].
const CONTRIBUTION_RANGE: f64 = 2.0;

/// The range of differences that 98 % of the pixels are within. A power of two, so similar views have the same range.
pub(crate) fn residual_range(pairs: &[IntensityPair]) -> f64 {
    const BEYOND: f64 = 0.02;
    let differences = pairs.iter().map(|pair| (pair.query - pair.synthetic).abs());
    let mut differences: Vec<f32> = differences.collect();
    let within = (differences.len() as f64 * (1.0 - BEYOND)) as usize;
    let Some(within) = within.checked_sub(1) else {
        return RESIDUAL_RANGE;
    };
    let (_, most, _) = differences.select_nth_unstable_by(within, f32::total_cmp);
    let most = f64::from(*most);
    let ranges = [16.0, 32.0, 64.0, 128.0];
    ranges.into_iter().find(|range| *range >= most).unwrap_or(256.0)
}

/// Query minus synthetic view, coloured over ±`range` grey values: blue where the query is darker, orange where it is
/// brighter.
pub(crate) fn residual_within(
    view: &SyntheticView,
    pairs: &[IntensityPair],
    range: f64,
) -> RgbImage {
    let values =
        pairs.iter().map(|pair| palette::diverging(f64::from(pair.query - pair.synthetic) / range));
    in_color(view, Painter::new(view).paint(palette::NOTHING, values))
}

/// The pixels that the photometric cost counted (white) and ignored (grey).
pub(crate) fn weights(view: &SyntheticView, weights: &PhotometricWeights) -> GrayImage {
    let values = weights.counted.iter().map(|&counted| WEIGHT_GRAYS[usize::from(counted)]);
    in_gray(view, Painter::new(view).paint(0, values))
}

/// The contribution of each pixel to mutual information, −2 … 2 nat: orange if its pair of grey values is more
/// frequent than by chance, blue if it is rarer.
pub(crate) fn contributions(
    view: &SyntheticView,
    pairs: &[IntensityPair],
    histogram: &JointHistogram,
) -> RgbImage {
    let pointwise = histogram.pointwise();
    let values = pairs
        .iter()
        .map(|pair| pointwise[histogram.cell(pair)] / CONTRIBUTION_RANGE)
        .map(palette::diverging);
    in_color(view, Painter::new(view).paint(palette::NOTHING, values))
}

fn in_color(view: &SyntheticView, colors: Vec<palette::Rgb>) -> RgbImage {
    let values = colors.into_flattened();
    RgbImage::from_raw(view.width, view.height, values).expect("a colour for each pixel")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::SplattedPixel;

    #[test]
    fn residuals_have_colours_up_to_the_range_that_they_have() {
        let pairs = |most: f32| -> Vec<IntensityPair> {
            (0..=100)
                .map(|at| IntensityPair { query: most * at as f32 / 100.0, synthetic: 0.0 })
                .collect()
        };
        let ranges = [10.0, 30.0, 100.0, 250.0].map(|most| residual_range(&pairs(most)));
        assert_eq!(ranges, [16.0, 32.0, 128.0, 256.0]);
        // One odd pixel of a hundred changes nothing.
        let mut odd = pairs(30.0);
        odd[7].query = 255.0;
        assert_eq!(residual_range(&odd), 32.0);
        assert_eq!(residual_range(&[]), RESIDUAL_RANGE);
    }

    fn view(width: u32, height: u32, indices: &[u32]) -> SyntheticView {
        let pixels =
            indices.iter().map(|&index| SplattedPixel { index, depth: 10.0, intensity: 50.0 });
        SyntheticView { width, height, pixels: pixels.collect() }
    }

    #[test]
    fn a_frequent_pair_of_grey_values_contributes_and_a_rare_one_takes_away() {
        let pair = |query, synthetic| IntensityPair { query, synthetic };
        // Bright meets bright and dark meets dark, but for one pixel.
        let mut pairs = vec![pair(250.0, 250.0); 40];
        pairs.extend(vec![pair(5.0, 5.0); 40]);
        pairs.push(pair(5.0, 250.0));
        let histogram = JointHistogram::of(&pairs, 16);
        let indices: Vec<u32> = (0..81).map(|i| 3 * i + 1).collect();
        let picture = contributions(&view(243, 1, &indices), &pairs, &histogram);
        let [first, last] = [1, 241].map(|x| picture.get_pixel(x, 0).0);
        assert!(first[0] > first[2], "more than chance: {first:?}");
        assert!(last[2] > last[0], "less than chance: {last:?}");
    }
}
