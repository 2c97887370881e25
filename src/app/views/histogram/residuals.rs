//! How far query and synthetic view differ, and which half of the differences PM counts.

use egui::Ui;
use egui_plot::{Bar, BarChart, HoverPosition, LineStyle, Plot, VLine};

use crate::app::theme;
use crate::app::views::legend::{name_picture, swatch};
use crate::cost::{IntensityPair, PhotometricWeights, Power};
use crate::method::Method;
use crate::render::Comparison;

/// Width of a bar \[grey values\].
const WIDTH: usize = 4;
/// Bars from -256 to 256.
const BARS: usize = 512 / WIDTH;

/// Draws the residuals of a comparison.
pub(super) fn ui(ui: &mut Ui, method: Method, shown: &Comparison, weights: &PhotometricWeights) {
    let counts = counts(&shown.pairs, weights);
    let median = f64::from(weights.threshold).sqrt();
    let ignored = ui.visuals().weak_text_color();
    let counted = theme::method(method);
    let label = |position: &HoverPosition<'_>| match position {
        HoverPosition::NearDataPoint { plot_name, .. } => Some((*plot_name).to_owned()),
        HoverPosition::Elsewhere { .. } => None,
    };
    let answer = Plot::new("residuals")
        .height(ui.available_width().clamp(120.0, 260.0))
        .allow_scroll(false)
        .x_axis_label("query less synthetic view [grey values]")
        .y_axis_label("pixels")
        .label_formatter(label)
        .include_y(0.0)
        .show(ui, |plot| {
            let inside = bars(&counts, 0);
            let inside = BarChart::new("counted", inside).color(counted);
            let outside =
                BarChart::new("ignored", bars(&counts, 1)).color(ignored).stack_on(&[&inside]);
            plot.bar_chart(inside.element_formatter(Box::new(describe)));
            plot.bar_chart(outside.element_formatter(Box::new(describe)));
            for side in [-median, median] {
                let line = VLine::new("median", side).color(theme::ESTIMATE);
                plot.vline(line.style(LineStyle::dashed_loose()).allow_hover(false));
            }
        });
    name_picture(&answer.response, format!("Residuals of {} pixels", shown.pairs.len()));
    let kept = weights.counted.iter().filter(|counted| **counted).count();
    let left_out = weights.counted.len() - kept;
    ui.horizontal_wrapped(|ui| {
        swatch(ui, counted);
        ui.label(format!("{kept} pixels count"));
        swatch(ui, ignored);
        ui.label(format!("{left_out} are ignored"));
    });
    ui.label(format!(
        "The median difference is {median:.2} grey values (dashed). Pixels that differ more are ignored"
    ));
    if let Some(cost) = shown.score.cost {
        let (mean, throughout) = match weights.power {
            Power::One => ("mean square of those that count", cost.sqrt()),
            Power::Two => ("mean fourth power of those that count", cost.sqrt().sqrt()),
        };
        ui.label(format!(
            "cost = {mean} = {cost:.4}, as if all differed by {throughout:.2} grey values"
        ));
    }
}

/// Per bar, the pixels that count and those that are ignored.
fn counts(pairs: &[IntensityPair], weights: &PhotometricWeights) -> Vec<[u32; 2]> {
    let mut counts = vec![[0; 2]; BARS];
    for (pair, &counted) in pairs.iter().zip(&weights.counted) {
        let bar = ((pair.query - pair.synthetic + 256.0) as usize / WIDTH).min(BARS - 1);
        counts[bar][usize::from(!counted)] += 1;
    }
    counts
}

fn bars(counts: &[[u32; 2]], which: usize) -> Vec<Bar> {
    let bar = |(index, count): (usize, &[u32; 2])| {
        let middle = (index * WIDTH) as f64 + 0.5 * WIDTH as f64 - 256.0;
        Bar::new(middle, f64::from(count[which])).width(WIDTH as f64)
    };
    counts.iter().enumerate().filter(|(_, count)| **count != [0; 2]).map(bar).collect()
}

fn describe(bar: &Bar, chart: &BarChart) -> String {
    let half = 0.5 * WIDTH as f64;
    let (from, to) = (bar.argument - half, bar.argument + half);
    let name = egui_plot::PlotItem::name(chart);
    format!("{from} to {to} grey values: {} {name}", bar.value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_falls_into_one_bar() {
        let differences = [-255.0_f32, -1.0, 0.0, 3.9, 4.0, 255.0];
        let pairs = differences.map(|difference| IntensityPair {
            query: difference.max(0.0),
            synthetic: (-difference).max(0.0),
        });
        let weights = PhotometricWeights {
            power: Power::One,
            threshold: 16.0,
            counted: vec![false, true, true, true, true, false],
        };
        let counts = counts(&pairs, &weights);
        let of = |difference: i32| counts[(difference + 256) as usize / WIDTH];
        assert_eq!(
            [of(-255), of(-1), of(0), of(4), of(255)],
            [[0, 1], [1, 0], [2, 0], [1, 0], [0, 1]]
        );
        assert_eq!(counts.iter().flatten().sum::<u32>(), 6);
    }
}
