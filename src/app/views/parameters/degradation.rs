//! Sliders that make the query's photo worse.

use std::ops::RangeInclusive;

use egui::{RichText, Slider, Ui};

use super::{is_done, remember, suffix};
use crate::app::{Command, ViewContext};
use crate::describe::{About, Choice, Describe as _, ParamVisitor};
use crate::image::Degradation;

/// A row for each step of the degradation whose name or help holds `filter`.
pub(super) fn sliders(ui: &mut Ui, context: &ViewContext<'_>, filter: &str) {
    let present = context.setup.task.protocol.degrade;
    let filter = filter.to_lowercase();
    let none = Degradation::default();
    let is_shown: Vec<bool> = (present.steps().iter().zip(none.steps()))
        .map(|(step, none)| {
            let help = step.about.help().to_lowercase();
            let is_meant = format!("query photo {} {help}", step.key).contains(&filter);
            is_meant && (step.value != none.value || !context.options.only_differences)
        })
        .collect();
    if !is_shown.contains(&true) {
        return;
    }
    ui.horizontal(|ui| {
        ui.heading("query photo");
        let as_taken = ui.add_enabled(!present.is_none(), egui::Button::new("As taken").small());
        if as_taken
            .on_hover_text("Localise the photo as it was taken")
            .clicked()
        {
            context.send(Command::Degrade(none));
        }
    });
    let mut degradation = present;
    let mut editor = Editor {
        ui,
        shown: is_shown.into_iter(),
        changed: None,
    };
    degradation.visit(&mut editor);
    if let Some((name, value)) = editor.changed {
        let mut wanted = present;
        // The range of the slider is that of the step.
        if wanted.set(name, &value).is_ok() {
            context.send(Command::Degrade(wanted));
        }
    }
}

/// Draws one row per step, and keeps what a person is done with.
struct Editor<'a> {
    ui: &'a mut Ui,
    shown: std::vec::IntoIter<bool>,
    changed: Option<(&'static str, String)>,
}

impl Editor<'_> {
    fn row(&mut self, about: About, is_none: bool, edit: impl FnOnce(&mut Ui) -> Option<String>) {
        if self.shown.next() != Some(true) {
            return;
        }
        let changed = self
            .ui
            .horizontal(|ui| {
                let name = RichText::new(about.name);
                let name = if is_none { name } else { name.strong() };
                ui.label(name).on_hover_text(about.help());
                let layout = egui::Layout::right_to_left(egui::Align::Center);
                ui.with_layout(layout, edit).inner
            })
            .inner;
        if let Some(value) = changed {
            self.changed = Some((about.name, value));
        }
    }
}

impl ParamVisitor for Editor<'_> {
    fn number(&mut self, about: About, value: &mut f64, range: RangeInclusive<f64>) {
        let present = *value;
        let is_factor = *range.start() > 0.0;
        let is_none = present == if is_factor { 1.0 } else { 0.0 };
        self.row(about, is_none, |ui| {
            let memory = ui.scope_id().with(("degradation", about.name));
            let mut edited = ui.data(|data| data.get_temp(memory)).unwrap_or(present);
            let slider = Slider::new(&mut edited, range)
                .logarithmic(is_factor)
                .max_decimals(2)
                .suffix(suffix(about.unit))
                .update_while_editing(false);
            let response = ui.add(slider);
            response.widget_info(|| {
                egui::WidgetInfo::slider(true, edited, format!("Photo: {}", about.name))
            });
            remember(ui, memory, &response, edited);
            (is_done(&response) && edited != present).then(|| edited.to_string())
        });
    }

    fn flag(&mut self, about: About, value: &mut bool) {
        let present = *value;
        self.row(about, !present, |ui| {
            let mut edited = present;
            let response = ui.checkbox(&mut edited, "");
            response.widget_info(|| {
                let label = format!("Photo: {}", about.name);
                egui::WidgetInfo::selected(egui::Role::CheckBox, true, edited, label)
            });
            response.clicked().then(|| edited.to_string())
        });
    }

    // A degradation has strengths and switches only.
    fn count(&mut self, _about: About, _value: &mut usize, _range: RangeInclusive<usize>) {
        self.shown.next();
    }

    fn choice(&mut self, _about: About, _value: &mut dyn Choice) {
        self.shown.next();
    }
}
