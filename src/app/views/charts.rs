//! The results of all queries as pictures: any two measures, recall, and the verdicts.

mod matrix;
mod recall;

use std::collections::BTreeMap;

use egui::{ComboBox, DragValue, Ui};
use egui_plot::{Legend, MarkerShape, Plot, PlotPoint, Points};

use super::View;
use super::legend::name_picture;
use crate::app::{ResultRow, ViewContext, theme};
use crate::diagnosis::Grade;
use crate::localize::QueryResult;
use crate::measure::{Field, Value};
use matrix::Columns;

/// What is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Chart {
    #[default]
    Scatter,
    Recall,
    Verdicts,
}

impl Chart {
    const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Scatter, "Scatter", "Any two measures of each result"),
        (
            Self::Recall,
            "Recall",
            "The share of right results over the tolerance in metres and degrees",
        ),
        (Self::Verdicts, "Verdicts", "How often each verdict is the primary one"),
    ];
}

/// The pointer chooses a point within this distance \[points\].
const REACH: f32 = 10.0;

/// The results that match the filter of Batch.
pub struct ChartsView {
    chart: Chart,
    across: &'static str,
    up: &'static str,
    /// The largest tolerance that is drawn \[m\].
    limit_m: f64,
    /// The columns of the verdicts.
    columns: Columns,
}

impl Default for ChartsView {
    fn default() -> Self {
        Self {
            chart: Chart::default(),
            across: "start",
            up: "error",
            limit_m: 2.0,
            columns: Columns::default(),
        }
    }
}

impl View for ChartsView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let results: Vec<Chosen<'_>> = match context.state.selected_results() {
            Ok(rows) => {
                let rows = rows.iter();
                rows.filter_map(|row| Some((*row, context.state.results.result(*row)?))).collect()
            }
            Err(error) => {
                ui.weak(error.to_string());
                return;
            }
        };
        if results.is_empty() {
            ui.weak("No results match. Run all queries, open a run folder, or change the filter in Batch");
            return;
        }
        ui.horizontal_wrapped(|ui| {
            for (chart, name, about) in Chart::ALL {
                ui.selectable_value(&mut self.chart, chart, name).on_hover_text(about);
            }
            ui.separator();
            match self.chart {
                Chart::Scatter => {
                    measure(ui, "Across", &mut self.across);
                    measure(ui, "Up", &mut self.up);
                }
                Chart::Recall => {
                    let label = ui.label("up to");
                    let drag = DragValue::new(&mut self.limit_m).range(0.05..=100.0);
                    ui.add(drag.speed(0.05).suffix(context.suffix("m"))).labelled_by(label.id);
                }
                Chart::Verdicts => {
                    for (columns, name, about) in Columns::ALL {
                        ui.selectable_value(&mut self.columns, columns, name).on_hover_text(about);
                    }
                }
            }
        });
        match self.chart {
            Chart::Scatter => self.scatter(ui, context, &results),
            Chart::Recall => recall::ui(ui, context, &results, self.limit_m),
            Chart::Verdicts => matrix::ui(ui, context, &results, self.columns),
        }
    }
}

fn measure(ui: &mut Ui, label: &str, name: &mut &'static str) {
    let label = ui.label(label);
    let combo = ComboBox::from_id_salt(label.id).selected_text(*name);
    let answer = combo.show_ui(ui, |ui| {
        let numbers = Field::ALL.iter().filter(|field| field.decimals.is_some());
        for field in numbers {
            ui.selectable_value(name, field.name, field.name).on_hover_text(field.about());
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
        name_picture(answer, format!("{} results: {up} over {across}", places.len()));
        let Some(pointer) = answer.hover_pos() else {
            return;
        };
        let distance = |at: &[f64; 2]| {
            let at = plot.transform.position_from_point(&PlotPoint::new(at[0], at[1]));
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
            let ResultRow { query, place } = *row;
            context.send(move |app| app.state.open_result(query, place));
        }
        let code = result.diagnosis.first();
        let code =
            code.map_or(String::new(), |finding| format!("\n{} {}", finding.code, finding.text));
        let words = format!("{} {}{code}", result.query, result.method.label());
        plot.response.clone().on_hover_text_at_pointer(words);
    }
}
