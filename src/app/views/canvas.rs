//! A picture that can be zoomed and dragged.

use egui::{Color32, Painter, Pos2, Rect, Response, TextureId, Ui, Vec2, pos2, vec2};

use crate::app::theme;

/// The greatest magnification over the fitted picture.
const LARGEST_ZOOM: f32 = 60.0;

/// Which part of a picture is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PanZoom {
    /// Magnification over the picture fitted into its area, at least 1.
    zoom: f32,
    /// What is in the middle, as shares of the picture's width and height.
    centre: Vec2,
}

impl Default for PanZoom {
    fn default() -> Self {
        Self { zoom: 1.0, centre: Vec2::splat(0.5) }
    }
}

impl PanZoom {
    /// Where a picture of `size` \[px\] lies in an area of the screen; `align` says to which side it
    /// keeps where the area is larger (0 left or top, 1 right or bottom).
    pub(super) fn place(&self, area: Rect, size: Vec2, align: Vec2) -> Placement {
        let size = size.max(Vec2::splat(1.0));
        let scale = (area.width() / size.x).min(area.height() / size.y) * self.zoom;
        let extent = size * scale;
        // The picture fills its area as far as it can: no gap opens at a border.
        let along = |axis: usize| {
            let free = area.size()[axis] - extent[axis];
            let wanted = 0.5 * area.size()[axis] - self.centre[axis] * extent[axis];
            let gap = if free >= 0.0 { align[axis] * free } else { wanted.clamp(free, 0.0) };
            area.min[axis] + gap
        };
        Placement { area, picture: Rect::from_min_size(pos2(along(0), along(1)), extent), scale }
    }

    /// Zooms by wheel and pinch about the pointer, moves by dragging, and goes back to the whole
    /// picture on a double click. Whether anything has changed.
    pub(super) fn handle_input(&mut self, ui: &Ui, response: &Response, at: &Placement) -> bool {
        let before = *self;
        if response.dragged() {
            self.centre = at.centre() - response.drag_delta() / at.picture.size();
        }
        if let Some(pointer) = response.hover_pos() {
            let factor = ui
                .input(|input| input.zoom_delta() * (input.smooth_scroll_delta().y / 200.0).exp());
            if factor != 1.0 {
                self.magnify(factor, pointer, at);
            }
        }
        if response.double_clicked() || self.zoom == 1.0 {
            *self = Self::default();
        }
        *self != before
    }

    /// Zooms, and keeps what is under the pointer there.
    fn magnify(&mut self, factor: f32, pointer: Pos2, at: &Placement) {
        let zoom = (self.zoom * factor).clamp(1.0, LARGEST_ZOOM);
        let under = (pointer - at.picture.min) / at.picture.size();
        let extent = at.picture.size() * (zoom / self.zoom);
        self.centre = under - (pointer - at.area.center()) / extent;
        self.zoom = zoom;
    }
}

/// Where a picture lies on the screen. Its pixel centres are at integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// The part of the screen that may show it.
    pub(super) area: Rect,
    /// Where the whole picture would be.
    picture: Rect,
    /// Points per pixel.
    pub(super) scale: f32,
}

impl Placement {
    /// The `half` pixels around a pixel, filling a square area.
    pub(super) fn around(pixel: [f32; 2], half: f32, area: Rect, size: Vec2) -> Self {
        let scale = 0.5 * area.width() / half;
        let corner = area.center() - scale * vec2(pixel[0] + 0.5, pixel[1] + 0.5);
        Self { area, picture: Rect::from_min_size(corner, scale * size), scale }
    }

    /// The share of the picture that is in the middle of the area.
    fn centre(&self) -> Vec2 {
        (self.area.center() - self.picture.min) / self.picture.size()
    }

    /// The place of a pixel position on the screen.
    pub(super) fn on_screen(&self, [x, y]: [f32; 2]) -> Pos2 {
        self.picture.min + self.scale * vec2(x + 0.5, y + 0.5)
    }

    /// The part of the screen on which the picture is seen.
    pub(super) fn visible(&self) -> Rect {
        self.picture.intersect(self.area)
    }

    /// A painter that keeps to the picture.
    pub(super) fn painter(&self, painter: &Painter) -> Painter {
        painter.with_clip_rect(painter.clip_rect().intersect(self.visible()))
    }

    /// Paints the picture.
    pub(super) fn paint(&self, painter: &Painter, texture: TextureId, tint: Color32) {
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        self.painter(painter).image(texture, self.picture, whole, tint);
    }
}

/// Words in a corner of a picture, readable on any ground.
pub(super) fn tag(painter: &Painter, at: Pos2, text: &str, color: Color32) {
    let galley = painter.layout_no_wrap(text.to_owned(), theme::CAPTION, color);
    let ground = Rect::from_min_size(at, galley.size()).expand2(vec2(4.0, 1.0));
    let ground = ground.translate(vec2(4.0, 1.0));
    painter.rect_filled(ground, 2.0, Color32::from_black_alpha(190));
    painter.galley(ground.shrink2(vec2(4.0, 1.0)).min, galley, color);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: Vec2 = vec2(400.0, 100.0);
    const CENTRED: Vec2 = vec2(0.5, 0.5);

    fn area() -> Rect {
        Rect::from_min_size(pos2(10.0, 20.0), vec2(200.0, 200.0))
    }

    #[test]
    fn a_fitted_picture_is_centred_and_pixel_centres_are_at_integers() {
        let at = PanZoom::default().place(area(), SIZE, CENTRED);
        assert_eq!(at.scale, 0.5);
        assert_eq!(at.on_screen([-0.5, -0.5]), pos2(10.0, 95.0));
        assert_eq!(at.on_screen([399.5, 99.5]), pos2(210.0, 145.0));
        let low = PanZoom::default().place(area(), SIZE, vec2(0.5, 1.0));
        assert_eq!(low.visible().max, area().max);
    }

    #[test]
    fn a_patch_has_its_pixel_in_the_middle() {
        let at = Placement::around([30.0, 40.0], 16.0, area(), SIZE);
        assert_eq!(at.on_screen([30.0, 40.0]), area().center());
        assert_eq!(at.on_screen([46.0, 40.0]).x, area().right());
    }

    proptest! {
        #[test]
        fn zooming_keeps_what_is_under_the_pointer_and_opens_no_gap(
            x in 10.0_f32..210.0, y in 95.0_f32..145.0,
            factors in prop::collection::vec(0.7_f32..1.6, 1..12),
        ) {
            let mut pan_zoom = PanZoom::default();
            let pointer = pos2(x, y);
            for factor in factors {
                let before = pan_zoom.place(area(), SIZE, CENTRED);
                let pixel = (pointer - before.picture.min) / before.scale;
                pan_zoom.magnify(factor, pointer, &before);
                let after = pan_zoom.place(area(), SIZE, CENTRED);
                let again = (pointer - after.picture.min) / after.scale;
                // Where the picture is as wide as its area, the border has the last word.
                let is_free = |axis: usize| {
                    after.picture.size()[axis] > area().size()[axis] + 1e-3
                        && after.picture.min[axis] < area().min[axis] - 1e-3
                        && after.picture.max[axis] > area().max[axis] + 1e-3
                };
                for axis in [0, 1] {
                    if is_free(axis) && factor > 1.0 && pan_zoom.zoom < LARGEST_ZOOM {
                        prop_assert!((pixel[axis] - again[axis]).abs() < 0.05, "{pixel} {again}");
                    }
                }
                prop_assert!(after.picture.min.x <= area().min.x + 1e-2);
                prop_assert!(after.picture.max.x >= area().max.x - 1e-2);
            }
        }
    }
}
