//! The cost surface: where the search has been, what it found there, and where it went.

mod dense;
mod line;
mod maps;
mod marks;
mod scale;
mod search;
mod slices;

use egui::{ScrollArea, Slider, Ui};

use super::View;
use super::readout::Readout;
use crate::app::{Command, ViewContext};
use crate::geometry::Pose;
use crate::grid::DenseSurface;
use crate::method::Method;

use dense::DenseSteps;
use maps::{CostMap, MapContent, progress};
use marks::{MapMark, legend, moved, place};
use scale::{NO_SAY, Scale, number, swatch};
use search::Search;

/// What could be done with the map.
const HELP: &str = "Click, drag: camera; wheel: zoom; Shift+drag: pan";

/// The least room for the legend beside the map, and the most that it takes \[points\].
const LEGEND: f32 = 132.0;
const WIDE_LEGEND: f32 = 260.0;

/// The map of a direct method's search, and slices through its minimum.
#[derive(Default)]
pub struct SurfaceView {
    /// The method that was asked for; that at the cursor otherwise.
    method: Option<Method>,
    /// The method at the cursor when `method` was asked for.
    asked_at: Option<Method>,
    /// The coverage floor that is tried; the run's own otherwise.
    floor: Option<f64>,
    map: CostMap,
    dense: DenseSteps,
    /// Whether this view has said that the pointer is over a pose.
    is_hovering: bool,
}

impl View for SurfaceView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let method = self.method(context);
        let mut pointed_at = None;
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let search = Search::at(context, method);
            self.head(ui, context, method, search.as_ref());
            let Some(search) = search else {
                ui.weak("Nothing is searched yet: the direct methods search, PM (2) and MI (3)");
                return;
            };
            pointed_at = self.content(ui, context, &search);
        });
        self.hover(context, pointed_at);
    }
}

impl SurfaceView {
    /// The method that is shown. What a person chose holds until the cursor comes to another method.
    fn method(&mut self, context: &ViewContext<'_>) -> Method {
        if self.asked_at != context.method() {
            self.asked_at = context.method();
            self.method = None;
        }
        self.method.unwrap_or_else(|| context.direct_method())
    }

    fn head(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        shown: Method,
        search: Option<&Search<'_>>,
    ) {
        ui.horizontal_wrapped(|ui| {
            for method in context.direct_methods() {
                let name = method.name().to_uppercase();
                let button = ui.selectable_label(method == shown, name);
                if button.on_hover_text("Show this method's search").clicked() {
                    self.method = Some(method);
                }
            }
            let Some(search) = search else { return };
            ui.separator();
            let run_floor = context.run.params.grid.coverage_floor;
            self.map.switches(ui, self.floor.unwrap_or(run_floor));
            dense::switch(ui, context);
            if let Some(around) = search.span.part.method().filter(|around| *around != shown) {
                ui.weak(format!("inside {}", around.label()));
            }
            match search.lattices.last() {
                Some(searched) => ui.weak(progress(searched)),
                None => ui.weak("no position tried yet"),
            };
        });
    }

