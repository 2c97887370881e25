//! The results of all queries as pictures: any two measures against each other, how many are how good, and
//! which verdicts are frequent.

mod recall;
mod verdicts;

use std::collections::BTreeMap;

use egui::{ComboBox, DragValue, Ui};
use egui_plot::{Legend, Line, MarkerShape, Plot, PlotPoint, Points};

use super::View;
use crate::app::{Command, ResultRow, ViewContext, theme};
use crate::diagnosis::Grade;
use crate::localize::QueryResult;
use crate::measure::{Field, Value};
use crate::method::Method;

/// What is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Chart {
    #[default]
    Scatter,
    Errors,
    Recall,
    Verdicts,
}

impl Chart {
    const ALL: [(Self, &'static str, &'static str); 4] = [
        (Self::Scatter, "Scatter", "Any two measures of each result"),
        (
            Self::Errors,
            "Errors",
            "The share of results within an error",
        ),
        (
            Self::Recall,
            "Recall",
            "The share that is right, over what right means: metres and degrees together",
        ),
        (
            Self::Verdicts,
            "Verdicts",
            "How often each verdict is the first, by method or by condition",
        ),
    ];
}

/// How near to a point the pointer must be to mean it \[points\].
const REACH: f32 = 10.0;

/// The results that the batch's condition chooses.
pub struct ChartsView {
    chart: Chart,
    across: &'static str,
    up: &'static str,
    /// The greatest error that is drawn \[m\].
    limit_m: f64,
    /// Whether verdicts are told by condition too.
    by_condition: bool,
}

impl Default for ChartsView {
    fn default() -> Self {
        Self {
            chart: Chart::default(),
            across: "start",
            up: "error",
            limit_m: 2.0,
            by_condition: false,
        }
    }
}

impl View for ChartsView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let results: Vec<Chosen<'_>> = match context.selected() {
            Ok(rows) => {
                let rows = rows.iter();
                rows.filter_map(|row| Some((*row, context.result(*row)?)))
                    .collect()
            }
            Err(error) => {
                ui.weak(error.to_string());
                return;
            }
        };
        if results.is_empty() {
            ui.weak("No result to draw: run all queries, open the folder of a run, or ask for others in Batch");
            return;
        }
        ui.horizontal_wrapped(|ui| {
            for (chart, name, about) in Chart::ALL {
                ui.selectable_value(&mut self.chart, chart, name)
                    .on_hover_text(about);
            }
            ui.separator();
            match self.chart {
                Chart::Scatter => {
                    measure(ui, "Across", &mut self.across);
                    measure(ui, "Up", &mut self.up);
                }
                Chart::Errors | Chart::Recall => {
                    let label = ui.label("up to");
                    let drag = DragValue::new(&mut self.limit_m).range(0.05..=100.0);
                    ui.add(drag.speed(0.05).suffix(" m")).labelled_by(label.id);
                }
                Chart::Verdicts => {
                    ui.selectable_value(&mut self.by_condition, false, "by method");
                    ui.selectable_value(&mut self.by_condition, true, "by condition")
                        .on_hover_text(
                            "A column for each pair of scenes that queries and references are from",
                        );
                }
            }
        });
        match self.chart {
            Chart::Scatter => self.scatter(ui, context, &results),
            Chart::Errors => self.errors(ui, &results),
            Chart::Recall => recall::ui(ui, context, &results, self.limit_m),
            Chart::Verdicts if self.by_condition => verdicts::by_condition(ui, context, &results),
            Chart::Verdicts => verdicts::by_method(ui, &results),
        }
    }
}

fn measure(ui: &mut Ui, label: &str, name: &mut &'static str) {
    let label = ui.label(label);
    let combo = ComboBox::from_id_salt(label.id).selected_text(*name);
    let answer = combo.show_ui(ui, |ui| {
        let numbers = Field::ALL.iter().filter(|field| field.decimals.is_some());
        for field in numbers {
            ui.selectable_value(name, field.name, field.name)
                .on_hover_text(field.about);
        }
    });
    answer.response.labelled_by(label.id);
}

type Chosen<'a> = (ResultRow, &'a QueryResult);

