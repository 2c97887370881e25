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
use super::legend::Readout;
use crate::app::ViewContext;
use crate::app::action::{Action, toggle};
use crate::geometry::Pose;
use crate::grid::DenseSurface;

use maps::{CostMap, LEFT_AXIS, LOWER_AXIS, MapContent, progress};
use marks::{MapMark, legend};
use scale::Scale;
use search::Search;

/// How to use the map.
const HELP: &str = "Click or drag on the map takes the camera there. The wheel zooms, Shift and drag moves the map.";
/// Below this width there is room for the map alone \[points\].
const NARROW: f32 = 420.0;
/// The smallest and the largest width of the legend beside the map \[points\].
const LEGEND: f32 = 160.0;
const WIDE_LEGEND: f32 = 260.0;
/// The smallest side of the map \[points\].
const SMALLEST: f32 = 100.0;
/// Height of the plot below the map with its words \[points\].
const PLOT: f32 = 168.0;

/// The map of a direct method's search; below it the cost from result to truth or, while they are not both known,
/// slices through the minimum.
#[derive(Default)]
pub struct SurfaceView {
    map: CostMap,
}

impl View for SurfaceView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let pointed_at = match Search::at(context, context.direct_method()) {
            Some(search) => self.content(ui, context, &search),
            None => {
                ui.weak("Nothing is searched yet. Run PM (2) or MI (3), which search for the lowest cost");
                None
            }
        };
        if pointed_at.is_some() {
            context.state.pointed_at.set(pointed_at);
        }
    }
}

impl SurfaceView {
    fn content(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        search: &Search<'_>,
    ) -> Option<Pose> {
        let is_narrow = ui.available_width() < NARROW;
        let dense = dense(context, search);
        let scale = match dense {
            Some(dense) => Scale::of_dense(dense, search),
            None => Scale::of(context.run, search),
        };
        let marks = MapMark::all(context, search, dense);
        let line = line::wanted(context, search);
        let shown = MapContent {
            search,
            dense,
            scale: &scale,
            marks: &marks,
            unit: context.setup.task.params.scale.unit(),
            line: line.map(|line| [line.from, line.to].map(|pose| search.offset(&pose))),
        };
        let readout = ui.horizontal(|ui| {
            if !is_narrow {
                self.map.switch(ui);
                toggle(
                    ui,
                    context,
                    "Dense",
                    const { Action::named("Dense map of all positions and headings") },
                );
            }
            Readout::reserve(ui)
        });
        if !is_narrow {
            dense::ui(ui, context, search);
        }

        let room = ui.available_size();
        let has_plot = !is_narrow && room.y > 2.5 * PLOT;
        let beside = if is_narrow { 0.0 } else { LEGEND };
        let below = if has_plot { PLOT } else { 0.0 };
        let side = (room.x - beside - LEFT_AXIS).min(room.y - below - LOWER_AXIS);
        let mut pointed_at = None;
        let under_pointer = ui.horizontal_top(|ui| {
            let under_pointer = self.map.ui(ui, context, &shown, side.max(SMALLEST));
            if !is_narrow {
                ui.vertical(|ui| {
                    ui.set_max_width(ui.available_width().min(WIDE_LEGEND));
                    self.map.colours(ui, context, &scale);
                    let area = ScrollArea::vertical().id_salt("legend");
                    let legend = area.show(ui, |ui| legend(ui, context, &marks));
                    pointed_at = legend.inner;
                });
            }
            under_pointer
        });
        let under_pointer = under_pointer.inner;
        let otherwise = match (is_narrow, search.lattices.last()) {
            (true, _) => self.map.caption(search, &scale),
            (false, Some(searched)) => progress(searched),
            (false, None) => "no position tried yet".to_owned(),
        };
        let words = under_pointer.as_ref().map(|(_, words)| words.as_str());
        readout.inner.say(ui, words, &otherwise).on_hover_text(HELP);

        let on_line = match line {
            _ if !has_plot => None,
            Some(line) => line::ui(ui, context, search, line),
            None => {
                slices::ui(ui, context, search);
                None
            }
        };
        let on_map = under_pointer.map(|(pose, _)| pose);
        on_map.or(pointed_at).or(on_line)
    }
}

/// The dense map, if it is shown; it is requested in each frame.
fn dense<'a>(context: &ViewContext<'a>, search: &Search<'_>) -> Option<&'a DenseSurface> {
    let wanted = dense::wanted(context, search)?;
    context.send(move |app| app.state.fill_dense_map(wanted));
    let map = context.state.scoring.dense_map(search.method)?;
    map.surface.as_ref().ok().filter(|_| map.ask == wanted)
}
