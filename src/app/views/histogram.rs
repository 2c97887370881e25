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
pub struct HistogramView {}

impl View for HistogramView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let method = context.direct_method();
            let Some(shown) = context.shown(method) else {
                ui.weak(
                    "No synthetic view yet. Run PM (2) or MI (3), or place a trial camera",
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

/// How a method's cost explains itself, if it has one.
pub(super) fn explains(method: Method) -> Option<ExplanationKind> {
    estimator::find(method).and_then(Entry::cost)?.explains()
}
