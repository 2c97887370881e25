//! The batch: what many queries came to, all results in a table, and the proof of the selected one.

use egui::{
    Align2, Color32, CornerRadius, Painter, Rect, RichText, Role, Sense, Ui, UiBuilder, WidgetInfo,
    pos2, vec2,
};

use super::inspector::capital;
use super::verdicts::{split, words_of};
use super::{Panes, canvas, proof::elided};
use crate::app::App;
use crate::app::action::Action;
use crate::app::theme;
use crate::app::{Sends, ViewContext, ViewName};
use crate::diagnosis::Grade;
use crate::measure::Overview;
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
    });
    ui.add_space(4.0);
    let rows = overview.bars.len().max(overview.causes.len()).min(MAX);
    let (area, _) =
        ui.allocate_exact_size(vec2(ui.available_width(), rows as f32 * BAR + 6.0), Sense::hover());
    let (bars, causes) = area.split_left_right_at_fraction(0.5);
    draw_bars(ui, &overview, bars.with_max_x(bars.right() - 16.0));
    draw_causes(ui, &overview, causes);
    panes.show(ui, ViewName::Batch, context);
}

/// One bar for each method: right, unmeasured, wrong, no pose.
fn draw_bars(ui: &Ui, overview: &Overview, area: Rect) {
    const NAME: f32 = 64.0;
    for (row, bar) in overview.bars.iter().take(MAX).enumerate() {
        let words = Grade::ALL.iter().filter(|grade| bar.count(**grade) > 0);
        let words: Vec<String> =
            words.map(|grade| format!("{} {grade}", bar.count(*grade))).collect();
        let spoken = format!("{}: {}", bar.name, words.join(", "));
        let (painter, line) = bar_row(ui, area, row, spoken, &bar.name, NAME - 4.0);
        let width = (line.width() - NAME) / bar.total().max(1) as f32;
        let mut left = line.left() + NAME;
        for grade in Grade::ALL {
            let count = bar.count(grade);
            if count == 0 {
                continue;
            }
            let part = Rect::from_min_size(
                pos2(left, line.top()),
                vec2(width * count as f32, line.height()),
            );
            let color = theme::rgb(palette::dark(palette::grade(grade)));
            painter.rect_filled(part, CornerRadius::ZERO, color);
            let galley =
                painter.layout_no_wrap(format!("{count} {grade}"), theme::CAPTION, Color32::WHITE);
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

/// Draws the name of a row at the left, and returns where its bar goes and what paints it. Hovering shows the whole
/// row as text.
fn bar_row(
    ui: &Ui,
    area: Rect,
    row: usize,
    spoken: String,
    name: &str,
    width: f32,
) -> (Painter, Rect) {
    let top = area.top() + row as f32 * BAR;
    let line = Rect::from_min_size(pos2(area.left(), top), vec2(area.width(), BAR - 4.0));
    let id = ui.scope_id().with((area.left().to_bits(), row));
    let response = ui.interact(line, id, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &spoken));
    response.on_hover_text(spoken);
    let (painter, text) = (ui.painter_at(line), ui.visuals().text_color());
    let name = elided(ui, name, text, width);
    painter.galley(pos2(line.left(), line.center().y - name.size().y / 2.0), name, text);
    (painter, line)
}

/// The causes of all failures, in words.
fn draw_causes(ui: &Ui, overview: &Overview, area: Rect) {
    const COUNT: f32 = 36.0;
    let most = overview.causes.first().map_or(1, |(_, times)| *times);
    let names = area.width() * 0.62;
    for (row, (code, times)) in overview.causes.iter().take(MAX).enumerate() {
        let title = capital(code.title());
        let spoken = format!("{title} ({code}): {times} results");
        let (painter, line) = bar_row(ui, area, row, spoken, &title, names - 8.0);
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
