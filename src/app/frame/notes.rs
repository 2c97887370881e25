//! Notes above everything else: nothing moves for them.

use egui::RichText;

use crate::app::command::Queue;
use crate::app::state::AppState;
use crate::app::theme;

/// Draws the notes in the lower right corner.
pub(crate) fn ui(ctx: &egui::Context, state: &AppState, commands: &Queue) {
    if state.notes.is_empty() {
        return;
    }
    let area = egui::Area::new(egui::Id::unique("notes"))
        .order(egui::Order::Foreground)
        .anchor(egui::Align2::RIGHT_BOTTOM, [-12.0, -76.0]);
    area.show(ctx, |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(520.0);
            for (index, note) in state.notes.iter().enumerate() {
                ui.horizontal_wrapped(|ui| {
                    if ui.small_button("×").on_hover_text("Dismiss").clicked() {
                        commands.send(move |app| app.state.dismiss(index));
                    }
                    let text = RichText::new(&note.text);
                    ui.label(if note.is_error {
                        text.color(theme::text(ui.visuals(), theme::ESTIMATE)).strong()
                    } else {
                        text
                    });
                });
            }
        });
    });
}
