//! All records of the run on one line, by their number or by the clock, with a bar for each stage.

use std::time::Duration;

use egui::{Align2, Color32, Rect, Sense, Slider, Stroke, StrokeKind, Ui, pos2, vec2};

use super::command::{Command, Queue};
use super::state::AppState;
use super::theme;
use crate::event::Stage;
use crate::method::Method;
use crate::session::{Part, Run, StageBar};

/// Height of a stage's bar \[points\].
const BAR_HEIGHT: f32 = 13.0;
/// Room for the names of the parts above the bars \[points\].
const NAMES_HEIGHT: f32 = 14.0;
/// Depths that have a row of their own; deeper stages share the last.
const ROWS: usize = 3;
/// The least part of a run that is shown.
const CLOSEST: f64 = 1e-3;

/// What lies along the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Axis {
    #[default]
    Events,
    Time,
}

/// How somebody looks at the line.
pub(super) struct Timeline {
    axis: Axis,
    /// The part of the run that is shown, as shares of all of it.
    shown: [f64; 2],
    /// Where the cursor was, which is kept in sight when it goes elsewhere.
    cursor: usize,
}

impl Default for Timeline {
    fn default() -> Self {
        Self {
            axis: Axis::default(),
            shown: [0.0, 1.0],
            cursor: 0,
        }
    }
}

impl Timeline {
    pub(super) fn ui(&mut self, ui: &mut Ui, state: &AppState, commands: &Queue) {
        self.keep_in_sight(state);
        self.head(ui, state, commands);
        self.lanes(ui, state, commands);
    }

    fn head(&mut self, ui: &mut Ui, state: &AppState, commands: &Queue) {
        let run = state.run();
        let last = run.len().saturating_sub(1);
        ui.horizontal(|ui| {
            let mut cursor = state.cursor();
            let label = ui.label("Step");
            ui.spacing_mut().slider_width = (ui.available_width() - 620.0).max(120.0);
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
            for (axis, name, help) in [
                (Axis::Events, "By events", "Every event has the same room"),
                (
                    Axis::Time,
                    "By time",
                    "Events lie where they were told by the clock, without the time that was waited",
                ),
            ] {
                let answer = ui.selectable_value(&mut self.axis, axis, name);
                if answer.on_hover_text(help).clicked() {
                    self.shown = [0.0, 1.0];
                }
            }
            let is_zoomed = self.shown != [0.0, 1.0];
            let whole = ui.add_enabled(is_zoomed, egui::Button::new("Whole run"));
            let help = "Wheel over the bars: zoom; Shift and wheel: pan; double click: the whole run";
            if whole.on_hover_text(help).on_disabled_hover_text(help).clicked() {
                self.shown = [0.0, 1.0];
            }
            let stages: Vec<_> = run
                .stages_at(state.cursor())
                .map(|bar| bar.stage.name())
                .collect();
            ui.add(egui::Label::new(egui::RichText::new(stages.join(" › ")).monospace()).truncate());
        });
    }

