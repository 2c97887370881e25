//! The cost along each axis through the minimum.

use egui::{Color32, Ui};
use egui_plot::{HoverPosition, Line, LineStyle, Plot, VLine};

use super::scale::number;
use super::search::{Search, Searched};
use crate::app::views::legend::name_picture;
use crate::app::{ViewContext, theme};
use crate::grid::{Lattice, Offset, Phase};

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
            slice(ui, axis, width, search, &marks);
        }
    });
}

type LineMark = (&'static str, Color32, LineStyle, Offset);

/// What is marked in the slices, if it is known.
fn marks(ui: &Ui, context: &ViewContext<'_>, search: &Search<'_>) -> Vec<LineMark> {
    let strong = ui.visuals().strong_text_color();
    let truth = context.truth().map(|pose| search.offset(pose));
    let hypothesis = search.hypothesis.map(|scored| scored.offset);
    let camera = context.camera().map(|pose| search.offset(&pose));
    let [dashed, dotted] = [LineStyle::dashed_loose(), LineStyle::dotted_loose()];
    let marks = [
        ("╎ truth", theme::TRUTH, dashed, truth),
        ("│ hypothesis", strong, LineStyle::Solid, hypothesis),
        ("┊ camera in hand", theme::CAMERA, dotted, camera),
    ];
    let marks = marks.into_iter();
    marks.filter_map(|(name, color, style, offset)| Some((name, color, style, offset?))).collect()
}

fn slice(
    ui: &mut Ui,
    (axis, name, unit): (SliceAxis, &str, &str),
    width: f32,
    search: &Search<'_>,
    marks: &[LineMark],
) {
    let label = |position: &HoverPosition<'_>| match position {
        HoverPosition::NearDataPoint { position, .. } => {
            let cost = number(position.y);
            Some(format!("cost {cost} at {name} {:.2} {unit}", position.x))
        }
        HoverPosition::Elsewhere { .. } => None,
    };
    let answer = Plot::new(name)
        .width(width)
        .height(PLOT_HEIGHT)
        .allow_scroll(false)
        .x_axis_label(format!("{name} [{unit}]"))
        .label_formatter(label)
        .show(ui, |plot| {
            for (name, color, style, offset) in marks {
                let line = VLine::new(*name, axis.of(offset)).color(*color);
                plot.vline(line.style(*style).allow_hover(false));
            }
            for (phase, width) in axis.phases().into_iter().zip([1.0, 2.5]) {
                let searched = search.last(phase);
                let stretches =
                    searched.map(|searched| axis.stretches(searched, search.least_covered));
                for (index, stretch) in stretches.into_iter().flatten().enumerate() {
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
