//! The joint histogram with its margins, entropies and the mutual information.

use std::sync::Arc;

use egui::{Color32, Rect, Stroke, Ui};
use egui_plot::{Bar, BarChart, GridInput, GridMark, Plot, PlotImage, PlotPoint};

use super::comparison;
use crate::app::views::readout::Readout;
use crate::app::{ViewContext, theme};
use crate::cost::JointHistogram;
use crate::cost::Similarity;
use crate::estimator::{self, Entry};
use crate::method::Method;
use crate::picture;
use crate::render::Comparison;

/// Grey values of an axis.
const GREYS: f64 = 256.0;
/// Where the marginal bars begin, and how long the longest is, in the unit of the axes.
const MARGIN_FROM: f64 = GREYS + 6.0;
const MARGIN_LENGTH: f64 = 52.0;

/// Draws the histogram of a comparison.
pub(super) fn ui(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    method: Method,
    shown: &Arc<Comparison>,
    histogram: &JointHistogram,
) {
    let cost = estimator::find(method).and_then(Entry::cost);
    let sees = cost.map_or("value", |cost| cost.sees);
    let margins = Margins::of(histogram);
    let texture = context
        .textures
        .of(ui.ctx(), "joint histogram", shown, |_| {
            let picture = picture::joint_histogram(histogram).into();
            crate::app::textures::color_image(&picture)
        });
    let readout = Readout::reserve(ui);
    let side = ui.available_width().min(420.0);
    let answer = Plot::new("joint histogram")
        .width(side)
        .height(side)
        .data_aspect(1.0)
        .show_x(false)
        .show_y(false)
        .show_grid(false)
        .allow_scroll(false)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_boxed_zoom(false)
        .x_grid_spacer(grey_marks)
        .y_grid_spacer(grey_marks)
        .x_axis_label(format!("{sees} of the synthetic view"))
        .y_axis_label(format!("{sees} of the query"))
        .include_x(-4.0)
        .include_y(-4.0)
        .include_x(MARGIN_FROM + MARGIN_LENGTH)
        .include_y(MARGIN_FROM + MARGIN_LENGTH)
        .set_margin_fraction(egui::Vec2::ZERO)
        .show(ui, |plot| {
            let middle = PlotPoint::new(0.5 * GREYS, 0.5 * GREYS);
            let size = [GREYS as f32; 2];
            plot.add(PlotImage::new("bins", texture.id(), middle, size));
            let color = ui_color(plot.ctx());
            let bars = |counts: &[u32]| margins.bars(counts);
            let synthetic = BarChart::new("synthetic", bars(&margins.synthetic));
            plot.bar_chart(synthetic.color(color).allow_hover(false));
            let query = BarChart::new("query", bars(&margins.query)).horizontal();
            plot.bar_chart(query.color(color).allow_hover(false));
        });
    let name = format!(
        "Joint histogram of {} pairs in {} bins per axis",
        margins.pairs, histogram.bins
    );
    answer
        .response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
    let pointed_at = answer.response.hover_pos().and_then(|at| {
        let point = answer.transform.value_from_position(at);
        margins.at(histogram, point.x, point.y)
    });
    if let Some(pointed_at) = &pointed_at {
        let corner = |[x, y]: [f64; 2]| answer.transform.position_from_point(&PlotPoint::new(x, y));
        let rect = Rect::from_two_pos(corner(pointed_at.from), corner(pointed_at.to));
        for (width, color) in [(3.0, Color32::BLACK), (1.5, Color32::WHITE)] {
            let stroke = Stroke::new(width, color);
            ui.painter()
                .rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Outside);
        }
    }
    let words = pointed_at.as_ref().map(|at| at.words.as_str());
    readout.say(ui, words, "Point at a bin (bright: many)");
    numbers(ui, context, method, shown, histogram);
}

fn ui_color(ctx: &egui::Context) -> Color32 {
    ctx.global_style().visuals.weak_text_color()
}

/// Marks at the grey values alone, not at the margins' bars.
fn grey_marks(_: GridInput) -> Vec<GridMark> {
    (0..=4)
        .map(|quarter| GridMark {
            value: 64.0 * f64::from(quarter),
            step_size: 64.0,
        })
        .collect()
}

/// How often each bin of one image occurs.
struct Margins {
    query: Vec<u32>,
    synthetic: Vec<u32>,
    pairs: u32,
    most: u32,
}

/// A bin or a bar under the pointer.
struct PointedAt {
    from: [f64; 2],
    to: [f64; 2],
    words: String,
}

impl Margins {
    fn of(histogram: &JointHistogram) -> Self {
        let JointHistogram { bins, counts, .. } = histogram;
        let mut query = Vec::with_capacity(*bins);
        let mut synthetic = vec![0; *bins];
        for row in counts.chunks(*bins) {
            query.push(row.iter().sum());
            for (sum, count) in synthetic.iter_mut().zip(row) {
                *sum += count;
            }
        }
        let most = query.iter().chain(&synthetic).copied().max();
        Self {
            pairs: query.iter().sum(),
            most: most.unwrap_or(0).max(1),
            query,
            synthetic,
        }
    }

    fn bars(&self, counts: &[u32]) -> Vec<Bar> {
        let width = GREYS / counts.len() as f64;
        let bar = |(bin, &count): (usize, &u32)| {
            let length = MARGIN_LENGTH * f64::from(count) / f64::from(self.most);
            Bar::new((bin as f64 + 0.5) * width, length)
                .width(0.9 * width)
                .base_offset(MARGIN_FROM)
        };
        counts.iter().enumerate().map(bar).collect()
    }

