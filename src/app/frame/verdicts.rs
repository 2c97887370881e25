//! The verdict bar: the grade of each method's result, and the selected one in one sentence.

use egui::{
    Align, AtomExt as _, Button, Layout, Rect, Role, Sense, Stroke, Ui, UiBuilder, WidgetInfo,
    pos2, vec2,
};

use super::proof::elided;
use super::storyboard::part_name;
use crate::app::action::Action;
use crate::app::lecture;
use crate::app::theme;
use crate::app::{Sends, ViewContext};
use crate::diagnosis::{Confidence, confidence};
use crate::localize::QueryResult;
use crate::session::{Part, RunState, Span};
use crate::text::first_sentence;

/// Width of a cell, of one among more than four, and of the button \[points\].
const CELL: f32 = 128.0;
const NARROW_CELL: f32 = 92.0;
const BUTTON: f32 = 190.0;
/// What to press while the run waits.
const HINT: &str =
    "Space runs the query to its end, I steps into the next event, ? lists all keys.";

/// Draws the cells, the sentence and the remedy.
pub(crate) fn ui(ui: &mut Ui, context: &ViewContext<'_>) {
    let area = ui.available_rect_before_wrap();
    let methods = &context.setup.task.protocol.methods;
    let width = if methods.len() > 4 { NARROW_CELL } else { CELL };
    let mut left = area.left();
    for &method in methods {
        let rect = Rect::from_min_size(pos2(left, area.top()), vec2(width, area.height()));
        let span = context.state.deciding_span(method);
        let part = span.map_or(Part::Reference(method, 0), |span| span.part);
        cell(ui, context, rect, part, span);
        left += width;
    }
    let rest = Rect::from_min_max(pos2(left + 12.0, area.top()), area.max);
    let (words, button) = rest.split_left_right_at_x(rest.right() - BUTTON);
    let span = context.span();
    let result = span.and_then(|span| context.state.outcome(span));
    let layout = Layout::top_down(Align::Min);
    ui.scope_builder(
        UiBuilder::new().max_rect(words.shrink2(vec2(0.0, 4.0))).layout(layout),
        |ui| {
            let (first, second) = sentence(context, span, result.as_ref());
            ui.spacing_mut().item_spacing.y = 1.0;
            let strong = ui.visuals().strong_text_color();
            let rows = lines(ui, &first, egui::FontId::proportional(15.0), strong, 2);
            if !second.is_empty() {
                let weak = ui.visuals().weak_text_color();
                lines(ui, &second, theme::BODY, weak, if rows > 1 { 1 } else { 2 });
            }
        },
    );
    ui.scope_builder(
        UiBuilder::new()
            .max_rect(button.shrink2(vec2(8.0, 16.0)))
            .layout(Layout::right_to_left(Align::Center)),
        |ui| {
            if let Some(result) = result.filter(|result| result.grade.is_failure()) {
                remedy(ui, context, &result);
            }
        },
    );
    ui.advance_cursor_after_rect(area);
}

/// A text in at most so many lines, whole on hover. How many it takes.
fn lines(ui: &mut Ui, text: &str, font: egui::FontId, color: egui::Color32, most: usize) -> usize {
    let mut job = egui::text::LayoutJob::simple(text.to_owned(), font, color, ui.available_width());
    job.wrap.max_rows = most;
    let galley = ui.fonts_mut(|fonts| fonts.layout_job(job));
    let (rect, response) = ui.allocate_exact_size(galley.size(), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, text));
    let rows = galley.rows.len();
    ui.painter().galley(rect.min, galley, color);
    response.on_hover_text(text);
    rows
}

fn cell(ui: &Ui, context: &ViewContext<'_>, rect: Rect, part: Part, span: Option<&Span>) {
    let response = ui.interact(rect, ui.scope_id().with(("verdict", part)), Sense::click());
    let result = span.and_then(|span| context.state.shown_result(span));
    let is_here = context.span().is_some_and(|here| here.part.method() == part.method());
    let painter = ui.painter_at(rect);
    if is_here || response.hovered() {
        painter.rect_filled(rect, 0.0, ui.visuals().widgets.inactive.weak_bg_fill);
    }
    let Some(method) = part.method() else { return };
    painter.hline(rect.x_range(), rect.top() + 1.5, Stroke::new(3.0, theme::method(method)));
    painter.vline(
        rect.right() - 0.5,
        rect.y_range(),
        ui.visuals().widgets.noninteractive.bg_stroke,
    );
    let color = theme::text(ui.visuals(), theme::method(method));
    let name = painter.layout_no_wrap(part_name(part), theme::STRONG, color);
    painter.galley(rect.min + vec2(10.0, 12.0), name, color);
    let (words, color) = match &result {
        Some(result) => worth(ui, result),
        None => (waiting(context, part).to_owned(), ui.visuals().weak_text_color()),
    };
    let galley = elided(ui, &words, color, rect.width() - 14.0);
    painter.galley(rect.min + vec2(10.0, 34.0), galley, color);
    let spoken = format!("{}: {words}", part_name(part));
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_here, &spoken));
    let help = match context.state.known_result(part).filter(|_| result.is_none()) {
        Some(known) => format!("{spoken}. An earlier run found: {}", known.words()),
        None => spoken.clone(),
    };
    response.on_hover_text(help).sends(context, move |app| app.state.show_outcome(part));
}

