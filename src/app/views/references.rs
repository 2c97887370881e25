//! The references of the query: how they are chosen, which frames could be, what is made of several.

use egui::{ComboBox, DragValue, RichText, ScrollArea, Ui};

use super::View;
use super::queries::dots;
use super::thumbnail::{THUMBNAIL, thumbnail};
use crate::app::{Command, ReferencePick, ViewContext, theme};
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

/// The frames around a query, and which of them are its references.
#[derive(Default)]
pub struct ReferencesView {
    nearby: Option<Nearby>,
}

/// Frames that could be references of a query.
struct Nearby {
    query: usize,
    radius_m: f64,
    scene: String,
    frames: Vec<usize>,
}

impl View for ReferencesView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        choice(ui, context);
        fusions(ui, context);
        ui.separator();
        let setup = context.setup;
        let nearby = self.nearby(context);
        let (frames, radius_m) = (&nearby.frames, nearby.radius_m);
        // Those that were named may be farther away than the radius.
        let mut shown: Vec<usize> = setup.chosen.frames.clone();
        shown.extend(frames.iter().filter(|f| !setup.chosen.frames.contains(f)));
        ui.weak(format!(
            "{} of {} frames within {} m",
            setup.chosen.frames.len(),
            frames.len(),
            radius_m
        ));
        ScrollArea::vertical().auto_shrink(false).show_rows(
            ui,
            THUMBNAIL.y,
            shown.len(),
            |ui, rows| {
                for &frame in &shown[rows] {
                    row(ui, context, frame);
                }
            },
        );
    }
}

impl ReferencesView {
    /// Looking for them in a long scene at every frame would be too slow.
    fn nearby(&mut self, context: &ViewContext<'_>) -> &Nearby {
        let setup = context.setup;
        let radius_m = setup.task.reach_m();
        let is_known = self.nearby.as_ref().is_some_and(|nearby| {
            nearby.query == setup.query
                && nearby.radius_m == radius_m
                && nearby.scene == setup.references.name()
        });
        let nearby = self.nearby.take().filter(|_| is_known);
        self.nearby.insert(nearby.unwrap_or_else(|| Nearby {
            query: setup.query,
            radius_m,
            scene: setup.references.name().to_owned(),
            frames: setup.candidates(setup.query),
        }))
    }
}

fn choice(ui: &mut Ui, context: &ViewContext<'_>) {
    let setup = context.setup;
    let name = |pick: ReferencePick| match pick {
        ReferencePick::ByHand => "by hand",
        ReferencePick::By(selection) => WAYS
            .iter()
            .find(|(_, way)| way.with_count(1) == selection.with_count(1))
            .map_or("", |(name, _)| name),
    };
    ui.horizontal(|ui| {
        let count = match setup.pick() {
            ReferencePick::ByHand => setup.chosen.frames.len(),
            ReferencePick::By(selection) => selection.count(),
        };
        let label = ui.label("Choose");
        ComboBox::from_id_salt("way")
            .selected_text(name(setup.pick()))
            .show_ui(ui, |ui| {
                let ways = WAYS.map(|(_, way)| ReferencePick::By(way.with_count(count.max(1))));
                for pick in ways.into_iter().chain([ReferencePick::ByHand]) {
                    if ui
                        .selectable_label(setup.pick() == pick, name(pick))
                        .clicked()
                    {
                        context.send(Command::PickReferences(pick));
                    }
                }
            })
            .response
            .labelled_by(label.id);
        if let ReferencePick::By(selection) = setup.pick() {
            let mut wanted = count;
            let drag = DragValue::new(&mut wanted)
                .range(1..=20)
                .update_while_editing(false);
            let response = ui.add(drag).on_hover_text("How many references");
            let is_done = !response.dragged() || response.drag_stopped();
            if wanted != count && is_done {
                let pick = ReferencePick::By(selection.with_count(wanted));
                context.send(Command::PickReferences(pick));
            }
        }
    });
}

fn fusions(ui: &mut Ui, context: &ViewContext<'_>) {
    let setup = context.setup;
    ui.horizontal(|ui| {
        ui.label("Fuse");
        let present = &setup.task.protocol.fusions;
        for fusion in Fusion::all() {
            let is_on = present.contains(&fusion);
            let response = ui.selectable_label(is_on, fusion.name);
            if response.on_hover_text(fusion.about).clicked() {
                // In the order of the registry.
                let wanted = Fusion::all().filter(|other| {
                    if *other == fusion {
                        !is_on
                    } else {
                        present.contains(other)
                    }
                });
                context.send(Command::SetFusions(wanted.collect()));
            }
        }
    });
}

fn row(ui: &mut Ui, context: &ViewContext<'_>, frame: usize) {
    let setup = context.setup;
    let name = &setup.references.frames()[frame];
    ui.horizontal(|ui| {
        let mut is_used = setup.chosen.frames.contains(&frame);
        let checkbox = ui.checkbox(&mut is_used, "");
        checkbox
            .widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, is_used, name));
        if checkbox.changed() {
            let mut frames = setup.chosen.frames.clone();
            if is_used {
                frames.push(frame);
            } else {
                frames.retain(|other| *other != frame);
            }
            context.send(Command::SetReferences(frames));
        }
        thumbnail(ui, context, Side::Reference, frame);
        ui.vertical(|ui| {
            ui.label(
                RichText::new(name)
                    .monospace()
                    .color(theme::text(ui.visuals(), theme::REFERENCE)),
            );
            ui.horizontal(|ui| {
                let results: Vec<QueryResult> = context
                    .run
                    .results()
                    .filter(|result| result.fusion.is_none() && result.references == [name.clone()])
                    .cloned()
                    .collect();
                dots(ui, context, &results);
                if let Some(words) = distance(context, frame) {
                    ui.weak(words);
                }
            });
        });
    });
}

/// How far a reference is from the query, which tells the truth.
fn distance(context: &ViewContext<'_>, frame: usize) -> Option<String> {
    let setup = context.setup;
    let reference = setup.references.pose(frame)?;
    let query = setup.queries.pose(setup.query)?;
    let error = PoseError::between(&query, &reference);
    context
        .options
        .shows_truth
        .then(|| format!("{}, {} away", error.translation(), error.rotation()))
}
