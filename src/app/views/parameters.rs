//! Every parameter with unit, range, help and a way back to its default.

mod degradation;

use std::ops::RangeInclusive;

use egui::{ComboBox, DragValue, RichText, ScrollArea, TextEdit, Ui};

use super::View;
use crate::app::{Command, ViewContext};
use crate::describe::{About, Choice, Described, ParamVisitor};
use crate::params::Params;

/// The list of parameters.
#[derive(Default)]
pub struct ParametersView {
    filter: String,
}

impl View for ParametersView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let present = context.is_present();
        ui.horizontal(|ui| {
            let edit = TextEdit::singleline(&mut self.filter).hint_text("Filter (/)");
            let response = ui.add(edit.desired_width(150.0));
            response.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Filter parameters")
            });
            if context.options.wants_filter {
                response.request_focus();
                context.send(Command::FilterFocused);
            }
            let help = "All parameters to their defaults";
            if ui.button("Reset all").on_hover_text(help).clicked() {
                context.send(Command::ResetParams);
            }
        });
        let mut params = if present {
            context.setup.task.params.clone()
        } else {
            context.run.params.clone()
        };
        let other = context.other_run().map(|run| run.params.clone());
        let reference = other.clone().unwrap_or_default();
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.add_enabled_ui(present, |ui| {
                degradation::sliders(ui, context, &self.filter);
                self.list(ui, context, &mut params, &reference, other.is_some());
            });
        });
    }
}

impl ParametersView {
    fn list(
        &self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        params: &mut Params,
        reference: &Params,
        is_compared: bool,
    ) {
        let rows = params.list();
        let defaults = Params::default().list();
        let references = reference.list();
        let filter = self.filter.to_lowercase();
        let is_shown = |index: usize| {
            let row = &rows[index];
            let differs = row.value != references[index].value;
            (row.key.to_lowercase().contains(&filter)
                || row.about.help().to_lowercase().contains(&filter))
                && (differs || !context.options.only_differences)
        };
        let shown: Vec<bool> = (0..rows.len()).map(is_shown).collect();
        if !shown.contains(&true) {
            ui.weak("No parameter matches");
        }
        let mut index = 0;
        params.visit_groups(|group, described| {
            let mut editor = Editor {
                ui,
                context,
                group,
                index: &mut index,
                shown: &shown,
                defaults: &defaults,
                references: is_compared.then_some(&references),
                is_titled: false,
            };
            described.visit(&mut editor);
        });
    }
}

/// Draws one row per parameter and asks for the change.
struct Editor<'a, 'b> {
    ui: &'a mut Ui,
    context: &'a ViewContext<'b>,
    group: &'static str,
    index: &'a mut usize,
    shown: &'a [bool],
    defaults: &'a [Described],
    references: Option<&'a Vec<Described>>,
    is_titled: bool,
}

impl Editor<'_, '_> {
    /// One row; `edit` draws the widget and answers the new value, once a person is done with it.
    fn row(
        &mut self,
        about: About,
        present: String,
        range: String,
        edit: impl FnOnce(&mut Ui, egui::Id) -> Option<String>,
    ) {
        let index = *self.index;
        *self.index += 1;
        if !self.shown[index] {
            return;
        }
        if !self.is_titled {
            self.is_titled = true;
            self.ui.heading(self.group);
        }
        let Self {
            ui,
            context,
            group,
            defaults,
            references,
            ..
        } = self;
        let key = format!("{group}.{}", about.name);
        let default = defaults[index].value.to_string();
        let help = format!("{}\n{key}, {range}, default {default}", about.help());
        ui.horizontal(|ui| {
            let is_default = present == default;
            let name = RichText::new(about.name);
            let name = if is_default { name } else { name.strong() };
            let label = ui.label(name).on_hover_text(&help);
            if let Some(references) = references
                && references[index].value.to_string() != present
            {
                ui.label("≠")
                    .on_hover_text(format!("the other run: {}", references[index].value));
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let reset = egui::Button::new("↺").small();
                let reset = ui.add_enabled(!is_default, reset);
                if reset.on_hover_text(format!("Back to {default}")).clicked() {
                    context.send(Command::SetParam {
                        key: key.clone(),
                        value: default.clone(),
                    });
                }
                if let Some(value) = edit(ui, label.id)
                    && value != present
                {
                    context.send(Command::SetParam { key, value });
                }
            });
        });
    }
}

