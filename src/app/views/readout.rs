//! A line above a picture that says what is under the pointer.

use egui::{Align, Label, Rect, Response, RichText, TextStyle, Ui, UiBuilder, vec2};

/// Room for the line. What is under the pointer is known only when the picture is drawn, but it is
/// written above it, where it stays in its place.
pub(super) struct Readout(Rect);

impl Readout {
    pub(super) fn reserve(ui: &mut Ui) -> Self {
        let size = vec2(ui.available_width(), ui.text_style_height(&TextStyle::Body));
        Self(ui.allocate_space(size).1)
    }

    /// Writes what is under the pointer, or else what could be done.
    pub(super) fn say(self, ui: &mut Ui, words: Option<&str>, otherwise: &str) -> Response {
        let text = match words {
            Some(words) => RichText::new(words).strong(),
            None => RichText::new(otherwise).weak(),
        };
        let mut line = ui.new_child(UiBuilder::new().max_rect(self.0));
        line.add(Label::new(text).truncate().halign(Align::LEFT))
    }
}
