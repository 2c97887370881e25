//! Every parameter with unit, range, help and a way back to its default; and how the query's photo is degraded.

use std::ops::RangeInclusive;

use egui::{Align, Button, ComboBox, DragValue, Id, Layout, RichText, ScrollArea, TextEdit, Ui};

use super::View;
use crate::app::text_field::text_field;
use crate::app::{Sends, ViewContext};
use crate::describe::{Described, Domain, Value};
use crate::image::Degradation;
use crate::params::Params;

/// The group of the steps that degrade the photo.
const PHOTO: &str = "query photo";

/// The list of parameters.
#[derive(Default)]
pub struct ParametersView {
    filter: String,
}

impl View for ParametersView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        ui.horizontal(|ui| {
            let edit = TextEdit::singleline(&mut self.filter).hint_text("Filter (/)");
            let (response, _) = text_field(ui, edit.desired_width(120.0));
            response.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Filter parameters")
            });
            if context.options.wants_filter {
                response.request_focus();
                context.send(|app| app.state.options.wants_filter = false);
            }
            let help = "All parameters to their defaults";
            ui.button("Reset all")
                .on_hover_text(help)
                .sends(context, |app| app.state.reset_params());
        });
        let area = ScrollArea::vertical().id_salt("list").auto_shrink(false);
        area.show(ui, |ui| {
            ui.add_enabled_ui(context.is_present(), |ui| self.list(ui, context));
        });
    }
}

impl ParametersView {
    fn list(&self, ui: &mut Ui, context: &ViewContext<'_>) {
        let params =
            if context.is_present() { &context.setup.task.params } else { &context.run.params };
        let degradation = context.setup.task.protocol.degrade;
        let rows = all(&degradation, params);
        let default = params.defaults();
        let defaults = all(&Degradation::default(), &default);
        // A beside the present run, and the other way round.
        let kept = context.state.kept.as_ref().map(|kept| &kept.run.params);
        let other = match kept {
            Some(_) if !context.is_present() => &context.state.run().params,
            kept => kept.unwrap_or(&default),
        };
        let others = all(&Degradation::default(), other);
        let filter = self.filter.to_lowercase();
        let is_meant = |row: &Described| {
            let words = format!("{} {}", row.key, row.about.help());
            words.to_lowercase().contains(&filter)
        };
        let mut group = "";
        for ((row, default), other) in rows.iter().zip(&defaults).zip(&others) {
            let differs = row.value != other.value || !context.options.only_differences;
            let Some((of, name)) = row.key.split_once('.').filter(|_| differs && is_meant(row))
            else {
                continue;
            };
            if group != of {
                group = of;
                ui.add_space(6.0);
                ui.strong(group);
                let help = "Localise the photo as it was taken";
                if group == PHOTO
                    && !degradation.is_none()
                    && ui.small_button("As taken").on_hover_text(help).clicked()
                {
                    context.send(|app| app.state.degrade(Degradation::default()));
                }
            }
            let Some(value) = edited(ui, name, row, &default.value, context.suffix(row.about.unit))
            else {
                continue;
            };
            let mut wanted = degradation;
            if group != PHOTO {
                let key = row.key.clone();
                context.send(move |app| app.state.set_param(&key, &value));
            } else if wanted.set(name, &value).is_ok() {
                context.send(move |app| app.state.degrade(wanted));
            }
        }
        if group.is_empty() {
            ui.weak("No parameter matches");
        }
    }
}

/// The steps of a degradation and all parameters.
fn all(degradation: &Degradation, params: &Params) -> Vec<Described> {
    let steps = degradation
        .steps()
        .into_iter()
        .map(|step| Described { key: format!("{PHOTO}.{}", step.key), ..step });
    steps.chain(params.list()).collect()
}

/// A row; answers the new value, once the user is done with it.
fn edited(
    ui: &mut Ui,
    name: &str,
    row: &Described,
    default: &Value,
    suffix: String,
) -> Option<String> {
    let (about, domain) = (row.about.help(), &row.domain);
    let help = format!("{about}\n{}: {domain}{suffix}, default {default}", row.key);
    let is_default = row.value == *default;
    let show = |ui: &mut Ui| {
        let text = RichText::new(name);
        let text = if is_default { text } else { text.strong() };
        let label = ui.label(text).on_hover_text(help).id;
        let values = Layout::right_to_left(Align::Center);
        let value = ui.with_layout(values, |ui| {
            let reset = ui.add_enabled(!is_default, Button::new("↺").small());
            if reset.on_hover_text(format!("Back to {default}")).clicked() {
                return Some(default.to_string());
            }
            match (&row.value, &row.domain) {
                (Value::Number(value), Domain::Number(range)) => {
                    number(ui, label, *value, range.clone(), (6, &suffix))
                }
                (Value::Count(value), Domain::Count(range)) => {
                    let range = *range.start() as f64..=*range.end() as f64;
                    number(ui, label, *value as f64, range, (0, &suffix))
                }
                (Value::Count(value), Domain::Odd(range)) => {
                    let range = *range.start() as f64..=*range.end() as f64;
                    let edited = number(ui, label, *value as f64, range, (0, &suffix))?;
                    edited.parse().ok().map(|edited: usize| (edited | 1).to_string())
                }
                (Value::Flag(value), _) => {
                    let mut value = *value;
                    let response = ui.checkbox(&mut value, "").labelled_by(label);
                    response.changed().then(|| value.to_string())
                }
                (Value::Choice(value), Domain::Choice(names)) => {
                    let mut chosen = *value;
                    let shown = ComboBox::from_id_salt(&row.key).width(70.0);
                    let shown = shown.selected_text(*value).show_ui(ui, |ui| {
                        for name in *names {
                            ui.selectable_value(&mut chosen, name, *name);
                        }
                    });
                    shown.response.labelled_by(label);
                    Some(chosen.to_owned())
                }
                _ => None,
            }
        });
        value.inner.filter(|value| *value != row.value.to_string())
    };
    ui.push_id(&row.key, |ui| ui.horizontal(show).inner).inner
}

/// A number to drag or to type. While the user does, the value is kept here; the run gets it in the end.
fn number(
    ui: &mut Ui,
    label: Id,
    value: f64,
    range: RangeInclusive<f64>,
    (decimals, suffix): (usize, &str),
) -> Option<String> {
    let memory = ui.scope_id().with("dragged");
    let mut edited = ui.data(|data| data.get_temp(memory)).unwrap_or(value);
    let speed = 0.002 * (range.end() - range.start()).min(50.0);
    let drag = DragValue::new(&mut edited)
        .range(range)
        .speed(if decimals == 0 { 0.1 } else { speed })
        .max_decimals(decimals)
        .suffix(suffix)
        .update_while_editing(false);
    let response = ui.add(drag).labelled_by(label);
    let is_edited = response.dragged() || response.has_focus();
    ui.data_mut(|data| {
        if is_edited {
            data.insert_temp(memory, edited);
        } else {
            data.remove::<f64>(memory);
        }
    });
    let is_done =
        response.drag_stopped() || response.lost_focus() || (response.changed() && !is_edited);
    is_done.then(|| edited.to_string())
}
