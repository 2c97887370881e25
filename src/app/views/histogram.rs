//! Why a cost is what it is: how grey values of query and synthetic view fall together (MI), or how
//! far they differ (PM).

mod joint;
mod residuals;

use egui::{RichText, ScrollArea, Ui};

use super::View;
use crate::app::{ShownView, ViewContext};
use crate::cost::Explanation;
use crate::cost::ExplanationKind;
use crate::estimator::{self, Entry};
use crate::method::Method;
use crate::place::place;

/// The joint histogram, or the residuals, of the synthetic view that is shown.
#[derive(Default)]
pub struct HistogramView {
    /// The method that was asked for; that at the cursor otherwise.
    method: Option<Method>,
    /// The method at the cursor when `method` was asked for.
    asked_at: Option<Method>,
}

impl View for HistogramView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let method = self.choose(ui, context);
            let Some(shown) = context.shown(method) else {
                ui.weak(
                    "No synthetic view yet: PM (2) and MI (3) render some, and so does a camera \
                     in hand",
                );
                return;
            };
            caption(ui, context, &shown);
            match &shown.comparison.explanation {
                Some(Explanation::JointHistogram(histogram)) => {
                    joint::ui(ui, context, method, &shown.comparison, histogram);
                }
                Some(Explanation::Weights(weights)) => {
                    residuals::ui(ui, context, method, &shown.comparison, weights);
                }
                None => {
                    ui.weak("This view has no cost: too little of it is covered, or it is all of one grey");
                }
            }
        });
    }
}

impl HistogramView {
    /// What a person chose holds until the cursor comes to another method.
    fn choose(&mut self, ui: &mut Ui, context: &ViewContext<'_>) -> Method {
        if self.asked_at != context.method() {
            self.asked_at = context.method();
            self.method = None;
        }
        let shown = self.method.unwrap_or_else(|| context.direct_method());
        ui.horizontal_wrapped(|ui| {
            for method in context.direct_methods() {
                let what = match explains(method) {
                    Some(ExplanationKind::Weights) => "residuals",
                    _ => "joint histogram",
                };
                let name = format!("{} {what}", method.label());
                if ui.selectable_label(method == shown, name).clicked() {
                    self.method = Some(method);
                }
            }
        });
        self.method.unwrap_or(shown)
    }
}

/// How a method's cost explains itself, if it has one.
pub(super) fn explains(method: Method) -> Option<ExplanationKind> {
    let cost = estimator::find(method).and_then(Entry::cost);
    cost.map(|cost| cost.explains)
}

/// Why this view is shown, and where its camera is.
fn caption(ui: &mut Ui, context: &ViewContext<'_>, shown: &ShownView) {
    ui.horizontal_wrapped(|ui| {
        let mut words = shown.reason.name().to_owned();
        if let Some(problem) = context.problem() {
            words += ": ";
            words += &place(&problem.reference_from_query(&shown.pose));
        }
        ui.weak(words);
        let is_old = context
            .looking_at()
            .is_some_and(|(pose, _)| pose != shown.pose);
        if is_old && context.is_probing() {
            ui.label(RichText::new("the next one is worked out").italics());
        }
    });
}

/// A name, and how a cost is told under it.
type Quality = (&'static str, fn(f64) -> f64);

/// The cost here beside those it can be compared with. `quality` turns a cost into what is shown
/// with it, if anything is.
fn comparison(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    method: Method,
    cost: Option<f64>,
    quality: Option<Quality>,
) {
    let bounds = context.cost_bounds(method);
    let rows = [
        ("here", cost),
        ("result of the search", bounds.best),
        ("truth", bounds.truth),
        ("shuffled pixels", bounds.shuffled),
    ];
    egui::Grid::new("comparison").striped(true).show(ui, |ui| {
        ui.label("");
        ui.label(RichText::new("cost").weak().small());
        if let Some((name, _)) = quality {
            ui.label(RichText::new(name).weak().small());
        }
        ui.end_row();
        for (name, cost) in rows {
            let Some(cost) = cost else { continue };
            ui.label(name);
            ui.monospace(format!("{cost:.4}"));
            if let Some((_, quality)) = quality {
                ui.monospace(format!("{:.4}", quality(cost)));
            }
            ui.end_row();
        }
    });
}
