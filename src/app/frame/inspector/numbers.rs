//! All numbers of the selected result, beside those of run A where one is kept.

use egui::{Grid, RichText, Ui, vec2};

use crate::app::ViewContext;
use crate::app::theme;
use crate::app::view_options::CompareMode;
use crate::localize::QueryResult;
use crate::measure::{Field, Value};

/// Fields that name the question, which the toolbar shows.
const NAMES: [&str; 7] =
    ["query", "scene", "queries", "reference", "method", "fusion", "references"];

pub(super) fn ui(ui: &mut Ui, context: &ViewContext<'_>) {
    let Some(span) = context.span() else {
        ui.weak("Nothing has run yet. Space runs the query.");
        return;
    };
    let is_compared = context.state.kept.is_some();
    if is_compared {
        settings(ui, context);
    }
    match context.state.outcome(span) {
        Some(result) => {
            let other = context.state.other_result(&result);
            fields(ui, context, &result, other.as_ref(), is_compared);
        }
        None => {
            ui.weak("There is no result yet.");
        }
    }
    if let Some(times) = &span.times {
        ui.add_space(8.0);
        ui.strong("Time");
        Grid::new("times").num_columns(2).spacing(vec2(10.0, 3.0)).show(ui, |ui| {
            for (stage, time) in times.iter() {
                ui.label(stage.replace('_', " "));
                ui.label(format!("{:.2} ms", 1e3 * time.as_secs_f64()));
                ui.end_row();
            }
        });
        ui.weak("Pauses count. A reused stage takes next to nothing.");
    }
}

/// What the two runs were asked differently.
fn settings(ui: &mut Ui, context: &ViewContext<'_>) {
    let Some(kept) = &context.state.kept else { return };
    let (a, b) = (kept.run.settings(), context.state.run().settings());
    let only = |these: &[String], those: &[String]| -> Vec<String> {
        these.iter().filter(|one| !those.contains(one)).cloned().collect()
    };
    ui.strong("Settings");
    let (only_a, only_b) = (only(&a, &b), only(&b, &a));
    if only_a.is_empty() && only_b.is_empty() {
        ui.weak("Both runs have the same settings.");
    }
    for (name, changes) in [("A", only_a), ("B", only_b)] {
        for change in changes {
            ui.horizontal_wrapped(|ui| {
                ui.strong(name);
                ui.monospace(change);
            });
        }
    }
    ui.add_space(8.0);
}

fn fields(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    result: &QueryResult,
    other: Option<&QueryResult>,
    is_compared: bool,
) {
    let shows_kept = context.options.compare_mode == CompareMode::Kept;
    const GAP: f32 = 10.0;
    let columns = if is_compared { 3 } else { 2 };
    let room = ui.available_width() - GAP * (columns - 1) as f32;
    Grid::new("numbers")
        .num_columns(columns)
        .max_col_width(room / columns as f32)
        .striped(true)
        .spacing(vec2(GAP, 3.0))
        .show(ui, |ui| {
            if is_compared {
                let names = if shows_kept { ["A", "B"] } else { ["B", "A"] };
                ui.label("");
                for name in names {
                    ui.strong(name);
                }
                ui.end_row();
            }
            for field in Field::ALL.iter().filter(|field| !NAMES.contains(&field.name)) {
                let text = |result: &QueryResult| match field.of(result) {
                    Value::None => None,
                    _ => Some(field.text(result)).filter(|text| !text.is_empty()),
                };
                let (own, theirs) = (text(result), other.and_then(text));
                let differs = is_compared && own != theirs;
                if own.is_none() && theirs.is_none() || context.options.only_differences && !differs
                {
                    continue;
                }
                ui.label(field.name.replace('_', " ")).on_hover_text(field.about());
                let own = RichText::new(own.unwrap_or_else(|| "–".to_owned()));
                ui.label(if differs { own.strong() } else { own });
                if is_compared {
                    let theirs = RichText::new(theirs.unwrap_or_else(|| "–".to_owned()));
                    ui.label(if differs {
                        theirs.color(theme::accent(ui.visuals()))
                    } else {
                        theirs.weak()
                    });
                }
                ui.end_row();
            }
        });
}
