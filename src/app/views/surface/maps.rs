//! The map of the positions: their cost or their coverage.

use egui::{Color32, ColorImage, Id, PointerButton, Pos2, Rect, Stroke, TextureHandle, Ui};
use egui_plot::{AxisHints, Plot, PlotBounds, PlotImage, PlotPoint, PlotTransform};

use super::marks::{MapMark, MarkKind, fanned, heading, place};
use super::scale::{BELOW_FLOOR, Scale, number};
use super::search::{Search, Searched, cell_of};
use crate::app::views::legend::{cost_bar, name_picture, swatch};
use crate::app::{ViewContext, theme};
use crate::geometry::Pose;
use crate::grid::{DenseSurface, Lattice, Offset, ScoredLattice};
use crate::proof::Thing;
use crate::render::Score;
use crate::scale::LengthUnit;

/// The width of the numbers left of the map \[points\].
pub(super) const LEFT_AXIS: f32 = 34.0;
/// The height of the numbers below the map \[points\].
pub(super) const LOWER_AXIS: f32 = 30.0;

/// The map with its switch. Each lattice has a texture, which is painted again when its pixels change.
#[derive(Default)]
pub(super) struct CostMap {
    shows_coverage: bool,
    painted: Vec<(ColorImage, TextureHandle)>,
}

/// A cell of a lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    offset: Offset,
    /// The side of the cell \[m\].
    step: f64,
    score: Option<Score>,
}

/// What the map is drawn from.
pub(super) struct MapContent<'a> {
    pub(super) search: &'a Search<'a>,
    /// What is shown instead of the search's own lattices.
    pub(super) dense: Option<&'a DenseSurface>,
    pub(super) scale: &'a Scale,
    pub(super) marks: &'a [MapMark],
    pub(super) unit: LengthUnit,
    /// From the result to the truth, where both are known and shown.
    pub(super) line: Option<[Offset; 2]>,
}

impl MapContent<'_> {
    /// The lattices, each drawn over those before it.
    fn layers(&self) -> Vec<&ScoredLattice> {
        match self.dense {
            Some(dense) => vec![dense.cheapest().as_ref()],
            None => {
                let positions = self.search.positions();
                positions.map(|searched| searched.surface.as_ref()).collect()
            }
        }
    }

    /// The hypothesis of a cell; in a dense map it includes the heading of lowest cost.
    fn offset(&self, layer: &ScoredLattice, cell: usize) -> Option<Offset> {
        let cheapest = self.dense.and_then(|dense| dense.at(cell));
        let offset = cheapest.map(|(offset, _)| offset);
        offset.or_else(|| layer.lattice.offset(cell))
    }

    /// How many hypotheses are tried, in words.
    fn progress(&self) -> String {
        if let Some(dense) = self.dense {
            return format!("dense, {} of {} tried", dense.tried(), dense.hypotheses());
        }
        let tried: Vec<String> = self.search.positions().map(progress).collect();
        tried.join("; ")
    }
}

