//! What is written over the picture: cameras, metres, the legend.

use egui::{
    Align, Color32, CornerRadius, Layout, Pos2, Rect, RichText, Role, Sense, Shape, Stroke, Ui,
    UiBuilder, WidgetInfo, vec2,
};

use super::cameras::{CameraKind, SceneCamera};
use super::ground::GridLabel;
use super::rays::{Rays, inlier_color, outlier_color};
use super::view_camera::ViewCamera;
use crate::app::theme;
use crate::app::views::legend::{cost_bar, paint_mark};

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
        let galley = painter.layout_no_wrap(camera.kind.name(), theme::label(), color);
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

/// The metres of the grid; a number that would cover another is omitted.
pub(super) fn metres(ui: &Ui, pane: Rect, view_camera: &ViewCamera, labels: &[GridLabel]) {
    let painter = ui.painter_at(pane);
    let mut taken: Vec<Rect> = Vec::new();
    for label in labels {
        let Some(at) = view_camera.project(&label.at) else {
            continue;
        };
        let at = at + pane.min.to_vec2();
        let color = ui.visuals().text_color();
        let galley = painter.layout_no_wrap(label.text.clone(), theme::caption(), color);
        let place = Rect::from_min_size(at + vec2(3.0, 1.0), galley.size());
        if pane.contains_rect(place) && !taken.iter().any(|other| other.intersects(place)) {
            let ground = ui.visuals().extreme_bg_color.gamma_multiply(0.6);
            painter.rect_filled(place.expand(1.0), CornerRadius::same(2), ground);
            painter.galley(place.min, galley, color);
            taken.push(place.expand(2.0));
        }
    }
}

/// The colours of the costs and of the rays, in the lower left corner.
pub(super) fn legend(ui: &mut Ui, pane: Rect, cost: Option<(&str, [String; 2])>, rays: &Rays) {
    const BAR: f32 = 150.0;
    let corner = UiBuilder::new()
        .max_rect(pane.shrink2(vec2(8.0, 6.0)))
        .layout(Layout::bottom_up(Align::LEFT));
    let mut ui = ui.new_child(corner);
    ui.spacing_mut().item_spacing.y = 2.0;
    let ground = ui.painter().add(Shape::Noop);
    let line = |ui: &mut Ui, words: String, color: Color32| {
        let color = theme::text(ui.visuals(), color);
        let text = RichText::new(words).font(theme::caption()).color(color);
        ui.add(egui::Label::new(text).selectable(false));
    };
    if rays.inliers + rays.outliers > 0 {
        line(&mut ui, format!("- - {} outliers", rays.outliers), outlier_color());
        line(&mut ui, format!("–– {} inliers", rays.inliers), inlier_color());
    }
    if rays.undecided > 0 {
        line(&mut ui, format!("–– {} lifted matches", rays.undecided), theme::CAMERA);
    }
    if let Some((method, ends)) = cost {
        cost_bar(&mut ui, BAR, "cost", &ends);
        let text = ui.visuals().text_color();
        line(&mut ui, format!("cost of {method} (grey: below the coverage floor)"), text);
    }
    if ui.min_rect().height() > 1.0 {
        let fill = ui.visuals().extreme_bg_color.gamma_multiply(0.75);
        let place = ui.min_rect().expand(3.0);
        let ground_shape = Shape::rect_filled(place, CornerRadius::same(2), fill);
        ui.painter().set(ground, ground_shape);
    }
}

/// A line in the upper left corner.
pub(super) fn headline(ui: &Ui, pane: Rect, words: &str) {
    let painter = ui.painter_at(pane);
    let color = ui.visuals().strong_text_color();
    // The menu is on the right.
    let galley = painter.layout(words.to_owned(), theme::label(), color, pane.width() - 80.0);
    let place = Rect::from_min_size(pane.min + vec2(8.0, 6.0), galley.size());
    let ground = ui.visuals().extreme_bg_color.gamma_multiply(0.6);
    painter.rect_filled(place.expand(2.0), CornerRadius::same(2), ground);
    painter.galley(place.min, galley, color);
}
