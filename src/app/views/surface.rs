//! The cost map: which positions the search tried, what they cost, and where it went.

mod dense;
mod line;
mod maps;
mod marks;
pub(super) mod scale;
pub(super) mod search;
mod slices;

use egui::{ScrollArea, Ui};

use super::View;
use super::readout::Readout;
use crate::app::{Command, ViewContext};
use crate::geometry::Pose;
use crate::grid::DenseSurface;
use crate::method::Method;

use dense::DenseSteps;
use maps::{CostMap, MapContent, progress};
use marks::{MapMark, legend};
use scale::Scale;
use search::Search;

/// How to use the map.
const HELP: &str = "Click, drag: camera; wheel: zoom; Shift+drag: pan";

/// The smallest and the largest width of the legend beside the map \[points\].
const LEGEND: f32 = 132.0;
const WIDE_LEGEND: f32 = 260.0;

/// The map of a direct method's search, and slices through its minimum.
#[derive(Default)]
pub struct SurfaceView {
    /// The method that was asked for; that at the cursor otherwise.
    method: Option<Method>,
    /// The method at the cursor when `method` was asked for.
    asked_at: Option<Method>,
    map: CostMap,
    dense: DenseSteps,
    /// Whether this view sent the pose under the pointer.
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
                ui.weak("Nothing is searched yet. Run PM (2) or MI (3), which search for the lowest cost");
                return;
            };
            pointed_at = self.content(ui, context, &search);
        });
        self.hover(context, pointed_at);
    }
}

impl SurfaceView {
    /// The method that is shown. The user's choice holds until the cursor comes to another method.
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
            self.map.switch(ui);
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
        let width = ui.available_width();
        let floor = context.run.params.grid.coverage_floor;
        self.dense.ui(ui, context, search);
        let dense = self.dense(context, search);
        let scale = match dense {
            Some(dense) => Scale::of_dense(dense, search),
            None => Scale::of(context.run, search),
        };
        let marks = MapMark::all(context, search, dense);
        let shown = MapContent {
            search,
            dense,
            scale: &scale,
            marks: &marks,
            line: line::wanted(context, search)
                .map(|line| [line.from, line.to].map(|pose| search.offset(&pose))),
        };
        let readout = Readout::reserve(ui);
        // Beside the map where there is room, below it elsewhere.
        let mut pointed_at = None;
        let mut has_legend = false;
        let under_pointer = ui
            .horizontal_top(|ui| {
                let (under_pointer, map_width) =
                    ui.vertical(|ui| self.map.ui(ui, context, &shown)).inner;
                has_legend = width - map_width > LEGEND;
                if has_legend {
                    ui.vertical(|ui| {
                        let room = ui.available_width().min(WIDE_LEGEND);
                        ui.set_max_width(room);
                        self.map.colours(ui, &scale, room, floor);
                        pointed_at = legend(ui, context, &marks, egui::TextWrapMode::Wrap);
                    });
                }
                under_pointer
            })
            .inner;
        let words = under_pointer.as_ref().map(|(_, words)| words.as_str());
        readout.say(ui, words, HELP);
        if !has_legend {
            self.map.colours(ui, &scale, width, floor);
            pointed_at = legend(ui, context, &marks, egui::TextWrapMode::Extend);
        }
        ui.separator();
        let on_line = line::ui(ui, context, search, width);
        ui.separator();
        slices::ui(ui, context, search, width);
        let on_map = under_pointer.map(|(pose, _)| pose);
        on_map.or(pointed_at).or(on_line)
    }

    /// The dense map, if it is shown; it is requested in each frame.
    fn dense<'a>(
        &self,
        context: &ViewContext<'a>,
        search: &Search<'_>,
    ) -> Option<&'a DenseSurface> {
        let wanted = self.dense.wanted(context, search)?;
        context.send(Command::FillDenseMap(wanted));
        let map = context.dense_map(search.method)?;
        map.surface().ok().filter(|_| *map.ask() == wanted)
    }

    /// Sends the pose under the pointer when it comes and when it leaves.
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
