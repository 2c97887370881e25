//! The cost along each axis through the minimum, PM and MI over each other.

use egui::{Color32, Ui};
use egui_plot::{HoverPosition, Line, LineStyle, Plot, PlotUi, VLine};

use super::scale::number;
use super::search::{Search, Searched};
use crate::app::{ViewContext, theme};
use crate::grid::{Lattice, Offset, Phase};
use crate::method::Method;

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
}

/// What costs are made comparable by: 0 and 1 on the axis of the slices.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CostScale {
    zero: f64,
    one: f64,
    /// Whether these are the result and its shuffled pixels, or else the least and greatest so far.
    is_assessed: bool,
}

impl CostScale {
    /// From the best cost to that of shuffled pixels. Before the search is assessed, and where the
    /// best is no better than shuffled pixels, from the least to the greatest cost.
    fn of(assessed: Option<(f64, f64)>, costs: impl Iterator<Item = f64>) -> Option<Self> {
        if let Some((zero, one)) = assessed
            && zero < one
        {
            return Some(Self {
                zero,
                one,
                is_assessed: true,
            });
        }
        let ends = costs.fold(None, |ends: Option<(f64, f64)>, cost| {
            let (least, greatest) = ends.unwrap_or((cost, cost));
            Some((least.min(cost), greatest.max(cost)))
        });
        let (zero, one) = ends?;
        Some(Self {
            zero,
            one: if zero < one { one } else { zero + 1.0 },
            is_assessed: false,
        })
    }

    fn place(&self, cost: f64) -> f64 {
        (cost - self.zero) / (self.one - self.zero)
    }

    fn cost(&self, place: f64) -> f64 {
        self.zero + place * (self.one - self.zero)
    }

    fn words(&self) -> String {
        let (zero, one) = (number(self.zero), number(self.one));
        if self.is_assessed {
            format!("0 = {zero} at the result, 1 = {one} with shuffled pixels")
        } else {
            format!("0 = {zero}, the least so far, 1 = {one}, the greatest")
        }
    }
}

/// A method's search with what its costs are measured by.
struct Curve<'a> {
    search: Search<'a>,
    range: CostScale,
    least_covered: u32,
}

impl<'a> Curve<'a> {
    fn of(context: &ViewContext<'a>, method: Method, floor: f64) -> Option<Self> {
        let search = Search::at(context, method)?;
        let least_covered = search.least_covered(floor);
        let assessed = search
            .assessed
            .and_then(|assessed| Some((assessed.best, assessed.shuffled?)));
        let scores = search
            .lattices
            .iter()
            .flat_map(|searched| searched.surface.scores.iter().flatten());
        let costs = scores.filter_map(|score| score.eligible_cost(least_covered));
        Some(Self {
            range: CostScale::of(assessed, costs)?,
            least_covered,
            search,
        })
    }

    /// The stretches of a lattice's slice that may win.
    fn stretches(&self, along: SliceAxis, searched: &Searched) -> Vec<Vec<[f64; 2]>> {
        let Some(minimum) = searched.minimum(self.least_covered) else {
            return Vec::new();
        };
        let lattice = &searched.surface.lattice;
        let points = along.cells(lattice, minimum.cell).into_iter().map(|cell| {
            let cost = searched.surface.scores[cell]?.eligible_cost(self.least_covered)?;
            Some([along.of(&lattice.offset(cell)?), self.range.place(cost)])
        });
        let points: Vec<Option<[f64; 2]>> = points.collect();
        points
            .split(Option::is_none)
            .filter(|stretch| !stretch.is_empty())
            .map(|stretch| stretch.iter().flatten().copied().collect())
            .collect()
    }

    fn draw<'p>(&self, plot: &mut PlotUi<'p>, along: SliceAxis) {
        let name = self.search.method.name().to_uppercase();
        let color = theme::method(self.search.method);
        for (phase, width) in along.phases().into_iter().zip([1.0, 2.5]) {
            let Some(searched) = self.search.last(phase) else {
                continue;
            };
            for (index, stretch) in self.stretches(along, searched).into_iter().enumerate() {
                let line = Line::new(name.clone(), stretch).color(color).width(width);
                plot.line(line.id((self.search.method, phase, index)));
            }
        }
    }
}

