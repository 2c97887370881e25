//! Where a run is to stop.

use egui::{ScrollArea, TextEdit, Ui};

use super::View;
use crate::app::{Command, ViewContext};
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
        let parsed = self.text.parse::<Breakpoint>();
        let mut is_added = false;
        ui.horizontal(|ui| {
            let edit = TextEdit::singleline(&mut self.text).hint_text("inliers < 10");
            let response = ui.add(edit.desired_width(180.0));
            response.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::TextInput, true, "New breakpoint")
            });
            let entered =
                response.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            let button = ui.add_enabled(parsed.is_ok(), egui::Button::new("Add"));
            is_added = parsed.is_ok() && (entered || button.clicked());
        });
        if is_added {
            let mut all = breakpoints.clone();
            all.push(std::mem::take(&mut self.text).trim().to_owned());
            context.send(Command::SetBreakpoints(all));
        } else if let (Err(error), false) = (&parsed, self.text.trim().is_empty()) {
            ui.weak(error.to_string());
        }
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for (index, breakpoint) in breakpoints.iter().enumerate() {
                ui.horizontal(|ui| {
                    let help = format!("Remove {breakpoint}");
                    let remove = ui.small_button("×").on_hover_text(&help);
                    remove
                        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &help));
                    if remove.clicked() {
                        let mut all = breakpoints.clone();
                        all.remove(index);
                        context.send(Command::SetBreakpoints(all));
                    }
                    ui.monospace(breakpoint);
                });
            }
            if breakpoints.is_empty() {
                ui.weak("None: a run goes through to its end");
            }
            ui.separator();
            ui.collapsing("Stages", |ui| {
                for stage in Breakpoint::stages() {
                    let is_set = breakpoints.iter().any(|text| text == stage);
                    let mut state = is_set;
                    if ui.checkbox(&mut state, stage).clicked() {
                        let mut all = breakpoints.clone();
                        if is_set {
                            all.retain(|text| text != stage);
                        } else {
                            all.push(stage.to_owned());
                        }
                        context.send(Command::SetBreakpoints(all));
                    }
                }
            });
            ui.collapsing("Numbers that can be watched", |ui| {
                for (name, about) in Breakpoint::quantities() {
                    ui.horizontal_wrapped(|ui| {
                        ui.monospace(name);
                        ui.weak(about);
                    });
                }
                ui.weak("A method before it narrows it down: mi.coverage < 0.1");
            });
        });
    }
}
