//! The references of the query: how they are chosen, which frames could be, and how their poses are fused.

use egui::{ComboBox, DragValue, Image, RichText, ScrollArea, Sense, Ui, Vec2, vec2};

use super::View;
use super::queries::dots;
use crate::app::memo::Memo;
use crate::app::{Sends, ViewContext};
use crate::event::Side;
use crate::fusion::Fusion;
use crate::geometry::PoseError;
use crate::localize::{QueryResult, Selection};

/// The ways of choosing, each with the count that it begins with.
const WAYS: [(&str, Selection); 4] = [
    ("at random", Selection::Random(1)),
    ("the nearest", Selection::Nearest(1)),
    ("most matches", Selection::Matched(1)),
    ("by the index", Selection::Retrieved(1)),
];
/// Size of the picture of a frame \[points\].
const THUMBNAIL: Vec2 = vec2(124.0, 38.0);

/// The frames around a query, and which of them are its references.
#[derive(Default)]
pub struct ReferencesView {
    /// Frames that could be references, for a query, a radius \[m\] and a scene's argument. Looking for them in a long
    /// scene at every frame would be too slow.
    nearby: Memo<(usize, f64, String), Vec<usize>>,
}

impl View for ReferencesView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        ui.horizontal_wrapped(|ui| choice(ui, context));
        ui.horizontal_wrapped(|ui| fusions(ui, context));
        ui.horizontal(|ui| numbers(ui, context));
        ui.separator();
        let setup = context.setup;
        let radius_m = setup.task.reach_m();
        let key = (setup.query, radius_m, setup.task.scene.clone());
        let frames = self.nearby.get(key, || setup.candidates(setup.query));
        // Those that were named may be farther away than the radius.
        let chosen = &setup.chosen.frames;
        let mut shown: Vec<usize> = chosen.clone();
        shown.extend(frames.iter().filter(|frame| !chosen.contains(frame)));
        let (used, all) = (chosen.len(), frames.len());
        ui.weak(context.in_unit(&format!("{used} of {all} frames within {radius_m} m")));
        let area = ScrollArea::vertical().auto_shrink(false);
        area.show_rows(ui, THUMBNAIL.y, shown.len(), |ui, rows| {
            for &frame in &shown[rows] {
                ui.horizontal(|ui| row(ui, context, frame));
            }
        });
    }
}

fn choice(ui: &mut Ui, context: &ViewContext<'_>) {
    let setup = context.setup;
    let (present, count) = match setup.pick() {
        None => ("by hand", setup.chosen.frames.len()),
        Some(selection) => {
            let is_same = |(_, way): &&(&str, Selection)| *way == selection.with_count(1);
            let way = WAYS.iter().find(is_same);
            (way.map_or("", |(name, _)| name), selection.count())
        }
    };
    let label = ui.label("Choose");
    let ways = ComboBox::from_id_salt("way").selected_text(present);
    let ways = ways.show_ui(ui, |ui| {
        let ways = WAYS.map(|(name, way)| (name, Some(way.with_count(count.max(1)))));
        for (name, pick) in ways.into_iter().chain([("by hand", None)]) {
            ui.selectable_label(name == present, name)
                .sends(context, move |app| app.state.pick_references(pick));
        }
    });
    ways.response.labelled_by(label.id);
    if let Some(selection) = setup.pick() {
        let mut wanted = count;
        let drag = DragValue::new(&mut wanted).range(1..=20).update_while_editing(false);
        let response = ui.add(drag).on_hover_text("How many references");
        if wanted != count && (!response.dragged() || response.drag_stopped()) {
            let pick = Some(selection.with_count(wanted));
            context.send(move |app| app.state.pick_references(pick));
        }
    }
}

/// The radius around a query in which references may lie, and the seed of all random choices.
fn numbers(ui: &mut Ui, context: &ViewContext<'_>) {
    let (radius_m, seed) = (context.setup.task.radius_m(), context.setup.task.protocol.seed);
    let is_done = |response: &egui::Response| response.drag_stopped() || response.lost_focus();
    let mut wanted = radius_m;
    let label = ui.label("Radius");
    let drag = DragValue::new(&mut wanted).range(1e-3..=500.0).suffix(context.suffix("m"));
    let response = ui.add(drag.update_while_editing(false));
    if is_done(&response.labelled_by(label.id)) && wanted != radius_m {
        context.send(move |app| app.state.set_radius(wanted));
    }
    let mut wanted = seed;
    let label = ui.label("Seed");
    let drag = DragValue::new(&mut wanted).update_while_editing(false);
    if is_done(&ui.add(drag).labelled_by(label.id)) && wanted != seed {
        context.send(move |app| app.state.set_seed(wanted));
    }
}

fn fusions(ui: &mut Ui, context: &ViewContext<'_>) {
    ui.label("Fuse");
    let present = &context.setup.task.protocol.fusions;
    for fusion in Fusion::all() {
        let is_on = present.contains(&fusion);
        let response = ui.selectable_label(is_on, fusion.name);
        if response.on_hover_text(fusion.about).clicked() {
            // In the order of the registry.
            let is_wanted = |other: &Fusion| present.contains(other) != (*other == fusion);
            let wanted = Fusion::all().filter(is_wanted).collect();
            context.send(|app| app.state.set_fusions(wanted));
        }
    }
}

fn row(ui: &mut Ui, context: &ViewContext<'_>, frame: usize) {
    let setup = context.setup;
    let name = &setup.references.frames()[frame];
    let mut frames = setup.chosen.frames.clone();
    let mut is_used = frames.contains(&frame);
    let checkbox = ui.checkbox(&mut is_used, "");
    checkbox.widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, is_used, name));
    if checkbox.changed() {
        frames.retain(|other| *other != frame);
        frames.extend(is_used.then_some(frame));
        context.send(|app| app.state.set_references(frames));
    }
    match context.state.frame_picture(Side::Reference, frame) {
        Some(texture) => {
            ui.add(Image::new(&texture).fit_to_exact_size(THUMBNAIL).alt_text(name));
        }
        None => {
            let (rect, _) = ui.allocate_exact_size(THUMBNAIL, Sense::hover());
            ui.painter().rect_filled(rect, 2.0, ui.visuals().faint_bg_color);
        }
    }
    ui.vertical(|ui| {
        ui.label(RichText::new(name).monospace());
        ui.horizontal(|ui| {
            let results = context.run.results().filter(|result| {
                result.fusion.is_none() && result.references == std::slice::from_ref(name)
            });
            let results: Vec<QueryResult> = results.cloned().collect();
            dots(ui, context, &results);
            if let Some(words) = distance(context, frame) {
                ui.weak(words);
            }
        });
    });
}

/// How far a reference is from the query, which reveals the truth.
fn distance(context: &ViewContext<'_>, frame: usize) -> Option<String> {
    let setup = context.setup;
    let reference = setup.references.pose(frame)?;
    let query = setup.queries.pose(setup.query)?;
    let error = PoseError::between(&query, &reference);
    let words = format!("{}, {} away", error.translation(), error.rotation());
    context.options.shows_truth.then(|| context.in_unit(&words))
}
