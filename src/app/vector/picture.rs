//! A picture that a drawing holds.

use std::sync::Arc;

use egui::ColorImage;

/// A picture on the graphics card, as it was given there.
#[derive(Clone)]
pub(super) struct Picture {
    pub(super) image: Arc<ColorImage>,
    /// Whether its pixels are to be seen when it is magnified.
    pub(super) is_pixelated: bool,
}
