//! Two runs as one table: what was changed, and what became different.

use egui::{Grid, RichText, ScrollArea, Ui};

use super::View;
use crate::app::{Command, CompareMode, ViewContext, theme};
use crate::diagnosis::Grade;
use crate::localize::QueryResult;
use crate::measure::{Field, Value};

/// A, B, what lies between them.
#[derive(Default)]
pub struct DifferencesView {
    /// Whether what is the same in both is shown too.
    shows_same: bool,
}

impl View for DifferencesView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(other) = context.other_run() else {
            ui.weak(
                "There is nothing to compare with: keep this run as A (P), then change something",
            );
            return;
        };
        let (a, b) = if context.is_present() {
            (other, context.run)
        } else {
            (context.run, other)
        };
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.shows_same, "What is the same too");
            if ui
                .button("Back to A")
                .on_hover_text("Show the run that was kept (X)")
                .clicked()
            {
                context.send(Command::Compare(CompareMode::Kept));
            }
        });
        ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            changed(ui, &a.settings(), &b.settings());
            for result in b.results() {
                let same = |other: &&QueryResult| {
                    other.method == result.method
                        && other.fusion == result.fusion
                        && other.references == result.references
                };
                match a.results().find(same) {
                    Some(before) => self.table(ui, context, before, result),
                    None => {
                        title(ui, result);
                        ui.weak("A has no such result");
                    }
                }
            }
            if b.results().next().is_none() {
                ui.weak("B has no results yet");
            }
        });
    }
}

/// What one of the runs was asked otherwise.
fn changed(ui: &mut Ui, a: &[String], b: &[String]) {
    let only = |these: &[String], those: &[String]| -> Vec<String> {
        let own = these.iter().filter(|change| !those.contains(change));
        own.cloned().collect()
    };
    let (only_a, only_b) = (only(a, b), only(b, a));
    if only_a.is_empty() && only_b.is_empty() {
        ui.weak("Both were asked the same");
    }
    for (name, changes) in [("A", only_a), ("B", only_b)] {
        for change in changes {
            ui.horizontal(|ui| {
                ui.label(RichText::new(name).strong());
                ui.monospace(change);
            });
        }
    }
    ui.separator();
}

fn title(ui: &mut Ui, result: &QueryResult) {
    let fusion = result
        .fusion
        .map_or(String::new(), |fusion| format!(" {fusion}"));
    let words = format!("{}{fusion}", result.method.label());
    let name = RichText::new(words)
        .color(theme::text(ui.visuals(), theme::method(result.method)))
        .strong();
    ui.horizontal(|ui| {
        ui.label(name);
        ui.weak(format!("← {}", result.references.join(", ")));
    });
}

/// Fields that name the question, and are the same by that.
const NAMES: [&str; 7] = [
    "query",
    "scene",
    "queries",
    "reference",
    "method",
    "fusion",
    "references",
];
/// Fields that would tell the truth.
const TRUTH: [&str; 8] = [
    "grade",
    "code",
    "codes",
    "error",
    "rotation",
    "start",
    "truth_cost",
    "basin",
];

impl DifferencesView {
    fn table(&self, ui: &mut Ui, context: &ViewContext<'_>, a: &QueryResult, b: &QueryResult) {
        title(ui, b);
        let shows_truth = context.options.shows_truth;
        let fields = Field::ALL.iter().filter(|field| {
            !NAMES.contains(&field.name) && (shows_truth || !TRUTH.contains(&field.name))
        });
        let rows: Vec<Compared> = fields
            .filter_map(|field| Compared::of(field, a, b))
            .filter(|row| self.shows_same || row.a != row.b)
            .collect();
        if rows.is_empty() {
            ui.weak("no difference");
            return;
        }
        let salt = format!("{} {:?} {}", b.method, b.fusion, b.references.join(" "));
        Grid::new(salt).striped(true).num_columns(4).show(ui, |ui| {
            for heading in ["", "A", "B", "B − A"] {
                ui.weak(heading);
            }
            ui.end_row();
            for row in rows {
                ui.label(row.field.name).on_hover_text(row.field.about);
                ui.label(&row.a);
                ui.label(RichText::new(&row.b).strong());
                ui.label(row.difference.unwrap_or_default());
                ui.end_row();
            }
        });
        let grades = [a, b].map(|result| result.grade_shown(shows_truth));
        if grades[0] != grades[1] {
            ui.label(RichText::new(became(grades)).strong());
        }
        ui.separator();
    }
}

/// What became of an answer, in words.
fn became([a, b]: [Grade; 2]) -> String {
    let how = match (a.is_failure(), b.is_failure()) {
        (true, false) => "fixed",
        (false, true) => "broken",
        _ => "changed",
    };
    format!("{how}: {} {a} → {} {b}", a.glyph(), b.glyph())
}

/// A field in both runs.
struct Compared {
    field: &'static Field,
    a: String,
    b: String,
    difference: Option<String>,
}

impl Compared {
    /// `None` where neither has it.
    fn of(field: &'static Field, a: &QueryResult, b: &QueryResult) -> Option<Self> {
        let difference = match (field.of(a), field.of(b)) {
            (Value::None, Value::None) => return None,
            (Value::Number(a), Value::Number(b)) => {
                Some(format!("{:+.*}", field.decimals.unwrap_or(0), b - a))
            }
            _ => None,
        };
        let text = |result| match field.text(result) {
            text if text.is_empty() => "–".to_owned(),
            text => text,
        };
        Some(Self {
            field,
            a: text(a),
            b: text(b),
            difference,
        })
    }
}
