//! A proof picture on the canvas.

use egui::{
    Align2, Color32, FontId, Pos2, Rect, Role, Sense, Shape, Stroke, TextureHandle, Ui, WidgetInfo,
    pos2, vec2,
};

use crate::app::textures::{Textures, color_image};
use crate::app::theme;
use crate::app::views::legend::paint_mark;
use crate::palette;
use crate::proof::{
    ColorScale, MARK, Mark, Panel, Place, ProofPicture, Thing, free_corner, label_place, title_end,
};

/// Draws a proof into the room there is. The large panel takes the place of a small one that is clicked, which is
/// returned.
pub(super) fn ui(
    ui: &mut Ui,
    textures: &Textures,
    proof: &ProofPicture,
    mut swapped: Option<usize>,
) -> Option<usize> {
    let area = ui.available_rect_before_wrap();
    let shown = match swapped {
        Some(small) => proof.swapped(small),
        None => proof.clone(),
    };
    let places = shown.places(area.width(), area.height());
    for (index, (panel, place)) in shown.panels().zip(&places).enumerate() {
        let rect = on_screen(area, place);
        let response = ui.interact(rect, ui.scope_id().with(("panel", index)), Sense::click());
        let title = panel.title.clone();
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &title));
        let end = area.left() + title_end(place, &places, area.width());
        draw(ui, textures, panel, rect, end);
        let first_small = 1 + usize::from(shown.below.is_some());
        if let Some(small) = index.checked_sub(first_small) {
            let response = response.on_hover_text("Click to show this large");
            if response.hovered() {
                let stroke = Stroke::new(1.0, theme::accent(ui.visuals()));
                ui.painter().rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Outside);
            }
            if response.clicked() {
                // The one that was large before stands in the place of the one that is large now.
                swapped = Some(small).filter(|_| swapped != Some(small));
            }
        }
    }
    ui.advance_cursor_after_rect(area);
    swapped
}

/// The picture of a panel on the graphics card.
pub(super) fn texture(ui: &Ui, textures: &Textures, panel: &Panel) -> TextureHandle {
    textures.of(ui.ctx(), "proof", &panel.picture, |picture| color_image(&picture.clone().into()))
}

fn on_screen(area: Rect, place: &Place) -> Rect {
    let corner = area.min + vec2(place.left, place.top);
    Rect::from_min_size(corner, vec2(place.width, place.height))
}

fn draw(ui: &Ui, textures: &Textures, panel: &Panel, rect: Rect, title_end: f32) {
    let words = ui.visuals().text_color();
    let title = pos2(rect.left(), rect.top() - 3.0);
    let galley = elided(ui, &panel.title, words, title_end - rect.left());
    ui.painter().galley(title - vec2(0.0, galley.size().y), galley, words);
    let texture = texture(ui, textures, panel);
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    let painter = ui.painter_at(rect.expand(1.0).intersect(ui.clip_rect()));
    painter.image(texture.id(), rect, whole, Color32::WHITE);
    let scale = rect.size() / vec2(panel.picture.width() as f32, panel.picture.height() as f32);
    let at = |point: [f32; 2]| rect.min + vec2(point[0], point[1]) * scale;
    for line in &panel.lines {
        let points = line.points.iter().map(|point| at(*point)).collect();
        painter.add(Shape::line(points, Stroke::new(line.width, theme::rgb(line.color))));
    }
    for mark in &panel.marks {
        paint_mark(&painter, mark.thing, at(mark.at), MARK);
    }
    let marks = || panel.marks.iter().map(|mark| (mark, at(mark.at)));
    let colors = panel.scale.as_ref();
    let taken = colors.map(|colors| color_scale(&painter, colors, rect, marks().map(|(_, at)| at)));
    labels(&painter, marks(), rect, taken, scale.min_elem());
}

