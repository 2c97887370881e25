//! The joint histogram with its entropies and the mutual information.

use std::sync::Arc;

use egui::{Color32, Rect, Stroke, Ui};
use egui_plot::{GridInput, GridMark, Plot, PlotImage, PlotPoint};

use crate::app::ViewContext;
use crate::app::views::legend::{Readout, name_picture};
use crate::cost::JointHistogram;
use crate::cost::Similarity;
use crate::estimator::{self, Entry};
use crate::method::Method;
use crate::picture;
use crate::render::Comparison;

/// The smallest and the largest histogram \[points\].
const SIDE: egui::Rangef = egui::Rangef { min: 110.0, max: 420.0 };
/// The height below which it is small, and the room below it, for its axis and with the numbers \[points\].
const SMALL: f32 = 320.0;
const AXIS: f32 = 6.0;
const NUMBERS: f32 = 90.0;
/// Grey values of an axis.
const GREYS: f64 = 256.0;

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
    let texture = context.state.textures.of(ui.ctx(), "joint histogram", shown, |_| {
        let picture = picture::joint_histogram(histogram).into();
        crate::app::textures::color_image(&picture)
    });
    let readout = Readout::reserve(ui);
    // A small one is beside something else, and has no room for the numbers below it.
    let is_small = ui.available_height() < SMALL;
    let below = if is_small { AXIS } else { NUMBERS };
    let room = (ui.available_height() - below).max(SIDE.min);
    let side = ui.available_width().min(room).min(SIDE.max);
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
        .x_axis_label(format!("{sees}, synthetic view"))
        .y_axis_label(format!("{sees}, query"))
        .include_x(0.0)
        .include_y(0.0)
        .include_x(GREYS)
        .include_y(GREYS)
        .set_margin_fraction(egui::Vec2::ZERO)
        .show(ui, |plot| {
            let middle = PlotPoint::new(0.5 * GREYS, 0.5 * GREYS);
            let size = [GREYS as f32; 2];
            plot.add(PlotImage::new("bins", texture.id(), middle, size));
        });
    name_picture(
        &answer.response,
        format!(
            "Joint histogram of {} pairs in {} bins per axis",
            histogram.counts.iter().sum::<u32>(),
            histogram.bins
        ),
    );
    let pointed_at = answer.response.hover_pos().and_then(|at| {
        let point = answer.transform.value_from_position(at);
        bin_at(histogram, point.x, point.y)
    });
    if let Some(([row, column], _)) = pointed_at {
        let width = GREYS / histogram.bins as f64;
        let corner = |column: usize, row: usize| {
            let point = PlotPoint::new(column as f64 * width, row as f64 * width);
            answer.transform.position_from_point(&point)
        };
        let rect = Rect::from_two_pos(corner(column, row), corner(column + 1, row + 1));
        for (width, color) in [(3.0, Color32::BLACK), (1.5, Color32::WHITE)] {
            let stroke = Stroke::new(width, color);
            ui.painter().rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Outside);
        }
    }
    let words = pointed_at.as_ref().map(|(_, words)| words.as_str());
    readout.say(ui, words, "Point at a bin (bright: many pairs)");
    if !is_small {
        numbers(ui, method, shown, histogram);
    }
}

/// Marks at every quarter of the grey values.
fn grey_marks(_: GridInput) -> Vec<GridMark> {
    let quarters =
        (0..=4).map(|quarter| GridMark { value: 64.0 * f64::from(quarter), step_size: 64.0 });
    quarters.collect()
}

/// The row and the column of the bin at a place of the plot, and what is in it.
fn bin_at(histogram: &JointHistogram, synthetic: f64, query: f64) -> Option<([usize; 2], String)> {
    let bins = histogram.bins;
    let bin = |value: f64| {
        let bin = (value * bins as f64 / GREYS) as usize;
        (0.0..GREYS).contains(&value).then_some(bin)
    };
    let (column, row) = (bin(synthetic)?, bin(query)?);
    let pairs: u32 = histogram.counts.iter().sum();
    let count = histogram.counts[row * bins + column];
    let share = 100.0 * f64::from(count) / f64::from(pairs.max(1));
    let (in_query, in_view) = (greys(row, bins), greys(column, bins));
    let words = format!("{count} pairs ({share:.2} %): query {in_query}, synthetic {in_view}");
    Some(([row, column], words))
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
fn numbers(ui: &mut Ui, method: Method, shown: &Comparison, histogram: &JointHistogram) {
    let cost = estimator::find(method).and_then(Entry::cost);
    // The histogram's entropies are natural ones.
    let bits = |nats: f64| nats / std::f64::consts::LN_2;
    let query = bits(histogram.entropies.query);
    let synthetic = bits(histogram.entropies.synthetic);
    let joint = bits(histogram.entropies.joint);
    ui.label(format!("H(Q) = {query:.3} bit, H(S) = {synthetic:.3} bit, H(Q,S) = {joint:.3} bit"));
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
            ui.label(format!("{name} = {formula} = {shared:.3} / {norm:.3} = {share:.4}"));
            is = format!(" = 1 - {name}");
        }
        ui.label(format!("cost{is} = {cost:.4}, over {} pixels", shown.score.covered));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::IntensityPair;

    #[test]
    fn the_pointer_finds_its_bin() {
        let pairs = [(0.0, 255.0), (10.0, 250.0), (200.0, 3.0)]
            .map(|(query, synthetic)| IntensityPair { query, synthetic });
        let histogram = JointHistogram::of(&pairs, 16);
        let words = |x, y| bin_at(&histogram, x, y).map(|(_, words)| words);
        assert_eq!(
            words(250.0, 5.0).as_deref(),
            Some("2 pairs (66.67 %): query 0 to 15, synthetic 240 to 255")
        );
        assert_eq!(words(270.0, 1.0), None);
        assert_eq!(words(-1.0, 5.0), None);
    }

    #[test]
    fn bins_are_named_by_the_grey_values_that_fall_into_them() {
        assert_eq!(greys(1, 16), "16 to 31");
        assert_eq!(greys(7, 256), "7");
        assert_eq!(greys(1, 10), "25.6 to 51.2");
    }
}
