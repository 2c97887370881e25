//! Every decision in words.

use egui::style::ScrollAnimation;
use egui::{Align, Label, RichText, ScrollArea, Sense, Ui, Vec2};

use super::View;
use crate::app::ViewContext;
use crate::event::Event;
use crate::narration;

/// The decisions up to the end of the run; those after the cursor are pale.
#[derive(Default)]
pub struct LogView {
    /// The cursor, and the room there was, when the decision at the cursor was brought into view.
    shown_for: Option<(usize, Vec2)>,
}

impl View for LogView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let records = context.run.records().iter().enumerate();
        let lines: Vec<(usize, usize, String)> = records
            .filter_map(|(at, record)| {
                let indent = record.depth.saturating_sub(1);
                let (indent, words) = match &record.event {
                    Event::StageStarted(started) => {
                        (indent, started.stage.name().replace('_', " "))
                    }
                    Event::StageEnded(ended) if !ended.succeeded => {
                        let name = ended.stage.name().replace('_', " ");
                        (indent, format!("{name} stopped here"))
                    }
                    // Of all that is tried, only what the cursor is on has a line.
                    Event::PoseScored(_) if at == context.cursor => {
                        (indent + 1, narration::tried(&context.run.records()[..=at])?)
                    }
                    event => (indent + 1, context.in_unit(&narration::sentence(event)?)),
                };
                Some((at, indent, words))
            })
            .collect();
        if lines.is_empty() {
            ui.weak("Nothing has run yet. Space runs the query.");
            return;
        }
        let here = lines.partition_point(|(at, ..)| *at <= context.cursor);
        let shown_for = Some((context.cursor, ui.available_size()));
        let has_moved = self.shown_for != shown_for;
        self.shown_for = shown_for;
        let area = ScrollArea::vertical().id_salt("log").auto_shrink(false);
        area.show(ui, |ui| {
            for (index, (at, indent, words)) in lines.into_iter().enumerate() {
                let text = match index + 1 {
                    line if line == here => RichText::new(words).strong(),
                    line if line > here => RichText::new(words).weak(),
                    _ => RichText::new(words),
                };
                ui.horizontal_top(|ui| {
                    ui.add_space(8.0 * indent as f32);
                    let line = ui.add(Label::new(text).wrap().sense(Sense::click()));
                    if index + 1 == here && has_moved {
                        let middle = Some(Align::Center);
                        ui.scroll_to_rect_animation(line.rect, middle, ScrollAnimation::none());
                    }
                    if line.on_hover_text(format!("Step {at}")).clicked() {
                        context.send(move |app| app.state.move_cursor(at));
                    }
                });
            }
        });
    }
}