    fn lanes(&mut self, ui: &mut Ui, state: &AppState, commands: &Queue) {
        let run = state.run();
        let height = BAR_HEIGHT * ROWS as f32 + NAMES_HEIGHT + 2.0;
        let size = vec2(ui.available_width(), height);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let share = |at: f32| f64::from((at - rect.left()) / rect.width());
        if let Some(pointer) = response.hover_pos() {
            let wheel = ui.input(|input| input.smooth_scroll_delta);
            let zoom = ui.input(|input| input.zoom_delta());
            let factor = (-f64::from(wheel.y) / 200.0).exp() / f64::from(zoom);
            self.zoom(self.inside(share(pointer.x)), factor);
            let width = self.shown[1] - self.shown[0];
            self.pan(-f64::from(wheel.x / rect.width()) * width);
        }
        if response.double_clicked() {
            self.shown = [0.0, 1.0];
        }
        let place = Place {
            run,
            axis: self.axis,
            shown: self.shown,
            rect,
        };
        response.widget_info(|| {
            let words = format!("Stages of the run, {}", self.words(run));
            egui::WidgetInfo::labeled(egui::Role::Slider, true, words)
        });
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        // Who hides the future shows no stage that has not begun.
        let end = if state.options.hides_future {
            state.cursor() + 1
        } else {
            usize::MAX
        };
        for span in run.spans().iter().filter(|span| span.records.start < end) {
            let (left, right) = (place.begin(span.records.start), place.end(span.records.end));
            let left = left.max(rect.left());
            let color = ui.visuals().text_color();
            let name = name_of(run, span.part);
            let galley = painter.layout_no_wrap(name, theme::small(), color);
            if galley.size().x + 6.0 <= right.min(rect.right()) - left {
                painter.galley(pos2(left + 3.0, rect.top() + 1.0), galley, color);
            }
        }
        for bar in run.stages().iter().filter(|bar| bar.records.start < end) {
            let is_over = bar.records.end <= end;
            let shown = StageBar {
                records: bar.records.start..bar.records.end.min(end),
                succeeded: bar.succeeded.filter(|_| is_over),
                ..bar.clone()
            };
            draw(ui, &painter, &shown, &place);
        }
        let color = ui.visuals().strong_text_color();
        let x = place.middle(state.cursor());
        painter.vline(x, rect.y_range(), Stroke::new(2.0, color));

        if let Some(pointer) = response.interact_pointer_pos() {
            let record = place.record(pointer.x);
            // Obeyed already, it is where the cursor is.
            if record != state.cursor() {
                commands.send(Command::MoveCursor(record));
            }
        } else if let Some(pointer) = response.hover_pos() {
            let record = place.record(pointer.x);
            response.on_hover_text_at_pointer(words_at(run, record));
        }
    }

    /// The share of the whole run at a share of what is shown.
    fn inside(&self, share: f64) -> f64 {
        let [from, to] = self.shown;
        from + share * (to - from)
    }

    /// Shows less of the run, or more, with a share of it where it is.
    fn zoom(&mut self, about: f64, factor: f64) {
        if factor == 1.0 {
            return;
        }
        let [from, to] = self.shown;
        let width = ((to - from) * factor).clamp(CLOSEST, 1.0);
        let kept = (about - from) / (to - from);
        let from = (about - kept * width).clamp(0.0, 1.0 - width);
        self.shown = [from, from + width];
    }

    /// Goes on by a share of the run.
    fn pan(&mut self, by: f64) {
        let [from, to] = self.shown;
        let width = to - from;
        let from = (from + by).clamp(0.0, 1.0 - width);
        self.shown = [from, from + width];
    }

    /// Follows a cursor that has left what is shown.
    fn keep_in_sight(&mut self, state: &AppState) {
        let cursor = state.cursor();
        if cursor == self.cursor {
            return;
        }
        self.cursor = cursor;
        let at = share_of(state.run(), self.axis, cursor);
        let [from, to] = self.shown;
        if at < from || at > to {
            self.pan(at - 0.5 * (from + to));
        }
    }

    /// What lies along the line, in words.
    fn words(&self, run: &Run) -> String {
        let last = run.len().saturating_sub(1);
        let [from, to] = self.shown;
        match self.axis {
            Axis::Events => {
                let at = |share: f64| (share * last as f64).round();
                format!("events {} to {}", at(from), at(to))
            }
            Axis::Time => {
                let all = run.worked_until(last).as_secs_f64();
                format!("{:.2} s to {:.2} s", from * all, to * all)
            }
        }
    }
}

/// Where the middle of a record is, as a share of the run.
fn share_of(run: &Run, axis: Axis, record: usize) -> f64 {
    match axis {
        Axis::Events => (record as f64 + 0.5) / run.len().max(1) as f64,
        Axis::Time => share_of_time(run, record),
    }
}

fn share_of_time(run: &Run, record: usize) -> f64 {
    let all = run.worked_until(usize::MAX).as_secs_f64();
    if all > 0.0 {
        run.worked_until(record).as_secs_f64() / all
    } else {
        0.0
    }
}

/// Where records are on the screen.
struct Place<'a> {
    run: &'a Run,
    axis: Axis,
    shown: [f64; 2],
    rect: Rect,
}

