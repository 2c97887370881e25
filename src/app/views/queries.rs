//! All queries with what is known of them.

use std::collections::BTreeSet;

use egui::style::ScrollAnimation;
use egui::{Align, Color32, Rect, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};

use super::View;
use crate::app::text_field::text_field;
use crate::app::{Sends, ViewContext, theme};
use crate::diagnosis::Grade;
use crate::event::Side;
use crate::localize::QueryResult;
use crate::method::Method;

/// Height of a name below its picture \[points\].
const NAME: f32 = 20.0;

/// The list of queries.
#[derive(Default)]
pub struct QueriesView {
    only_failures: bool,
    typed: String,
    /// The query that was brought into sight.
    in_sight: Option<usize>,
}

impl View for QueriesView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let field = egui::TextEdit::singleline(&mut self.typed).hint_text("Filter");
        let (field, _) = text_field(ui, field.desired_width(f32::INFINITY));
        field.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Filter queries"));
        let failed = context.state.results.keys().filter(|query| context.state.has_failed(**query));
        let failed = failed.count();
        let run = context.state.results.len();
        let is_measured = |one: &QueryResult| one.grade != Grade::Unmeasured;
        let words = if run == 0 || context.state.results.values().flatten().any(is_measured) {
            format!("{failed} of {run} failed")
        } else if failed > 0 {
            format!("{failed} of {run} contradicted")
        } else {
            format!("{run} run, none measured")
        };
        let only = ui.checkbox(&mut self.only_failures, words);
        only.on_hover_text("Only queries where at least one method is wrong or found no pose");
        let frames = context.setup.queries.frames();
        let is_shown = |query: &usize| {
            frames[*query].contains(self.typed.trim())
                && (!self.only_failures || context.state.has_failed(*query))
        };
        let offered = context.setup.offered.iter().copied();
        let shown: Vec<usize> = offered.filter(is_shown).collect();
        if shown.is_empty() {
            ui.weak("No query matches the filter.");
        }
        let is_new = self.in_sight != Some(context.setup.query);
        self.in_sight = Some(context.setup.query);
        let height = 0.31 * ui.available_width() + NAME;
        let area = ScrollArea::vertical().auto_shrink(false);
        area.show_rows(ui, height, shown.len(), |ui, rows| {
            let place = shown.iter().position(|query| *query == context.setup.query);
            if let Some(place) = place.filter(|_| is_new) {
                bring_to_the_middle(ui, rows.start, place, height);
            }
            for &query in &shown[rows] {
                row(ui, context, query, height);
            }
        });
    }
}

/// Scrolls the rows that are drawn from `first` on, so that one is in the middle, as far as there are rows on either
/// side; `height` is that of a row alone \[points\].
///
/// The offset of a scroll area could be set too, but egui limits it to the size that the contents had before.
fn bring_to_the_middle(ui: &Ui, first: usize, row: usize, height: f32) {
    let step = height + ui.spacing().item_spacing.y;
    let top = ui.max_rect().top() + (row as f32 - first as f32) * step;
    let place = Rect::from_min_size(pos2(ui.max_rect().left(), top), vec2(1.0, height));
    ui.scroll_to_rect_animation(place, Some(Align::Center), ScrollAnimation::none());
}

/// The thumbnail, below it the name and one mark for each method.
fn row(ui: &mut Ui, context: &ViewContext<'_>, query: usize, height: f32) {
    let name = &context.setup.queries.frames()[query];
    let is_here = query == context.setup.query;
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_here, name));
    let painter = ui.painter_at(rect);
    if is_here || response.hovered() {
        let ground = if is_here {
            theme::selected(ui.visuals())
        } else {
            ui.visuals().widgets.inactive.weak_bg_fill
        };
        painter.rect_filled(rect, 2.0, ground);
    }
    let (picture, below) = rect.split_top_bottom_at_y(rect.bottom() - NAME);
    if let Some(texture) = context.state.frame_picture(Side::Query, query) {
        let size = texture.size_vec2();
        let room = picture.shrink(2.0);
        let place = Rect::from_center_size(room.center(), size * (room.size() / size).min_elem());
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), place, whole, Color32::WHITE);
    }
    let results = context.state.results.get(&query).map_or(&[][..], Vec::as_slice);
    let marks: Vec<_> = grades(context, results).collect();
    let color =
        if is_here { ui.visuals().selection.stroke.color } else { ui.visuals().text_color() };
    let left = pos2(below.left() + 4.0, below.center().y);
    painter.text(left, egui::Align2::LEFT_CENTER, name, theme::CAPTION, color);
    let mut right = below.right() - 4.0;
    for (glyph, color, _) in marks.iter().rev() {
        let at = pos2(right, below.center().y);
        // On the ground of what is selected the shape alone says the grade.
        let color = if is_here { ui.visuals().selection.stroke.color } else { *color };
        right =
            painter.text(at, egui::Align2::RIGHT_CENTER, glyph, theme::CAPTION, color).left() - 1.0;
    }
    let words: Vec<&str> = marks.iter().map(|(.., words)| words.as_str()).collect();
    let response = match words.as_slice() {
        [] => response,
        words => response.on_hover_text(words.join("\n")),
    };
    response.sends(context, move |app| app.state.select_query(query));
}

/// One mark for each result, with its colour and its words.
fn grades<'a>(
    context: &'a ViewContext<'_>,
    results: &'a [QueryResult],
) -> impl Iterator<Item = (&'static str, Color32, String)> + 'a {
    let shows_truth = context.options.shows_truth;
    let methods: BTreeSet<Method> = results.iter().map(|result| result.method).collect();
    let of_method = move |method| results.iter().filter(move |result| result.method == method);
    methods.into_iter().flat_map(of_method).map(move |result| {
        let grade = result.grade_shown(shows_truth);
        let error = result.error.filter(|_| shows_truth);
        let error = error.map_or(String::new(), |error| format!(", {error}"));
        let words = format!("{}: {grade}{error}", result.method.label());
        (grade.glyph(), theme::grade(&context.state.ctx.global_style().visuals, grade), words)
    })
}

/// One mark for each result, in a row.
pub(super) fn dots(ui: &mut Ui, context: &ViewContext<'_>, results: &[QueryResult]) {
    ui.spacing_mut().item_spacing.x = 2.0;
    for (glyph, color, words) in grades(context, results) {
        ui.label(egui::RichText::new(glyph).color(color)).on_hover_text(words);
    }
}