impl ChartsView {
    fn scatter(&self, ui: &mut Ui, context: &ViewContext<'_>, results: &[Chosen<'_>]) {
        let number = |name: &str, result: &QueryResult| {
            let value = Field::find(name).ok()?.of(result);
            match value {
                Value::Number(number) if number.is_finite() => Some(number),
                _ => None,
            }
        };
        let mut kinds: BTreeMap<Grade, Vec<[f64; 2]>> = BTreeMap::new();
        let mut places = Vec::new();
        for (row, result) in results {
            let at = number(self.across, result).zip(number(self.up, result));
            let Some((x, y)) = at else { continue };
            kinds.entry(result.grade).or_default().push([x, y]);
            places.push((*row, *result, [x, y]));
        }
        let (across, up) = (self.across, self.up);
        let plot = Plot::new(("scatter", across, up))
            .x_axis_label(across)
            .y_axis_label(up)
            .legend(Legend::default())
            .show(ui, |plot| {
                for (grade, points) in kinds {
                    let shape = match grade {
                        Grade::Right | Grade::Unmeasured => MarkerShape::Circle,
                        Grade::Wrong => MarkerShape::Up,
                        Grade::NoPose => MarkerShape::Cross,
                    };
                    let color = theme::grade(&plot.ctx().global_style().visuals, grade);
                    let points = Points::new(grade.to_string(), points).shape(shape);
                    plot.points(points.radius(4.0).color(color));
                }
            });
        let answer = &plot.response;
        answer.widget_info(|| {
            let words = format!("{} results: {up} over {across}", places.len());
            egui::WidgetInfo::labeled(egui::Role::Image, true, words)
        });
        let Some(pointer) = answer.hover_pos() else {
            return;
        };
        let distance = |at: &[f64; 2]| {
            let at = plot
                .transform
                .position_from_point(&PlotPoint::new(at[0], at[1]));
            at.distance(pointer)
        };
        let nearest = places
            .iter()
            .map(|place| (distance(&place.2), place))
            .filter(|(distance, _)| *distance < REACH)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, (row, result, _))) = nearest else {
            return;
        };
        if answer.clicked() {
            context.send(Command::OpenResult {
                query: row.query,
                result: row.place,
            });
        }
        let code = result.diagnosis.first();
        let code = code.map_or(String::new(), |finding| {
            format!("\n{} {}", finding.code, finding.text)
        });
        let words = format!("{} {}{code}", result.query, result.method.label());
        plot.response.clone().on_hover_text_at_pointer(words);
    }

    fn errors(&self, ui: &mut Ui, results: &[Chosen<'_>]) {
        let mut errors: BTreeMap<Method, (usize, Vec<f64>)> = BTreeMap::new();
        for (_, result) in results {
            let (all, known) = errors.entry(result.method).or_default();
            *all += 1;
            known.extend(result.error.map(|error| error.translation_m));
        }
        let limit_m = self.limit_m;
        let plot = Plot::new("errors")
            .x_axis_label("error [m]")
            .y_axis_label("share within it [%]")
            .default_x_bounds(0.0, limit_m)
            .default_y_bounds(0.0, 100.0)
            .legend(Legend::default())
            .show(ui, |plot| {
                for (method, (all, mut errors)) in errors {
                    errors.sort_by(f64::total_cmp);
                    let line = steps(&errors, all, limit_m);
                    plot.line(
                        Line::new(method.label(), line)
                            .color(theme::method(method))
                            .width(2.0),
                    );
                }
            });
        plot.response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Image, true, "Share of results within an error")
        });
    }
}

/// The share \[%\] of `all` results whose error is at most that, as a line of steps. The errors are sorted;
/// results without one are within none.
fn steps(errors: &[f64], all: usize, limit_m: f64) -> Vec<[f64; 2]> {
    let share = |count: usize| 100.0 * count as f64 / all.max(1) as f64;
    let mut line = vec![[0.0, 0.0]];
    let within = errors.iter().take_while(|error| **error <= limit_m);
    for (index, &error) in within.enumerate() {
        line.extend([[error, share(index)], [error, share(index + 1)]]);
    }
    let last = line.last().map_or(0.0, |point| point[1]);
    line.push([limit_m, last]);
    line
}

#[cfg(test)]
mod tests {
    use super::steps;

    #[test]
    fn what_has_no_error_is_within_none() {
        let line = steps(&[0.5, 1.0, 3.0], 4, 2.0);
        assert_eq!(
            line,
            [
                [0.0, 0.0],
                [0.5, 0.0],
                [0.5, 25.0],
                [1.0, 25.0],
                [1.0, 50.0],
                [2.0, 50.0]
            ]
        );
        assert_eq!(steps(&[], 0, 1.0), [[0.0, 0.0], [1.0, 0.0]]);
    }
}
