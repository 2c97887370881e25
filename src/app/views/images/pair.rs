//! Two photos beside or above each other, which are zoomed and moved together.

use std::sync::Arc;

use egui::{Color32, Rect, Response, Sense, TextureHandle, Ui, Vec2, pos2, vec2};

use super::GAP;
use crate::app::ViewContext;
use crate::app::textures::color_image;
use crate::app::views::canvas::{self, PanZoom, Placement};
use crate::app::views::legend::name_picture;
use crate::image::Photo;
use crate::picture;

/// A photo on the graphics card.
pub(crate) fn photo(ui: &Ui, context: &ViewContext<'_>, source: &Arc<Photo>) -> TextureHandle {
    context
        .state
        .textures
        .of(ui.ctx(), "photo", source, |photo| color_image(&picture::photo(photo)))
}

/// Where the query's and the reference's photo are, and what the pointer does there.
pub(crate) struct PhotoPair {
    pub(crate) at: [Placement; 2],
    pub(super) over: [Response; 2],
}

impl PhotoPair {
    /// Shows both photos as large as they can be. Both show the part that was zoomed into; a double click shows
    /// them whole. `names` are for assistive technology.
    pub(crate) fn show(
        ui: &Ui,
        area: Rect,
        photos: [&TextureHandle; 2],
        names: [String; 2],
        pan_zoom: &mut PanZoom,
    ) -> Self {
        let sizes = photos.map(TextureHandle::size_vec2);
        let before = place(area, sizes, pan_zoom);
        let over = [0, 1].map(|side| {
            let id = ui.scope_id().with(("photo", side));
            let response = ui.interact(before[side].visible(), id, Sense::click_and_drag());
            name_picture(&response, names[side].as_str());
            pan_zoom.handle_input(ui, &response, &before[side]);
            response
        });
        let at = place(area, sizes, pan_zoom);
        for (at, photo) in at.iter().zip(photos) {
            at.paint(ui.painter(), photo.id(), Color32::WHITE);
        }
        Self { at, over }
    }

    /// Writes captions into the corners of the photos.
    pub(crate) fn name(&self, ui: &Ui, captions: [String; 2]) {
        for (at, caption) in self.at.iter().zip(captions) {
            let corner = at.visible().min + vec2(4.0, 4.0);
            canvas::tag(&at.painter(ui.painter()), corner, &caption, Color32::WHITE);
        }
    }
}

/// Two photos above or beside each other, whichever shows them larger. Each keeps to the side of the other.
fn place(area: Rect, [query, reference]: [Vec2; 2], pan_zoom: &PanZoom) -> [Placement; 2] {
    let free = (area.size() - Vec2::splat(GAP)).max(Vec2::splat(1.0));
    let sum = query + reference;
    let stacked = (area.width() / query.x.max(reference.x)).min(free.y / sum.y);
    let abreast = (free.x / sum.x).min(area.height() / query.y.max(reference.y));
    if stacked >= abreast {
        let end = area.top() + free.y * query.y / sum.y;
        let rest = Rect::from_min_max(pos2(area.left(), (end + GAP).min(area.bottom())), area.max);
        [
            pan_zoom.place(area.with_max_y(end), query, vec2(0.5, 1.0)),
            pan_zoom.place(rest, reference, vec2(0.5, 0.0)),
        ]
    } else {
        let end = area.left() + free.x * query.x / sum.x;
        let rest = Rect::from_min_max(pos2((end + GAP).min(area.right()), area.top()), area.max);
        [
            pan_zoom.place(area.with_max_x(end), query, vec2(1.0, 0.5)),
            pan_zoom.place(rest, reference, vec2(0.0, 0.5)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KITTI: Vec2 = vec2(1241.0, 376.0);

    fn area(width: f32, height: f32) -> Rect {
        Rect::from_min_size(pos2(5.0, 7.0), vec2(width, height))
    }

    #[test]
    fn wide_photos_are_stacked_in_a_square_and_abreast_in_a_band() {
        let place = |area| place(area, [KITTI; 2], &PanZoom::default()).map(|at| at.visible());
        let [query, reference] = place(area(700.0, 700.0));
        assert!((query.width() - 700.0).abs() < 1e-2);
        assert!((reference.top() - query.bottom() - GAP).abs() < 1e-2);
        let [query, reference] = place(area(1400.0, 200.0));
        assert!((query.height() - 200.0).abs() < 1e-2);
        assert!((reference.left() - query.right() - GAP).abs() < 1e-2);
    }

    #[test]
    fn an_area_without_room_is_no_trouble() {
        let [_, at] = place(area(0.0, 0.0), [KITTI; 2], &PanZoom::default());
        assert!(at.scale.is_finite() && at.visible().min.x.is_finite());
    }
}
