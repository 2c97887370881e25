//! Colours and sizes of the window.

use egui::Color32;

use crate::estimator;
use crate::features::FeatureState;
use crate::localize::Standing;
use crate::method::Method;
use crate::palette::{self, Rgb};

/// Colour of the reference.
pub const REFERENCE: Color32 = rgb(palette::REFERENCE);
/// Colour of estimates.
pub const ESTIMATE: Color32 = rgb(palette::ESTIMATE);
/// Colour of the ground truth.
pub const TRUTH: Color32 = rgb(palette::TRUTH);
/// Colour of the camera in hand.
pub const CAMERA: Color32 = rgb(palette::UNDECIDED);

/// Colour of a pose that is too far from the truth.
pub const FAR: Color32 = Color32::from_rgb(0xE6, 0x9F, 0x00);

/// A colour as egui takes it.
pub const fn rgb([r, g, b]: Rgb) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// The colour of a feature's state, by its position in [`FeatureState::NAMES`].
pub fn state(index: usize) -> Color32 {
    rgb(palette::STATES[index.min(FeatureState::NAMES.len() - 1)])
}

/// The colour of what a result is worth.
pub fn standing(visuals: &egui::Visuals, standing: Standing) -> Color32 {
    match standing {
        Standing::Right => TRUTH,
        Standing::Unmeasured => visuals.text_color(),
        Standing::LowConfidence => FAR,
        Standing::Wrong | Standing::NoPose => ESTIMATE,
    }
}

/// The colour of a method's lane and curves.
pub fn method(method: Method) -> Color32 {
    /// In the order of the registry; those behind the paper's take turns.
    const COLORS: [Rgb; 6] = [
        [0x56, 0xB4, 0xE9],
        [0xE6, 0x9F, 0x00],
        [0xCC, 0x79, 0xA7],
        [0x80, 0x80, 0x80],
        [0xF0, 0xE4, 0x42],
        [0x8D, 0xD3, 0xC7],
    ];
    let place = estimator::methods().position(|known| known == method);
    // Other systems are behind all of ours.
    let place = place.unwrap_or_else(|| estimator::all().len());
    let paper = Method::PAPER.len();
    rgb(match COLORS.get(place) {
        Some(&color) => color,
        None => COLORS[paper + (place - paper) % (COLORS.len() - paper)],
    })
}

/// Viridis, for costs: 0 the worst, 1 the best.
pub fn viridis(value: f64) -> Color32 {
    rgb(palette::viridis(value))
}

/// Turbo, for depths and heights: 0 the least, 1 the greatest.
pub fn turbo(value: f64) -> Color32 {
    rgb(palette::turbo(value))
}

pub(super) fn install(ctx: &egui::Context) {
    // The font for text has no arrows and no shapes; that for code has.
    let mut fonts = egui::FontDefinitions::default();
    if let Some(proportional) = fonts.families.get_mut(&egui::FontFamily::Proportional) {
        proportional.push("Hack".to_owned());
    }
    ctx.set_fonts(fonts);
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(6.0, 4.0);
        style.interaction.tooltip_delay = 0.3;
    });
}
