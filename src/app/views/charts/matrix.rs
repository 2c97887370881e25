//! Primary verdicts as a matrix: by method, by condition, or against the results A.

use std::collections::{BTreeMap, BTreeSet};

use egui::{Button, Color32, Grid, RichText, ScrollArea, Ui};

use super::Chosen;
use crate::app::command::Command;
use crate::app::{ViewContext, ViewName, theme};
use crate::diagnosis::{Code, Grade};
use crate::localize::QueryResult;
use crate::measure::{Migration, NOTHING_FOUND, verdict_name};
use crate::method::Method;

/// What the columns of the matrix are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Columns {
    #[default]
    Methods,
    Conditions,
    Now,
}

impl Columns {
    pub(super) const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Methods, "by method", "A column for each method"),
        (
            Self::Conditions,
            "by condition",
            "A column for each pair of scenes of queries and references",
        ),
        (Self::Now, "since A", "Verdicts of the results A in rows, those of now in columns"),
    ];
}

/// The name of a row or a column, behind its place among the verdicts: `ok`, which is none, comes first, and what is no
/// verdict is in the order of the alphabet.
type Name = (Option<usize>, String);

/// The numbers of a matrix, by row and column.
type Cells = BTreeMap<(Name, Name), Cell>;

/// A number of the matrix, and what a click on it does.
struct Cell {
    text: RichText,
    /// What it counts.
    words: String,
    is_chosen: bool,
    command: Command,
}

/// Draws the matrix. A click on a number shows its results in Batch.
pub(super) fn ui(ui: &mut Ui, context: &ViewContext<'_>, results: &[Chosen<'_>], columns: Columns) {
    let results = || results.iter().map(|(_, result)| *result);
    let ok = theme::text(ui.visuals(), theme::TRUTH);
    let tables = match columns {
        Columns::Methods => {
            let column = |result: &QueryResult| (result.method.label(), String::new());
            vec![(String::new(), tally(results(), column, ok))]
        }
        Columns::Conditions => by_method(results().map(|result| (result.method, result)))
            .map(|(method, own)| (method.label(), tally(own.into_iter(), condition, ok)))
            .collect(),
        Columns::Now => {
            if !context.state.results.has_before() {
                ui.weak(
                    "Nothing to compare with. Open two runs with --before, or click Keep results as A in Batch, \
                     change a setting and run all queries again",
                );
                return;
            }
            let migrations = context.state.results.migrations();
            if migrations.is_empty() {
                ui.weak("A has no result in common with these: scenes, queries, methods and settings differ");
                return;
            }
            ui.label(changes(&migrations));
            let wrong = theme::text(ui.visuals(), theme::ESTIMATE);
            let change = |one: &Migration| migration(context, one, [ok, wrong]);
            by_method(migrations.iter().map(|one| (one.method, one)))
                .map(|(method, own)| (method.label(), own.into_iter().map(change).collect()))
                .collect()
        }
    };
    let corner = match columns {
        Columns::Methods | Columns::Conditions => "verdict",
        Columns::Now => "A ↓  now →",
    };
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        for (title, cells) in tables {
            if !title.is_empty() {
                ui.strong(&title);
            }
            ui.push_id(&title, |ui| table(ui, context, corner, cells));
            ui.add_space(8.0);
        }
    });
}

fn by_method<T>(all: impl Iterator<Item = (Method, T)>) -> impl Iterator<Item = (Method, Vec<T>)> {
    let mut groups: BTreeMap<Method, Vec<T>> = BTreeMap::new();
    for (method, one) in all {
        groups.entry(method).or_default().push(one);
    }
    groups.into_iter()
}

/// The scenes of queries and references, such as `street:night ← street:overcast`, and the filter for them.
fn condition(result: &QueryResult) -> (String, String) {
    let references = &result.scene;
    let queries = result.query_scene.as_ref().unwrap_or(references);
    let name = if queries == references {
        references.clone()
    } else {
        format!("{queries} ← {references}")
    };
    let filter = format!(" and queries = \"{queries}\" and scene = \"{references}\"");
    (name, filter)
}

