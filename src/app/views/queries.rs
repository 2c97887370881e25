//! All queries with what is known of them.

use egui::{Color32, RichText, ScrollArea, Ui};

use super::View;
use super::thumbnail::{THUMBNAIL, thumbnail};
use crate::app::desk::has_failed;
use crate::app::{Command, Scope, theme};
use crate::estimator;
use crate::event::Side;
use crate::localize::QueryResult;

/// The list of queries.
#[derive(Default)]
pub struct QueryList {
    only_failures: bool,
}

impl View for QueryList {
    fn ui(&mut self, ui: &mut Ui, scope: &Scope<'_>) {
        let desk = scope.desk;
        ui.horizontal(|ui| {
            let (text, help) = match desk.queries.progress() {
                Some((done, all)) => (format!("Stop ({done} of {all})"), "Stop"),
                None => (
                    "Run all".to_owned(),
                    "Localise all queries, to know which fail",
                ),
            };
            if ui.button(text).on_hover_text(help).clicked() {
                scope.send(Command::RunAllQueries);
            }
            ui.checkbox(&mut self.only_failures, "Failures only");
            let failed = desk
                .results
                .values()
                .filter(|results| results.iter().any(has_failed))
                .count();
            ui.weak(format!("{failed} of {} failed", desk.results.len()));
        });
        let shown: Vec<usize> = desk
            .setup
            .offered
            .iter()
            .copied()
            .filter(|query| {
                let results = desk.results.get(query);
                !self.only_failures || results.is_some_and(|results| results.iter().any(has_failed))
            })
            .collect();
        ScrollArea::vertical().auto_shrink(false).show_rows(
            ui,
            THUMBNAIL.y,
            shown.len(),
            |ui, rows| {
                for &query in &shown[rows] {
                    row(ui, scope, query);
                }
            },
        );
    }
}

fn row(ui: &mut Ui, scope: &Scope<'_>, query: usize) {
    let desk = scope.desk;
    let name = &desk.setup.queries.frames()[query];
    let is_here = query == desk.setup.query;
    ui.horizontal(|ui| {
        thumbnail(ui, desk, Side::Query, query);
        ui.vertical(|ui| {
            let text = RichText::new(name).monospace();
            if ui.selectable_label(is_here, text).clicked() {
                scope.send(Command::SelectQuery(query));
            }
            let results = desk.results.get(&query).map_or(&[][..], Vec::as_slice);
            ui.horizontal(|ui| dots(ui, results, desk.shows_truth));
        });
    });
}

/// One mark per method: what it is tells the shape too.
pub(super) fn dots(ui: &mut Ui, results: &[QueryResult], shows_truth: bool) {
    ui.spacing_mut().item_spacing.x = 2.0;
    for method in estimator::methods() {
        for result in results.iter().filter(|r| r.method == method) {
            let (mark, color, words) = match (&result.reason, &result.error) {
                (Some(reason), _) => ("×", theme::ESTIMATE, reason.text.clone()),
                (None, Some(error)) if has_failed(result) => (
                    "▲",
                    Color32::from_rgb(0xE6, 0x9F, 0x00),
                    format!("{:.1} m off", error.translation_m),
                ),
                (None, Some(error)) => (
                    "●",
                    theme::TRUTH,
                    format!("{:.2} m off", error.translation_m),
                ),
                (None, None) => ("●", theme::REFERENCE, "a pose".to_owned()),
            };
            let words = match shows_truth {
                true => format!("{}: {words}", method.name()),
                false => method.name().to_owned(),
            };
            ui.label(RichText::new(mark).color(color))
                .on_hover_text(words);
        }
    }
}
