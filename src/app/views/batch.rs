//! All results of a run in a table: filtered, sorted, and each a click away.

use std::collections::BTreeMap;

use egui::{Button, RichText, ScrollArea, Sense, TextEdit, Ui};

use super::View;
use crate::app::{Command, ViewContext, theme};
use crate::diagnosis::Tolerance;
use crate::localize::{QueryResult, Standing};
use crate::measure::{Condition, ConditionError, Field, Order, select};
use crate::method::Method;

/// What the table shows, with the width of its column \[points\].
const COLUMNS: [(&str, f32); 9] = [
    ("query", 84.0),
    ("reference", 110.0),
    ("method", 56.0),
    ("is", 104.0),
    ("error", 72.0),
    ("rotation", 64.0),
    ("start", 64.0),
    ("code", 48.0),
    ("confidence", 76.0),
];

/// The results of all queries that were run.
#[derive(Default)]
pub struct BatchView {
    order: Option<Order>,
    /// What was shown last, and what it was made from.
    made: Option<(Made, Vec<Row>)>,
}

/// What the rows depend on.
#[derive(Clone, PartialEq)]
struct Made {
    typed: String,
    order: Option<Order>,
    results: usize,
    right: Tolerance,
}

/// A result by its query and its place among the query's.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub(super) query: usize,
    pub(super) place: usize,
}

impl View for BatchView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let right = context.setup.task.protocol.right;
        ui.horizontal(|ui| {
            let label = ui.label("Where");
            let hint = "method = mi and code = D3";
            let mut typed = context.options.results_filter.clone();
            let field = TextEdit::singleline(&mut typed).hint_text(hint);
            let field = ui.add(field.desired_width(ui.available_width() - 8.0));
            if field.labelled_by(label.id).changed() {
                context.send(Command::FilterResults(typed));
            }
        });
        let condition = match condition(context) {
            Ok(condition) => condition,
            Err(error) => {
                ui.label(RichText::new(error.to_string()).color(theme::ESTIMATE));
                return;
            }
        };
        let results: usize = context.results.values().map(Vec::len).sum();
        if results == 0 {
            ui.weak(
                "No query was run yet: Run all in the list of queries, or open the folder of a run",
            );
            return;
        }
        self.make(context, results, right, condition.as_ref());
        let Some((_, rows)) = &self.made else { return };
        ui.weak(words(context, rows, results, right));
        header(ui, &mut self.order);
        let height = ui.spacing().interact_size.y;
        let area = ScrollArea::both().auto_shrink(false);
        area.show_rows(ui, height, rows.len(), |ui, range| {
            for row in &rows[range] {
                if let Some(result) = result(context, *row) {
                    draw(ui, context, *row, result, right);
                }
            }
        });
    }
}

impl BatchView {
    /// Filters and sorts, where anything has changed.
    fn make(
        &mut self,
        context: &ViewContext<'_>,
        results: usize,
        right: Tolerance,
        condition: Option<&Condition>,
    ) {
        let wanted = Made {
            typed: context.options.results_filter.clone(),
            order: self.order,
            results,
            right,
        };
        if self.made.as_ref().is_some_and(|(made, _)| *made == wanted) {
            return;
        }
        let all = known(context);
        let only: Vec<&QueryResult> = all.iter().map(|(_, result)| *result).collect();
        let chosen = select(&only, right, condition, self.order);
        let rows = chosen.into_iter().map(|index| all[index].0).collect();
        self.made = Some((wanted, rows));
    }
}

/// All results that are known.
fn known<'a>(context: &ViewContext<'a>) -> Vec<(Row, &'a QueryResult)> {
    let all = context.results.iter().flat_map(|(&query, results)| {
        let results = results.iter().enumerate();
        results.map(move |(place, result)| (Row { query, place }, result))
    });
    all.collect()
}

/// The results that the condition chooses, in the order of the queries.
///
/// # Errors
/// What is wrong with the condition.
pub(super) fn chosen<'a>(
    context: &ViewContext<'a>,
) -> Result<Vec<(Row, &'a QueryResult)>, ConditionError> {
    let condition = condition(context)?;
    let right = context.setup.task.protocol.right;
    let mut all = known(context);
    if let Some(condition) = condition {
        all.retain(|(_, result)| condition.is_met(result, right));
    }
    Ok(all)
}

/// The condition that is asked for, if one is.
fn condition(context: &ViewContext<'_>) -> Result<Option<Condition>, ConditionError> {
    match context.options.results_filter.trim() {
        "" => Ok(None),
        typed => typed.parse().map(Some),
    }
}

fn result<'a>(context: &ViewContext<'a>, row: Row) -> Option<&'a QueryResult> {
    context.results.get(&row.query)?.get(row.place)
}

/// How many are shown, and how many of them are wrong or missing, by method.
fn words(context: &ViewContext<'_>, rows: &[Row], results: usize, right: Tolerance) -> String {
    let mut failed: BTreeMap<Method, usize> = BTreeMap::new();
    for result in rows.iter().filter_map(|row| result(context, *row)) {
        let is_failed = result.standing(right, true) >= Standing::Wrong;
        *failed.entry(result.method).or_default() += usize::from(is_failed);
    }
    let failed: Vec<String> = failed
        .iter()
        .map(|(method, count)| format!("{} {count}", method.label()))
        .collect();
    format!(
        "{} of {results} results; wrong or without a pose: {}",
        rows.len(),
        failed.join(", ")
    )
}

/// The names of the columns. A click sorts, another one the other way round, a third not at all.
fn header(ui: &mut Ui, order: &mut Option<Order>) {
    ui.horizontal(|ui| {
        for (name, width) in COLUMNS {
            let Ok(field) = Field::find(name) else {
                continue;
            };
            let own = order.filter(|order| order.field == field);
            let text = match own {
                Some(Order {
                    descending: false, ..
                }) => format!("{name} ▲"),
                Some(_) => format!("{name} ▼"),
                None => name.to_owned(),
            };
            let button = Button::new(RichText::new(text).small()).frame(false);
            let response = ui.add_sized([width, ui.spacing().interact_size.y], button);
            if response.on_hover_text(field.about).clicked() {
                *order = match own {
                    None => Some(Order {
                        field,
                        descending: false,
                    }),
                    Some(Order {
                        descending: false, ..
                    }) => Some(Order {
                        field,
                        descending: true,
                    }),
                    Some(_) => None,
                };
            }
        }
    });
}

fn draw(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    Row { query, place }: Row,
    result: &QueryResult,
    right: Tolerance,
) {
    let standing = result.standing(right, true);
    let is_here = query == context.setup.query;
    let row = ui.horizontal(|ui| {
        for (name, width) in COLUMNS {
            let Ok(field) = Field::find(name) else {
                continue;
            };
            let mut text = RichText::new(match name {
                "is" => format!("{} {standing}", standing.mark()),
                _ => field.text(result, right),
            });
            if name == "is" {
                text = text.color(theme::standing(ui.visuals(), standing));
            } else if name == "method" {
                text = text.color(theme::method(result.method));
            } else if is_here {
                text = text.strong();
            }
            let label = egui::Label::new(text).truncate().selectable(false);
            ui.add_sized([width, ui.spacing().interact_size.y], label);
        }
    });
    let answer = row.response.interact(Sense::click());
    let primary = result.diagnosis.first().map(|finding| finding.text.clone());
    let answer = match primary {
        Some(text) => answer.on_hover_text(text),
        None => answer,
    };
    if answer.clicked() {
        context.send(Command::OpenResult {
            query,
            result: place,
        });
    }
}
