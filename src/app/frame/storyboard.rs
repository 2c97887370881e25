//! The storyboard: one row for each method, one picture for each of its stages, and a line to move inside a stage.

use std::ops::Range;

use egui::{
    Align2, Color32, Rect, RichText, Role, Sense, Stroke, StrokeKind, Ui, UiBuilder, WidgetInfo,
    pos2, vec2,
};

use super::proof::{self, elided};
use super::stage;
use crate::app::setup::Setup;
use crate::app::theme;
use crate::app::{Sends, ViewContext};
use crate::diagnosis::Grade;
use crate::event::Stage;
use crate::session::{Breakpoint, Part, RunState, Span, StageBar};

/// Width of a row's name \[points\].
const NAME: f32 = 112.0;
/// Height of the line at the bottom \[points\].
const SCRUB: f32 = 26.0;
/// The widest and the narrowest picture \[points\].
const WIDTH: std::ops::RangeInclusive<f32> = 62.0..=118.0;
/// The highest and the lowest row \[points\].
const ROW: std::ops::RangeInclusive<f32> = 28.0..=40.0;
const GAP: f32 = 5.0;
/// Above and below everything \[points\].
const MARGINS: f32 = 8.0;

/// A row: a part of the run, with the stages that have begun.
struct Row<'a> {
    part: Part,
    span: Option<&'a Span>,
    stages: Vec<&'a StageBar>,
}

/// The height that all rows of a setup take, with the line below them \[points\]. It is the same at every step.
pub(crate) fn height(setup: &Setup) -> f32 {
    let protocol = &setup.task.protocol;
    let fused = usize::from(!protocol.fusions.is_empty());
    let rows = protocol.methods.len() * (1 + fused) + usize::from(!protocol.is_by_hand());
    rows.max(1) as f32 * (ROW.end() + GAP) + SCRUB + MARGINS
}

/// Draws all rows and the line below them.
pub(crate) fn ui(ui: &mut Ui, context: &ViewContext<'_>) {
    let area = ui.available_rect_before_wrap();
    let (above, line) = area.split_top_bottom_at_y(area.bottom() - SCRUB);
    let rows = rows(context);
    let most = rows.iter().map(|row| row.stages.len() + 1).max().unwrap_or(1);
    let room = above.width() - NAME - 12.0;
    let width = (room / most as f32 - GAP).clamp(*WIDTH.start(), *WIDTH.end());
    let height = (above.height() / rows.len().max(1) as f32 - GAP).clamp(*ROW.start(), *ROW.end());
    ui.scope_builder(UiBuilder::new().max_rect(above), |ui| {
        ui.shrink_clip_rect(above);
        let area = egui::ScrollArea::both().id_salt("storyboard").auto_shrink(false);
        area.show(ui, |ui| {
            ui.spacing_mut().item_spacing = vec2(GAP, GAP);
            for row in &rows {
                ui.horizontal(|ui| draw(ui, context, row, vec2(width, height)));
            }
        });
    });
    ui.scope_builder(UiBuilder::new().max_rect(line), |ui| {
        scrub(ui, context);
    });
}

/// The rows: the choice of references, each method on the reference that is shown, its fusions.
fn rows<'a>(context: &ViewContext<'a>) -> Vec<Row<'a>> {
    let run = context.run;
    let reference = run.reference_at(context.cursor);
    let methods = context.setup.task.protocol.methods.iter();
    let own = methods.clone().map(|&method| Part::Reference(method, reference));
    let fused = methods.map(|&method| Part::Fusion(method));
    let fused = fused.filter(|part| run.span_of(*part).is_some());
    let retrieval = [Part::Retrieval].into_iter().filter(|part| run.span_of(*part).is_some());
    let parts = retrieval.chain(own).chain(fused);
    parts
        .map(|part| {
            let span = run.span_of(part);
            let stages = span.map_or(Vec::new(), |span| context.state.stages_of(span));
            Row { part, span, stages }
        })
        .collect()
}

