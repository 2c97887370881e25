//! Places on the map with their legend.

use std::f32::consts::TAU;

use egui::{Color32, Painter, Pos2, Rect, Stroke, Ui, Vec2, vec2};

use super::scale::number;
use super::search::{Minimum, Search};
use crate::app::views::legend;
use crate::app::{ViewContext, theme};
use crate::diagnosis::PoseConfidence;
use crate::geometry::Pose;
use crate::grid::{DenseSurface, Offset, Phase};
use crate::method::Method;
use crate::palette;
use crate::proof::Thing;

/// What is at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MarkKind {
    /// What has the same mark in every picture.
    Thing(Thing),
    /// A local minimum of the coarse positions; the lowest is 1.
    Minimum(usize),
    /// The lowest cost of a dense map.
    Lowest,
}

/// Radius of a mark in the legend \[points\].
const RADIUS: f32 = 5.0;
/// Local minima that are shown.
const MINIMA: usize = 6;

/// A place on the map.
pub(super) struct MapMark {
    pub(super) kind: MarkKind,
    pub(super) offset: Offset,
    pub(super) pose: Pose,
    pub(super) words: String,
    /// The outline of the places where it may be, if it is right: right and forward of it \[m\].
    pub(super) outline: Vec<[f64; 2]>,
}

impl MapMark {
    /// Every mark, the most important one last. `dense` is the dense map that is shown.
    pub(super) fn all(
        context: &ViewContext<'_>,
        search: &Search<'_>,
        dense: Option<&DenseSurface>,
    ) -> Vec<Self> {
        let mut marks = Vec::new();
        let mark = |kind, pose: Pose, name: &str, note: String| {
            let offset = search.offset(&pose);
            let words = context.in_unit(&format!("{name} {}{note}", place(&offset)));
            Self { kind, offset, pose, words, outline: Vec::new() }
        };
        let noted = |cost: Option<f64>| cost.map_or(String::new(), |c| format!(", {}", number(c)));
        // The cost of the cell that a pose lies in, where none is known at the pose itself.
        let near = |pose: &Pose| match search.cost_near(&search.offset(pose)) {
            Some(cost) => format!(", cell {}", number(cost)),
            None => String::new(),
        };
        let reference = search.pose(&Offset::default());
        let kind = MarkKind::Thing(Thing::Reference);
        marks.push(mark(kind, reference, "reference", near(&reference)));
        for (number, (minimum, note)) in minima(search).into_iter().enumerate() {
            let (kind, pose) = (MarkKind::Minimum(number + 1), search.pose(&minimum.offset));
            marks.push(mark(kind, pose, "minimum", note));
        }
        if let Some((offset, score)) = dense.and_then(DenseSurface::minimum) {
            let note = format!(", {}{}", heading(&offset), noted(score.cost));
            let pose = search.pose(&offset);
            marks.push(mark(MarkKind::Lowest, pose, "lowest of all", note));
        }
        if let Some(pose) = context.estimate(Method::FB) {
            let kind = MarkKind::Thing(legend::result(context, &pose));
            marks.push(mark(kind, pose, "FB's result", near(&pose)));
        }
        if let Some(pose) = context.state.camera {
            let kind = MarkKind::Thing(Thing::Dot(palette::UNDECIDED));
            marks.push(mark(kind, pose, "trial camera", near(&pose)));
        }
        let method = search.span.part.method();
        if let Some(pose) = method.and_then(|method| context.estimate(method)) {
            let kind = MarkKind::Thing(legend::result(context, &pose));
            let cost = search.assessed.map(|assessed| assessed.best);
            let known = method.and_then(|method| context.confidence(method));
            let spread = known.and_then(|known| known.covariance);
            let turn = search.problem.reference_from_query(&pose).rotation;
            let outline = spread.map(|spread| spread.outline(&turn)).unwrap_or_default();
            let interval = known.and_then(PoseConfidence::interval);
            let note = interval.map_or(String::new(), |words| format!(", {words}"));
            let note = noted(cost) + &note;
            marks.push(Self { outline, ..mark(kind, pose, "result", note) });
        } else if let Some((pose, cost, note)) = best_so_far(search) {
            let kind = MarkKind::Thing(Thing::Result(palette::NO_POSE));
            marks.push(mark(kind, pose, "best so far", noted(cost) + &note));
        }
        // Last, so that nothing hides it.
        if let Some(pose) = context.truth() {
            let kind = MarkKind::Thing(Thing::Truth);
            let cost = context.cost_bounds(search.method).truth;
            let note = cost.map_or_else(|| near(pose), |cost| noted(Some(cost)));
            marks.push(mark(kind, *pose, "truth", note));
        }
        marks
    }