impl CostMap {
    fn name(&self) -> &'static str {
        if self.shows_coverage { "Coverage map" } else { "Cost map" }
    }

    /// Switches between costs and coverages.
    pub(super) fn switch(&mut self, ui: &mut Ui) {
        let help = "Colour by coverage instead of cost";
        ui.toggle_value(&mut self.shows_coverage, "Coverage").on_hover_text(help);
    }

    /// Draws the map. Returns the pose under the pointer with its cost in words.
    pub(super) fn ui(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        shown: &MapContent<'_>,
        side: f32,
    ) -> Option<(Pose, String)> {
        let group = ui.make_persistent_id("maps");
        let images = self.images(ui, shown);
        let answer = plot(ui, shown, self.name(), group, side, images);
        let response = &answer.response;
        let at = response.hover_pos().or(response.interact_pointer_pos());
        let pointed_at = at
            .filter(|at| answer.transform.frame().contains(*at))
            .and_then(|at| cell_at(shown, &answer.transform, at));
        let is_panning = ui.input(|input| input.modifiers.shift);
        let takes_camera =
            !is_panning && (response.clicked() || response.dragged_by(PointerButton::Primary));
        overlay(ui, shown, &answer.transform, pointed_at);
        let cell = pointed_at?;
        let pose = shown.search.pose(&cell.offset);
        if takes_camera && context.state.camera != Some(pose) {
            context.send(move |app| app.state.camera = Some(pose));
        }
        Some((pose, readout(shown, &cell)))
    }

    /// What the map shows, in a few words.
    pub(super) fn caption(&self, search: &Search<'_>, scale: &Scale) -> String {
        let method = search.method.label();
        match scale.cost_ends() {
            _ if self.shows_coverage => format!("Coverage of {method}, yellow is more"),
            Some([dark, bright]) => format!("{method} cost {bright} (yellow) to {dark}"),
            None => format!("{method}: no cost yet"),
        }
    }

    /// The meaning of the map's colours.
    pub(super) fn colours(&self, ui: &mut Ui, context: &ViewContext<'_>, scale: &Scale) {
        let width = ui.available_width();
        if self.shows_coverage {
            cost_bar(ui, width, "coverage", &scale.coverage_ends());
            return;
        }
        let Some(ends) = scale.cost_ends() else {
            ui.weak("no cost yet");
            return;
        };
        cost_bar(ui, width, "cost", &ends);
        ui.horizontal(|ui| {
            swatch(ui, BELOW_FLOOR);
            let help =
                "These cells cover less than this share of the reference view and are not eligible";
            let floor = 100.0 * context.run.params.grid.coverage_floor;
            ui.weak(format!("coverage below {floor:.0} %")).on_hover_text(help);
        });
    }

    /// The textures of the map with their places.
    fn images(&mut self, ui: &Ui, shown: &MapContent<'_>) -> Vec<PlotImage> {
        let least_covered = shown.search.least_covered;
        let color = |score: &Score| {
            if self.shows_coverage {
                return shown.scale.coverage(shown.search.coverage(score.covered));
            }
            let cost = score.eligible_cost(least_covered);
            cost.map_or(BELOW_FLOOR, |cost| shown.scale.cost(cost))
        };
        let layers = shown.layers();
        let pictures: Vec<ColorImage> = layers.iter().map(|layer| picture(layer, color)).collect();
        let layers = layers.into_iter().zip(pictures).enumerate();
        layers
            .map(|(index, (layer, image))| {
                let id = self.paint(ui, index, image);
                let lattice = &layer.lattice;
                let size = [lattice.columns, lattice.rows]
                    .map(|count| (count as f64 * lattice.step) as f32);
                let middle = PlotPoint::new(lattice.centre.right_m, lattice.centre.forward_m);
                PlotImage::new(index.to_string(), id, middle, size)
            })
            .collect()
    }

    fn paint(&mut self, ui: &Ui, index: usize, image: ColorImage) -> egui::TextureId {
        const OPTIONS: egui::TextureOptions = egui::TextureOptions::NEAREST;
        if self.painted.len() <= index {
            let texture = ui.ctx().load_texture("surface", image.clone(), OPTIONS);
            self.painted.push((image.clone(), texture));
        }
        let (before, texture) = &mut self.painted[index];
        if *before != image {
            texture.set(image.clone(), OPTIONS);
            *before = image;
        }
        texture.id()
    }
}

/// One pixel per cell, the row farthest ahead first; cells that are not tried are transparent.
fn picture(layer: &ScoredLattice, color: impl Fn(&Score) -> Color32) -> ColorImage {
    let Lattice { columns, rows, .. } = layer.lattice;
    let cells =
        (0..rows).rev().flat_map(|row| (0..columns).map(move |column| row * columns + column));
    let pixels = cells.map(|cell| {
        let score = layer.scores[cell].as_ref();
        score.map_or(Color32::TRANSPARENT, &color)
    });
    ColorImage::new([columns, rows], pixels.collect())
}