fn draw(ui: &mut Ui, context: &ViewContext<'_>, row: &Row<'_>, size: egui::Vec2) {
    name(ui, context, row, size.y);
    let Some(span) = row.span else { return };
    let is_here = context.span().is_some_and(|here| here.records == span.records);
    let shows_why = is_here && context.options.shows_why;
    let run = context.run;
    for bar in &row.stages {
        let end = context.state.stage_end(span, bar);
        let here = bar.records.start..end + 1;
        let is_selected = is_here && !shows_why && here.contains(&context.cursor);
        let records = bar.records.start..bar.records.end.min(run.len());
        let has_failed =
            bar.succeeded == Some(false) && context.state.has_begun(bar.records.end - 1);
        // The view at the start is rendered right after the cloud has its colours.
        let shown = match bar.stage {
            Stage::Color => records.start..(records.end + 2).min(span.records.end),
            _ => records.clone(),
        };
        let caption = stage::caption(bar.stage, has_failed, &run.records()[shown.clone()]);
        let picture = context.state.shown_pictures().stage(run, &span.records, &shown);
        let cell = Cell {
            caption,
            spoken: format!("{} {}", part_name(row.part), stage::name(bar.stage)),
            picture: picture.map(|texture| (texture.id(), texture.size_vec2())),
            has_failed,
            is_selected,
            is_pale: bar.reused,
        };
        let response = cell.ui(ui, size);
        response.sends(context, move |app| app.state.move_cursor(end));
        let part = row.part;
        let stage = bar.stage;
        response.context_menu(|ui| stop_here(ui, context, part, stage.name()));
    }
    why(ui, context, row, size, shows_why);
}

/// The last picture: why the result is what it is.
fn why(ui: &mut Ui, context: &ViewContext<'_>, row: &Row<'_>, size: egui::Vec2, is_selected: bool) {
    let Some(span) = row.span else { return };
    let result = context.state.outcome(span).filter(|result| result.grade != Grade::Right);
    let Some(result) = result else { return };
    let caption = if result.is_suspect() { "why" } else { "what decided" };
    let picture = context.state.shown_pictures().proof(span.part).map(|picture| {
        let texture = proof::texture(ui, &context.state.textures, &picture.large);
        (texture.id(), texture.size_vec2())
    });
    let cell = Cell {
        spoken: format!("{} why", part_name(row.part)),
        caption: caption.to_owned(),
        picture,
        has_failed: false,
        is_selected,
        is_pale: false,
    };
    if cell.ui(ui, size).clicked() {
        let part = row.part;
        context.send(move |app| app.state.show_part(part, true));
    }
}

fn stop_here(ui: &mut Ui, context: &ViewContext<'_>, part: Part, stage: &str) {
    let breakpoint = match part.method() {
        Some(method) if !Breakpoint::is_outside(stage) => format!("{method}.{stage}"),
        _ => stage.to_owned(),
    };
    let mut texts: Vec<String> =
        context.setup.task.breakpoints.iter().map(ToString::to_string).collect();
    let known = texts.iter().position(|text| *text == breakpoint);
    let words = match known {
        Some(_) => format!("Do not stop at {breakpoint}"),
        None => format!("Stop at {breakpoint}"),
    };
    if ui.button(words).clicked() {
        match known {
            Some(place) => {
                texts.remove(place);
            }
            None => texts.push(breakpoint),
        }
        context.send(|app| app.state.set_breakpoints(texts));
        ui.close();
    }
}

/// A picture with its caption.
struct Cell {
    caption: String,
    spoken: String,
    picture: Option<(egui::TextureId, egui::Vec2)>,
    has_failed: bool,
    is_selected: bool,
    is_pale: bool,
}

