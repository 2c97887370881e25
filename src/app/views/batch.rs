//! All results of a run in a table: filtered, sorted, and each a click away.

use std::collections::BTreeMap;
use std::rc::Rc;

use egui::{Button, RichText, ScrollArea, Sense, TextEdit, Ui};

use super::View;
use crate::app::{Command, ResultRow, ViewContext, theme};
use crate::localize::QueryResult;
use crate::measure::{Field, Order, select, verdict_name};
use crate::method::Method;

/// What the table shows, with the width of its column \[points\].
const COLUMNS: [(&str, f32); 10] = [
    ("query", 84.0),
    ("method", 56.0),
    ("grade", 104.0),
    ("error", 60.0),
    ("code", 48.0),
    ("cause", *CAUSE.start()),
    ("rotation", 64.0),
    ("start", 60.0),
    ("probability", 76.0),
    ("reference", 110.0),
];

/// Width of the column with the verdicts of the results A \[points\].
const WAS: f32 = 40.0;

/// The widest that causes are shown, and the narrowest before the table is moved sideways \[points\].
const CAUSE: std::ops::RangeInclusive<f32> = 120.0..=900.0;

/// The results of all queries that were run.
#[derive(Default)]
pub struct BatchView {
    order: Option<Order>,
    /// What was shown last, and what it was made from.
    made: Option<(Made, Shown)>,
}

/// The rows in their order, and what is said of them.
struct Shown {
    rows: Vec<ResultRow>,
    words: String,
}

/// What the rows depend on, beside their order; equal where it is the very same.
struct Made {
    chosen: Rc<[ResultRow]>,
    order: Option<Order>,
    version: u64,
}

impl View for BatchView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
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
        changes(ui, context);
        let chosen = match context.selected() {
            Ok(chosen) => chosen,
            Err(error) => {
                ui.label(
                    RichText::new(error.to_string())
                        .color(theme::text(ui.visuals(), theme::ESTIMATE)),
                );
                return;
            }
        };
        if context.results.is_empty() {
            ui.weak(
                "No query was run yet: Run all in the list of queries, or open the folder of a run",
            );
            return;
        }
        self.make(context, chosen);
        let Some((_, Shown { rows, words })) = &self.made else {
            return;
        };
        ui.weak(words);
        let height = ui.spacing().interact_size.y;
        // The names of the columns move sideways with the rows, and stay above them.
        let sideways = ScrollArea::horizontal().auto_shrink(false);
        let columns = columns(ui, context);
        sideways.show(ui, |ui| {
            header(ui, context, &columns, &mut self.order);
            let area = ScrollArea::vertical().auto_shrink(false);
            area.show_rows(ui, height, rows.len(), |ui, range| {
                for row in &rows[range] {
                    if let Some(result) = context.result(*row) {
                        draw(ui, context, &columns, *row, result);
                    }
                }
            });
        });
    }
}

impl BatchView {
    /// Sorts, where anything has changed.
    fn make(&mut self, context: &ViewContext<'_>, chosen: Rc<[ResultRow]>) {
        let version = context.results_version();
        if let Some((made, _)) = &self.made
            && Rc::ptr_eq(&made.chosen, &chosen)
            && made.order == self.order
            && made.version == version
        {
            return;
        }
        let results: Vec<&QueryResult> = chosen
            .iter()
            .filter_map(|row| context.result(*row))
            .collect();
        let order = select(&results, None, self.order);
        let rows: Vec<ResultRow> = order.into_iter().map(|index| chosen[index]).collect();
        let words = words(context, &rows);
        let made = Made {
            chosen,
            order: self.order,
            version,
        };
        self.made = Some((made, Shown { rows, words }));
    }
}

