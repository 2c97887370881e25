//! The batch: what many queries came to, all results in a table, and the proof of the selected one.

use egui::{
    Align2, Color32, CornerRadius, Painter, Rect, Response, RichText, Role, Sense, Ui, UiBuilder,
    WidgetInfo, pos2, vec2,
};

use super::inspector::capital;
use super::verdicts::{split, words_of};
use super::{Panes, canvas, proof::elided};
use crate::app::App;
use crate::app::action::Action;
use crate::app::theme;
use crate::app::{Sends, ViewContext, ViewName};
use crate::diagnosis::Grade;
use crate::measure::{Bar, Overview};
use crate::opinion::Standing;
use crate::palette;

/// Height of a bar with its gap \[points\].
const BAR: f32 = 22.0;
/// Bars and causes that are drawn, at most.
const MAX: usize = 8;

pub(crate) fn left(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes) {
    let overview = context.state.results.overview(context.options.shows_truth);
    ui.add_space(4.0);
    for finding in &overview.findings {
        let color = theme::text(ui.visuals(), theme::ESTIMATE);
        ui.label(RichText::new(&finding.text).size(15.0).color(color));
    }
    ui.horizontal_wrapped(|ui| {
        let headline =
            RichText::new(&overview.headline).size(15.0).color(ui.visuals().strong_text_color());
        ui.label(headline);
        let (text, help) = match context.state.queries.progress() {
            Some((done, all)) => (format!("Stop ({done} of {all})"), "Stop"),
            None => ("Run all".to_owned(), "Localise all queries, to know which fail"),
        };
        ui.button(text)
            .on_hover_text(help)
            .sends(context, const { Action::named("Run all queries, or stop") }.run);
        let mut known = context.state.results.keys();
        if context.state.queries.progress().is_none()
            && known.any(|query| context.state.is_unexplained(*query))
        {
            ui.button("Explain all failures")
                .on_hover_text("Localise each failed query again in other ways, to know what mends most of them")
                .sends(context, const { Action::named("Explain all failures") }.run);
        }
    });
    for remark in &overview.remarks {
        ui.label(remark);
    }
    ui.add_space(4.0);
    let rows = overview.bars.len().max(overview.causes.len()).min(MAX);
    let (area, _) =
        ui.allocate_exact_size(vec2(ui.available_width(), rows as f32 * BAR + 6.0), Sense::hover());
    let (bars, causes) = area.split_left_right_at_fraction(0.5);
    draw_bars(ui, context, &overview, bars.with_max_x(bars.right() - 16.0));
    draw_causes(ui, context, &overview, causes);
    panes.show(ui, ViewName::Batch, context);
}

/// The parts of a bar: what it counts, its colour, and the count. Poses of other systems that nothing measures are
/// counted by their second opinions.
fn parts(bar: &Bar) -> Vec<(&'static str, palette::Rgb, usize)> {
    let has_opinions = bar.opinions.iter().any(|count| *count > 0);
    let of_grade = |grade: Grade| (grade.word(), palette::grade(grade), bar.count(grade));
    let parts: Vec<_> = if has_opinions && bar.count(Grade::Unmeasured) > 0 {
        let color = |standing| match standing {
            Standing::Confirmed => palette::TRUTH,
            Standing::Contradicted => palette::ESTIMATE,
            Standing::Undecided => palette::NO_POSE,
        };
        let opinions = Standing::ALL.into_iter().zip(bar.opinions);
        let opinions = opinions.map(|(one, count)| (one.word(), color(one), count));
        opinions.chain([of_grade(Grade::NoPose)]).collect()
    } else {
        Grade::ALL.map(of_grade).to_vec()
    };
    parts.into_iter().filter(|(_, _, count)| *count > 0).collect()
}

/// One bar for each method: right, unmeasured, wrong, no pose. A click filters by the method.
fn draw_bars(ui: &Ui, context: &ViewContext<'_>, overview: &Overview, area: Rect) {
    const NAME: f32 = 64.0;
    for (row, bar) in overview.bars.iter().take(MAX).enumerate() {
        let parts = parts(bar);
        let words: Vec<String> =
            parts.iter().map(|(what, _, count)| format!("{count} {what}")).collect();
        let spoken = format!("{}: {}", bar.name, words.join(", "));
        let (painter, line, response) = bar_row(ui, area, row, spoken, &bar.name, NAME - 4.0);
        // The fusion is not part of the method.
        let method = bar.name.split(' ').next().unwrap_or_default();
        filter_by(context, &response, format!("method = {method}"));
        let width = (line.width() - NAME) / bar.total().max(1) as f32;
        let mut left = line.left() + NAME;
        for (what, color, count) in parts {
            let part = Rect::from_min_size(
                pos2(left, line.top()),
                vec2(width * count as f32, line.height()),
            );
            painter.rect_filled(part, CornerRadius::ZERO, theme::rgb(palette::dark(color)));
            let galley =
                painter.layout_no_wrap(format!("{count} {what}"), theme::CAPTION, Color32::WHITE);
            let galley = if galley.size().x + 6.0 <= part.width() {
                galley
            } else {
                painter.layout_no_wrap(count.to_string(), theme::CAPTION, Color32::WHITE)
            };
            if galley.size().x + 4.0 <= part.width() {
                painter.galley(part.center() - galley.size() / 2.0, galley, Color32::WHITE);
            }
            left = part.right();
        }
    }
}

