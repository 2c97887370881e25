//! All queries with what is known of them.

use std::collections::BTreeSet;

use egui::{RichText, ScrollArea, Ui};

use super::View;
use super::in_sight::bring_to_the_middle;
use super::thumbnail::{THUMBNAIL, thumbnail};
use crate::app::{Command, ViewContext, theme};
use crate::event::Side;
use crate::localize::QueryResult;
use crate::method::Method;

/// The list of queries.
#[derive(Default)]
pub struct QueriesView {
    only_failures: bool,
    /// The query that was brought into sight.
    in_sight: Option<usize>,
}

impl View for QueriesView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        ui.horizontal(|ui| {
            let (text, help) = match context.queries.progress() {
                Some((done, all)) => (format!("Stop ({done} of {all})"), "Stop"),
                None => (
                    "Run all".to_owned(),
                    "Localise all queries, to know which fail",
                ),
            };
            if ui.button(text).on_hover_text(help).clicked() {
                context.send(Command::RunAllQueries);
            }
            ui.checkbox(&mut self.only_failures, "Failures only");
            let failed = context
                .results
                .keys()
                .filter(|query| context.has_failed(**query));
            let failed = failed.count();
            let words = format!("{failed} of {} failed", context.results.len());
            let help = "A query counts whose answer is wrong or missing by one method at least";
            ui.weak(words).on_hover_text(help);
        });
        let shown: Vec<usize> = context
            .setup
            .offered
            .iter()
            .copied()
            .filter(|query| !self.only_failures || context.has_failed(*query))
            .collect();
        let is_new = self.in_sight != Some(context.setup.query);
        self.in_sight = Some(context.setup.query);
        let area = ScrollArea::vertical().auto_shrink(false);
        area.show_rows(ui, THUMBNAIL.y, shown.len(), |ui, rows| {
            let place = shown.iter().position(|query| *query == context.setup.query);
            if let Some(place) = place.filter(|_| is_new) {
                bring_to_the_middle(ui, rows.start, place, THUMBNAIL.y);
            }
            for &query in &shown[rows] {
                row(ui, context, query);
            }
        });
    }
}

fn row(ui: &mut Ui, context: &ViewContext<'_>, query: usize) {
    let name = &context.setup.queries.frames()[query];
    let is_here = query == context.setup.query;
    ui.horizontal(|ui| {
        thumbnail(ui, context, Side::Query, query);
        ui.vertical(|ui| {
            let text = RichText::new(name).monospace();
            if ui.selectable_label(is_here, text).clicked() {
                context.send(Command::SelectQuery(query));
            }
            let results = context.results.get(&query).map_or(&[][..], Vec::as_slice);
            ui.horizontal(|ui| dots(ui, context, results));
        });
    });
}

/// One mark per method: what it is tells the shape too.
pub(super) fn dots(ui: &mut Ui, context: &ViewContext<'_>, results: &[QueryResult]) {
    let shows_truth = context.options.shows_truth;
    ui.spacing_mut().item_spacing.x = 2.0;
    let methods: BTreeSet<Method> = results.iter().map(|result| result.method).collect();
    for method in methods {
        for result in results.iter().filter(|r| r.method == method) {
            // As the card says it.
            let grade = result.grade_shown(shows_truth);
            let color = theme::grade(ui.visuals(), grade);
            let error = result.error.filter(|_| shows_truth);
            let error = error.map_or(String::new(), |error| format!(", {error}"));
            ui.label(RichText::new(grade.glyph()).color(color))
                .on_hover_text(format!("{}: {grade}{error}", method.label()));
        }
    }
}