    /// Paints the mark with its heading.
    pub(super) fn paint(&self, painter: &Painter, at: Pos2, radius: f32) {
        if !matches!(self.kind, MarkKind::Thing(Thing::Reference) | MarkKind::Minimum(_)) {
            let (sin, cos) = (self.offset.yaw_rad as f32).sin_cos();
            let tip = at + 2.4 * radius * vec2(-sin, -cos);
            painter.line_segment([at, tip], Stroke::new(3.5, Color32::BLACK));
            painter.line_segment([at, tip], Stroke::new(1.5, self.kind.color()));
        }
        self.kind.paint(painter, at, radius);
    }

    /// Paints a mark that lies outside the map on its rim, with an arrow towards it.
    pub(super) fn paint_beyond(&self, painter: &Painter, map: Rect, at: Pos2, radius: f32) {
        let rim = map.shrink(3.0 * radius).clamp(at);
        let ahead = (at - rim).normalized();
        for (width, color) in [(4.5, Color32::BLACK), (2.0, self.kind.color())] {
            painter.arrow(rim, 3.0 * radius * ahead, Stroke::new(width, color));
        }
        self.kind.paint(painter, rim, radius);
    }
}

/// Where marks stand so that none hides another: at their places or, where a later mark is nearer than `apart`,
/// beside them. A mark without a free place within the map stays at its own.
pub(super) fn fanned(places: &[Pos2], apart: f32, map: Rect) -> Vec<Pos2> {
    /// Places that are tried for each turn around the mark, and turns.
    const STEPS: u16 = 8;
    const TURNS: u16 = 4;
    let is_free = |at: Pos2, others: &[Pos2]| others.iter().all(|o| o.distance(at) >= apart);
    let mut stands = Vec::new();
    for &place in places.iter().rev() {
        // Outwards in a spiral, which begins at the upper right.
        let mut around = (STEPS..STEPS * TURNS).map(|step| {
            let turns = f32::from(step) / f32::from(STEPS);
            place + 1.01 * apart * turns * Vec2::angled(TAU * (turns - 0.125))
        });
        let stand = if !map.contains(place) || is_free(place, &stands) {
            Some(place)
        } else {
            around.find(|at| map.contains(*at) && is_free(*at, places) && is_free(*at, &stands))
        };
        stands.push(stand.unwrap_or(place));
    }
    stands.reverse();
    stands
}

/// The local minima of the coarse positions, the lowest first, with the cost of the first and by how much the
/// others are higher. Only the lowest while the search is incomplete and where all costs are equal.
fn minima(search: &Search<'_>) -> Vec<(Minimum, String)> {
    let Some(searched) = search.last(Phase::PositionCoarse) else {
        return Vec::new();
    };
    let Some(lowest) = searched.minimum() else {
        return Vec::new();
    };
    let so_far = if searched.is_complete { "" } else { " so far" };
    let mut minima = vec![(lowest, format!(", {}{so_far}", number(lowest.cost)))];
    if searched.is_complete && searched.surface.flat_cost().is_none() {
        let local = searched.surface.local_minima();
        let others = local.into_iter().filter(|(cell, _)| *cell != lowest.cell);
        minima.extend(others.take(MINIMA - 1).filter_map(|(cell, cost)| {
            let offset = searched.surface.lattice.offset(cell)?;
            let note = format!(", +{}", number(cost - lowest.cost));
            Some((Minimum { cell, offset, cost }, note))
        }));
    }
    minima
}

