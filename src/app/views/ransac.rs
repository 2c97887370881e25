//! MLESAC: the support of every hypothesis, the best so far, and the test of the result.

mod trials;
mod verdict;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use egui::{Color32, Ui};
use egui_plot::{Line, Plot, PlotPoint, Points, VLine};

use super::legend::name_picture;
use super::{View, features, part_with};
use crate::app::memo::{Memo, Same};
use crate::app::{ViewContext, theme};
use crate::event::HypothesisTried;
use crate::method::Method;
use crate::session::{Loaded, Span};

use trials::Trials;

/// Height of the plot \[points\].
const HEIGHT: f32 = 180.0;

/// Inliers by hypothesis, the sample at the cursor, and the test of the result.
#[derive(Default)]
pub struct RansacView {
    /// The trials of a run among some of its records.
    trials: Memo<(Same<Loaded>, Range<usize>), Trials>,
}

impl View for RansacView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let mut matching = features::methods(context).map(|(_, method)| method);
            let method = matching.next().unwrap_or(Method::FB);
            let hybrid = || {
                let (span, cursor) = part_with::<HypothesisTried>(context, method)?;
                Some((Cow::Borrowed(span), cursor))
            };
            let inside = context.inside(|inner| inner == method);
            let inside = inside.map(|(_, span, cursor)| (Cow::Owned(span), cursor));
            let part = inside.or_else(hybrid);
            let Some((span, cursor, trials)) = part.and_then(|(span, cursor)| {
                let trials = self.read(context, &span, cursor)?;
                Some((span, cursor, trials))
            }) else {
                ui.weak(
                    "No hypothesis yet. Run FB (1) or FB2, which try hypotheses in their stage ransac",
                );
                return;
            };
            head(ui, context, &span, method, trials);
            plot(ui, context, method, trials);
            verdict::ui(ui, context, &span, cursor, trials);
        });
    }
}

impl RansacView {
    fn read(&mut self, context: &ViewContext<'_>, span: &Span, cursor: usize) -> Option<&Trials> {
        let loaded = Arc::clone(context.run.loaded.as_ref()?);
        let (start, records) = (span.records.start, context.run.until(span, cursor));
        let key = (Same(loaded), start..start + records.len());
        let trials = self.trials.get(key, || Trials::read(records, start));
        (trials.made() > 0).then_some(trials)
    }
}

fn head(ui: &mut Ui, context: &ViewContext<'_>, span: &Span, method: Method, trials: &Trials) {
    ui.horizontal_wrapped(|ui| {
        if let Some(hybrid) = span.part.method().filter(|of| *of != method) {
            ui.weak(format!("inside {}", hybrid.label()));
        }
        let most = features::mlesac(context).max_trials;
        let made = trials.made();
        ui.label(match trials.needed().filter(|needed| *needed < most) {
            Some(needed) => format!("{made} trials made, {needed} needed"),
            None => format!("{made} trials made, more are needed than the {most} allowed"),
        });
        if trials.without_pose > 0 {
            ui.weak(format!("{} samples have no pose", trials.without_pose));
        }
    });
    ui.horizontal_wrapped(|ui| {
        let legend = |ui: &mut Ui, color: Color32, words: &str| {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(14.0, 3.0), egui::Sense::hover());
            ui.painter().rect_filled(rect, 0.0, color);
            ui.weak(words);
        };
        legend(ui, theme::method(method), "hypothesis");
        legend(ui, theme::ESTIMATE, "best so far, refined");
        legend(ui, ui.visuals().strong_text_color(), "cursor");
        ui.weak("(click a point to go there)");
    });
}

/// Inliers over trials. A click goes to the nearest trial.
fn plot(ui: &mut Ui, context: &ViewContext<'_>, method: Method, trials: &Trials) {
    let strong = ui.visuals().strong_text_color();
    // Bands would fill the corners of steps.
    let best = Line::new("best", trials.best_support.clone()).allow_band(false).allow_hover(false);
    let answer = Plot::new("inliers")
        .height(HEIGHT)
        .allow_scroll(false)
        .show_x(false)
        .show_y(false)
        .x_axis_label("trial")
        .y_axis_label("inliers")
        .show(ui, |plot| {
            if let Some(trial) = trials.at_cursor() {
                let cursor = VLine::new("cursor", trial.index as f64).color(strong);
                plot.vline(cursor.width(1.0).allow_hover(false));
            }
            let points = Points::new("hypotheses", trials.support.clone());
            let points = points.color(theme::method(method)).radius(1.6);
            plot.points(points.allow_hover(false));
            plot.line(best.color(theme::ESTIMATE).width(1.5));
        });
    let response = &answer.response;
    name_picture(response, format!("inliers by trial, {} trials", trials.made()));
    if let (true, Some(at)) = (response.clicked(), response.interact_pointer_pos()) {
        let distance = |[trial, value]: [f64; 2]| {
            let point = PlotPoint::new(trial, value);
            answer.transform.position_from_point(&point).distance_sq(at)
        };
        if let Some(record) = trials.nearest(distance) {
            context.send(move |app| app.state.move_cursor(record));
        }
    }
}
