//! All records of the run on one line, with a lane for each estimator.

use egui::{Align2, Color32, FontId, Rect, Sense, Slider, Stroke, StrokeKind, Ui, pos2, vec2};

use super::command::{Command, Queue};
use super::state::AppState;
use super::theme;
use crate::method::Method;
use crate::session::{Part, Run, StageBar};

/// Height of a stage's bar \[points\].
const BAR_HEIGHT: f32 = 9.0;
/// Depths that have a row of their own; deeper stages share the last.
const ROWS: usize = 3;

pub(super) fn ui(ui: &mut Ui, state: &AppState, commands: &Queue) {
    let run = state.run();
    let last = run.len().saturating_sub(1);
    ui.horizontal(|ui| {
        let mut cursor = state.cursor();
        let label = ui.label("Step");
        ui.spacing_mut().slider_width = (ui.available_width() - 420.0).max(120.0);
        let slider = ui
            .add(Slider::new(&mut cursor, 0..=last).smart_aim(false))
            .labelled_by(label.id);
        if slider.changed() {
            commands.send(Command::MoveCursor(cursor));
        }
        // A slider keeps the arrow keys once it has the focus; they are the steps' keys.
        if slider.has_focus() {
            slider.surrender_focus();
        }
        ui.label(format!("of {last}"));
        let stages: Vec<_> = run
            .stages_at(state.cursor())
            .map(|bar| bar.stage.name())
            .collect();
        ui.monospace(stages.join(" › "));
    });
    lanes(ui, state, commands);
}

fn lanes(ui: &mut Ui, state: &AppState, commands: &Queue) {
    let run = state.run();
    let height = BAR_HEIGHT * ROWS as f32 + 16.0;
    let size = vec2(ui.available_width(), height);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let count = run.len().max(1) as f32;
    let x_of = |record: usize| rect.left() + rect.width() * record as f32 / count;
    response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Stages of the run"));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    // Who hides the future shows no stage that has not begun.
    let end = match state.options.hides_future {
        true => state.cursor() + 1,
        false => usize::MAX,
    };
    for span in run.spans().iter().filter(|span| span.records.start < end) {
        let name = name_of(run, span.part);
        let (left, right) = (x_of(span.records.start), x_of(span.records.end));
        let top = pos2(left + 3.0, rect.top() + 1.0);
        if right - left > 20.0 {
            let color = ui.visuals().text_color();
            painter.text(
                top,
                Align2::LEFT_TOP,
                name,
                FontId::proportional(10.0),
                color,
            );
        }
    }
    for bar in run.stages().iter().filter(|bar| bar.records.start < end) {
        let is_over = bar.records.end <= end;
        let shown = StageBar {
            records: bar.records.start..bar.records.end.min(end),
            succeeded: bar.succeeded.filter(|_| is_over),
            ..bar.clone()
        };
        draw(ui, &painter, &shown, rect, x_of);
    }
    let x = x_of(state.cursor()) + 0.5 * rect.width() / count;
    let color = ui.visuals().strong_text_color();
    painter.vline(x, rect.y_range(), Stroke::new(2.0, color));

    if let Some(pointer) = response.interact_pointer_pos() {
        let record = ((pointer.x - rect.left()) / rect.width() * count).max(0.0) as usize;
        commands.send(Command::MoveCursor(record));
    } else if let Some(pointer) = response.hover_pos() {
        let record = ((pointer.x - rect.left()) / rect.width() * count).max(0.0) as usize;
        response.on_hover_text_at_pointer(words_at(run, record));
    }
}

/// The estimator, with the number of its reference where there are several.
fn name_of(run: &Run, part: Part) -> String {
    let problems = run
        .loaded
        .as_ref()
        .map_or(0, |loaded| loaded.problems.len());
    let upper = |method: Method| method.name().to_uppercase();
    match part {
        Part::Retrieval => "retrieval".to_owned(),
        Part::Reference(method, _) if problems < 2 => upper(method),
        Part::Reference(method, reference) => format!("{} {}", upper(method), reference + 1),
        Part::Fusion(method) => format!("{} fusion", upper(method)),
    }
}

fn draw(ui: &Ui, painter: &egui::Painter, bar: &StageBar, rect: Rect, x_of: impl Fn(usize) -> f32) {
    let row = bar.depth.clamp(1, ROWS) - 1;
    let top = rect.top() + 13.0 + BAR_HEIGHT * row as f32;
    let (left, right) = (x_of(bar.records.start), x_of(bar.records.end));
    let area = Rect::from_min_max(
        pos2(left, top),
        pos2(right.max(left + 1.0), top + BAR_HEIGHT - 1.0),
    );
    let color = color_of(bar);
    if bar.reused {
        // Remembered results are outlined, those made now are filled.
        painter.rect_stroke(area, 1.0, Stroke::new(1.0, color), StrokeKind::Inside);
    } else {
        painter.rect_filled(area, 1.0, color);
    }
    if bar.succeeded == Some(false) {
        let text = ui.visuals().strong_text_color();
        let font = FontId::proportional(10.0);
        painter.text(area.right_center(), Align2::RIGHT_CENTER, "×", font, text);
    }
}

fn color_of(bar: &StageBar) -> Color32 {
    use crate::event::Stage;
    match (bar.stage, bar.succeeded) {
        (_, Some(false)) => theme::ESTIMATE,
        (Stage::Estimator(method), _) => theme::method(method),
        (Stage::Detect | Stage::Color, _) => Color32::from_rgb(0x6A, 0x8C, 0xAF),
        (Stage::Descend | Stage::SearchCoarse | Stage::RefinePlane | Stage::RefineSix, _)
        | (Stage::Retrieve | Stage::Match | Stage::MatchGuided | Stage::Search(_), _) => {
            Color32::from_rgb(0x8F, 0xA8, 0x6E)
        }
        (Stage::DepthLift, _) => Color32::from_rgb(0xB0, 0x9A, 0x5B),
        (Stage::Consensus, _) => Color32::from_rgb(0x9A, 0x7F, 0xB0),
        (Stage::Accept | Stage::Judge | Stage::Assess | Stage::Fuse, _) => {
            Color32::from_rgb(0x5F, 0x9E, 0x8F)
        }
    }
}

fn words_at(run: &Run, record: usize) -> String {
    let stages: Vec<_> = run
        .stages_at(record)
        .map(|bar| {
            let remark = match (bar.reused, bar.succeeded) {
                (true, _) => " (reused)",
                (_, Some(false)) => " (failed)",
                _ => "",
            };
            format!("{}{remark}", bar.stage.name())
        })
        .collect();
    format!("step {record}: {}", stages.join(" › "))
}