/// Shows only the results that meet a condition once it was clicked, and all of them after the next click.
fn filter_by(context: &ViewContext<'_>, response: &Response, condition: String) {
    response.sends(context, move |app| {
        let filter = &mut app.state.options.results_filter;
        *filter = if *filter == condition { String::new() } else { condition };
    });
}

/// Draws the name of a row at the left, and returns where its bar goes and what paints it. Hovering shows the whole
/// row as text, and it can be clicked.
fn bar_row(
    ui: &Ui,
    area: Rect,
    row: usize,
    spoken: String,
    name: &str,
    width: f32,
) -> (Painter, Rect, Response) {
    let top = area.top() + row as f32 * BAR;
    let line = Rect::from_min_size(pos2(area.left(), top), vec2(area.width(), BAR - 4.0));
    let id = ui.scope_id().with((area.left().to_bits(), row));
    let response = ui.interact(line, id, Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &spoken));
    let response = response.on_hover_text(spoken);
    let (painter, text) = (ui.painter_at(line), ui.visuals().text_color());
    let name = elided(ui, name, text, width);
    painter.galley(pos2(line.left(), line.center().y - name.size().y / 2.0), name, text);
    (painter, line, response)
}

/// The causes of all failures, in words. A click filters by one.
fn draw_causes(ui: &Ui, context: &ViewContext<'_>, overview: &Overview, area: Rect) {
    const COUNT: f32 = 36.0;
    let most = overview.causes.first().map_or(1, |(_, times)| *times);
    let names = area.width() * 0.62;
    for (row, (code, times)) in overview.causes.iter().take(MAX).enumerate() {
        let title = capital(code.title());
        let spoken = format!("{title} ({code}): {times} results");
        let (painter, line, response) = bar_row(ui, area, row, spoken, &title, names - 8.0);
        filter_by(context, &response, format!("code = {code}"));
        let longest = area.width() - names - COUNT;
        let bar = Rect::from_min_size(
            pos2(line.left() + names, line.top() + 2.0),
            vec2((longest * *times as f32 / most as f32).max(2.0), line.height() - 4.0),
        );
        painter.rect_filled(bar, 1.0, theme::ESTIMATE);
        painter.text(
            bar.right_center() + vec2(6.0, 0.0),
            Align2::LEFT_CENTER,
            times,
            theme::CAPTION,
            ui.visuals().text_color(),
        );
    }
}

/// The selected result: its name, its sentence, its proof, and one plot below.
pub(crate) fn right(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes) {
    let area = ui.available_rect_before_wrap();
    let (upper, lower) = area.split_top_bottom_at_fraction(0.56);
    ui.scope_builder(UiBuilder::new().max_rect(upper), |ui| {
        ui.shrink_clip_rect(upper);
        let span = context.span();
        match &span.and_then(|span| context.state.outcome(span)) {
            Some(result) => {
                let error = result.off().map_or(String::new(), |off| format!(" · {off} off"));
                ui.strong(format!("{} · {}{error}", result.query, result.method.label()));
                let text = words_of(result);
                ui.add(egui::Label::new(split(&text).0).truncate()).on_hover_text(&text);
            }
            None => {
                ui.weak("Select a result in the table.");
            }
        }
        ui.horizontal(|ui| {
            let open = ui.button("Open in Inspect");
            open.on_hover_text("Show this query at its proof picture (Enter)")
                .sends(context, App::open_selected);
        });
        match span.map(|span| span.part) {
            Some(part) if context.state.needs_why(part) => canvas::why(ui, context, panes),
            _ => canvas::ui(ui, context, panes, 1),
        }
    });
    let lower = lower.with_min_y(lower.top() + 8.0);
    ui.scope_builder(UiBuilder::new().max_rect(lower), |ui| {
        ui.shrink_clip_rect(lower);
        panes.show(ui, ViewName::Charts, context);
    });
    ui.advance_cursor_after_rect(area);
}
