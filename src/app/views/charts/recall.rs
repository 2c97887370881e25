//! Recall: the share of right results over the tolerance.

use std::collections::BTreeMap;

use egui::Ui;
use egui_plot::{Legend, Line, LineStyle, Plot, VLine};

use super::Chosen;
use crate::app::views::legend::name_picture;
use crate::app::{ViewContext, theme};
use crate::diagnosis::Tolerance;
use crate::localize::QueryResult;
use crate::method::Method;

/// The smallest tolerance at which this result is right \[m\]; degrees scale with metres, as in the run's own
/// tolerance. `None` without an error.
fn limit_m(result: &QueryResult, right: Tolerance) -> Option<f64> {
    let error = result.error?;
    let degrees = error.rotation_deg / right.rotation_deg;
    Some(error.translation_m.max(degrees * right.translation_m))
}

/// The number of results of each method, and the tolerances that they need.
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
    let before = results.iter().filter_map(|(row, _)| context.state.results.before_row(*row));
    let before = limits(before, right);
    let share = |(all, known): &(usize, Vec<f64>)| {
        let within = known.iter().filter(|limit| **limit <= right.translation_m).count();
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
    let words = context.in_unit(&format!("Within {right}: {}", words.join("; ")));
    ui.weak(&words);
    let degrees_of = right.rotation_deg / right.translation_m;
    let plot = Plot::new("recall")
        .x_axis_label(context.in_unit(&format!("tolerance x [m] and x times {degrees_of:.3}°")))
        .y_axis_label("share of right results [%]")
        .default_x_bounds(0.0, most_m)
        .default_y_bounds(0.0, 100.0)
        .legend(Legend::default())
        .show(ui, |plot| {
            let own = VLine::new("tolerance of the run", right.translation_m);
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
    name_picture(&plot.response, format!("Recall. {words}"));
}

/// The share \[%\] of `all` results within each tolerance, as a line of steps. The tolerances that results
/// need are sorted; results without one are never within.
fn steps(needed: &[f64], all: usize, limit_m: f64) -> Vec<[f64; 2]> {
    let share = |count: usize| 100.0 * count as f64 / all.max(1) as f64;
    let mut line = vec![[0.0, 0.0]];
    let within = needed.iter().take_while(|needed| **needed <= limit_m);
    for (index, &tolerance) in within.enumerate() {
        line.extend([[tolerance, share(index)], [tolerance, share(index + 1)]]);
    }
    let last = line.last().map_or(0.0, |point| point[1]);
    line.push([limit_m, last]);
    line
}

#[cfg(test)]
mod tests {
    use super::steps;

    #[test]
    fn a_result_without_an_error_is_never_within() {
        let line = steps(&[0.5, 1.0, 3.0], 4, 2.0);
        assert_eq!(
            line,
            [[0.0, 0.0], [0.5, 0.0], [0.5, 25.0], [1.0, 25.0], [1.0, 50.0], [2.0, 50.0]]
        );
        assert_eq!(steps(&[], 0, 1.0), [[0.0, 0.0], [1.0, 0.0]]);
    }
}
