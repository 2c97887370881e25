//! The bar of a lecture: the stage at the cursor in one sentence, and the latest decision.

use egui::{Align, Button, Layout, RichText, Ui};

use super::action::Action;
use super::frame::storyboard::part_name;
use super::theme;
use super::view_context::{Sends, ViewContext};
use crate::event::Stage;
use crate::narration;
use crate::session::{Run, Span};

/// Size of the sentence, and of the one below it \[points\].
const LARGE: f32 = 24.0;
const SMALL: f32 = 17.0;
/// Width of the count of stages, and of the buttons \[points\].
const COUNT: f32 = 120.0;
const BUTTONS: f32 = 130.0;

pub(super) fn ui(ui: &mut Ui, context: &ViewContext<'_>) {
    ui.horizontal_centered(|ui| {
        let span = context.span();
        let stages = span.map_or(Vec::new(), |span| context.state.stages_of(span));
        let place = stages.iter().position(|bar| bar.records.contains(&context.cursor));
        let size = egui::vec2(COUNT, ui.available_height());
        ui.allocate_ui_with_layout(size, Layout::top_down(Align::Min), |ui| {
            ui.set_min_width(COUNT);
            ui.add_space(size.y / 2.0 - 24.0);
            if let Some(span) = span {
                let method = span.part.method();
                let color = method.map_or(ui.visuals().text_color(), theme::method);
                let color = theme::text(ui.visuals(), color);
                ui.label(RichText::new(part_name(span.part)).size(15.0).color(color).strong());
            }
            if let Some(place) = place {
                ui.weak(format!("stage {}", place + 1));
            }
        });
        let size = egui::vec2(ui.available_width() - BUTTONS, ui.available_height());
        ui.allocate_ui_with_layout(size, Layout::top_down(Align::Min), |ui| {
            ui.set_min_width(size.x);
            let (first, second) = sentences(context);
            ui.add_space(size.y / 2.0 - 34.0);
            let color = ui.visuals().strong_text_color();
            ui.add(egui::Label::new(RichText::new(first).size(LARGE).color(color)).wrap());
            ui.add(egui::Label::new(RichText::new(second).size(SMALL).weak()).truncate());
        });
        let actions = match context.options.lockstep {
            Some(_) => {
                const {
                    [
                        Action::named("All methods one step back"),
                        Action::named("All methods one step on"),
                    ]
                }
            }
            None => const { [Action::named("Previous stage"), Action::named("Next stage")] },
        };
        for (name, action) in ["◀", "▶"].into_iter().zip(actions) {
            let button = ui.add_sized([52.0, 34.0], Button::new(name));
            button.on_hover_text(action.tooltip(ui.ctx())).sends(context, action.run);
        }
    });
}

fn sentences(context: &ViewContext<'_>) -> (String, String) {
    if context.options.lockstep.is_some() {
        return (
            "Every method goes on by one step at a time, beside the others.".to_owned(),
            "The . key goes on, the , key back, with Shift by fifty steps.".to_owned(),
        );
    }
    let Some(span) = context.span() else {
        return ("I takes the first step, Space runs to the end.".to_owned(), String::new());
    };
    let first = stage(context.run, span, context.cursor).map_or("", narration::about).to_owned();
    (first, latest(context.run, span, context.cursor).unwrap_or_default())
}

/// The innermost stage at the cursor. What a part reports after a stage belongs to that stage.
fn stage(run: &Run, span: &Span, cursor: usize) -> Option<Stage> {
    let mut begun = run.stages().iter().filter(|bar| {
        (span.records.start..=cursor).contains(&bar.records.start)
            && !matches!(bar.stage, Stage::Estimator(_))
    });
    let open = begun.clone().rfind(|bar| bar.records.contains(&cursor));
    let bar = open.or_else(|| begun.next_back()).or_else(|| run.stages_at(cursor).last());
    bar.map(|bar| bar.stage)
}

/// The latest decision of a part of a run, in words.
pub(super) fn latest(run: &Run, span: &Span, cursor: usize) -> Option<String> {
    let last = span.records.end.checked_sub(1)?.min(cursor);
    let records = run.records().get(span.records.start..=last)?;
    if let Some(tried) = narration::tried(records) {
        return Some(tried);
    }
    let mut latest = records.iter().rev();
    let sentence = latest.find_map(|record| narration::sentence(&record.event))?;
    Some(run.params.scale.unit().words(&sentence))
}