impl Cell {
    fn ui(&self, ui: &mut Ui, size: egui::Vec2) -> egui::Response {
        const CAPTION: f32 = 14.0;
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let spoken = format!("{}: {}", self.spoken, self.caption);
        response
            .widget_info(|| WidgetInfo::selected(Role::Button, true, self.is_selected, &spoken));
        if !ui.is_rect_visible(rect) {
            return response;
        }
        let painter = ui.painter_at(rect.expand(2.0).intersect(ui.clip_rect()));
        painter.rect_filled(rect, 2.0, Color32::from_gray(12));
        if let Some((texture, picture)) = self.picture {
            let scale = (rect.width() / picture.x).min(rect.height() / picture.y);
            let place = Rect::from_center_size(rect.center(), picture * scale);
            let tint = Color32::WHITE.gamma_multiply(if self.is_pale { 0.6 } else { 1.0 });
            painter.image(texture, place, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), tint);
        }
        let strip = rect.with_min_y(rect.bottom() - CAPTION);
        painter.rect_filled(strip, 0.0, Color32::from_rgb(16, 17, 20));
        let words = elided(ui, &self.caption, Color32::from_gray(232), rect.width() - 6.0);
        painter.galley(strip.min + vec2(3.0, 1.0), words, Color32::WHITE);
        let frame =
            match (self.is_selected, self.has_failed, response.hovered() || response.has_focus()) {
                (true, ..) => Some((2.0, ui.visuals().strong_text_color())),
                (_, true, _) => Some((2.0, theme::ESTIMATE)),
                (.., true) => Some((1.0, theme::accent(ui.visuals()))),
                _ => None,
            };
        if let Some((width, color)) = frame {
            ui.painter().rect_stroke(rect, 2.0, Stroke::new(width, color), StrokeKind::Outside);
        }
        response.on_hover_text(spoken)
    }
}

/// `MI`, `MI fusion`, `references`.
pub(crate) fn part_name(part: Part) -> String {
    match part {
        Part::Retrieval => "references".to_owned(),
        Part::Reference(method, _) => method.label(),
        Part::Fusion(method) => format!("{} fusion", method.label()),
    }
}

fn name(ui: &mut Ui, context: &ViewContext<'_>, row: &Row<'_>, height: f32) {
    let (rect, response) = ui.allocate_exact_size(vec2(NAME, height), Sense::click());
    let run = context.run;
    let references = run.problems().len();
    let of = match row.part.reference() {
        Some(reference) if references > 1 => format!("  ref {} of {references}", reference + 1),
        _ => String::new(),
    };
    let color = row.part.method().map_or(ui.visuals().text_color(), |method| {
        theme::text(ui.visuals(), theme::method(method))
    });
    let result = row.span.and_then(|span| context.state.outcome(span));
    let (grade, grade_color) = match &result {
        Some(result) => {
            let text = result.off().unwrap_or_else(|| result.grade.to_string());
            let color = theme::grade(ui.visuals(), result.grade);
            (format!("{} {text}", result.grade.glyph()), color)
        }
        None => (String::new(), color),
    };
    let spoken = format!("Show {}{of}", part_name(row.part));
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &spoken));
    let painter = ui.painter_at(rect);
    let left = rect.left() + 4.0;
    let (upper, lower) = (rect.center().y - 7.0, rect.center().y + 8.0);
    let name = part_name(row.part);
    painter.text(pos2(left, upper), Align2::LEFT_CENTER, name, theme::BODY, color);
    let small = theme::CAPTION;
    let at =
        painter.text(pos2(left, lower), Align2::LEFT_CENTER, &grade, small.clone(), grade_color);
    let weak = ui.visuals().weak_text_color();
    painter.text(pos2(at.right(), lower), Align2::LEFT_CENTER, &of, small, weak);
    let help = if of.is_empty() { "Show what it did" } else { "Show the next reference" };
    if response.on_hover_text(help).clicked() {
        click(context, row, references);
    }
}

/// A click on a name shows the method; a second one its next reference.
fn click(context: &ViewContext<'_>, row: &Row<'_>, references: usize) {
    let here = context.span().map(|span| span.part);
    let part = match row.part {
        Part::Reference(method, reference) if here == Some(row.part) && references > 1 => {
            Part::Reference(method, (reference + 1) % references)
        }
        part => part,
    };
    context.send(move |app| app.state.show_outcome(part));
}

