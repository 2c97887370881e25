//! Where a run is to stop.

use egui::{ScrollArea, TextEdit, Ui};

use super::View;
use crate::app::ViewContext;
use crate::app::text_field::text_field;
use crate::session::Breakpoint;

/// The list of breakpoints, and a line to write a new one.
#[derive(Default)]
pub struct BreakpointsView {
    text: String,
}

impl View for BreakpointsView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let breakpoints = context.setup.task.breakpoints.iter();
        let breakpoints: Vec<String> = breakpoints.map(ToString::to_string).collect();
        let mut wanted = breakpoints.clone();
        let parsed = self.text.parse::<Breakpoint>();
        ui.horizontal(|ui| {
            let edit = TextEdit::singleline(&mut self.text).hint_text("inliers < 10");
            let (response, entered) = text_field(ui, edit.desired_width(180.0));
            response.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::TextInput, true, "New breakpoint")
            });
            let button = ui.add_enabled(parsed.is_ok(), egui::Button::new("Add"));
            if parsed.is_ok() && (entered || button.clicked()) {
                wanted.push(std::mem::take(&mut self.text).trim().to_owned());
            }
        });
        if let (Err(error), false) = (&parsed, self.text.trim().is_empty()) {
            ui.weak(error.to_string());
        }
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for breakpoint in &breakpoints {
                ui.horizontal(|ui| {
                    let remove = ui.small_button("×").on_hover_text("Remove");
                    if remove.accessible_name(format!("Remove {breakpoint}")).clicked() {
                        wanted.retain(|other| other != breakpoint);
                    }
                    ui.monospace(breakpoint);
                });
            }
            if breakpoints.is_empty() {
                ui.weak("None: the run goes to its end");
            }
            ui.collapsing("Stages", |ui| {
                for stage in Breakpoint::stages() {
                    let mut is_set = wanted.iter().any(|text| text == stage);
                    if ui.checkbox(&mut is_set, stage).changed() {
                        wanted.retain(|text| text != stage);
                        wanted.extend(is_set.then(|| stage.to_owned()));
                    }
                }
            });
            ui.collapsing("Numbers", |ui| {
                ui.weak("A method in front narrows it down: mi.coverage < 0.1");
                for (name, about) in Breakpoint::quantities() {
                    ui.horizontal_wrapped(|ui| {
                        ui.monospace(name);
                        ui.weak(about);
                    });
                }
            });
        });
        if wanted != breakpoints {
            context.send(|app| app.state.set_breakpoints(wanted));
        }
    }
}