/// What the results are held against, and what has to have become of them.
fn changes(ui: &mut Ui, context: &ViewContext<'_>) {
    ui.horizontal_wrapped(|ui| {
        if let Some(change) = &context.options.verdict_change {
            let button = ui.button(format!("{change} ×"));
            if button.on_hover_text("Look at all verdicts again").clicked() {
                context.send(Command::FilterVerdictChange(None));
            }
        }
        let keep = ui.button("Keep results as A");
        let help = "Hold the results that follow against these: change a setting, Run all, look at Migrations";
        if keep.on_hover_text(help).clicked() {
            context.send(Command::KeepResults);
        }
        if context.has_results_before() {
            let mut only = context.options.only_differences;
            let toggle = ui.toggle_value(&mut only, "Only what changed");
            if toggle.on_hover_text("Verdicts that are others than in A (D)").clicked() {
                context.send(Command::OnlyDifferences);
            }
            let forget = ui.button("Forget A");
            if forget.on_hover_text("Forget the results A").clicked() {
                context.send(Command::ForgetResults);
            }
        }
    });
}

/// How many are shown, and how many of them are wrong or missing, by method.
fn words(context: &ViewContext<'_>, rows: &[ResultRow]) -> String {
    let results: usize = context.results.values().map(Vec::len).sum();
    let mut failed: BTreeMap<Method, usize> = BTreeMap::new();
    for result in rows.iter().filter_map(|row| context.result(*row)) {
        let is_failed = result.grade.is_failure();
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

/// The columns with their widths: causes have what the others leave.
fn columns(ui: &Ui, context: &ViewContext<'_>) -> [(&'static str, f32); COLUMNS.len()] {
    let spacing = ui.spacing().item_spacing.x;
    let own = COLUMNS.iter().filter(|(name, _)| *name != "cause");
    let mut others: f32 = own.map(|(_, width)| width + spacing).sum();
    if context.has_results_before() {
        others += WAS + spacing;
    }
    let room = ui.available_width() - others - ui.spacing().scroll.allocated_width();
    COLUMNS.map(|(name, width)| match name {
        "cause" => (name, room.clamp(*CAUSE.start(), *CAUSE.end())),
        _ => (name, width),
    })
}

/// The names of the columns. A click sorts, another one the other way round, a third not at all.
fn header(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    columns: &[(&str, f32)],
    order: &mut Option<Order>,
) {
    ui.horizontal(|ui| {
        for &(name, width) in columns {
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
        if context.has_results_before() {
            let size = [WAS, ui.spacing().interact_size.y];
            let label = egui::Label::new(RichText::new("was").small());
            ui.add_sized(size, label)
                .on_hover_text("The primary verdict in A");
        }
    });
}

fn draw(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    columns: &[(&str, f32)],
    at: ResultRow,
    result: &QueryResult,
) {
    let ResultRow { query, place } = at;
    let grade = result.grade;
    let is_here = query == context.setup.query;
    let row = ui.horizontal(|ui| {
        for &(name, width) in columns {
            let Ok(field) = Field::find(name) else {
                continue;
            };
            let mut text = RichText::new(match name {
                "grade" => format!("{} {grade}", grade.glyph()),
                _ => field.text(result),
            });
            if name == "grade" {
                text = text.color(theme::grade(ui.visuals(), grade));
            } else if name == "method" {
                text = text.color(theme::text(ui.visuals(), theme::method(result.method)));
            } else if is_here {
                text = text.strong();
            }
            let label = egui::Label::new(text).truncate().selectable(false);
            ui.add_sized([width, ui.spacing().interact_size.y], label);
        }
        if context.has_results_before() {
            let primary = |result: &QueryResult| Some(result.diagnosis.first()?.code);
            let was = context
                .result_before(at)
                .map(|was| verdict_name(primary(was)));
            let mut text = RichText::new(was.unwrap_or("–"));
            if was.is_some_and(|was| was != verdict_name(primary(result))) {
                text = text.strong();
            }
            let label = egui::Label::new(text).selectable(false);
            ui.add_sized([WAS, ui.spacing().interact_size.y], label);
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
