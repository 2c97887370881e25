//! Both photos on the screen.

use egui::{Color32, Rect, Response, Role, Sense, TextureHandle, TextureId, Ui, Vec2, WidgetInfo};

use super::arrangement::Arrangement;
use crate::app::ViewContext;
use crate::app::textures::color_image;
use crate::app::views::canvas::{self, PanZoom, Placement};
use crate::image::Photo;
use crate::picture;
use crate::problem::Problem;

/// A photo on the graphics card.
pub(super) struct PhotoTexture(TextureHandle);

impl PhotoTexture {
    pub(super) fn size(&self) -> Vec2 {
        self.0.size_vec2()
    }

    pub(super) fn id(&self) -> TextureId {
        self.0.id()
    }
}

pub(super) struct Photos {
    pub(super) query: PhotoTexture,
    pub(super) reference: PhotoTexture,
}

impl Photos {
    pub(super) fn of(ui: &Ui, context: &ViewContext<'_>, problem: &Problem) -> Self {
        let image = |photo: &Photo| color_image(&picture::photo(photo));
        let (ctx, textures) = (ui.ctx(), context.textures);
        let query = textures.of(ctx, "photo", &problem.query, |query| image(&query.photo));
        let reference = textures.of(ctx, "photo", &problem.reference, |tuple| {
            image(&tuple.photo)
        });
        Self {
            query: PhotoTexture(query),
            reference: PhotoTexture(reference),
        }
    }
}

/// Which parts of both photos are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PhotoPanZoom {
    query: PanZoom,
    reference: PanZoom,
    /// Whether both show the same part.
    pub(super) are_linked: bool,
}

impl Default for PhotoPanZoom {
    fn default() -> Self {
        Self {
            query: PanZoom::default(),
            reference: PanZoom::default(),
            are_linked: true,
        }
    }
}

/// A photo's place, and what the pointer does there.
pub(super) struct PhotoOnScreen {
    pub(super) at: Placement,
    pub(super) response: Response,
}

impl PhotoPanZoom {
    /// Draws the switches of the zoom.
    pub(super) fn ui(&mut self, ui: &mut Ui) {
        let help = "Zoom (wheel) and move (drag) both photos together";
        let link = ui.checkbox(&mut self.are_linked, "Link zoom");
        if link.on_hover_text(help).changed() {
            self.reference = self.query;
        }
        let are_whole = self.query == PanZoom::default() && self.reference == PanZoom::default();
        let whole = ui.add_enabled(!are_whole, egui::Button::new("Whole photos"));
        if whole.on_hover_text("Or double-click a photo").clicked() {
            (self.query, self.reference) = Default::default();
        }
    }

    /// Shows both photos and does what the pointer wants.
    pub(super) fn show(
        &mut self,
        ui: &Ui,
        problem: &Problem,
        photos: &Photos,
        area: Rect,
    ) -> (PhotoOnScreen, PhotoOnScreen) {
        let sizes = [photos.query.size(), photos.reference.size()];
        let arrangement = Arrangement::new(area, sizes[0], sizes[1]);
        let interact = |pan_zoom: &mut PanZoom, photo: usize, name: String| {
            let before = arrangement.place(photo, pan_zoom, sizes[photo]);
            let id = ui.scope_id().with(photo);
            let response = ui.interact(before.visible(), id, Sense::click_and_drag());
            response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
            let has_moved = pan_zoom.handle_input(ui, &response, &before);
            (response, has_moved)
        };
        let name = format!("query photo {}", problem.query.name);
        let (over_query, _) = interact(&mut self.query, 0, name);
        let name = format!("reference photo {}", problem.reference.name);
        let (over_reference, reference_has_moved) = interact(&mut self.reference, 1, name);
        if self.are_linked && reference_has_moved {
            self.query = self.reference;
        } else if self.are_linked {
            self.reference = self.query;
        }
        let query = arrangement.place(0, &self.query, sizes[0]);
        let reference = arrangement.place(1, &self.reference, sizes[1]);
        query.paint(ui.painter(), photos.query.id(), Color32::WHITE);
        reference.paint(ui.painter(), photos.reference.id(), Color32::WHITE);
        let shown = |at, response| PhotoOnScreen { at, response };
        (shown(query, over_query), shown(reference, over_reference))
    }
}

/// The names of the frames, on the photos.
pub(super) fn name(ui: &Ui, labels: &[String; 2], query: &Placement, reference: &Placement) {
    let text = format!("query {}", labels[0]);
    canvas::tag(ui.painter(), query.visible().min, &text, Color32::WHITE);
    let text = format!("reference {}", labels[1]);
    /// The colour of the reference, light enough for words on black.
    const COLOR: Color32 = Color32::from_rgb(0x8F, 0xC8, 0xF0);
    canvas::tag(ui.painter(), reference.visible().min, &text, COLOR);
}
