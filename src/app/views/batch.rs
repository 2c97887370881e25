//! All results of a run in a table: filtered, sorted, and each a click away.

use std::collections::BTreeMap;
use std::rc::Rc;

use egui::{Button, RichText, ScrollArea, Sense, TextEdit, Ui};
use egui_extras::{Column, TableBuilder, TableRow};

use super::View;
use crate::app::action::{Action, button, toggle};
use crate::app::memo::Memo;
use crate::app::text_field::text_field;
use crate::app::{App, ResultRow, Sends, ViewContext, theme};
use crate::measure::{Field, Order, Overview, verdict_name};
use crate::method::Method;

/// All columns of the table.
const COLUMNS: [&Field; 13] = [
    Field::named("query"),
    Field::named("method"),
    Field::named("grade"),
    Field::named("error"),
    Field::named("opinion"),
    Field::named("off"),
    Field::named("code"),
    Field::named("cause"),
    Field::named("rotation"),
    Field::named("turned"),
    Field::named("start"),
    Field::named("probability"),
    Field::named("reference"),
];

/// The columns that have any value: those of errors need the truth, and those of opinions another system.
fn columns(overview: &Overview) -> Vec<&'static Field> {
    let bars = &overview.bars;
    let has_truth = bars.iter().any(|bar| bar.median_m.is_some());
    let has_opinions = bars.iter().any(|bar| bar.opinions.iter().any(|count| *count > 0));
    let has_values = |field: &&Field| match field.name {
        "error" | "rotation" | "start" => has_truth,
        "opinion" | "off" | "turned" => has_opinions,
        _ => true,
    };
    COLUMNS.into_iter().filter(has_values).collect()
}

/// Width of the column with the verdicts of the results A \[points\].
const WAS: f32 = 40.0;

/// The chosen results, their order, and the version of what they are compared with.
type ShownKey = (Rc<[ResultRow]>, Option<Order>, u64);

/// The results of all queries that were run.
#[derive(Default)]
pub struct BatchView {
    /// The rows in their order, and a line about them.
    shown: Memo<ShownKey, (Vec<ResultRow>, String)>,
}

impl View for BatchView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        ui.horizontal(|ui| {
            let label = ui.label("Where");
            let hint = "method = mi and code = D3";
            let mut typed = context.options.results_filter.clone();
            let field = TextEdit::singleline(&mut typed).hint_text(hint);
            let width = ui.available_width() - 8.0;
            let (field, _) = text_field(ui, field.desired_width(width));
            if field.labelled_by(label.id).changed() {
                context.send(|app| app.state.options.results_filter = typed);
            }
        });
        changes(ui, context);
        let chosen = match context.state.selected_results() {
            Ok(chosen) => chosen,
            Err(error) => {
                ui.label(
                    RichText::new(error.to_string())
                        .color(theme::text(ui.visuals(), theme::ESTIMATE)),
                );
                return;
            }
        };
        if context.state.results.is_empty() {
            ui.weak("No query was run yet: Run all in the list of queries, or open a run folder");
            return;
        }
        // Clicks on the names of the columns sort from the next frame on.
        let mut order = context.options.results_order;
        let key = (Rc::clone(&chosen), order, context.state.results.version());
        let (rows, words) = self.shown.get(key, || {
            let rows = context.state.results.sorted(&chosen, order);
            let words = words(context, &rows);
            (rows, words)
        });
        ui.weak(words);
        let columns = columns(&context.state.results.overview(context.options.shows_truth));
        let (height, has_before) =
            (ui.spacing().interact_size.y, context.state.results.has_before());
        // The names of the columns move sideways with the rows, and stay above them.
        ScrollArea::horizontal().auto_shrink(false).show(ui, |ui| {
            let mut table = TableBuilder::new(ui).striped(true).sense(Sense::click());
            for field in &columns {
                table = table.column(match field.name {
                    // It has the rest of the room.
                    "cause" => Column::remainder().at_least(field.width).clip(true),
                    _ => Column::exact(field.width),
                });
            }
            if has_before {
                table = table.column(Column::exact(WAS));
            }
            let table = table.header(height, |mut names| {
                for field in &columns {
                    names.col(|ui| header(ui, context, field, &mut order));
                }
                if has_before {
                    names.col(|ui| {
                        let was = ui.label(RichText::new("was").small());
                        was.on_hover_text("The primary verdict in A");
                    });
                }
            });
            table.body(|body| {
                body.rows(height, rows.len(), |mut row| {
                    let at = rows[row.index()];
                    draw(&mut row, context, &columns, at);
                });
            });
        });
        if order != context.options.results_order {
            context.send(move |app| app.state.options.results_order = order);
        }
    }
}

