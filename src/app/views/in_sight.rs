//! Bringing a row of a long list into sight.

use egui::style::ScrollAnimation;
use egui::{Align, Rect, Ui, pos2, vec2};

/// Scrolls the rows of [`egui::ScrollArea::show_rows`] so that one is in the middle, as far as there are rows
/// on either side. Called while they are drawn from `first` on; `height` is that of a row alone \[points\].
///
/// An area may be told an offset too, but swings back from what is beyond the contents that it had before.
pub(super) fn bring_to_the_middle(ui: &Ui, first: usize, row: usize, height: f32) {
    let step = height + ui.spacing().item_spacing.y;
    let top = ui.max_rect().top() + (row as f32 - first as f32) * step;
    let place = Rect::from_min_size(pos2(ui.max_rect().left(), top), vec2(1.0, height));
    ui.scroll_to_rect_animation(place, Some(Align::Center), ScrollAnimation::none());
}
