//! Every decision in words.

use egui::{RichText, ScrollArea, TextStyle, Ui};

use super::View;
use crate::app::{Command, ViewContext};
use crate::event::Event;
use crate::narration;

/// The decisions up to the end of the run; those behind the cursor are pale.
#[derive(Default)]
pub struct LogView {
    /// Sentences with their positions, and how many records they were made from.
    lines: Vec<(usize, String)>,
    told: usize,
    cursor_shown: Option<usize>,
}

impl LogView {
    fn take_in(&mut self, context: &ViewContext<'_>) {
        let records = context.run.records();
        if records.len() < self.told {
            *self = Self::default();
        }
        for (at, record) in records.iter().enumerate().skip(self.told) {
            let indent = "  ".repeat(record.depth.saturating_sub(1));
            let words = match &record.event {
                Event::StageStarted(started) => Some(started.stage.name().to_owned()),
                Event::StageEnded(ended) if !ended.succeeded => {
                    Some(format!("{} stopped here", ended.stage.name()))
                }
                event => narration::sentence(event).map(|words| format!("  {words}")),
            };
            if let Some(words) = words {
                self.lines.push((at, format!("{indent}{words}")));
            }
        }
        self.told = records.len();
    }
}

impl View for LogView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        self.take_in(context);
        if self.lines.is_empty() {
            ui.weak("Nothing was told yet");
            return;
        }
        let here = self.lines.partition_point(|(at, _)| *at <= context.cursor);
        let height = ui.text_style_height(&TextStyle::Monospace);
        let mut area = ScrollArea::both().auto_shrink(false);
        if self.cursor_shown != Some(context.cursor) {
            self.cursor_shown = Some(context.cursor);
            let spacing = ui.spacing().item_spacing.y;
            let above = (here as f32 * (height + spacing) - 0.5 * ui.available_height()).max(0.0);
            area = area.vertical_scroll_offset(above);
        }
        area.show_rows(ui, height, self.lines.len(), |ui, rows| {
            for row in rows {
                let (at, words) = &self.lines[row];
                let mut text = RichText::new(words).monospace();
                if row + 1 == here {
                    text = text.strong();
                } else if row >= here {
                    text = text.weak();
                }
                let label = egui::Label::new(text).sense(egui::Sense::click()).extend();
                if ui.add(label).on_hover_text(format!("step {at}")).clicked() {
                    context.send(Command::MoveCursor(*at));
                }
            }
        });
    }
}
