//! All methods beside each other on one axis: each as many steps into its own work.

use std::collections::BTreeMap;

use egui::{RichText, Slider, Ui};

use super::View;
use super::images::ImagesView;
use super::surface::SurfaceView;
use crate::app::{Command, ViewContext, theme};
use crate::event::PoseScored;
use crate::method::Method;
use crate::session::{Part, Span};

/// A panel for each method, with the pictures that its work is seen in.
#[derive(Default)]
pub struct LockstepView {
    panels: BTreeMap<Method, Panel>,
}

/// What a panel remembers of how somebody looks at it.
#[derive(Default)]
struct Panel {
    images: ImagesView,
    surface: SurfaceView,
}

impl View for LockstepView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let spans = spans(context);
        let longest = spans.iter().map(|span| span.records.len()).max();
        let Some(last) = longest.and_then(|longest| longest.checked_sub(1)) else {
            ui.weak("No method has begun yet: Space runs the query");
            return;
        };
        let step = context.options.lockstep.unwrap_or(last).min(last);
        axis(ui, context, step, last);
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

/// The parts of the methods on the reference that is looked at, in the order in which they ran.
fn spans<'a>(context: &ViewContext<'a>) -> Vec<&'a Span> {
    let reference = context.reference();
    let spans = context.run.spans().iter();
    spans
        .filter(|span| span.part.reference() == Some(reference) && !span.records.is_empty())
        .collect()
}

fn axis(ui: &mut Ui, context: &ViewContext<'_>, step: usize, last: usize) {
    ui.horizontal(|ui| {
        let label = ui.label("Step of each method");
        let mut wanted = step;
        ui.spacing_mut().slider_width = (ui.available_width() - 190.0).max(80.0);
        let slider = Slider::new(&mut wanted, 0..=last).smart_aim(false);
        let slider = ui.add(slider).labelled_by(label.id);
        if slider.changed() {
            context.send(Command::StepTogether(Some(wanted)));
        }
        if slider.has_focus() {
            slider.surrender_focus();
        }
        ui.label(format!("of {last}"));
        let follow = ui.add_enabled(
            context.options.lockstep.is_some(),
            egui::Button::new("Leave"),
        );
        if follow
            .on_hover_text("Back to the cursor of the run")
            .clicked()
        {
            context.send(Command::StepTogether(None));
        }
    });
}

impl LockstepView {
    fn panel(&mut self, ui: &mut Ui, context: &ViewContext<'_>, span: &Span, step: usize) {
        let Part::Reference(method, _) = span.part else {
            return;
        };
        let steps = span.records.len();
        let cursor = span.records.start + step.min(steps - 1);
        let is_over = step + 1 >= steps && span.result.is_some();
        let here = context.at(cursor);
        ui.horizontal(|ui| {
            let name = RichText::new(method.label())
                .color(theme::text(ui.visuals(), theme::method(method)));
            ui.label(name.strong());
            let stages = context.run.stages_at(cursor).skip(1);
            let stages: Vec<_> = stages.map(|bar| bar.stage.name()).collect();
            if is_over {
                ui.label(format!("over after {steps} steps"))
            } else {
                ui.label(stages.join(" › "))
            };
            if let (true, Some(result)) = (is_over, &span.result) {
                let shows_truth = context.options.shows_truth;
                let grade = result.grade_shown(shows_truth);
                let error = result.error.filter(|_| shows_truth);
                let error =
                    error.map_or(String::new(), |error| format!(", {}", error.translation()));
                let words = format!("{} {grade}{error}", grade.glyph());
                let color = theme::grade(ui.visuals(), grade);
                ui.label(RichText::new(words).color(color).strong());
            }
        });
        let told = here.told().unwrap_or_default();
        // Room for two lines, so that nothing moves from step to step.
        let lines = 2.0 * ui.text_style_height(&egui::TextStyle::Body);
        ui.allocate_ui(egui::vec2(ui.available_width(), lines), |ui| {
            ui.set_min_height(lines);
            ui.add(egui::Label::new(RichText::new(told).weak()).wrap());
        });
        let panel = self.panels.entry(method).or_default();
        ui.push_id(method.name(), |ui| {
            // A hybrid is seen in the pictures of the part that is at work.
            let searches = here.latest::<PoseScored>().is_some();
            if searches || context.direct_methods().contains(&method) {
                panel.surface.ui(ui, &here);
            } else {
                panel.images.ui(ui, &here);
            }
        });
    }
}
