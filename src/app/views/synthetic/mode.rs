//! The pictures there are of a query and a synthetic view.

use std::sync::Arc;

use egui::{Color32, TextureHandle, Ui};
use image::{DynamicImage, GrayImage, RgbImage};

use crate::app::textures::color_image;
use crate::app::views::histogram::explains;
use crate::app::views::legend;
use crate::app::{ShownView, ViewContext, theme};
use crate::cost::{
    Explanation, ExplanationKind, IntensityPair, JointHistogram, PhotometricWeights,
};
use crate::method::Method;
use crate::palette;
use crate::picture::{self, Painter, RESIDUAL_RANGE, WEIGHT_GRAYS, in_gray};
use crate::problem::Problem;
use crate::render::{Comparison, SyntheticView};

/// What the picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Query,
    View,
    Blend,
    Residual,
    /// The share of each pixel in the cost.
    Weights,
}

/// Width of a legend \[points\].
const LEGEND: f32 = 260.0;

impl Mode {
    pub(super) const ALL: [Self; 5] =
        [Self::Query, Self::View, Self::Blend, Self::Residual, Self::Weights];

    pub(super) fn name(self, method: Method) -> &'static str {
        match self {
            Self::Query => "Query",
            Self::View => "View",
            Self::Blend => "Blend",
            Self::Residual => "Residual",
            Self::Weights if explains(method) == Some(ExplanationKind::Weights) => "Weights",
            Self::Weights => "Shares",
        }
    }

    pub(super) fn about(self, method: Method) -> &'static str {
        match self {
            Self::Query => "The query in grey values",
            Self::View => "The map seen from this pose, over the darkened query",
            Self::Blend => "View and query mixed",
            Self::Residual => "Query minus view: orange where the query is brighter",
            Self::Weights if explains(method) == Some(ExplanationKind::Weights) => {
                "Which pixels the photometric cost counts, and which it ignores"
            }
            Self::Weights => "What each pixel's pair of grey values adds to mutual information",
        }
    }

    /// The picture, made once for each view; `None` where the query alone is shown, or there is
    /// nothing to make it of.
    pub(super) fn texture(
        self,
        ui: &Ui,
        context: &ViewContext<'_>,
        problem: &Problem,
        shown: &ShownView,
    ) -> Option<TextureHandle> {
        let of = |what, make: &dyn Fn(&Comparison) -> DynamicImage| {
            let textures = &context.state.textures;
            let made = |comparison: &Comparison| color_image(&make(comparison));
            textures.of(ui.ctx(), what, &shown.comparison, made)
        };
        let picture = match self {
            Self::Query => return None,
            Self::View => {
                let query = Arc::clone(problem.query());
                of("synthetic/over", &move |made| {
                    picture::over(&query.photo().gray, &made.view).into()
                })
            }
            Self::Blend => of("synthetic/view", &|made| picture::synthetic(&made.view).into()),
            Self::Residual => of("synthetic/residual", &|made| {
                let range = residual_range(&made.pairs);
                residual_within(&made.view, &made.pairs, range).into()
            }),
            Self::Weights => {
                shown.comparison.explanation.as_ref()?;
                of("synthetic/weights", &explained)
            }
        };
        Some(picture)
    }

    pub(super) fn legend(self, ui: &mut Ui, method: Method, shown: Option<&ShownView>) {
        let explanation = shown.and_then(|shown| shown.comparison.explanation.as_ref());
        match (self, explanation) {
            (Self::Residual, _) => {
                let pairs = shown.map_or(&[][..], |shown| &shown.comparison.pairs);
                let range = residual_range(pairs);
                let words = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|share| format!("{}", share * range));
                let places = [0.0, 0.25, 0.5, 0.75, 1.0];
                let ends: [(f64, &str); 5] =
                    std::array::from_fn(|tick| (places[tick], words[tick].as_str()));
                diverging_bar(ui, "query minus view, grey values", &ends);
                ui.weak("query darker ← → query brighter");
            }
            (Self::Weights, Some(Explanation::Weights(weights))) => {
                let most = weights.threshold.sqrt();
                legend::swatch(ui, Color32::from_gray(WEIGHT_GRAYS[1]));
                ui.label(format!("counted: off by at most {most:.1} grey values"));
                legend::swatch(ui, Color32::from_gray(WEIGHT_GRAYS[0]));
                ui.label("ignored");
            }
            (Self::Weights, Some(Explanation::JointHistogram(_))) => {
                let ends = [(0.0, "-2"), (0.5, "0"), (1.0, "2 nat")];
                diverging_bar(ui, "contribution to mutual information, nat", &ends);
                ui.weak("rarer ← → more frequent than by chance");
            }
            (Self::Weights, None) => {
                ui.weak("There is no cost to explain");
            }
            _ => {
                ui.weak(self.about(method));
            }
        }
    }
}

fn explained(made: &Comparison) -> DynamicImage {
    match &made.explanation {
        Some(Explanation::Weights(weights)) => counted(&made.view, weights).into(),
        Some(Explanation::JointHistogram(histogram)) => {
            contributions(&made.view, &made.pairs, histogram).into()
        }
        _ => picture::synthetic(&made.view).into(),
    }
}

fn diverging_bar(ui: &mut Ui, name: &str, ticks: &[(f64, &str)]) {
    let color = |share: f64| theme::rgb(palette::diverging(2.0 * share - 1.0));
    legend::color_bar(ui, LEGEND, name, color, ticks);
}

/// The range of contributions to mutual information with distinct colours \[nat\].
const CONTRIBUTION_RANGE: f64 = 2.0;

/// The range of differences that 98 % of the pixels are within. A power of two, so similar views have the same range.
fn residual_range(pairs: &[IntensityPair]) -> f64 {
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
fn residual_within(view: &SyntheticView, pairs: &[IntensityPair], range: f64) -> RgbImage {
    let values =
        pairs.iter().map(|pair| palette::diverging(f64::from(pair.query - pair.synthetic) / range));
    in_color(view, Painter::new(view).paint(palette::NOTHING, values))
}

/// The pixels that the photometric cost counted (white) and ignored (grey).
fn counted(view: &SyntheticView, weights: &PhotometricWeights) -> GrayImage {
    let values = weights.counted.iter().map(|&counted| WEIGHT_GRAYS[usize::from(counted)]);
    in_gray(view, Painter::new(view).paint(0, values))
}

/// The contribution of each pixel to mutual information, −2 … 2 nat: orange if its pair of grey values is more
/// frequent than by chance, blue if it is rarer.
fn contributions(
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
