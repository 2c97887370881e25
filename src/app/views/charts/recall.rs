//! Recall: the share of results that are right, the stricter or the laxer right is meant.

use std::collections::BTreeMap;

use egui::Ui;
use egui_plot::{Legend, Line, LineStyle, Plot, VLine};

use super::{Chosen, steps};
use crate::app::{ViewContext, theme};
use crate::diagnosis::Tolerance;
use crate::localize::QueryResult;
use crate::method::Method;

/// How lax right has to be meant for a result to be right \[m\]: metres and degrees grow together, in the
/// proportion of the run's own tolerance. Nothing is lax enough for a result without an error.
fn limit_m(result: &QueryResult, right: Tolerance) -> Option<f64> {
    let error = result.error?;
    let degrees = error.rotation_deg / right.rotation_deg;
    Some(error.translation_m.max(degrees * right.translation_m))
}

/// The results that a method has, and how lax right has to be meant for each that has an error.
type Limits = BTreeMap<Method, (usize, Vec<f64>)>;

fn limits<'a>(results: impl Iterator<Item = &'a QueryResult>, right: Tolerance) -> Limits {
    let mut limits = Limits::new();
    for result in results {
        let (all, known) = limits.entry(result.method).or_default();
        *all += 1;
        known.extend(limit_m(result, right));
    }
    for (_, known) in limits.values_mut() {
        known.sort_by(f64::total_cmp);
    }
    limits
}

pub(super) fn ui(ui: &mut Ui, context: &ViewContext<'_>, results: &[Chosen<'_>], most_m: f64) {
    let right = context.setup.task.protocol.right;
    let now = limits(results.iter().map(|(_, result)| *result), right);
    let before = results
        .iter()
        .filter_map(|(row, _)| context.result_before(*row));
    let before = limits(before, right);
    let share = |(all, known): &(usize, Vec<f64>)| {
        let within = known
            .iter()
            .filter(|limit| **limit <= right.translation_m)
            .count();
        100.0 * within as f64 / (*all).max(1) as f64
    };
    let words: Vec<String> = now
        .iter()
        .map(|(method, of_method)| {
            let was = before.get(method).map(share);
            let was = was.map_or(String::new(), |was| format!(", {was:.1} % in A"));
            format!("{} {:.1} %{was}", method.label(), share(of_method))
        })
        .collect();
    let words = format!("Within {right}: {}", words.join("; "));
    ui.weak(&words);
    let degrees_of = right.rotation_deg / right.translation_m;
    let plot = Plot::new("recall")
        .x_axis_label(format!("right means within x m and {degrees_of:.3} x °"))
        .y_axis_label("share that is right [%]")
        .default_x_bounds(0.0, most_m)
        .default_y_bounds(0.0, 100.0)
        .legend(Legend::default())
        .show(ui, |plot| {
            let own = VLine::new("right, as the run means it", right.translation_m);
            plot.vline(own.color(theme::TRUTH).style(LineStyle::dashed_loose()));
            for (run, limits) in [("A", &before), ("", &now)] {
                for (method, (all, known)) in limits {
                    let name = format!("{} {run}", method.label());
                    let style = match run {
                        "A" => LineStyle::dashed_dense(),
                        _ => LineStyle::Solid,
                    };
                    let line = Line::new(name.trim_end(), steps(known, *all, most_m));
                    plot.line(line.color(theme::method(*method)).style(style).width(2.0));
                }
            }
        });
    plot.response.widget_info(|| {
        let words = format!("Recall. {words}");
        egui::WidgetInfo::labeled(egui::Role::Image, true, words)
    });
}
