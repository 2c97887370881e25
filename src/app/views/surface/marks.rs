//! Places on the maps, each with a shape of its own, and their legend.

use egui::{
    Align2, Color32, FontId, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, pos2, vec2,
};
use egui_plot::MarkerShape;

use super::scale::number;
use super::search::{Minimum, Search};
use crate::app::{Command, ViewContext, theme};
use crate::geometry::Pose;
use crate::grid::{DenseSurface, Offset, Phase};
use crate::method::Method;

/// What is at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MarkKind {
    Start,
    Coarse,
    Fine,
    Feature,
    Truth,
    Camera,
    /// A local minimum of the coarse positions, the best being 1.
    Ranked(usize),
    /// The minimum under the floor of the slider.
    Floored,
    /// The least of a dense map.
    Dense,
}

/// Half the size of a mark in the legend \[points\].
const REACH: f32 = 5.0;
/// Local minima that are shown.
const RANKED: usize = 5;

/// A place on the maps.
pub(super) struct MapMark {
    pub(super) kind: MarkKind,
    pub(super) offset: Offset,
    pub(super) pose: Pose,
    /// The cost there, where it is known of the place itself.
    pub(super) cost: Option<f64>,
    pub(super) words: String,
}

impl MapMark {
    /// Everything that is to be marked, what matters most last. `floor` is what the slider says,
    /// `dense` the dense map that is shown.
    pub(super) fn all(
        context: &ViewContext<'_>,
        search: &Search<'_>,
        floor: f64,
        dense: Option<&DenseSurface>,
    ) -> Vec<Self> {
        let mut marks = Vec::new();
        let mut add = |kind, offset, pose, cost, name: &str, note: String| {
            marks.push(Self {
                kind,
                offset,
                pose,
                cost,
                words: format!("{name} {}{note}", place(&offset)),
            });
        };
        // The cost of the cell that a pose lies in, where it is not known at the pose itself.
        let at_cell = |offset: &Offset| match search.cost_near(offset) {
            Some(cost) => format!(", cell {}", number(cost)),
            None => String::new(),
        };
        let start = Offset::default();
        let pose = search.pose(&start);
        add(MarkKind::Start, start, pose, None, "start", at_cell(&start));
        let own_floor = search.least_covered(context.run.params.grid.coverage_floor);
        for (rank, minimum, margin) in ranked(search, search.least_covered(floor)) {
            let note = format!(", +{}", number(margin));
            let pose = search.pose(&minimum.offset);
            add(
                MarkKind::Ranked(rank),
                minimum.offset,
                pose,
                Some(minimum.cost),
                "minimum",
                note,
            );
        }
        let phases = [
            (MarkKind::Coarse, Phase::PositionCoarse, "coarse minimum"),
            (MarkKind::Fine, Phase::PositionFine, "fine minimum"),
        ];
        for (kind, phase, name) in phases {
            if let Some(searched) = search.last(phase)
                && let Some(minimum) = searched.minimum(own_floor)
            {
                let so_far = if searched.is_complete { "" } else { " so far" };
                let note = format!(", {}{so_far}", number(minimum.cost));
                add(
                    kind,
                    minimum.offset,
                    search.pose(&minimum.offset),
                    Some(minimum.cost),
                    name,
                    note,
                );
            }
        }
        if let Some(step) = search.steps.last() {
            let offset = Offset::of(&step.reference_from_camera);
            let pose = search.problem.world_from_query(&step.reference_from_camera);
            let cost = step.score.cost;
            let words = cost.map_or(String::new(), number);
            let note = format!(", {words}, after {} steps", search.steps.len());
            add(MarkKind::Fine, offset, pose, cost, "descent", note);
        }
        if let Some(moved) = moved(search, own_floor, search.least_covered(floor)) {
            let note = format!(", {}", number(moved.cost));
            let pose = search.pose(&moved.offset);
            add(
                MarkKind::Floored,
                moved.offset,
                pose,
                Some(moved.cost),
                "minimum at this floor",
                note,
            );
        }
        if let Some((offset, score)) = dense.and_then(DenseSurface::minimum) {
            let words = score.cost.map_or(String::new(), number);
            let note = format!(", {}, {words}", heading(&offset));
            let pose = search.pose(&offset);
            add(
                MarkKind::Dense,
                offset,
                pose,
                score.cost,
                "least of all",
                note,
            );
        }
        let cameras = [
            (
                MarkKind::Feature,
                context.estimate(Method::FB),
                "FB's estimate",
            ),
            (MarkKind::Camera, context.camera(), "camera in hand"),
            // Last, so that nothing hides it.
            (MarkKind::Truth, context.truth().copied(), "truth"),
        ];
        let at_truth = context.cost_bounds(search.method).truth;
        for (kind, pose, name) in cameras {
            if let Some(pose) = pose {
                let offset = search.offset(&pose);
                let cost = at_truth.filter(|_| kind == MarkKind::Truth);
                let note = match cost {
                    Some(cost) => format!(", {}", number(cost)),
                    None => at_cell(&offset),
                };
                add(kind, offset, pose, cost, name, note);
            }
        }
        marks
    }

