//! What became of verdicts from the results A to those of now: a matrix for each method.

use std::collections::BTreeSet;

use egui::{Button, Grid, RichText, ScrollArea, Ui};

use super::View;
use crate::app::{Command, VerdictChange, ViewContext, theme};
use crate::diagnosis::Code;
use crate::measure::{Migration, verdict_name};
use crate::method::Method;

/// How often each verdict became each other one. A click looks at the results that did.
#[derive(Default)]
pub struct MigrationsView;

impl View for MigrationsView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        if !context.has_results_before() {
            ui.weak(
                "There are no results A to hold these against: `posescope view RUN --before RUN_A` opens \
                 two runs, and Keep results as A in Batch keeps what is there, before a setting is changed \
                 and all queries are run again",
            );
            return;
        }
        let migrations = context.migrations();
        if migrations.is_empty() {
            ui.weak("A has no result in common with these: scenes, queries, methods and settings differ");
            return;
        }
        ui.label(words(&migrations));
        ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            let methods: BTreeSet<Method> = migrations.iter().map(|one| one.method).collect();
            for method in methods {
                let own: Vec<&Migration> = migrations
                    .iter()
                    .filter(|one| one.method == method)
                    .collect();
                matrix(ui, context, method, &own);
                ui.add_space(8.0);
            }
        });
    }
}

/// Such as `12 of 160 verdicts changed: MI ok → D2 3, FB R3 → ok 2`.
fn words(migrations: &[Migration]) -> String {
    let all: usize = migrations.iter().map(|one| one.count).sum();
    let changed: Vec<&Migration> = migrations.iter().filter(|one| one.is_change()).collect();
    let count: usize = changed.iter().map(|one| one.count).sum();
    if changed.is_empty() {
        return format!("None of {all} verdicts changed");
    }
    let told = changed.iter().map(|one| {
        let name = one.method.name().to_uppercase();
        format!("{name} {} → {} {}", one.before, one.after, one.count)
    });
    let told: Vec<String> = told.collect();
    format!("{count} of {all} verdicts changed: {}", told.join(", "))
}

/// Where a verdict stands in a row or a column: `ok` first, then by code.
fn place(name: &str) -> usize {
    let place = Code::all().iter().position(|code| code.name() == name);
    place.map_or(0, |place| place + 1)
}

fn matrix(ui: &mut Ui, context: &ViewContext<'_>, method: Method, migrations: &[&Migration]) {
    let verdicts = |of: fn(&Migration) -> &str| -> Vec<String> {
        let names: BTreeSet<(usize, &str)> = migrations
            .iter()
            .map(|one| (place(of(one)), of(one)))
            .collect();
        names.into_iter().map(|(_, name)| name.to_owned()).collect()
    };
    let (rows, columns) = (verdicts(|one| &one.before), verdicts(|one| &one.after));
    ui.label(RichText::new(method.label()).strong());
    ui.push_id(method.name(), |ui| {
        Grid::new("migrations").striped(true).show(ui, |ui| {
            ui.weak("A ↓  now →");
            for after in &columns {
                ui.strong(after).on_hover_text(about(after));
            }
            ui.end_row();
            for before in &rows {
                ui.strong(before).on_hover_text(about(before));
                for after in &columns {
                    let mut all = migrations.iter();
                    let found = all.find(|one| one.before == *before && one.after == *after);
                    match found {
                        Some(one) => cell(ui, context, one),
                        None => {
                            ui.weak("·");
                        }
                    }
                }
                ui.end_row();
            }
        });
    });
}

fn about(name: &str) -> &'static str {
    let code: Option<Code> = name.parse().ok();
    code.map_or("no verdict", Code::title)
}

/// A number that is clicked to see its results.
fn cell(ui: &mut Ui, context: &ViewContext<'_>, one: &Migration) {
    let change = VerdictChange {
        method: one.method,
        before: one.before.clone(),
        after: one.after.clone(),
    };
    let ok = verdict_name(None);
    let text = RichText::new(one.count.to_string());
    let is_chosen = context.options.verdict_change.as_ref() == Some(&change);
    let text = match (one.is_change(), one.after == ok, one.before == ok) {
        _ if is_chosen => text,
        (false, ..) => text.weak(),
        (true, true, _) => text.strong().color(theme::text(ui.visuals(), theme::TRUTH)),
        (true, _, true) => text
            .strong()
            .color(theme::text(ui.visuals(), theme::ESTIMATE)),
        (true, ..) => text.strong(),
    };
    let words = format!("{change}: {}", one.count);
    let answer = ui.add(Button::selectable(is_chosen, text).min_size(egui::vec2(34.0, 0.0)));
    answer.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &words));
    if answer
        .on_hover_text(format!("{words}. Look at these"))
        .clicked()
    {
        let wanted = (!is_chosen).then_some(change);
        context.send(Command::FilterVerdictChange(wanted));
        context.send(Command::ShowView("batch"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_in_the_order_of_the_codes_behind_ok() {
        assert_eq!(place("ok"), 0);
        let places: Vec<usize> = Code::all().iter().map(|code| place(code.name())).collect();
        assert!(places.is_sorted() && places[0] == 1);
    }

    #[test]
    fn changes_are_told_with_the_most_frequent_first() {
        let of = |before: &str, after: &str, count| Migration {
            method: Method::MI,
            before: before.to_owned(),
            after: after.to_owned(),
            count,
        };
        let all = [of("ok", "ok", 7), of("ok", "D2", 3), of("D3", "ok", 2)];
        assert_eq!(
            words(&all),
            "5 of 12 verdicts changed: MI ok → D2 3, MI D3 → ok 2"
        );
        assert_eq!(words(&all[..1]), "None of 7 verdicts changed");
    }
}