    /// What is at a point of the plot.
    fn at(&self, histogram: &JointHistogram, synthetic: f64, query: f64) -> Option<PointedAt> {
        let bins = histogram.bins;
        let width = GREYS / bins as f64;
        let bin = |value: f64| {
            (0.0..GREYS)
                .contains(&value)
                .then_some((value / width) as usize)
        };
        let is_bar = |value: f64| (MARGIN_FROM..=MARGIN_FROM + MARGIN_LENGTH).contains(&value);
        let ends = |bin: usize| (bin as f64 * width, (bin + 1) as f64 * width);
        let share = |count: u32| 100.0 * f64::from(count) / f64::from(self.pairs.max(1));
        let grey = |bin: usize| greys(bin, bins);
        match (bin(synthetic), bin(query)) {
            (Some(column), Some(row)) => {
                let count = histogram.counts[row * bins + column];
                let ((left, right), (low, high)) = (ends(column), ends(row));
                Some(PointedAt {
                    from: [left, low],
                    to: [right, high],
                    words: format!(
                        "{count} pairs ({:.2} %): query {}, synthetic {}",
                        share(count),
                        grey(row),
                        grey(column)
                    ),
                })
            }
            (Some(column), None) if is_bar(query) => {
                let (left, right) = ends(column);
                let count = self.synthetic[column];
                Some(PointedAt {
                    from: [left, MARGIN_FROM],
                    to: [right, MARGIN_FROM + MARGIN_LENGTH],
                    words: format!(
                        "{count} pixels ({:.2} %): synthetic {}",
                        share(count),
                        grey(column)
                    ),
                })
            }
            (None, Some(row)) if is_bar(synthetic) => {
                let (low, high) = ends(row);
                let count = self.query[row];
                Some(PointedAt {
                    from: [MARGIN_FROM, low],
                    to: [MARGIN_FROM + MARGIN_LENGTH, high],
                    words: format!(
                        "{count} pixels ({:.2} %): query {}",
                        share(count),
                        grey(row)
                    ),
                })
            }
            _ => None,
        }
    }
}

/// The grey values of a bin in words; whole ones where the bins hold whole ones.
fn greys(bin: usize, bins: usize) -> String {
    let width = GREYS / bins as f64;
    let (from, to) = (bin as f64 * width, (bin + 1) as f64 * width);
    match (width.fract() == 0.0, width) {
        (true, 1.0) => format!("{from}"),
        (true, _) => format!("{from} to {}", to - 1.0),
        (false, _) => format!("{from:.1} to {to:.1}"),
    }
}

/// The formula with its numbers.
fn numbers(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    method: Method,
    shown: &Comparison,
    histogram: &JointHistogram,
) {
    let cost = estimator::find(method).and_then(Entry::cost);
    // The histogram's entropies are natural ones.
    let bits = |nats: f64| nats / std::f64::consts::LN_2;
    let query = bits(histogram.query_entropy);
    let synthetic = bits(histogram.synthetic_entropy);
    let joint = bits(histogram.joint_entropy);
    ui.label(format!(
        "H(Q) = {query:.3} bit, H(S) = {synthetic:.3} bit, H(Q,S) = {joint:.3} bit"
    ));
    let shared = query + synthetic - joint;
    ui.label(format!(
        "I(Q,S) = H(Q) + H(S) - H(Q,S) = {query:.3} + {synthetic:.3} - {joint:.3} = {shared:.3} bit"
    ));
    let similarity = cost.and_then(|cost| cost.similarity);
    if let Some(cost) = shown.score.cost {
        let mut is = String::new();
        if let Some(Similarity { name, formula }) = similarity {
            let share = 1.0 - cost;
            let norm = shared / share;
            ui.label(format!(
                "{name} = {formula} = {shared:.3} / {norm:.3} = {share:.4}"
            ));
            is = format!(" = 1 - {name}");
        }
        ui.label(format!(
            "cost{is} = {cost:.4}, over {} pixels",
            shown.score.covered
        ));
    }
    let quality: fn(f64) -> f64 = |cost| 1.0 - cost;
    ui.separator();
    ui.label(
        egui::RichText::new(method.label())
            .color(theme::text(ui.visuals(), theme::method(method)))
            .strong(),
    );
    let quality = similarity.map(|similarity| (similarity.name, quality));
    comparison(ui, context, method, shown.score.cost, quality);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::IntensityPair;

    #[test]
    fn the_pointer_finds_its_bin_and_its_bars() {
        let pairs = [(0.0, 255.0), (10.0, 250.0), (200.0, 3.0)]
            .map(|(query, synthetic)| IntensityPair { query, synthetic });
        let histogram = JointHistogram::of(&pairs, 16);
        let margins = Margins::of(&histogram);
        let words = |x, y| margins.at(&histogram, x, y).map(|at| at.words);
        assert_eq!(
            words(250.0, 5.0).as_deref(),
            Some("2 pairs (66.67 %): query 0 to 15, synthetic 240 to 255")
        );
        assert_eq!(
            words(1.0, 270.0).as_deref(),
            Some("1 pixels (33.33 %): synthetic 0 to 15")
        );
        assert_eq!(
            words(270.0, 1.0).as_deref(),
            Some("2 pixels (66.67 %): query 0 to 15")
        );
        assert_eq!(words(270.0, 270.0), None);
        assert_eq!(words(-1.0, 5.0), None);
    }

    #[test]
    fn bins_are_named_by_the_grey_values_that_fall_into_them() {
        assert_eq!(greys(1, 16), "16 to 31");
        assert_eq!(greys(7, 256), "7");
        assert_eq!(greys(1, 10), "25.6 to 51.2");
    }
}