    fn content(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        search: &Search<'_>,
    ) -> Option<Pose> {
        let run_floor = context.run.params.grid.coverage_floor;
        let floor = self.floor.unwrap_or(run_floor);
        let width = ui.available_width();
        self.dense.ui(ui, context, search);
        let dense = self.dense(context, search, floor);
        let scale = match dense {
            Some(dense) => Scale::of_dense(dense, search),
            None => Scale::of(context.run, search),
        };
        let marks = MapMark::all(context, search, floor, dense);
        let shown = MapContent {
            search,
            dense,
            scale: &scale,
            marks: &marks,
            floor,
            line: line::wanted(context, search)
                .map(|line| [line.from, line.to].map(|pose| search.offset(&pose))),
        };
        let readout = Readout::reserve(ui);
        // Beside the map where there is room, below it elsewhere.
        let mut pointed_at = None;
        let mut has_legend = false;
        let under_pointer = ui
            .horizontal_top(|ui| {
                let (told, map_width) = ui.vertical(|ui| self.map.ui(ui, context, &shown)).inner;
                has_legend = width - map_width > LEGEND;
                if has_legend {
                    ui.vertical(|ui| {
                        let room = ui.available_width().min(WIDE_LEGEND);
                        ui.set_max_width(room);
                        self.map.colours(ui, &scale, room);
                        pointed_at = legend(ui, context, &marks, egui::TextWrapMode::Wrap);
                    });
                }
                told
            })
            .inner;
        let words = under_pointer.as_ref().map(|(_, words)| words.as_str());
        readout.say(ui, words, HELP);
        if !has_legend {
            self.map.colours(ui, &scale, width);
            pointed_at = legend(ui, context, &marks, egui::TextWrapMode::Extend);
        }
        self.floor_ui(ui, context, search, run_floor);
        ui.separator();
        let on_line = line::ui(ui, context, search, &marks, floor, width);
        ui.separator();
        slices::ui(ui, context, search, floor, width);
        let on_map = under_pointer.map(|(pose, _)| pose);
        on_map.or(pointed_at).or(on_line)
    }

    /// The dense map under a floor, if one is shown; it is asked for in each frame.
    fn dense<'a>(
        &self,
        context: &ViewContext<'a>,
        search: &Search<'_>,
        floor: f64,
    ) -> Option<&'a DenseSurface> {
        let floor = if self.map.is_floored() { floor } else { 0.0 };
        let least_covered = search.least_covered(floor);
        let wanted = self.dense.wanted(context, search, least_covered)?;
        context.send(Command::FillDenseMap(wanted));
        let map = context.dense_map(search.method)?;
        map.surface().ok().filter(|_| *map.ask() == wanted)
    }

    /// The floor and what it would change.
    fn floor_ui(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        search: &Search<'_>,
        run_floor: f64,
    ) {
        let mut floor = self.floor.unwrap_or(run_floor);
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().slider_width = 80.0;
            swatch(ui, NO_SAY);
            ui.label("below the floor");
            let slider = Slider::new(&mut floor, 0.0..=1.0)
                .step_by(0.005)
                .fixed_decimals(3)
                .text("coverage floor");
            let help = "Least coverage of a position that may win, as a share of the reference's";
            ui.add(slider).on_hover_text(help);
            // The slider's own step leaves a tail of digits.
            let floor = (1000.0 * floor).round() / 1000.0;
            let is_other = floor != run_floor;
            self.floor = is_other.then_some(floor);
            if !is_other {
                return;
            }
            if ui.button("Reset floor").clicked() {
                self.floor = None;
            }
            let is_present = context.is_present();
            let apply = ui.add_enabled(is_present, egui::Button::new("Run with this floor"));
            if apply.on_hover_text("Sets grid.coverage_floor").clicked() {
                context.send(Command::SetParam {
                    key: "grid.coverage_floor".to_owned(),
                    value: floor.to_string(),
                });
            }
        });
        let floor = self.floor.unwrap_or(run_floor);
        if floor != run_floor {
            let (own, other) = [run_floor, floor]
                .map(|floor| search.least_covered(floor))
                .into();
            let words = match moved(search, own, other) {
                Some(minimum) => format!(
                    "The minimum moves to {} at this floor, cost {}",
                    place(&minimum.offset),
                    number(minimum.cost)
                ),
                None if search
                    .positions()
                    .all(|searched| searched.minimum(other).is_none()) =>
                {
                    "No position may win at this floor".to_owned()
                }
                None => "The minimum stays where it is at this floor".to_owned(),
            };
            ui.label(words);
        }
    }

    /// Says where the pointer is, once when it comes and once when it leaves.
    fn hover(&mut self, context: &ViewContext<'_>, pointed_at: Option<Pose>) {
        if pointed_at.is_some() {
            if context.hovered() != pointed_at {
                context.send(Command::Hover(pointed_at));
            }
        } else if self.is_hovering {
            context.send(Command::Hover(None));
        }
        self.is_hovering = pointed_at.is_some();
    }
}
