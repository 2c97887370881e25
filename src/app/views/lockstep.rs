//! All methods side by side, each as many steps into its own work.

use std::collections::BTreeMap;

use egui::{Label, RichText, Slider, Ui, vec2};

use super::View;
use super::images::ImagesView;
use super::legend::method_name;
use super::surface::SurfaceView;
use crate::app::{Sends, ViewContext, lecture, theme};
use crate::event::PoseScored;
use crate::method::Method;
use crate::session::Span;

/// A panel for each method, with the picture of its work.
#[derive(Default)]
pub struct LockstepView {
    panels: BTreeMap<Method, (ImagesView, SurfaceView)>,
}

impl View for LockstepView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let reference = Some(context.reference());
        let spans = context.run.spans().iter();
        let spans = spans.filter(|span| span.part.reference() == reference);
        let spans: Vec<&Span> = spans.filter(|span| !span.records.is_empty()).collect();
        let Some(longest) = spans.iter().map(|span| span.records.len()).max() else {
            ui.weak("No method has begun yet. Space runs the query.");
            return;
        };
        let last = longest - 1;
        let step = context.options.lockstep.unwrap_or(last).min(last);
        ui.horizontal(|ui| axis(ui, context, step, last));
        let columns = if spans.len() > 1 { 2 } else { 1 };
        let rows = spans.len().div_ceil(columns);
        let spacing = ui.spacing().item_spacing.y;
        let height = (ui.available_height() - spacing * (rows - 1) as f32) / rows as f32;
        for row in spans.chunks(columns) {
            ui.columns(columns, |cells| {
                for (ui, span) in cells.iter_mut().zip(row) {
                    ui.set_height(height);
                    ui.set_max_height(height);
                    self.panel(ui, context, span, step);
                }
            });
        }
    }
}

fn axis(ui: &mut Ui, context: &ViewContext<'_>, step: usize, last: usize) {
    let label = ui.label("Step of each method");
    let mut wanted = step;
    ui.spacing_mut().slider_width = (ui.available_width() - 190.0).max(80.0);
    let slider = Slider::new(&mut wanted, 0..=last).smart_aim(false);
    let slider = ui.add(slider).labelled_by(label.id);
    if slider.changed() {
        context.send(move |app| app.state.options.lockstep = Some(wanted));
    }
    if slider.has_focus() {
        slider.surrender_focus();
    }
    ui.label(format!("of {last}"));
    let is_on = context.options.lockstep.is_some();
    let leave = ui.add_enabled(is_on, egui::Button::new("Leave"));
    leave
        .on_hover_text("Back to the cursor of the run")
        .sends(context, |app| app.state.options.lockstep = None);
}

impl LockstepView {
    fn panel(&mut self, ui: &mut Ui, context: &ViewContext<'_>, span: &Span, step: usize) {
        let Some(method) = span.part.method() else {
            return;
        };
        let steps = span.records.len();
        let cursor = span.records.start + step.min(steps - 1);
        let here = context.at(cursor);
        ui.horizontal(|ui| {
            ui.strong(method_name(ui, method));
            let Some(result) = span.result.as_ref().filter(|_| step + 1 >= steps) else {
                let stages = context.run.stages_at(cursor).skip(1);
                let stages: Vec<_> = stages.map(|bar| bar.stage.name()).collect();
                ui.label(stages.join(" › "));
                return;
            };
            ui.label(format!("over after {steps} steps"));
            let result = result.shown(context.options.shows_truth);
            let mut words = format!("{} {}", result.grade.glyph(), result.grade);
            if let Some(off) = result.off() {
                words += &format!(", {off}");
            }
            let color = theme::grade(ui.visuals(), result.grade);
            ui.strong(RichText::new(words).color(color));
        });
        // Room for two lines, so that nothing moves from step to step.
        let lines = 2.0 * ui.text_style_height(&egui::TextStyle::Body);
        ui.allocate_ui(vec2(ui.available_width(), lines), |ui| {
            ui.set_min_height(lines);
            let told =
                RichText::new(lecture::latest(here.run, span, here.cursor).unwrap_or_default());
            ui.add(Label::new(told.weak()).wrap());
        });
        let (images, surface) = self.panels.entry(method).or_default();
        ui.push_id(method.name(), |ui| {
            // A hybrid is seen in the pictures of the part that is at work.
            let searches = here.latest::<PoseScored>().is_some();
            if searches || context.setup.direct_methods().contains(&method) {
                surface.ui(ui, &here);
            } else {
                images.ui(ui, &here);
            }
        });
    }
}
