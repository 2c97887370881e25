//! The pictures there are of a query and a synthetic view.

use std::sync::Arc;

use egui::{Color32, TextureHandle, Ui};
use image::DynamicImage;

use crate::app::pictures;
use crate::app::textures::color_image;
use crate::app::views::histogram::explains;
use crate::app::views::legend;
use crate::app::{ShownView, ViewContext, theme};
use crate::cost::Explanation;
use crate::cost::ExplanationKind;
use crate::method::Method;
use crate::problem::Problem;
use crate::render::Comparison;
use crate::{palette, picture};

/// What the picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Query,
    View,
    Blend,
    Residual,
    /// What each pixel has to say in the cost.
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
                let query = Arc::clone(&problem.query);
                of("synthetic/over", &move |made| {
                    picture::over(&query.photo.gray, &made.view).into()
                })
            }
            Self::Blend => of("synthetic/view", &|made| picture::synthetic(&made.view).into()),
            Self::Residual => of("synthetic/residual", &|made| {
                let range = pictures::residual_range(&made.pairs);
                pictures::residual_within(&made.view, &made.pairs, range).into()
            }),
            Self::Weights => {
                shown.comparison.explanation.as_ref()?;
                of("synthetic/weights", &weights)
            }
        };
        Some(picture)
    }

    pub(super) fn legend(self, ui: &mut Ui, method: Method, shown: Option<&ShownView>) {
        let explanation = shown.and_then(|shown| shown.comparison.explanation.as_ref());
        match (self, explanation) {
            (Self::Residual, _) => {
                let pairs = shown.map_or(&[][..], |shown| &shown.comparison.pairs);
                let range = pictures::residual_range(pairs);
                let words = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|share| format!("{}", share * range));
                let places = [0.0, 0.25, 0.5, 0.75, 1.0];
                let ends: [(f64, &str); 5] =
                    std::array::from_fn(|tick| (places[tick], words[tick].as_str()));
                diverging_bar(ui, "query minus view, grey values", &ends);
                ui.weak("query darker ← → query brighter");
            }
            (Self::Weights, Some(Explanation::Weights(weights))) => {
                let most = weights.threshold.sqrt();
                legend::swatch(ui, Color32::from_gray(picture::WEIGHT_GRAYS[1]));
                ui.label(format!("counted: off by at most {most:.1} grey values"));
                legend::swatch(ui, Color32::from_gray(picture::WEIGHT_GRAYS[0]));
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

fn weights(made: &Comparison) -> DynamicImage {
    match &made.explanation {
        Some(Explanation::Weights(weights)) => pictures::weights(&made.view, weights).into(),
        Some(Explanation::JointHistogram(histogram)) => {
            pictures::contributions(&made.view, &made.pairs, histogram).into()
        }
        _ => picture::synthetic(&made.view).into(),
    }
}

fn diverging_bar(ui: &mut Ui, name: &str, ticks: &[(f64, &str)]) {
    let color = |share: f64| theme::rgb(palette::diverging(2.0 * share - 1.0));
    legend::color_bar(ui, LEGEND, name, color, ticks);
}
