//! The list of keys, and the search for any action.

use egui::{Key, Modal, Modifiers, ScrollArea, TextEdit, Ui};

use crate::app::ViewContext;
use crate::app::action::{ACTIONS, Action, Group};

/// The list of keys, in two columns.
pub(crate) fn keys_ui(ctx: &egui::Context, open: &mut bool) {
    /// What the title and the margins take \[points\].
    const AROUND: f32 = 90.0;
    let of = |group: Group| {
        ACTIONS.iter().filter(move |action| action.group == group && !action.keys.is_empty())
    };
    // Where the higher of the two columns is lowest; a title takes about a row.
    let rows = |groups: &[(Group, &str)]| -> usize {
        groups.iter().map(|(group, _)| 1 + of(*group).count()).sum()
    };
    let highest = |split: &usize| {
        let (left, right) = Group::ALL.split_at(*split);
        rows(left).max(rows(right))
    };
    let split = (0..Group::ALL.len()).min_by_key(highest).unwrap_or(0);
    let (left, right) = Group::ALL.split_at(split);
    let window = egui::Window::new("Keys").open(open).resizable(false);
    window.show(ctx, |ui| {
        let height = ctx.content_rect().height() - AROUND;
        ScrollArea::vertical().max_height(height).show(ui, |ui| {
            ui.horizontal_top(|ui| {
                for groups in [left, right] {
                    ui.vertical(|ui| {
                        for (group, title) in groups {
                            ui.strong(*title);
                            egui::Grid::new(title).striped(true).spacing([12.0, 1.0]).show(
                                ui,
                                |ui| {
                                    for action in of(*group) {
                                        ui.monospace(action.keys_text(ui.ctx()));
                                        ui.label(action.text);
                                        ui.end_row();
                                    }
                                },
                            );
                            ui.add_space(4.0);
                        }
                    });
                    ui.add_space(12.0);
                }
            });
        });
    });
}

/// The search for an action: what was typed, and which of the matches is chosen.
#[derive(Default)]
pub(crate) struct ActionSearch {
    typed: String,
    chosen: usize,
    has_focus: bool,
}

impl ActionSearch {
    /// Draws the search; whether it is over.
    pub(crate) fn ui(&mut self, ctx: &egui::Context, context: &ViewContext<'_>) -> bool {
        let modal = Modal::new(egui::Id::unique("action search"));
        let answer = modal.show(ctx, |ui| self.content(ui, context));
        answer.inner || answer.should_close()
    }

    fn content(&mut self, ui: &mut Ui, context: &ViewContext<'_>) -> bool {
        const MAX: usize = 12;
        ui.set_width(420.0);
        let pressed = |ui: &Ui, key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        let (down, up, enter) =
            (pressed(ui, Key::ArrowDown), pressed(ui, Key::ArrowUp), pressed(ui, Key::Enter));
        let field = TextEdit::singleline(&mut self.typed)
            .hint_text("What do you want to do?")
            .desired_width(f32::INFINITY);
        let field = ui.add(field);
        field.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Search for an action")
        });
        if !self.has_focus {
            field.request_focus();
            self.has_focus = true;
        }
        if field.changed() {
            self.chosen = 0;
        }
        let found = found(&self.typed);
        let found = &found[..found.len().min(MAX)];
        self.chosen = match (down, up) {
            (true, _) => (self.chosen + 1).min(found.len().saturating_sub(1)),
            (_, true) => self.chosen.saturating_sub(1),
            _ => self.chosen,
        };
        let mut taken = found.get(self.chosen).filter(|_| enter).copied();
        for (index, action) in found.iter().enumerate() {
            let is_chosen = index == self.chosen;
            let text = if (action.is_on)(context.state) {
                format!("{}: on", action.text)
            } else {
                action.text.to_owned()
            };
            let button = egui::Button::selectable(is_chosen, text)
                .shortcut_text(action.keys_text(ui.ctx()))
                .min_size(egui::vec2(ui.available_width(), 0.0));
            if ui.add(button).clicked() {
                taken = Some(action);
            }
        }
        if found.is_empty() {
            ui.weak("No action has these words. Try one of them alone.");
        }
        if let Some(action) = taken {
            context.send(action.run);
        }
        taken.is_some()
    }
}

/// The actions that have all typed words.
fn found(typed: &str) -> Vec<&'static Action> {
    let typed = typed.to_lowercase();
    /// Words that people type, and those of the table.
    const ALSO: [(&str, &str); 4] =
        [("export", "save"), ("pose", "camera"), ("screenshot", "picture"), ("undo", "back")];
    let has_all = |action: &&Action| {
        let text = action.text.to_lowercase();
        let has = |word: &str| {
            let also = ALSO.iter().filter(|(typed, _)| *typed == word);
            text.contains(word) || also.into_iter().any(|(_, meant)| text.contains(meant))
        };
        typed.split_whitespace().all(has)
    };
    ACTIONS.iter().filter(has_all).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_action_is_found_by_its_words_in_any_order() {
        let texts: Vec<_> = found("RERUN stream").iter().map(|action| action.text).collect();
        assert_eq!(texts, ["Stream the run to a Rerun viewer"]);
        assert_eq!(found("").len(), ACTIONS.len());
        assert!(found("export").iter().any(|action| action.text.starts_with("Save a recording")));
        assert!(found("pose truth").iter().any(|action| action.text == "Camera to the truth"));
        assert!(found("no such words").is_empty());
    }
}