/// What is counted together: the grade of results without a verdict, the name of the verdict, the column, the method, and
/// the filter for the column.
type Counted = ((Option<Grade>, &'static str), String, Method, String);

/// Counts the verdicts of each column; `column` gives its name and the filter for it.
fn tally<'a>(
    results: impl Iterator<Item = &'a QueryResult>,
    column: impl Fn(&QueryResult) -> (String, String),
    ok: Color32,
) -> Cells {
    let mut counts: BTreeMap<Counted, usize> = BTreeMap::new();
    let mut sums: BTreeMap<String, usize> = BTreeMap::new();
    for result in results {
        let (name, filter) = column(result);
        *sums.entry(name.clone()).or_default() += 1;
        let verdict = (result.diagnosis.is_empty().then_some(result.grade), verdict_name(result));
        *counts.entry((verdict, name, result.method, filter)).or_default() += 1;
    }
    let cells = counts.into_iter();
    let cell = |(((without, row), column, method, scenes), count): (Counted, usize)| {
        let all = sums[&column];
        let text = format!("{count} ({:.0} %)", 100.0 * count as f64 / all as f64);
        let text = RichText::new(text);
        let filter = match without {
            Some(grade) => format!("\"\" and grade = \"{grade}\""),
            None => row.to_owned(),
        };
        let place = if scenes.is_empty() { String::new() } else { format!(", {column}") };
        let cell = Cell {
            words: format!("{} {row}{place}: {count} of {all}", method.label()),
            text: if without == Some(Grade::Right) { text.color(ok) } else { text },
            is_chosen: false,
            command: Box::new(move |app| {
                app.state.options.results_filter =
                    format!("method = {method} and code = {filter}{scenes}");
            }),
        };
        ((name_of(row), name_of(&column)), cell)
    };
    cells.map(cell).collect()
}

fn migration(
    context: &ViewContext<'_>,
    one: &Migration,
    [ok, wrong]: [Color32; 2],
) -> ((Name, Name), Cell) {
    let is_chosen = context.options.verdict_change.as_ref().is_some_and(|other| one.is_like(other));
    let change = one.clone();
    let name = NOTHING_FOUND;
    let text = RichText::new(one.count.to_string());
    let text = match (one.is_change(), is_chosen) {
        (_, true) => text,
        (false, _) => text.weak(),
        (true, _) if one.after == name => text.strong().color(ok),
        (true, _) if one.before == name => text.strong().color(wrong),
        (true, _) => text.strong(),
    };
    let cell = Cell {
        text,
        words: format!("{one}: {}", one.count),
        is_chosen,
        command: Box::new(move |app| {
            app.state.options.verdict_change = (!is_chosen).then_some(change);
        }),
    };
    ((name_of(&one.before), name_of(&one.after)), cell)
}

/// Such as `12 of 160 verdicts changed: MI ok → D2 3, FB R3 → ok 2`.
fn changes(migrations: &[Migration]) -> String {
    let all: usize = migrations.iter().map(|one| one.count).sum();
    let changed: Vec<&Migration> = migrations.iter().filter(|one| one.is_change()).collect();
    let count: usize = changed.iter().map(|one| one.count).sum();
    if changed.is_empty() {
        return format!("None of {all} verdicts changed");
    }
    let each = changed.iter().map(|one| format!("{one} {}", one.count));
    let each: Vec<String> = each.collect();
    format!("{count} of {all} verdicts changed: {}", each.join(", "))
}

fn name_of(name: &str) -> Name {
    (Code::all().iter().position(|code| code.name() == name), name.to_owned())
}

fn table(ui: &mut Ui, context: &ViewContext<'_>, corner: &str, mut cells: Cells) {
    let header = |ui: &mut Ui, name: &str| {
        let answer = ui.strong(name);
        if let Ok(code) = name.parse::<Code>() {
            answer.on_hover_text(code.title());
        }
    };
    let rows: BTreeSet<Name> = cells.keys().map(|(row, _)| row.clone()).collect();
    let columns: BTreeSet<Name> = cells.keys().map(|(_, column)| column.clone()).collect();
    Grid::new("matrix").striped(true).show(ui, |ui| {
        ui.weak(corner);
        columns.iter().for_each(|(_, column)| header(ui, column));
        ui.end_row();
        for row in rows {
            header(ui, &row.1);
            for column in &columns {
                match cells.remove(&(row.clone(), column.clone())) {
                    Some(cell) => number(ui, context, cell),
                    None => {
                        ui.weak("·");
                    }
                }
            }
            ui.end_row();
        }
    });
}

fn number(ui: &mut Ui, context: &ViewContext<'_>, cell: Cell) {
    let button = Button::selectable(cell.is_chosen, cell.text).min_size(egui::vec2(34.0, 0.0));
    let answer = ui.add(button);
    answer.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &cell.words));
    let help = format!("{}. Click to show them", cell.words);
    if answer.on_hover_text(help).clicked() {
        context.send(cell.command);
        context.send(|app| app.state.show_view(ViewName::Batch));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_in_the_order_of_the_codes_after_ok() {
        let codes: Vec<Name> = Code::all().iter().map(|code| name_of(code.name())).collect();
        let mut ordered: Vec<Name> = codes.iter().rev().cloned().chain([name_of("ok")]).collect();
        ordered.sort();
        assert_eq!(ordered[0].1, "ok");
        assert_eq!(ordered[1..], codes);
    }

    #[test]
    fn the_most_frequent_change_is_named_first() {
        let of = |before: &str, after: &str, count| Migration {
            method: Method::MI,
            before: before.to_owned(),
            after: after.to_owned(),
            count,
        };
        let all = [of("ok", "ok", 7), of("ok", "D2", 3), of("D3", "ok", 2)];
        assert_eq!(changes(&all), "5 of 12 verdicts changed: MI ok → D2 3, MI D3 → ok 2");
        assert_eq!(changes(&all[..1]), "None of 7 verdicts changed");
    }
}