/// Labels beside their marks, inside the panel, none upon another. Words have a place among others in the picture, so they
/// shrink with it.
fn labels<'a>(
    painter: &egui::Painter,
    marks: impl Iterator<Item = (&'a Mark, Pos2)>,
    panel: Rect,
    taken: Option<Rect>,
    scale: f32,
) {
    const MARGIN: egui::Vec2 = vec2(3.0, 1.0);
    /// Smaller words cannot be read.
    const LEAST: f32 = 0.7;
    let small = FontId { size: theme::CAPTION.size * scale.clamp(LEAST, 1.0), ..theme::CAPTION };
    let within = place_of(panel);
    let mut taken: Vec<Place> = taken.into_iter().map(place_of).collect();
    for (mark, at) in marks.filter(|(mark, _)| !mark.label.is_empty()) {
        let font = if mark.thing == Thing::Words { small.clone() } else { theme::CAPTION };
        let galley = painter.layout_no_wrap(mark.label.clone(), font, Color32::WHITE);
        let size = galley.size();
        if mark.thing == Thing::Words {
            painter.galley(at - vec2(0.0, size.y / 2.0), galley, Color32::WHITE);
            continue;
        }
        let size = size + 2.0 * MARGIN;
        let place = label_place([at.x, at.y], size.into(), &within, &mut taken);
        let rect = Rect::from_min_size(pos2(place.left, place.top), size);
        if (rect.center().y - at.y).abs() > size.y {
            let end = pos2(at.x.clamp(rect.left(), rect.right()), rect.center().y);
            painter.line_segment([at, end], Stroke::new(1.0, Color32::from_gray(200)));
        }
        painter.rect_filled(rect, 2.0, Color32::from_black_alpha(190));
        painter.galley(rect.min + MARGIN, galley, Color32::WHITE);
    }
}

fn place_of(rect: Rect) -> Place {
    Place { left: rect.left(), top: rect.top(), width: rect.width(), height: rect.height() }
}

/// What the colours mean, in a corner without a mark. Where it is.
fn color_scale(
    painter: &egui::Painter,
    scale: &ColorScale,
    panel: Rect,
    marks: impl Iterator<Item = Pos2> + Clone,
) -> Rect {
    const BAR: egui::Vec2 = vec2(90.0, 12.0);
    const STEPS: usize = 45;
    let galley =
        |words: &str| painter.layout_no_wrap(words.to_owned(), theme::CAPTION, Color32::WHITE);
    let (dark, bright) = (galley(&scale.dark), galley(&scale.bright));
    let width = dark.size().x + bright.size().x + BAR.x + 20.0;
    let size = vec2(width, 18.0);
    let [left, top] = free_corner(&place_of(panel), size.into(), marks.map(|at| [at.x, at.y]));
    let corner = pos2(left, top);
    let ground = Rect::from_min_size(corner, size);
    painter.rect_filled(ground, 2.0, Color32::from_black_alpha(190));
    let start = corner + vec2(dark.size().x + 10.0, 3.0);
    for step in 0..STEPS {
        let color = theme::rgb(palette::viridis((step as f64 + 0.5) / STEPS as f64));
        let wide = BAR.x / STEPS as f32;
        let rect =
            Rect::from_min_size(start + vec2(step as f32 * wide, 0.0), vec2(wide + 0.5, BAR.y));
        painter.rect_filled(rect, 0.0, color);
    }
    let after = start + vec2(BAR.x + 5.0, -1.0);
    painter.galley(corner + vec2(5.0, 2.0), dark, Color32::WHITE);
    painter.galley(after, bright, Color32::WHITE);
    ground
}

/// Words in one line that ends with an ellipsis where they do not fit.
pub(super) fn elided(
    ui: &Ui,
    words: &str,
    color: Color32,
    width: f32,
) -> std::sync::Arc<egui::Galley> {
    let mut job = egui::text::LayoutJob::simple_singleline(words.to_owned(), theme::CAPTION, color);
    job.wrap = egui::text::TextWrapping::truncate_at_width(width.max(1.0));
    ui.fonts_mut(|fonts| fonts.layout_job(job))
}

/// A message in the middle of the place where a picture will be.
pub(super) fn empty(ui: &mut Ui, words: &str) {
    let rect = ui.available_rect_before_wrap();
    let color = ui.visuals().weak_text_color();
    let response = ui.allocate_rect(rect, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, words));
    ui.painter().text(
        rect.center(),
        Align2::CENTER_CENTER,
        words,
        egui::FontId::proportional(15.0),
        color,
    );
}
