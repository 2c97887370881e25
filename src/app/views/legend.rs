//! What the colours of a picture mean.

use egui::{Align2, Color32, Mesh, Role, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2};

use crate::palette;

/// A bar of colours from 0 to 1, with words at some of its places beneath it. `name` says what it
/// shows, with the unit.
pub(super) fn color_bar(
    ui: &mut Ui,
    width: f32,
    name: &str,
    color: impl Fn(f64) -> Color32,
    ticks: &[(f64, &str)],
) {
    const BAR: f32 = 9.0;
    const MARGIN: f32 = 12.0;
    const STEPS: u32 = 32;
    let font = TextStyle::Small.resolve(ui.style());
    let size = vec2(width, BAR + 2.0 + font.size);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    response.on_hover_text(name);
    let (left, right) = (rect.left() + MARGIN, rect.right() - MARGIN);
    let at = |share: f64| left + share as f32 * (right - left);
    let (top, bottom) = (rect.top(), rect.top() + BAR);
    let mut mesh = Mesh::default();
    for step in 0..=STEPS {
        let share = f64::from(step) / f64::from(STEPS);
        mesh.colored_vertex(pos2(at(share), top), color(share));
        mesh.colored_vertex(pos2(at(share), bottom), color(share));
        if step > 0 {
            let here = 2 * step;
            mesh.add_triangle(here - 2, here - 1, here);
            mesh.add_triangle(here, here - 1, here + 1);
        }
    }
    let painter = ui.painter();
    painter.add(mesh);
    let text = ui.visuals().text_color();
    for (share, words) in ticks {
        let x = at(*share);
        painter.vline(x, bottom - 3.0..=bottom + 2.0, (1.0, text));
        let below = pos2(x, bottom + 1.0);
        painter.text(below, Align2::CENTER_TOP, words, font.clone(), text);
    }
}

/// The bar of [`palette::depth`].
pub(super) fn depth_bar(ui: &mut Ui, width: f32) {
    let metres = [2.0, 5.0, 10.0, 20.0, 40.0, 80.0];
    let words = ["2", "5", "10", "20", "40", "80 m"];
    let ticks: Vec<(f64, &str)> = metres
        .into_iter()
        .map(palette::depth_share)
        .zip(words)
        .collect();
    let color = |share| crate::app::theme::rgb(palette::turbo(share));
    color_bar(ui, width, "depth, m", color, &ticks);
}