/// Whether a person has finished with a number: not while they drag or type.
fn is_done(response: &egui::Response) -> bool {
    response.drag_stopped()
        || response.lost_focus()
        || (response.changed() && !response.dragged() && !response.has_focus())
}

fn suffix(unit: &str) -> String {
    match unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    }
}

impl ParamVisitor for Editor<'_, '_> {
    fn number(&mut self, about: About, value: &mut f64, range: RangeInclusive<f64>) {
        let words = format!("{} … {}{}", range.start(), range.end(), suffix(about.unit));
        self.row(about, value.to_string(), words, |ui, label| {
            let memory = ui.scope_id().with(about.name);
            let mut edited = ui.data(|data| data.get_temp(memory)).unwrap_or(*value);
            let speed = 0.002 * (range.end() - range.start()).min(50.0);
            let drag = DragValue::new(&mut edited)
                .range(range)
                .speed(speed)
                .max_decimals(6)
                .suffix(suffix(about.unit))
                .update_while_editing(false);
            let response = ui.add(drag).labelled_by(label);
            remember(ui, memory, &response, edited);
            is_done(&response).then(|| edited.to_string())
        });
    }

    fn count(&mut self, about: About, value: &mut usize, range: RangeInclusive<usize>) {
        let words = format!("{} … {}{}", range.start(), range.end(), suffix(about.unit));
        self.row(about, value.to_string(), words, |ui, label| {
            let memory = ui.scope_id().with(about.name);
            let mut edited = ui.data(|data| data.get_temp(memory)).unwrap_or(*value);
            let drag = DragValue::new(&mut edited)
                .range(range)
                .speed(0.1)
                .suffix(suffix(about.unit))
                .update_while_editing(false);
            let response = ui.add(drag).labelled_by(label);
            remember(ui, memory, &response, edited);
            is_done(&response).then(|| edited.to_string())
        });
    }

    fn flag(&mut self, about: About, value: &mut bool) {
        let present = *value;
        self.row(
            about,
            present.to_string(),
            "yes or no".to_owned(),
            |ui, label| {
                let mut edited = present;
                let response = ui.checkbox(&mut edited, "").labelled_by(label);
                response.clicked().then(|| edited.to_string())
            },
        );
    }

    fn choice(&mut self, about: About, value: &mut dyn Choice) {
        let names = value.names();
        let present = names[value.index()];
        let words = format!("one of {}", names.join(", "));
        // Groups may have parameters of one name.
        let salt = (self.group, about.name);
        self.row(about, present.to_owned(), words, |ui, label| {
            let mut chosen = None;
            let shown = ComboBox::from_id_salt(salt)
                .selected_text(present)
                .show_ui(ui, |ui| {
                    for name in names {
                        if ui.selectable_label(*name == present, *name).clicked() {
                            chosen = Some((*name).to_owned());
                        }
                    }
                });
            shown.response.labelled_by(label);
            chosen
        });
    }
}

/// While a number is dragged it is the editor's own; the run hears of it in the end.
fn remember<T: Clone + Send + Sync + 'static>(
    ui: &Ui,
    memory: egui::Id,
    response: &egui::Response,
    edited: T,
) {
    let is_edited = response.dragged() || response.has_focus();
    ui.data_mut(|data| {
        if is_edited {
            data.insert_temp(memory, edited);
        } else {
            data.remove::<T>(memory);
        }
    });
}
