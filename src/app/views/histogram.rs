//! What a cost is computed from: pairs of grey values in query and synthetic view (MI), or their
//! differences (PM).

mod joint;
mod residuals;

use egui::{ScrollArea, Ui};

use super::View;
use crate::app::ViewContext;
use crate::cost::Explanation;
use crate::cost::ExplanationKind;
use crate::estimator::{self, Entry};
use crate::method::Method;

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
                    "No synthetic view yet. Run PM (2) or MI (3), or take a camera in hand",
                );
                return;
            };
            match &shown.comparison.explanation {
                Some(Explanation::JointHistogram(histogram)) => {
                    joint::ui(ui, context, method, &shown.comparison, histogram);
                }
                Some(Explanation::Weights(weights)) => {
                    residuals::ui(ui, method, &shown.comparison, weights);
                }
                _ => {
                    ui.weak("This view has no cost: it covers too few pixels, or all have the same grey value");
                }
            }
        });
    }
}

impl HistogramView {
    /// The user's choice holds until the cursor comes to another method.
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
    estimator::find(method).and_then(Entry::cost)?.explains()
}
