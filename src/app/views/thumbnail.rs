//! A frame's small picture in a list.

use egui::{Sense, Ui, Vec2, vec2};

use crate::app::ViewContext;
use crate::event::Side;

/// Its size on the screen \[points\].
pub(super) const THUMBNAIL: Vec2 = vec2(124.0, 38.0);

/// Shows the thumbnail of a frame of the queries' or the references' scene; its place stays empty
/// until it is made.
pub(super) fn thumbnail(ui: &mut Ui, context: &ViewContext<'_>, side: Side, frame: usize) {
    let scene = match side {
        Side::Query => &context.setup.queries,
        Side::Reference => &context.setup.references,
    };
    match context.queries.thumbnail(side, frame) {
        Some(texture) => {
            let image = egui::Image::new(texture).fit_to_exact_size(THUMBNAIL);
            ui.add(image.alt_text(&scene.frames()[frame]));
        }
        None => {
            let (rect, _) = ui.allocate_exact_size(THUMBNAIL, Sense::hover());
            let fill = ui.visuals().faint_bg_color;
            ui.painter().rect_filled(rect, 2.0, fill);
        }
    }
}