/// Which results are compared with these, and which changes are shown.
fn changes(ui: &mut Ui, context: &ViewContext<'_>) {
    ui.horizontal_wrapped(|ui| {
        if let Some(change) = &context.options.verdict_change {
            let button = ui.button(format!("{change} ×")).on_hover_text("Show all verdicts again");
            button.sends(context, |app| app.state.options.verdict_change = None);
        }
        let keep = ui.button("Keep results as A");
        let help = "Compare later results with these: change a setting, run all queries, and see \
                    Verdicts since A in Charts";
        keep.on_hover_text(help).sends(context, |app| app.state.keep_results());
        if context.state.results.has_before() {
            toggle(ui, context, "Only what changed", const { Action::named("Differences only") });
            button(ui, context, "Forget A", const { Action::named("Forget the results A") });
        }
    });
}

/// How many results are shown, and how many of each method are to be looked at first.
fn words(context: &ViewContext<'_>, rows: &[ResultRow]) -> String {
    let results: usize = context.state.results.values().map(Vec::len).sum();
    let mut failed: BTreeMap<Method, usize> = BTreeMap::new();
    let mut contradicted = "";
    for result in rows.iter().filter_map(|row| context.state.results.result(*row)) {
        *failed.entry(result.method).or_default() += usize::from(result.is_suspect());
        if result.is_suspect() && !result.grade.is_failure() {
            contradicted = ", contradicted";
        }
    }
    let failed: Vec<String> =
        failed.iter().map(|(method, count)| format!("{} {count}", method.label())).collect();
    let failed = failed.join(", ");
    format!("{} of {results} results; wrong{contradicted} or without a pose: {failed}", rows.len())
}

/// The name of a column by which conditions call it, with its unit.
fn heading(context: &ViewContext<'_>, field: &Field) -> String {
    match field.unit {
        "" => field.name.to_owned(),
        unit => context.in_unit(&format!("{} ({unit})", field.name)),
    }
}

/// The name of a column. A click sorts by it, the next one reverses, the third ends it.
fn header(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    field: &'static Field,
    order: &mut Option<Order>,
) {
    let heading = heading(context, field);
    let own = order.filter(|order| order.field == field);
    let (text, next) = match own.map(|order| order.descending) {
        None => (heading.clone(), Some(false)),
        Some(false) => (format!("{heading} ▲"), Some(true)),
        Some(true) => (format!("{heading} ▼"), None),
    };
    let button = ui.add(Button::new(RichText::new(text).small()).frame(false));
    if button.on_hover_text(field.about()).clicked() {
        *order = next.map(|descending| Order { field, descending });
    }
}

fn draw(
    row: &mut TableRow<'_, '_>,
    context: &ViewContext<'_>,
    columns: &[&'static Field],
    at: ResultRow,
) {
    let Some(result) = context.state.results.result(at) else {
        return;
    };
    let selected = context.options.selected_row.filter(|row| row.query == context.setup.query);
    let is_here = selected.map_or(at.query == context.setup.query, |row| row == at);
    let label = |ui: &mut Ui, text: RichText| {
        ui.add(egui::Label::new(text).truncate().selectable(false));
    };
    for field in columns {
        row.col(|ui| {
            let (grade, visuals) = (result.grade, ui.visuals());
            let text = match field.name {
                "grade" => RichText::new(format!("{} {grade}", grade.glyph()))
                    .color(theme::grade(visuals, grade)),
                "method" => RichText::new(field.text(result))
                    .color(theme::text(visuals, theme::method(result.method))),
                _ if is_here => RichText::new(field.text(result)).strong(),
                _ => RichText::new(field.text(result)),
            };
            label(ui, text);
        });
    }
    if context.state.results.has_before() {
        let was = context.state.results.before_row(at).map(verdict_name);
        let text = RichText::new(was.unwrap_or("–"));
        let is_change = was.is_some_and(|was| was != verdict_name(result));
        row.col(|ui| label(ui, if is_change { text.strong() } else { text }));
    }
    let mut answer = row.response();
    if let Some(finding) = result.diagnosis.first() {
        answer = answer.on_hover_text(&finding.text);
    }
    if answer.double_clicked() {
        context.send(App::open_selected);
    }
    answer.sends(context, move |app| app.state.open_result(at.query, at.place));
}