/// The fine minimum, or the last step of a descent, before there is a result.
fn best_so_far(search: &Search<'_>) -> Option<(Pose, Option<f64>, String)> {
    if let Some(step) = search.steps.last() {
        let pose = search.problem.world_from_query(&step.reference_from_camera);
        let note = format!(", after {} steps", search.steps.len());
        return Some((pose, step.score.cost, note));
    }
    let fine = search.last(Phase::PositionFine)?;
    let minimum = fine.minimum()?;
    let pose = search.pose(&minimum.offset);
    Some((pose, Some(minimum.cost), String::new()))
}

/// An offset's position in words.
pub(super) fn place(offset: &Offset) -> String {
    // The sum is no negative zero.
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
    pub(super) fn color(self) -> Color32 {
        match self {
            Self::Thing(thing) => theme::rgb(thing.color()),
            Self::Minimum(_) | Self::Lowest => Color32::WHITE,
        }
    }

    fn paint(self, painter: &Painter, at: Pos2, radius: f32) {
        match self {
            Self::Thing(thing) => legend::paint_mark(painter, thing, at, radius),
            Self::Minimum(number) => {
                legend::paint_minimum(painter, &number.to_string(), at, radius);
            }
            Self::Lowest => legend::paint_minimum(painter, "D", at, radius),
        }
    }
}

/// The marks in words. Pointing at one shows its pose, which is returned; a click takes the camera there.
pub(super) fn legend(ui: &mut Ui, context: &ViewContext<'_>, marks: &[MapMark]) -> Option<Pose> {
    let mut pointed_at = None;
    // The room for the mark is part of the button, so that both wrap together.
    ui.spacing_mut().button_padding = vec2(3.4 * RADIUS, 1.0);
    for mark in marks {
        let words = egui::RichText::new(&mark.words).small();
        // Without a frame a button would have no room beside its words.
        let button =
            egui::Button::new(words).fill(Color32::TRANSPARENT).stroke(Stroke::NONE).wrap();
        let response = ui.add(button);
        let left = response.rect.left_center();
        mark.kind.paint(ui.painter(), left + vec2(1.5 * RADIUS, 0.0), RADIUS);
        if response.hovered() {
            pointed_at = Some(mark.pose);
        }
        if response.clicked() {
            let pose = mark.pose;
            context.send(move |app| app.state.camera = Some(pose));
        }
    }
    pointed_at
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn marks_on_each_other_fan_out_and_the_last_keeps_its_place() {
        let map = Rect::from_min_max(pos2(0.0, 0.0), pos2(200.0, 100.0));
        let places = [pos2(52.0, 50.0), pos2(50.0, 50.0), pos2(150.0, 50.0), pos2(50.0, 51.0)];
        let stands = fanned(&places, 16.0, map);
        assert_eq!(stands[2..], places[2..]);
        for (index, stand) in stands.iter().enumerate() {
            assert!(map.contains(*stand));
            let others = stands[index + 1..].iter().chain(&places[2..3]);
            assert!(others.filter(|o| *o != stand).all(|o| o.distance(*stand) >= 16.0));
        }
        // Where there is no room, marks stay where they are.
        let crowded = [pos2(5.0, 5.0); 3];
        assert_eq!(
            fanned(&crowded, 16.0, Rect::from_min_max(pos2(0.0, 0.0), pos2(9.0, 9.0))),
            crowded
        );
    }

    #[test]
    fn a_heading_says_to_which_side() {
        let turned =
            |degrees: f64| heading(&Offset { yaw_rad: degrees.to_radians(), ..Offset::default() });
        let words = [3.5, -0.25, 0.0].map(turned);
        assert_eq!(words, ["3.5° left", "0.25° right", "straight ahead"]);
    }

    #[test]
    fn a_place_has_as_many_decimals_as_it_needs_and_no_negative_zero() {
        let at = |right_m, forward_m| place(&Offset { right_m, forward_m, yaw_rad: 0.0 });
        assert_eq!(at(1.0, 2.0), "(1.0, 2.0) m");
        assert_eq!(at(-1e-12, -0.2), "(0.0, -0.2) m");
        assert_eq!(at(0.25, 3.0), "(0.25, 3.00) m");
    }
}