/// The grade with the error, or the confidence where there is no grade.
fn worth(ui: &Ui, result: &QueryResult) -> (String, egui::Color32) {
    let color = theme::grade(ui.visuals(), result.grade);
    let words = match (result.off(), &result.confidence) {
        (Some(off), _) => format!("{} {} {off}", result.grade.glyph(), result.grade),
        (None, Some(known)) if result.pose.is_some() => {
            let low = if known.word == Confidence::Low { "◆ " } else { "" };
            format!("{low}{} likely right", confidence::percent(known.probability))
        }
        _ => match &result.opinion {
            Some(opinion) => format!("{} {}", opinion.standing.glyph(), opinion.standing),
            None => format!("{} {}", result.grade.glyph(), result.grade),
        },
    };
    (words, color)
}

fn waiting(context: &ViewContext<'_>, part: Part) -> &'static str {
    match context.run.span_of(part) {
        Some(_) => context.state.run_state().of_what_has_begun(),
        None => "not run yet",
    }
}

/// The sentence of what is selected, and the one below it.
fn sentence(
    context: &ViewContext<'_>,
    span: Option<&Span>,
    result: Option<&QueryResult>,
) -> (String, String) {
    let Some(span) = span else {
        return match context.state.run_state() {
            RunState::Loading => {
                ("The photos and the cloud are being read.".to_owned(), String::new())
            }
            RunState::Broken(why) => (why.clone(), String::new()),
            _ => (HINT.to_owned(), String::new()),
        };
    };
    let Some(result) = result else {
        let first = format!(
            "{} is {}.",
            part_name(span.part),
            context.state.run_state().of_what_has_begun()
        );
        let is_waiting = matches!(context.state.run_state(), RunState::Paused { .. });
        if is_waiting && context.state.run().results().next().is_none() {
            return (first, HINT.to_owned());
        }
        let latest = lecture::latest(context.run, span, context.cursor);
        return (first, latest.unwrap_or_default());
    };
    split(&words_of(result))
}

/// What a result is, in its own words: its verdict, or why it has no pose, or what speaks for it.
pub(super) fn words_of(result: &QueryResult) -> String {
    match (result.diagnosis.first(), &result.reason) {
        (Some(found), _) => found.text.clone(),
        (None, Some(reason)) => reason.text.clone(),
        (None, None) => result.evidence(),
    }
}

/// The first sentence, and the others; without the marks of code, which a page would show.
pub(crate) fn split(text: &str) -> (String, String) {
    let text = text.replace('`', "");
    let (first, others) = first_sentence(&text);
    (first.to_owned(), others.to_owned())
}

/// What a remedy changes, without the names of common options: `mi6`, `grid.rounds=2`.
pub(super) fn short(args: &[String]) -> String {
    let values = args.iter().map(String::as_str).filter(|arg| !["--set", "--method"].contains(arg));
    values.collect::<Vec<_>>().join(" ")
}

/// The best of what helped, or the offer to look for it; always of the same width. Where it does not fit, the words end
/// with an ellipsis, and the number stays.
fn remedy(ui: &mut Ui, context: &ViewContext<'_>, result: &QueryResult) {
    let size = vec2(BUTTON - 16.0, 30.0);
    let explaining = context.state.run().explaining;
    let explaining = explaining.filter(|explaining| explaining.method == result.method);
    let can_explain = result.error.or(result.initial_error).is_some();
    let is_offered = can_explain && context.setup.task.protocol.explain == 0;
    let (mut number, mut args) = (String::new(), None);
    let (text, help) = match (&result.explanation, explaining) {
        (Some(explanation), _) => match explanation.best() {
            Some(helped) => {
                number = format!(" → {}", context.in_unit(&helped.error.translation()));
                args = Some(helped.args.clone());
                let all = helped.args.join(" ");
                let help = format!("Keeps this run as A and runs the query with {all}");
                (format!("Try {}", short(&helped.args)), help)
            }
            None => (format!("None of {} remedies helped", explanation.runs), String::new()),
        },
        (None, Some(explaining)) => {
            let (tried, all) = (explaining.tried, explaining.remedies);
            (format!("Trying {tried} of {all} …"), String::new())
        }
        (None, None) if is_offered => (
            "Try what would help".to_owned(),
            const { Action::named("Try what would have helped") }.tooltip(ui.ctx()),
        ),
        (None, None) => return,
    };
    let whole = format!("{text}{number}");
    let button = Button::new((text.atom_shrink(true), number)).gap(0.0).truncate();
    let button = button.min_size(size).fill(theme::selected(ui.visuals()));
    let mut response = ui.add_enabled(!help.is_empty(), button).accessible_name(whole);
    if !help.is_empty() {
        response = response.on_hover_text(help);
    }
    response.sends(context, move |app| match args {
        Some(args) => app.state.try_again(&args),
        None => app.state.switch_explaining(),
    });
}
