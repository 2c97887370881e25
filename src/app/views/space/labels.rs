//! What is written over the picture: the cameras, and a line in a corner.

use egui::{CornerRadius, Pos2, Rect, Role, Sense, Stroke, Ui, WidgetInfo, vec2};

use super::cameras::{CameraKind, SceneCamera};
use super::view_camera::ViewCamera;
use crate::app::theme;
use crate::app::views::legend::paint_mark;

/// Marks and labels of cameras, no label over another. Returns the camera whose label is clicked.
pub(super) fn cameras(
    ui: &Ui,
    pane: Rect,
    view_camera: &ViewCamera,
    cameras: &[SceneCamera],
) -> Option<CameraKind> {
    const RADIUS: f32 = 8.0;
    let seen = |camera: &SceneCamera| {
        let at = view_camera.project(&camera.centre())? + pane.min.to_vec2();
        pane.shrink(4.0).contains(at).then_some(at)
    };
    let painter = ui.painter_at(pane);
    let shown = cameras.iter();
    let mut shown: Vec<(Pos2, &SceneCamera)> =
        shown.filter_map(|camera| Some((seen(camera)?, camera))).collect();
    // The truth last, so that nothing hides it.
    shown.sort_by_key(|(_, camera)| camera.kind == CameraKind::Truth);
    for (at, camera) in &shown {
        paint_mark(&painter, camera.thing, *at, RADIUS);
    }
    shown.sort_by(|a, b| a.0.y.total_cmp(&b.0.y));
    let mut taken: Vec<Rect> = Vec::new();
    let mut clicked = None;
    for (at, camera) in shown {
        let visuals = ui.visuals();
        let color = visuals.strong_text_color();
        let galley = painter.layout_no_wrap(camera.kind.name(), theme::LABEL, color);
        let size = galley.size() + vec2(24.0, 4.0);
        let corner = at + vec2(12.0, -0.5 * size.y);
        let mut place = inside(Rect::from_min_size(corner, size), pane);
        while let Some(other) = taken.iter().find(|other| other.intersects(place)) {
            place = place.translate(vec2(0.0, other.bottom() - place.top() + 1.0));
        }
        taken.push(place);
        let id = ui.scope_id().with(camera.kind.name());
        let response = ui.interact(place, id, Sense::click());
        let words = format!("{}: {}", camera.kind.name(), camera.about);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &words));
        let own = theme::rgb(camera.thing.color());
        let border = if response.hovered() { color } else { own };
        painter.line_segment([at, place.left_center()], Stroke::new(1.0, own));
        painter.rect(
            place,
            CornerRadius::same(3),
            visuals.window_fill.gamma_multiply(0.85),
            Stroke::new(1.0, border),
            egui::StrokeKind::Inside,
        );
        let mark = place.left_center() + vec2(10.0, 0.0);
        paint_mark(&painter, camera.thing, mark, 4.5);
        painter.galley(place.min + vec2(20.0, 2.0), galley, color);
        let response = response.on_hover_text(format!("{words}\nClick to look through it"));
        if response.clicked() {
            clicked = Some(camera.kind);
        }
    }
    clicked
}

fn inside(place: Rect, pane: Rect) -> Rect {
    let right = (place.right() - pane.right()).max(0.0);
    let left = (pane.left() - place.left()).max(0.0);
    place.translate(vec2(left - right, 0.0))
}

/// A line in the upper left corner.
pub(super) fn headline(ui: &Ui, pane: Rect, words: &str) {
    let painter = ui.painter_at(pane);
    let color = ui.visuals().strong_text_color();
    // The menu is on the right.
    let galley = painter.layout(words.to_owned(), theme::LABEL, color, pane.width() - 80.0);
    let place = Rect::from_min_size(pane.min + vec2(8.0, 6.0), galley.size());
    let ground = ui.visuals().extreme_bg_color.gamma_multiply(0.6);
    painter.rect_filled(place.expand(2.0), CornerRadius::same(2), ground);
    painter.galley(place.min, galley, color);
}