    /// Paints the mark with its heading; `reach` is half its size \[points\].
    pub(super) fn paint(&self, painter: &Painter, at: Pos2, reach: f32) {
        if matches!(
            self.kind,
            MarkKind::Feature | MarkKind::Truth | MarkKind::Camera | MarkKind::Dense
        ) {
            let (sin, cos) = (self.offset.yaw_rad as f32).sin_cos();
            let tip = at + 2.4 * reach * vec2(-sin, -cos);
            painter.line_segment([at, tip], Stroke::new(3.0, Color32::WHITE));
            painter.line_segment([at, tip], Stroke::new(1.5, self.kind.color()));
        }
        self.kind.paint(painter, at, reach);
    }

    /// Paints a mark that lies beyond the map on its rim, with an arrow towards it.
    pub(super) fn paint_beyond(&self, painter: &Painter, map: Rect, at: Pos2, reach: f32) {
        let rim = map.shrink(3.0 * reach).clamp(at);
        let ahead = (at - rim).normalized();
        for (width, color) in [(4.5, Color32::WHITE), (2.0, self.kind.color())] {
            painter.arrow(rim, 3.0 * reach * ahead, Stroke::new(width, color));
        }
        self.kind.paint(painter, rim, reach);
    }
}

/// The local minima of the complete coarse positions behind the best one: rank, place, and how much
/// more they cost than it.
fn ranked(search: &Search<'_>, least_covered: u32) -> Vec<(usize, Minimum, f64)> {
    let Some(searched) = search.last(Phase::PositionCoarse) else {
        return Vec::new();
    };
    // What is equally cheap everywhere has no minima.
    if !searched.is_complete || searched.surface.flat_cost().is_some() {
        return Vec::new();
    }
    let minima = searched.surface.local_minima_with(least_covered);
    let Some(&(_, best)) = minima.first() else {
        return Vec::new();
    };
    let ranked = minima.into_iter().enumerate().skip(1).take(RANKED);
    ranked
        .filter_map(|(index, (cell, cost))| {
            let offset = searched.surface.lattice.offset(cell)?;
            Some((index + 1, Minimum { cell, offset, cost }, cost - best))
        })
        .collect()
}

/// The minimum under another floor, where it is not that of the run's own: among the coarse
/// positions, or, where those keep theirs, among the fine ones.
pub(super) fn moved(search: &Search<'_>, own: u32, other: u32) -> Option<Minimum> {
    [Phase::PositionCoarse, Phase::PositionFine]
        .into_iter()
        .filter_map(|phase| search.last(phase))
        .find_map(|searched| {
            let there = searched.minimum(other)?;
            (searched.minimum(own) != Some(there)).then_some(there)
        })
}

/// An offset's position in words.
pub(super) fn place(offset: &Offset) -> String {
    // A negative zero is no place of its own.
    let [right, forward] =
        [offset.right_m, offset.forward_m].map(|m| (100.0 * m).round() / 100.0 + 0.0);
    let is_round = |m: f64| ((10.0 * m).round() - 10.0 * m).abs() < 1e-9;
    if is_round(right) && is_round(forward) {
        format!("({right:.1}, {forward:.1}) m")
    } else {
        format!("({right:.2}, {forward:.2}) m")
    }
}

/// An offset's heading in words.
pub(super) fn heading(offset: &Offset) -> String {
    let degrees = (100.0 * offset.yaw_rad.to_degrees()).round() / 100.0;
    match degrees {
        left if left > 0.0 => format!("{left}° left"),
        right if right < 0.0 => format!("{}° right", -right),
        _ => "straight ahead".to_owned(),
    }
}

impl MarkKind {
    /// The shape that is most like its own among those of plots.
    pub(super) fn plot_shape(self) -> MarkerShape {
        match self {
            Self::Start | Self::Ranked(_) | Self::Floored => MarkerShape::Circle,
            Self::Coarse => MarkerShape::Square,
            Self::Fine => MarkerShape::Diamond,
            Self::Dense => MarkerShape::Asterisk,
            Self::Feature => MarkerShape::Up,
            Self::Truth => MarkerShape::Plus,
            Self::Camera => MarkerShape::Down,
        }
    }

    pub(super) fn color(self) -> Color32 {
        match self {
            Self::Start => theme::REFERENCE,
            Self::Coarse | Self::Fine | Self::Dense => theme::ESTIMATE,
            Self::Feature => theme::method(Method::FB),
            Self::Truth => theme::TRUTH,
            Self::Camera => theme::CAMERA,
            Self::Ranked(_) | Self::Floored => Color32::BLACK,
        }
    }