/// The line that moves the cursor inside the selected stage, and what the run is doing.
fn scrub(ui: &mut Ui, context: &ViewContext<'_>) {
    let run = context.run;
    let cursor = context.cursor;
    let words = status(context);
    ui.horizontal_centered(|ui| {
        let span = context.span();
        let method = span.and_then(|span| span.part.method());
        let stages = span.map_or(Vec::new(), |span| context.state.stages_of(span));
        let bar = stages.into_iter().find(|bar| bar.records.contains(&cursor));
        let title = match (span, bar) {
            (Some(span), Some(bar)) => {
                format!("{} · {}", part_name(span.part), stage::name(bar.stage))
            }
            (Some(span), None) => part_name(span.part),
            (None, _) => "No step yet".to_owned(),
        };
        let color = method.map_or(ui.visuals().weak_text_color(), theme::method);
        let size = vec2(NAME, 18.0);
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(size, layout, |ui| {
            ui.set_min_size(size);
            ui.add(egui::Label::new(RichText::new(title).size(12.0)).truncate());
        });
        let records = bar.map(|bar| bar.records.clone()).or(span.map(|span| span.records.clone()));
        let records = records.unwrap_or(0..0);
        let width = (ui.available_width() - 310.0).max(60.0);
        line(ui, context, &records, cursor, width, color);
        let position = match run.len() {
            0 => words,
            len => {
                let inside = cursor.saturating_sub(records.start) + 1;
                format!(
                    "{inside} of {} in this stage, step {cursor} of {} · {words}",
                    records.len(),
                    len - 1
                )
            }
        };
        ui.add(egui::Label::new(RichText::new(position).size(12.0)).truncate());
    });
}

fn line(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    records: &Range<usize>,
    cursor: usize,
    width: f32,
    color: Color32,
) {
    let (rect, response) = ui.allocate_exact_size(vec2(width, 18.0), Sense::click_and_drag());
    let last = records.len().saturating_sub(1);
    let here = cursor.saturating_sub(records.start).min(last);
    response.widget_info(|| WidgetInfo::slider(true, here as f64, "Step inside the stage"));
    let inside = rect.shrink2(vec2(7.0, 0.0));
    let share = if last == 0 { 1.0 } else { here as f32 / last as f32 };
    let x = inside.left() + share * inside.width();
    let painter = ui.painter_at(rect);
    let weak = ui.visuals().widgets.inactive.bg_fill;
    painter.hline(inside.x_range(), rect.center().y, Stroke::new(3.0, weak));
    painter.hline(inside.left()..=x, rect.center().y, Stroke::new(3.0, color));
    painter.circle_filled(pos2(x, rect.center().y), 6.0, ui.visuals().strong_text_color());
    if let Some(pointer) = response.interact_pointer_pos() {
        let share = ((pointer.x - inside.left()) / inside.width().max(1.0)).clamp(0.0, 1.0);
        let wanted = records.start + (share * last as f32).round() as usize;
        if wanted != cursor && !records.is_empty() {
            context.send(move |app| app.state.move_cursor(wanted));
        }
    }
    response.on_hover_text("Drag to move inside the stage (← →)");
}

/// What the run is doing, in a few words.
fn status(context: &ViewContext<'_>) -> String {
    match context.state.run_state() {
        RunState::Loading => match context.state.run().ranking {
            Some([ranked, candidates]) => format!("choosing references, {ranked} of {candidates}"),
            None => "loading".to_owned(),
        },
        RunState::Running => match &context.state.run().explaining {
            Some(explaining) => explaining.to_string(),
            None => "running".to_owned(),
        },
        RunState::Paused { breakpoint: None } => "paused".to_owned(),
        RunState::Paused { breakpoint: Some(text) } => format!("stopped at {text}"),
        RunState::Finished => "finished".to_owned(),
        RunState::Cancelled => "cancelled".to_owned(),
        RunState::Broken(_) => "stopped by an error".to_owned(),
    }
}
