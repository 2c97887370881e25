//! The cost along each axis through the minimum.

use egui::{Color32, Ui};
use egui_plot::{HoverPosition, Line, LineStyle, Plot, PlotUi, VLine};

use super::scale::number;
use super::search::{Search, Searched};
use crate::app::{ViewContext, theme};
use crate::grid::{Lattice, Offset, Phase};

/// What changes along a slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SliceAxis {
    Right,
    Forward,
    Yaw,
}

impl SliceAxis {
    const ALL: [Self; 3] = [Self::Right, Self::Forward, Self::Yaw];

    fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Forward => "forward",
            Self::Yaw => "yaw",
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Right | Self::Forward => "m",
            Self::Yaw => "°",
        }
    }

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

    /// The cells of a lattice through a cell, in their order.
    fn cells(self, lattice: &Lattice, through: usize) -> Vec<usize> {
        let Lattice { columns, rows, .. } = *lattice;
        match self {
            Self::Right | Self::Yaw => {
                let row = through / columns;
                (0..columns).map(|column| row * columns + column).collect()
            }
            Self::Forward => {
                let column = through % columns;
                (0..rows).map(|row| row * columns + column).collect()
            }
        }
    }

    /// The stretches of a lattice's slice through its minimum that are above the coverage floor.
    fn stretches(self, searched: &Searched, least_covered: u32) -> Vec<Vec<[f64; 2]>> {
        let Some(minimum) = searched.minimum(least_covered) else {
            return Vec::new();
        };
        let lattice = &searched.surface.lattice;
        let points = self.cells(lattice, minimum.cell).into_iter().map(|cell| {
            let cost = searched.surface.scores[cell]?.eligible_cost(least_covered)?;
            Some([self.of(&lattice.offset(cell)?), cost])
        });
        let points: Vec<Option<[f64; 2]>> = points.collect();
        points
            .split(Option::is_none)
            .filter(|stretch| !stretch.is_empty())
            .map(|stretch| stretch.iter().flatten().copied().collect())
            .collect()
    }
}

/// Draws the slices of a search.
pub(super) fn ui(ui: &mut Ui, context: &ViewContext<'_>, search: &Search<'_>, width: f32) {
    ui.strong("Slices through the minimum");
    let marks = marks(ui, context, search);
    let gap = ui.spacing().item_spacing.x;
    let width = ((width - 2.0 * gap - 2.0) / 3.0).max(60.0);
    ui.horizontal_top(|ui| {
        for along in SliceAxis::ALL {
            slice(ui, along, width, search, &marks);
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.weak("thin: coarse, thick: fine");
        for (name, color, style, _) in &marks {
            key(ui, *color, *style);
            ui.weak(*name);
        }
    });
}

type LineMark = (&'static str, Color32, LineStyle, Offset);

fn marks(ui: &Ui, context: &ViewContext<'_>, search: &Search<'_>) -> Vec<LineMark> {
    let strong = ui.visuals().strong_text_color();
    let truth = context.truth().map(|pose| search.offset(pose));
    let hypothesis = search.hypothesis.map(|scored| scored.offset);
    let camera = context.camera().map(|pose| search.offset(&pose));
    let [dashed, dotted] = [LineStyle::dashed_loose(), LineStyle::dotted_loose()];
    let marks = [
        ("truth", theme::TRUTH, dashed, truth),
        ("hypothesis", strong, LineStyle::Solid, hypothesis),
        ("camera in hand", theme::CAMERA, dotted, camera),
    ];
    let known = marks.into_iter();
    known
        .filter_map(|(name, color, style, offset)| Some((name, color, style, offset?)))
        .collect()
}

fn slice(ui: &mut Ui, along: SliceAxis, width: f32, search: &Search<'_>, marks: &[LineMark]) {
    const HEIGHT: f32 = 130.0;
    let (name, unit) = (along.name(), along.unit());
    let label = |position: &HoverPosition<'_>| match position {
        HoverPosition::NearDataPoint { position, .. } => {
            let cost = number(position.y);
            Some(format!("cost {cost} at {name} {:.2} {unit}", position.x))
        }
        HoverPosition::Elsewhere { .. } => None,
    };
    let answer = Plot::new(name)
        .width(width)
        .height(HEIGHT)
        .allow_scroll(false)
        .x_axis_label(format!("{name} [{unit}]"))
        .label_formatter(label)
        .show(ui, |plot| {
            for (name, color, style, offset) in marks {
                let line = VLine::new(*name, along.of(offset)).color(*color);
                plot.vline(line.style(*style).allow_hover(false));
            }
            draw(plot, along, search);
        });
    let name = format!("Cost along {name}");
    answer
        .response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
}

fn draw(plot: &mut PlotUi<'_>, along: SliceAxis, search: &Search<'_>) {
    let color = theme::method(search.method);
    for (phase, width) in along.phases().into_iter().zip([1.0, 2.5]) {
        let Some(searched) = search.last(phase) else {
            continue;
        };
        let stretches = along.stretches(searched, search.least_covered);
        for (index, stretch) in stretches.into_iter().enumerate() {
            let line = Line::new(search.method.label(), stretch);
            plot.line(line.color(color).width(width).id((phase, index)));
        }
    }
}

/// A piece of a line as the plots draw it.
fn key(ui: &mut Ui, color: Color32, style: LineStyle) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(16.0, 10.0), egui::Sense::hover());
    let ends = [rect.left_center(), rect.right_center()];
    let stroke = egui::Stroke::new(2.0, color);
    let shapes = match style {
        LineStyle::Solid => vec![egui::Shape::line_segment(ends, stroke)],
        LineStyle::Dashed { .. } => egui::Shape::dashed_line(&ends, stroke, 5.0, 3.0),
        LineStyle::Dotted { .. } => egui::Shape::dotted_line(&ends, color, 4.0, 1.2),
    };
    ui.painter().extend(shapes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridParams;

    #[test]
    fn a_slice_takes_the_row_or_the_column_of_its_cell() {
        let params = GridParams::default();
        let lattice =
            Lattice::new(Phase::PositionCoarse, Offset::default(), 1.0, &params).expect("small");
        assert_eq!(SliceAxis::Right.cells(&lattice, 5), [3, 4, 5]);
        assert_eq!(SliceAxis::Forward.cells(&lattice, 5), [2, 5, 8]);
        let yaw = Lattice::new(Phase::YawCoarse, Offset::default(), 1.0, &params).expect("small");
        assert_eq!(SliceAxis::Yaw.cells(&yaw, 5).len(), yaw.columns);
    }
}