    /// The shape at a place, with a light rim that shows on dark cells.
    fn paint(self, painter: &Painter, at: Pos2, reach: f32) {
        let color = self.color();
        let outlined = |points: &[(f32, f32)], fill: Color32, line: Color32| {
            let points = points.iter().map(|(x, y)| at + reach * vec2(*x, *y));
            Shape::convex_polygon(points.collect(), fill, Stroke::new(1.5, line))
        };
        match self {
            Self::Start => {
                painter.circle(at, reach * 0.8, color, Stroke::new(1.5, Color32::WHITE));
            }
            Self::Coarse => {
                let square = [(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)];
                let size = Vec2::splat(1.8 * reach);
                let rect = Rect::from_center_size(at, size);
                let white = Stroke::new(3.5, Color32::WHITE);
                painter.rect_stroke(rect, 0.0, white, egui::StrokeKind::Middle);
                painter.add(outlined(&square, Color32::TRANSPARENT, color));
            }
            Self::Fine => {
                let diamond = [(0.0, -1.1), (1.1, 0.0), (0.0, 1.1), (-1.1, 0.0)];
                painter.add(outlined(&diamond, color, Color32::WHITE));
            }
            Self::Feature => {
                let triangle = [(0.0, -1.0), (1.0, 0.8), (-1.0, 0.8)];
                painter.add(outlined(&triangle, color, Color32::BLACK));
            }
            // Its arms are longer than any other mark is wide.
            Self::Truth => {
                let arm = 1.6 * reach;
                for (width, color) in [(4.5, Color32::WHITE), (2.5, color)] {
                    let stroke = Stroke::new(width, color);
                    painter.hline(at.x - arm..=at.x + arm, at.y, stroke);
                    painter.vline(at.x, at.y - arm..=at.y + arm, stroke);
                }
            }
            Self::Camera => {
                let wedge = [(-1.0, -0.8), (1.0, -0.8), (0.0, 1.0)];
                painter.add(outlined(&wedge, color, Color32::WHITE));
            }
            Self::Ranked(rank) => {
                painter.circle(at, reach, Color32::WHITE, Stroke::new(1.0, color));
                let font = FontId::proportional(1.9 * reach);
                painter.text(at, Align2::CENTER_CENTER, rank.to_string(), font, color);
            }
            Self::Dense => {
                let arms = [0.0, 60.0, 120.0_f32].map(|degrees| {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    1.4 * reach * vec2(sin, cos)
                });
                for (width, color) in [(5.0, Color32::WHITE), (2.5, color)] {
                    for arm in arms {
                        painter.line_segment([at - arm, at + arm], Stroke::new(width, color));
                    }
                }
            }
            Self::Floored => {
                painter.circle_stroke(at, reach * 1.3, Stroke::new(4.0, Color32::WHITE));
                painter.circle_stroke(at, reach * 1.3, Stroke::new(2.0, color));
            }
        }
    }
}

/// The marks in words, which are broken where a mark has a line of its own. Pointing at one looks at its
/// pose, which is answered; a click takes the camera there.
pub(super) fn legend(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    marks: &[MapMark],
    wrap_mode: egui::TextWrapMode,
) -> Option<Pose> {
    let mut pointed_at = None;
    let rows = |ui: &mut Ui| {
        // The room for the mark is part of the button, so that both wrap together.
        let icon = ui.spacing().icon_width;
        ui.spacing_mut().button_padding = vec2(0.5 * icon + 4.0, 1.0);
        for mark in marks {
            // Without a frame a button would have no room beside its words.
            let button = egui::Button::new(egui::RichText::new(&mark.words).small())
                .fill(Color32::TRANSPARENT)
                .stroke(Stroke::NONE)
                .wrap_mode(wrap_mode);
            let response = ui.add(button.sense(Sense::click()));
            let at = pos2(response.rect.left() + 5.0, response.rect.center().y);
            // These have longer arms than their room here.
            let reach = match mark.kind {
                MarkKind::Truth | MarkKind::Dense => 0.6 * REACH,
                _ => REACH,
            };
            mark.kind.paint(ui.painter(), at, reach);
            if response.hovered() {
                pointed_at = Some(mark.pose);
            }
            if response.clicked() {
                context.send(Command::TakeCamera(Some(mark.pose)));
            }
        }
    };
    match wrap_mode {
        egui::TextWrapMode::Wrap => ui.vertical(rows),
        _ => ui.horizontal_wrapped(rows),
    };
    pointed_at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_says_to_which_side() {
        let turned = |degrees: f64| {
            heading(&Offset {
                yaw_rad: degrees.to_radians(),
                ..Offset::default()
            })
        };
        let words = [3.5, -0.25, 0.0].map(turned);
        assert_eq!(words, ["3.5° left", "0.25° right", "straight ahead"]);
    }

    #[test]
    fn a_place_has_as_many_decimals_as_it_needs_and_no_negative_zero() {
        let at = |right_m, forward_m| {
            place(&Offset {
                right_m,
                forward_m,
                yaw_rad: 0.0,
            })
        };
        assert_eq!(at(1.0, 2.0), "(1.0, 2.0) m");
        assert_eq!(at(-1e-12, -0.2), "(0.0, -0.2) m");
        assert_eq!(at(0.25, 3.0), "(0.25, 3.00) m");
    }
}