/// One map. The wheel zooms, Shift and drag or the middle button pan.
fn plot(
    ui: &mut Ui,
    shown: &MapContent<'_>,
    name: &str,
    group: Id,
    side: f32,
    images: Vec<PlotImage>,
) -> egui_plot::PlotResponse<()> {
    let pan = if ui.input(|input| input.modifiers.shift) {
        PointerButton::Primary
    } else {
        PointerButton::Middle
    };
    // Wider numbers must not move the map.
    let narrow = |axis: AxisHints<'static>, thickness| {
        axis.min_thickness(thickness)
            .label_spacing(egui::Rangef::new(24.0, 40.0))
            .tick_label_font(theme::SMALL)
            .formatter(|mark, _| format!("{}", (1000.0 * mark.value).round() / 1000.0))
    };
    let right =
        narrow(AxisHints::new_x(), LOWER_AXIS).label(small(ui, &shown.unit.words("right [m]")));
    let forward =
        narrow(AxisHints::new_y(), LEFT_AXIS).label(small(ui, &shown.unit.words("forward [m]")));
    let bounds = whole(shown);
    // A plot keeps its bounds, so a map of another extent is another plot.
    let extent = bounds.width().to_bits();
    let answer = Plot::new(("cost map", extent))
        .width(side + LEFT_AXIS)
        .height(side + LOWER_AXIS)
        .data_aspect(1.0)
        .link_axis(group.with(extent), true)
        .show_x(false)
        .show_y(false)
        .show_grid(false)
        .custom_x_axes(vec![right])
        .custom_y_axes(vec![forward])
        .default_x_bounds(bounds.min()[0], bounds.max()[0])
        .default_y_bounds(bounds.min()[1], bounds.max()[1])
        .allow_scroll(false)
        .allow_axis_zoom_drag(false)
        .pan_pointer_button(pan)
        .show(ui, |plot| {
            let wheel = plot.ctx().input(|input| input.smooth_scroll_delta.y);
            if plot.response().hovered() && wheel != 0.0 {
                plot.zoom_bounds_around_hovered(egui::Vec2::splat((wheel / 200.0).exp()));
            }
            for image in images {
                plot.add(image);
            }
        });
    name_picture(&answer.response, format!("{name}: {}", shown.progress()));
    answer
}

fn small(ui: &Ui, text: &str) -> egui::RichText {
    egui::RichText::new(text).font(theme::SMALL).color(ui.visuals().weak_text_color())
}

/// How many positions of a lattice are scored, in words.
pub(super) fn progress(searched: &Searched) -> String {
    let all = searched.surface.lattice.hypotheses().count();
    format!("{}, {} of {all} tried", searched.phase().name(), searched.tried)
}

/// All lattices with a margin.
fn whole(shown: &MapContent<'_>) -> PlotBounds {
    const MARGIN: f64 = 1.04;
    let radius = shown.search.problem.uncertainty_radius_m();
    let half = shown.layers().into_iter().fold(radius, |half, layer| {
        let lattice = &layer.lattice;
        let reach = |middle: f64, count: usize| middle.abs() + 0.5 * count as f64 * lattice.step;
        half.max(reach(lattice.centre.right_m, lattice.columns))
            .max(reach(lattice.centre.forward_m, lattice.rows))
    });
    PlotBounds::new_symmetrical(MARGIN * half)
}

/// The cell at a place of the screen, in the uppermost lattice there.
fn cell_at(shown: &MapContent<'_>, transform: &PlotTransform, at: Pos2) -> Option<Cell> {
    let point = transform.value_from_position(at);
    let layers = shown.layers();
    layers.iter().enumerate().rev().find_map(|(index, layer)| {
        let cell = cell_of(&layer.lattice, point.x, point.y)?;
        // Where a fine lattice is not tried yet, the coarse one below it is visible.
        let is_seen = index == 0 || layer.scores[cell].is_some();
        let offset = shown.offset(layer, cell).filter(|_| is_seen)?;
        Some(Cell { offset, step: layer.lattice.step, score: layer.scores[cell] })
    })
}

/// The cost and coverage of a cell, in words.
fn readout(shown: &MapContent<'_>, cell: &Cell) -> String {
    let mut at = shown.unit.words(&place(&cell.offset));
    if shown.dense.is_some() {
        at += &format!(", {}", heading(&cell.offset));
    }
    let Some(score) = cell.score else {
        return format!("not tried yet at {at}");
    };
    let cost =
        score.cost.map_or_else(|| "no cost".to_owned(), |cost| format!("cost {}", number(cost)));
    let coverage = shown.search.coverage(score.covered);
    let is_below = score.covered < shown.search.least_covered;
    let note = if is_below { ", below the floor" } else { "" };
    format!("{cost}, coverage {coverage:.2} at {at}{note}")
}

