//! The cost along each axis through the minimum.

use egui::{Color32, Ui};
use egui_plot::{Line, LineStyle, Plot, PlotPoint, VLine};

use super::scale::number;
use super::search::{Minimum, Search, Searched};
use crate::app::views::legend::{at_points, name_picture, stretches};
use crate::app::{ViewContext, theme};
use crate::grid::{Offset, Phase};

/// Height of a plot \[points\].
const PLOT_HEIGHT: f32 = 130.0;

/// What changes along a slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SliceAxis {
    Right,
    Forward,
    Yaw,
}

impl SliceAxis {
    /// The axes with their names and units.
    const ALL: [(Self, &'static str, &'static str); 3] =
        [(Self::Right, "right", "m"), (Self::Forward, "forward", "m"), (Self::Yaw, "yaw", "°")];

    /// The coordinate along the axis, in its unit.
    fn of(self, offset: &Offset) -> f64 {
        match self {
            Self::Right => offset.right_m,
            Self::Forward => offset.forward_m,
            Self::Yaw => offset.yaw_rad.to_degrees(),
        }
    }

    fn phases(self) -> [Phase; 2] {
        match self {
            Self::Right | Self::Forward => [Phase::PositionCoarse, Phase::PositionFine],
            Self::Yaw => [Phase::YawCoarse, Phase::YawFine],
        }
    }

    /// The slice of a lattice through its minimum; nothing where it is not eligible.
    fn curve(self, searched: &Searched) -> Vec<Option<[f64; 2]>> {
        let Some(Minimum { offset: through, .. }) = searched.minimum() else {
            return Vec::new();
        };
        let is_on_slice = |offset: &Offset| match self {
            Self::Right => offset.forward_m == through.forward_m,
            Self::Forward => offset.right_m == through.right_m,
            Self::Yaw => true,
        };
        let cells = searched.surface.lattice.hypotheses();
        let cells = cells
            .filter(|(_, offset)| is_on_slice(offset))
            .map(|(cell, offset)| Some([self.of(&offset), searched.surface.eligible_cost(cell)?]));
        cells.collect()
    }
}

/// Draws the slices of a search.
pub(super) fn ui(ui: &mut Ui, context: &ViewContext<'_>, search: &Search<'_>) {
    let marks = marks(ui, context, search);
    ui.horizontal_wrapped(|ui| {
        ui.weak("Cost through the minimum (thin: coarse, thick: fine)");
        for (name, color, ..) in &marks {
            ui.colored_label(theme::text(ui.visuals(), *color), *name);
        }
    });
    let gap = ui.spacing().item_spacing.x;
    let width = ((ui.available_width() - 2.0 * gap) / 3.0).max(60.0);
    ui.horizontal_top(|ui| {
        for axis in SliceAxis::ALL {
            slice(ui, context, axis, width, search, &marks);
        }
    });
}

type LineMark = (&'static str, Color32, LineStyle, Offset);

/// What is marked in the slices, if it is known.
fn marks(ui: &Ui, context: &ViewContext<'_>, search: &Search<'_>) -> Vec<LineMark> {
    let strong = ui.visuals().strong_text_color();
    let truth = context.truth().map(|pose| search.offset(pose));
    let hypothesis = search.hypothesis.map(|scored| scored.offset);
    let camera = context.state.camera.map(|pose| search.offset(&pose));
    let [dashed, dotted] = [LineStyle::dashed_loose(), LineStyle::dotted_loose()];
    let marks = [
        ("╎ truth", theme::TRUTH, dashed, truth),
        ("│ hypothesis", strong, LineStyle::Solid, hypothesis),
        ("┊ trial camera", theme::CAMERA, dotted, camera),
    ];
    let marks = marks.into_iter();
    marks.filter_map(|(name, color, style, offset)| Some((name, color, style, offset?))).collect()
}

fn slice(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    (axis, name, unit): (SliceAxis, &str, &str),
    width: f32,
    search: &Search<'_>,
    marks: &[LineMark],
) {
    let label = at_points(|_, PlotPoint { x, y }| {
        context.in_unit(&format!("cost {} at {name} {x:.2} {unit}", number(y)))
    });
    let answer = Plot::new(name)
        .width(width)
        .height(PLOT_HEIGHT)
        .allow_scroll(false)
        .x_axis_label(context.in_unit(&format!("{name} [{unit}]")))
        .label_formatter(label)
        .show(ui, |plot| {
            for (name, color, style, offset) in marks {
                let line = VLine::new(*name, axis.of(offset)).color(*color);
                plot.vline(line.style(*style).allow_hover(false));
            }
            for (phase, width) in axis.phases().into_iter().zip([1.0, 2.5]) {
                let curve = search.last(phase).map(|searched| axis.curve(searched));
                let curve = curve.unwrap_or_default();
                for (index, stretch) in stretches(&curve).enumerate() {
                    let line = Line::new(search.method.label(), stretch).width(width);
                    let line = line.color(theme::method(search.method));
                    plot.line(line.id((phase, index)));
                }
            }
        });
    name_picture(&answer.response, format!("Cost along {name}"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::grid::{GridParams, Lattice, ScoredLattice};
    use crate::render::Score;

    #[test]
    fn a_slice_takes_the_row_or_the_column_of_the_minimum() {
        let lattice =
            Lattice::new(Phase::PositionCoarse, Offset::default(), 1.0, &GridParams::default());
        let lattice = lattice.expect("small");
        let lowest = Offset { right_m: 0.0, forward_m: -1.0, yaw_rad: 0.0 };
        let mut scores = vec![None; lattice.cells()];
        for (cell, offset) in lattice.hypotheses() {
            let cost = if offset == lowest { 1.0 } else { 2.0 };
            scores[cell] = Some(Score { cost: Some(cost), covered: 9 });
        }
        let curve_above = |axis: SliceAxis, least_covered| {
            let (lattice, scores) = (lattice.clone(), scores.clone());
            let surface = Arc::new(ScoredLattice { lattice, scores, least_covered });
            axis.curve(&Searched { tried: 5, surface, is_complete: true })
        };
        let curve = |axis| curve_above(axis, 5);
        let column = [[-1.0, 1.0], [0.0, 2.0], [1.0, 2.0]].map(Some);
        assert_eq!(curve(SliceAxis::Forward), column);
        assert_eq!(curve(SliceAxis::Right), [Some([0.0, 1.0])]);
        assert_eq!(curve_above(SliceAxis::Forward, 10), []);
    }
}