/// Draws the slices. `shown` is the method of the maps, whose minimum is marked; the floor is that
/// of the slider.
pub(super) fn ui(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    shown: &Search<'_>,
    floor: f64,
    width: f32,
) {
    let methods = context.direct_methods();
    let curves: Vec<Curve<'_>> = methods
        .into_iter()
        .filter_map(|method| Curve::of(context, method, floor))
        .collect();
    ui.label("Slices through each minimum");
    for curve in &curves {
        ui.horizontal_wrapped(|ui| {
            let name = curve.search.method.name().to_uppercase();
            let color = theme::method(curve.search.method);
            key(ui, color, LineStyle::Solid);
            ui.label(egui::RichText::new(name).strong());
            ui.weak(curve.range.words());
        });
    }
    let marks = marks(ui, context, shown, floor);
    let gap = ui.spacing().item_spacing.x;
    let width = ((width - 2.0 * gap - 2.0) / 3.0).max(60.0);
    ui.horizontal_top(|ui| {
        for along in SliceAxis::ALL {
            slice(ui, along, width, &curves, &marks);
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

fn marks(ui: &Ui, context: &ViewContext<'_>, shown: &Search<'_>, floor: f64) -> Vec<LineMark> {
    let least_covered = shown.least_covered(floor);
    let minimum = |phases: [Phase; 2]| {
        let searched = phases.into_iter().find_map(|phase| shown.last(phase))?;
        Some(searched.minimum(least_covered)?.offset)
    };
    let position = minimum([Phase::PositionFine, Phase::PositionCoarse]);
    let yaw = minimum([Phase::YawFine, Phase::YawCoarse]);
    let lowest = position.map(|position| Offset {
        yaw_rad: yaw.map_or(position.yaw_rad, |yaw| yaw.yaw_rad),
        ..position
    });
    let truth = context.truth().map(|pose| shown.offset(pose));
    let hypothesis = shown.hypothesis.map(|scored| scored.offset);
    let camera = context.camera().map(|pose| shown.offset(&pose));
    let strong = ui.visuals().strong_text_color();
    let dashed = LineStyle::dashed_loose();
    [
        ("minimum", theme::ESTIMATE, LineStyle::Solid, lowest),
        ("truth", theme::TRUTH, dashed, truth),
        ("hypothesis", strong, LineStyle::dotted_dense(), hypothesis),
        (
            "camera in hand",
            theme::CAMERA,
            LineStyle::dotted_loose(),
            camera,
        ),
    ]
    .into_iter()
    .filter_map(|(name, color, style, offset)| Some((name, color, style, offset?)))
    .collect()
}

fn slice(ui: &mut Ui, along: SliceAxis, width: f32, curves: &[Curve<'_>], marks: &[LineMark]) {
    const HEIGHT: f32 = 130.0;
    let cost_of = |name: &str, place: f64| {
        let curve = curves
            .iter()
            .find(|curve| curve.search.method.name().eq_ignore_ascii_case(name))?;
        Some(curve.range.cost(place))
    };
    let label = |position: &HoverPosition<'_>| match position {
        HoverPosition::NearDataPoint {
            plot_name,
            position,
            ..
        } => {
            let cost = number(cost_of(plot_name, position.y)?);
            let (name, unit) = (along.name(), along.unit());
            Some(format!(
                "{plot_name} {cost} at {name} {:.2} {unit}",
                position.x
            ))
        }
        HoverPosition::Elsewhere { .. } => None,
    };
    let answer = Plot::new(along.name())
        .width(width)
        .height(HEIGHT)
        .default_y_bounds(-0.1, 1.3)
        .allow_scroll(false)
        .x_axis_label(format!("{} [{}]", along.name(), along.unit()))
        .label_formatter(label)
        .show(ui, |plot| {
            for (name, color, style, offset) in marks {
                let line = VLine::new(*name, along.of(offset))
                    .color(*color)
                    .style(*style);
                plot.vline(line.allow_hover(false));
            }
            for curve in curves {
                curve.draw(plot, along);
            }
        });
    let name = format!("Slice along {}", along.name());
    answer
        .response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
}

/// A piece of a line, as in the plots.
pub(super) fn key(ui: &mut Ui, color: Color32, style: LineStyle) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(16.0, 10.0), egui::Sense::hover());
    let ends = [rect.left_center(), rect.right_center()];
    let stroke = egui::Stroke::new(2.0, color);
    match style {
        LineStyle::Solid => {
            ui.painter().line_segment(ends, stroke);
        }
        LineStyle::Dashed { .. } => {
            ui.painter()
                .extend(egui::Shape::dashed_line(&ends, stroke, 5.0, 3.0));
        }
        LineStyle::Dotted { .. } => {
            ui.painter()
                .extend(egui::Shape::dotted_line(&ends, color, 4.0, 1.2));
        }
    }
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

    #[test]
    fn a_range_that_means_nothing_gives_way_to_that_of_the_costs() {
        let costs = || [3.0, 1.0, 2.0].into_iter();
        let assessed = CostScale::of(Some((1.0, 5.0)), costs()).expect("costs");
        assert_eq!((assessed.place(3.0), assessed.cost(0.5)), (0.5, 3.0));
        let worse_than_shuffled = CostScale::of(Some((5.0, 1.0)), costs()).expect("costs");
        assert!(!worse_than_shuffled.is_assessed);
        assert_eq!(worse_than_shuffled.place(2.0), 0.5);
        assert_eq!(CostScale::of(None, std::iter::empty()), None);
        let flat = CostScale::of(None, [4.0, 4.0].into_iter()).expect("costs");
        assert_eq!(flat.place(4.0), 0.0);
    }
}