/// Outlines and marks on top of a map.
fn overlay(ui: &Ui, shown: &MapContent<'_>, transform: &PlotTransform, pointed_at: Option<Cell>) {
    let painter = ui.painter().with_clip_rect(transform.frame().intersect(ui.clip_rect()));
    let screen = |offset: &Offset| {
        transform.position_from_point(&PlotPoint::new(offset.right_m, offset.forward_m))
    };
    let outline = |offset: &Offset, columns: f64, rows: f64, color: Color32, width: f32| {
        let [width_px, height_px] = [transform.dpos_dvalue_x(), transform.dpos_dvalue_y()];
        let size = egui::vec2((columns * width_px).abs() as f32, (rows * height_px).abs() as f32);
        let rect = Rect::from_center_size(screen(offset), size);
        let stroke = Stroke::new(width, color);
        painter.rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Outside);
    };
    let strong = ui.visuals().strong_text_color();
    for layer in shown.layers().into_iter().skip(1) {
        let lattice = &layer.lattice;
        let [width, height] =
            [lattice.columns, lattice.rows].map(|count| count as f64 * lattice.step);
        outline(&lattice.centre, width, height, Color32::WHITE, 1.0);
    }
    if let Some(hypothesis) = shown.search.hypothesis
        && let Some(searched) = shown.search.positions().last()
        && searched.phase() == hypothesis.phase
    {
        let step = searched.surface.lattice.step;
        outline(&hypothesis.offset, step, step, strong, 1.5);
    }
    let start = shown.search.steps.first().map(|_| Offset::default());
    let steps = shown.search.steps.iter();
    let way: Vec<_> = start
        .into_iter()
        .chain(steps.map(|step| Offset::of(&step.reference_from_camera)))
        .map(|offset| screen(&offset))
        .collect();
    for &at in way.iter().skip(1) {
        painter.circle_filled(at, 2.0, strong);
    }
    painter.line(way, Stroke::new(1.0, strong));
    if let Some(ends) = &shown.line {
        let ends = ends.map(|end| screen(&end));
        for (width, color) in [(3.0, Color32::WHITE), (1.0, Color32::BLACK)] {
            let stroke = Stroke::new(width, color);
            painter.extend(egui::Shape::dashed_line(&ends, stroke, 6.0, 4.0));
        }
    }
    for mark in shown.marks.iter().filter(|mark| !mark.outline.is_empty()) {
        let around = mark.outline.iter().map(|[right, forward]| {
            let (right, forward) = (mark.offset.right_m + right, mark.offset.forward_m + forward);
            transform.position_from_point(&PlotPoint::new(right, forward))
        });
        let around: Vec<Pos2> = around.collect();
        for (width, color) in [(3.0, Color32::BLACK), (1.5, mark.kind.color())] {
            painter.add(egui::Shape::closed_line(around.clone(), Stroke::new(width, color)));
        }
    }
    // Marks must not cover a small map.
    let reach = (transform.frame().width() / 40.0).clamp(3.0, 8.0);
    let places: Vec<Pos2> = shown.marks.iter().map(|mark| screen(&mark.offset)).collect();
    let stands = fanned(&places, 2.2 * reach, *transform.frame());
    for (place, stand) in places.iter().zip(&stands).filter(|(place, stand)| place != stand) {
        for (width, color) in [(2.5, Color32::BLACK), (1.0, Color32::WHITE)] {
            painter.line_segment([*place, *stand], Stroke::new(width, color));
        }
    }
    // Where a mark stands aside, a dot of its colour is at its place.
    for ((mark, place), stand) in shown.marks.iter().zip(&places).zip(&stands) {
        if place != stand {
            painter.circle(*place, 2.5, mark.kind.color(), Stroke::new(1.0, Color32::BLACK));
        }
    }
    for (mark, at) in shown.marks.iter().zip(stands) {
        if mark.kind == MarkKind::Thing(Thing::Truth) && !transform.frame().contains(at) {
            mark.paint_beyond(&painter, *transform.frame(), at, reach);
        } else {
            mark.paint(&painter, at, reach);
        }
    }
    if let Some(Cell { offset, step, .. }) = &pointed_at {
        outline(offset, *step, *step, Color32::BLACK, 3.0);
        outline(offset, *step, *step, Color32::WHITE, 1.5);
    }
}
