//! What is written over the picture: cameras, metres, colour bars.

use egui::text::LayoutJob;
use egui::{
    Align2, Color32, CornerRadius, Pos2, Rect, Role, Sense, Stroke, TextFormat, Ui, Vec2,
    WidgetInfo, vec2,
};

use super::cameras::{CameraKind, SceneCamera};
use super::ground::GridLabel;
use super::view_camera::ViewCamera;
use crate::app::theme;

/// Labels of cameras, none over another; a click on one answers with its camera.
pub(super) fn cameras(
    ui: &Ui,
    pane: Rect,
    view_camera: &ViewCamera,
    cameras: &[SceneCamera],
) -> Option<CameraKind> {
    let seen = |camera: &SceneCamera| {
        let at = view_camera.project(&camera.centre())? + pane.min.to_vec2();
        pane.shrink(4.0).contains(at).then_some(at)
    };
    let mut shown: Vec<(Pos2, &SceneCamera)> = cameras
        .iter()
        .filter_map(|camera| Some((seen(camera)?, camera)))
        .collect();
    shown.sort_by(|a, b| a.0.y.total_cmp(&b.0.y));
    let mut taken: Vec<Rect> = Vec::new();
    let mut clicked = None;
    for (at, camera) in shown {
        let galley = ui.painter().layout_job(name(ui, camera));
        let size = galley.size() + vec2(8.0, 4.0);
        let mut place = Rect::from_min_size(at + vec2(9.0, -0.5 * size.y), size);
        place = inside(place, pane);
        while let Some(other) = taken.iter().find(|other| other.intersects(place)) {
            place = place.translate(vec2(0.0, other.bottom() - place.top() + 1.0));
        }
        taken.push(place);
        let response = ui.interact(
            place,
            ui.scope_id().with(camera.kind.name()),
            Sense::click(),
        );
        let words = format!("{}: {}", camera.kind.name(), camera.about);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &words));
        let visuals = ui.visuals();
        let painter = ui.painter_at(pane);
        let color = camera.color;
        painter.line_segment([at, place.left_center()], Stroke::new(1.0, color));
        painter.circle_filled(at, 2.5, color);
        let fill = visuals.window_fill.gamma_multiply(0.85);
        let border = if response.hovered() {
            visuals.strong_text_color()
        } else {
            color
        };
        painter.rect(
            place,
            CornerRadius::same(3),
            fill,
            Stroke::new(1.0, border),
            egui::StrokeKind::Inside,
        );
        painter.galley(place.min + vec2(4.0, 2.0), galley, visuals.text_color());
        let response = response.on_hover_text(format!("{words}\nClick to look through it"));
        if response.clicked() {
            clicked = Some(camera.kind);
        }
    }
    clicked
}

fn name(ui: &Ui, camera: &SceneCamera) -> LayoutJob {
    let format = |color| TextFormat::simple(theme::label(), color);
    let mut job = LayoutJob::default();
    let shape = camera.kind.shape();
    let own = theme::text(ui.visuals(), camera.color);
    job.append(shape, 0.0, format(own));
    let color = ui.visuals().strong_text_color();
    job.append(&camera.kind.name(), 4.0, format(color));
    job
}

fn inside(place: Rect, pane: Rect) -> Rect {
    let right = (place.right() - pane.right()).max(0.0);
    let left = (pane.left() - place.left()).max(0.0);
    place.translate(vec2(left - right, 0.0))
}

/// The metres of the grid; those that would lie over another are left out.
pub(super) fn marks(ui: &Ui, pane: Rect, view_camera: &ViewCamera, marks: &[GridLabel]) {
    let painter = ui.painter_at(pane);
    let mut taken: Vec<Rect> = Vec::new();
    for mark in marks {
        let Some(at) = view_camera.project(&mark.at) else {
            continue;
        };
        let at = at + pane.min.to_vec2();
        let color = ui.visuals().text_color();
        let font = theme::caption();
        let galley = painter.layout_no_wrap(mark.text.clone(), font, color);
        let place = Rect::from_min_size(at + vec2(3.0, 1.0), galley.size());
        if pane.contains_rect(place) && !taken.iter().any(|other| other.intersects(place)) {
            let ground = ui.visuals().extreme_bg_color.gamma_multiply(0.6);
            painter.rect_filled(place.expand(1.0), CornerRadius::same(2), ground);
            painter.galley(place.min, galley, color);
            taken.push(place.expand(2.0));
        }
    }
}

/// A colour map with the values at its ends.
pub(super) struct Bar {
    pub(super) title: String,
    pub(super) ends: [String; 2],
    pub(super) color: fn(f64) -> Color32,
}

/// Colour maps and lines of words in the lower left corner.
pub(super) fn legend(ui: &Ui, pane: Rect, bars: &[Bar], words: &[(String, Color32)]) {
    const BAR: Vec2 = vec2(90.0, 8.0);
    let painter = ui.painter_at(pane);
    let text = ui.visuals().text_color();
    let font = theme::caption();
    let line = 15.0;
    let mut bottom = pane.left_bottom() + vec2(8.0, -6.0);
    let written = |at: Pos2, words: &str, color: Color32| {
        let galley = painter.layout_no_wrap(words.to_owned(), font.clone(), color);
        let place = Align2::LEFT_BOTTOM.anchor_size(at, galley.size());
        let ground = ui.visuals().extreme_bg_color.gamma_multiply(0.6);
        painter.rect_filled(place.expand(1.0), CornerRadius::same(2), ground);
        painter.galley(place.min, galley, color);
        place.right()
    };
    for (words, color) in words.iter().rev() {
        written(bottom, words, theme::text(ui.visuals(), *color));
        bottom.y -= line;
    }
    for bar in bars.iter().rev() {
        let right = written(bottom, &bar.ends[0], text) + 5.0;
        let place = Rect::from_min_size(Pos2::new(right, bottom.y - 11.0), BAR);
        const STEPS: u32 = 30;
        let width = BAR.x / STEPS as f32;
        for step in 0..STEPS {
            let share = (f64::from(step) + 0.5) / f64::from(STEPS);
            let left = place.left() + width * step as f32;
            let piece = Rect::from_min_size(Pos2::new(left, place.top()), vec2(width, BAR.y));
            painter.rect_filled(piece, CornerRadius::ZERO, (bar.color)(share));
        }
        let at = Pos2::new(place.right() + 5.0, bottom.y);
        written(at, &format!("{} {}", bar.ends[1], bar.title), text);
        bottom.y -= line;
    }
}

/// A line in the upper left corner.
pub(super) fn headline(ui: &Ui, pane: Rect, words: &str) {
    let painter = ui.painter_at(pane);
    let color = ui.visuals().strong_text_color();
    let galley = painter.layout(words.to_owned(), theme::label(), color, pane.width() - 16.0);
    let place = Rect::from_min_size(pane.min + vec2(8.0, 6.0), galley.size());
    let ground = ui.visuals().extreme_bg_color.gamma_multiply(0.6);
    painter.rect_filled(place.expand(2.0), CornerRadius::same(2), ground);
    painter.galley(place.min, galley, color);
}