impl Place<'_> {
    fn x(&self, share: f64) -> f32 {
        let [from, to] = self.shown;
        self.rect.left() + self.rect.width() * ((share - from) / (to - from)) as f32
    }

    fn by_count(&self, records: f64) -> f32 {
        self.x(records / self.run.len().max(1) as f64)
    }

    /// Where something begins whose first record this is.
    fn begin(&self, record: usize) -> f32 {
        match self.axis {
            Axis::Events => self.by_count(record as f64),
            Axis::Time => self.x(share_of_time(self.run, record)),
        }
    }

    /// Where something ends whose last record is before this one.
    fn end(&self, record: usize) -> f32 {
        match self.axis {
            Axis::Events => self.by_count(record as f64),
            Axis::Time => self.x(share_of_time(self.run, record.saturating_sub(1))),
        }
    }

    fn middle(&self, record: usize) -> f32 {
        self.x(share_of(self.run, self.axis, record))
    }

    /// The record at a place of the screen.
    fn record(&self, x: f32) -> usize {
        let [from, to] = self.shown;
        let share = f64::from((x - self.rect.left()) / self.rect.width());
        let share = (from + share * (to - from)).clamp(0.0, 1.0);
        let last = self.run.len().saturating_sub(1);
        match self.axis {
            Axis::Events => ((share * self.run.len() as f64) as usize).min(last),
            Axis::Time => {
                let all = self.run.worked_until(last).as_secs_f64();
                self.run.record_at(Duration::from_secs_f64(share * all))
            }
        }
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

fn draw(ui: &Ui, painter: &egui::Painter, bar: &StageBar, place: &Place<'_>) {
    let rect = place.rect;
    let row = bar.depth.clamp(1, ROWS) - 1;
    let top = rect.top() + NAMES_HEIGHT + BAR_HEIGHT * row as f32;
    let (left, right) = (place.begin(bar.records.start), place.end(bar.records.end));
    if right < rect.left() || left > rect.right() {
        return;
    }
    let area = Rect::from_min_max(
        pos2(left, top),
        pos2(right.max(left + 1.0), top + BAR_HEIGHT - 1.0),
    );
    let color = color_of(bar);
    let mut text_color = theme::on(color);
    if bar.reused {
        // Remembered results are outlined, those made now are filled.
        painter.rect_stroke(area, 1.0, Stroke::new(1.0, color), StrokeKind::Inside);
        text_color = ui.visuals().text_color();
    } else {
        painter.rect_filled(area, 1.0, color);
    }
    let seen = area.intersect(rect);
    let galley = painter.layout_no_wrap(bar.stage.name().to_owned(), theme::small(), text_color);
    if galley.size().x + 6.0 <= seen.width() {
        let at = pos2(seen.left() + 3.0, seen.center().y - 0.5 * galley.size().y);
        painter.galley(at, galley, text_color);
    }
    if bar.succeeded == Some(false) {
        let at = seen.right_center();
        painter.text(at, Align2::RIGHT_CENTER, "×", theme::small(), text_color);
    }
}

fn color_of(bar: &StageBar) -> Color32 {
    match (bar.stage, bar.succeeded) {
        (_, Some(false)) => theme::ESTIMATE,
        (Stage::Estimator(method), _) => theme::method(method),
        (Stage::Detect | Stage::Color, _) => theme::STAGE_PREPARE,
        (
            Stage::Descend
            | Stage::SearchCoarse
            | Stage::RefinePlane
            | Stage::RefineSix
            | Stage::Retrieve
            | Stage::Match
            | Stage::MatchGuided
            | Stage::Search(_),
            _,
        ) => theme::STAGE_SEARCH,
        (Stage::DepthLift, _) => theme::STAGE_LIFT,
        (Stage::Consensus, _) => theme::STAGE_CONSENSUS,
        (Stage::Accept | Stage::Judge | Stage::Assess | Stage::Fuse, _) => theme::STAGE_JUDGE,
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
    let time = run.worked_until(record).as_secs_f64();
    format!("step {record}, {time:.2} s: {}", stages.join(" › "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zooming_keeps_what_is_under_the_pointer_and_ends_at_the_whole_run() {
        let mut line = Timeline::default();
        line.zoom(0.25, 0.5);
        assert_eq!(line.shown, [0.125, 0.625]);
        assert_eq!(line.inside(0.25), 0.25);
        line.pan(1.0);
        assert_eq!(line.shown, [0.5, 1.0]);
        line.zoom(0.75, 100.0);
        assert_eq!(line.shown, [0.0, 1.0]);
        line.zoom(0.0, 1e-9);
        assert_eq!(line.shown, [0.0, CLOSEST]);
    }
}
