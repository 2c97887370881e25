//! The design of the window in one place: type scale, spacing, and the tokens of colour with which text and
//! marks are drawn in both themes.
//!
//! A colour says what something is, the same in pictures of the window and in recordings (after Okabe and
//! Ito); shapes and words say it too. As text it is read on grounds that it was not made for: [`text`]
//! moves it towards the text of the theme until it has [`CONTRAST`] on each of them.

use egui::{Color32, FontId, TextStyle, Visuals};

use crate::diagnosis::Grade;
use crate::features::FeatureState;
use crate::method::Method;
use crate::palette::{self, Rgb};

/// The least contrast of a text with its ground: that of WCAG 2.2, criterion 1.4.3, for text of any size.
pub const CONTRAST: f32 = 4.5;

/// Between two things beside and below each other \[points\].
const GAP: egui::Vec2 = egui::vec2(6.0, 4.0);
/// Until a hint is shown \[s\].
const HINT_DELAY: f32 = 0.3;

/// Numbers of axes and names of stages.
pub const SMALL: FontId = FontId::proportional(10.0);
/// Captions of pictures.
pub const CAPTION: FontId = FontId::proportional(11.0);
/// Names of things in space.
pub const LABEL: FontId = FontId::proportional(12.0);
/// Body text.
pub const BODY: FontId = FontId::proportional(13.0);
/// Names of methods in the verdict bar.
pub const STRONG: FontId = FontId::proportional(14.0);
const HEADING: FontId = FontId::proportional(18.0);

/// The colour of what is selected or can be clicked; used for nothing else.
pub fn accent(visuals: &Visuals) -> Color32 {
    text(visuals, ACCENT)
}

/// The ground of what is selected, and of the one button that stands out.
pub fn selected(visuals: &Visuals) -> Color32 {
    visuals.selection.bg_fill
}

/// Colour of what is selected or can be clicked.
const ACCENT: Color32 = rgb(palette::ACCENT);

/// Colour of the reference.
pub const REFERENCE: Color32 = rgb(palette::REFERENCE);
/// Colour of estimates.
pub const ESTIMATE: Color32 = rgb(palette::ESTIMATE);
/// Colour of the ground truth.
pub const TRUTH: Color32 = rgb(palette::TRUTH);
/// Colour of the trial camera.
pub const CAMERA: Color32 = rgb(palette::UNDECIDED);

/// Everything whose colour stands for what it is.
#[cfg(test)]
const MEANINGS: [Color32; 5] = [REFERENCE, ESTIMATE, TRUTH, CAMERA, ACCENT];

/// A colour as egui takes it.
pub const fn rgb([r, g, b]: Rgb) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// The colour of a feature's state, by its position in [`FeatureState::NAMES`].
pub fn state(index: usize) -> Color32 {
    rgb(palette::STATES[index.min(FeatureState::NAMES.len() - 1)])
}

/// The text colour of a grade.
pub fn grade(visuals: &Visuals, grade: Grade) -> Color32 {
    match grade {
        Grade::Right => text(visuals, TRUTH),
        Grade::Unmeasured => visuals.text_color(),
        Grade::Wrong => text(visuals, ESTIMATE),
        Grade::NoPose => text(visuals, rgb(palette::NO_POSE)),
    }
}

/// The colour of a method's lane and curves.
pub fn method(method: Method) -> Color32 {
    rgb(palette::method(method))
}

/// Viridis, for costs: 0 the worst, 1 the best.
pub fn viridis(value: f64) -> Color32 {
    rgb(palette::viridis(value))
}

/// What words of a theme stand on: panels, fields, rows of tables, buttons.
fn grounds(visuals: &Visuals) -> [Color32; 5] {
    [
        visuals.panel_fill,
        visuals.window_fill,
        visuals.extreme_bg_color,
        over(visuals.panel_fill, visuals.faint_bg_color),
        visuals.widgets.inactive.weak_bg_fill,
    ]
}

/// A colour that is not quite opaque on another one.
fn over(ground: Color32, color: Color32) -> Color32 {
    ground.blend(color)
}

/// The colour of something as text: as near to its own as can be read on every ground of the theme.
pub fn text(visuals: &Visuals, color: Color32) -> Color32 {
    const STEPS: usize = 20;
    let end = if visuals.dark_mode { Color32::WHITE } else { Color32::BLACK };
    let grounds = grounds(visuals);
    let mixed = (0..=STEPS).map(|step| color.lerp_to_gamma(end, step as f32 / STEPS as f32));
    let mut readable = mixed.filter(|mixed| {
        let mut grounds = grounds.iter();
        grounds.all(|ground| contrast(*mixed, *ground) >= CONTRAST)
    });
    readable.next().unwrap_or(end)
}

/// The contrast of two opaque colours, 1 to 21 (WCAG 2.2, "contrast ratio").
pub fn contrast(a: Color32, b: Color32) -> f32 {
    let luminance = |color: Color32| {
        let linear = |channel: u8| {
            let share = f32::from(channel) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(color.r()) + 0.7152 * linear(color.g()) + 0.0722 * linear(color.b())
    };
    let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
    a.max(b) / a.min(b)
}

/// A theme: egui's own, with more contrast for pale text.
fn visuals(theme: egui::Theme) -> Visuals {
    let mut visuals = theme.default_visuals();
    // Labels need as much contrast as buttons.
    let ([pale, plain], ground, words) = match theme {
        egui::Theme::Dark => ([170, 190], [0x3A, 0x37, 0x70], [0xE8, 0xE6, 0xFF]),
        egui::Theme::Light => ([88, 60], [0xCD, 0xCB, 0xFA], [0x1E, 0x1B, 0x50]),
    };
    visuals.weak_text_color = Some(Color32::from_gray(pale));
    visuals.widgets.noninteractive.fg_stroke.color = Color32::from_gray(plain);
    visuals.selection.bg_fill = rgb(ground);
    visuals.selection.stroke.color = rgb(words);
    if theme == egui::Theme::Dark {
        visuals.panel_fill = Color32::from_rgb(0x1B, 0x1D, 0x22);
        visuals.window_fill = visuals.panel_fill;
        visuals.extreme_bg_color = Color32::from_rgb(0x10, 0x11, 0x14);
        visuals.widgets.inactive.weak_bg_fill = Color32::from_rgb(0x2A, 0x2D, 0x34);
    }
    visuals.warn_fg_color = text(&visuals, visuals.warn_fg_color);
    visuals.error_fg_color = text(&visuals, visuals.error_fg_color);
    visuals.hyperlink_color = text(&visuals, visuals.hyperlink_color);
    visuals
}

pub(super) fn install(ctx: &egui::Context) {
    // The font for text has no arrows and no shapes; that for code has.
    let mut fonts = egui::FontDefinitions::default();
    if let Some(proportional) = fonts.families.get_mut(&egui::FontFamily::Proportional) {
        proportional.push("Hack".to_owned());
    }
    ctx.set_fonts(fonts);
    for theme in [egui::Theme::Dark, egui::Theme::Light] {
        ctx.set_visuals_of(theme, visuals(theme));
    }
    ctx.all_styles_mut(|style| {
        style.text_styles = [
            (TextStyle::Small, SMALL),
            (TextStyle::Body, BODY),
            (TextStyle::Button, BODY),
            (TextStyle::Heading, HEADING),
            (TextStyle::Monospace, FontId::monospace(BODY.size)),
        ]
        .into();
        style.spacing.item_spacing = GAP;
        style.interaction.tooltip_delay = HINT_DELAY;
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator;

    const THEMES: [egui::Theme; 2] = [egui::Theme::Dark, egui::Theme::Light];

    #[test]
    fn contrast_is_that_of_the_standard() {
        assert!((contrast(Color32::BLACK, Color32::WHITE) - 21.0).abs() < 1e-4);
        assert!((contrast(Color32::WHITE, Color32::WHITE) - 1.0).abs() < 1e-6);
        // The grey that is just enough on white.
        let grey = Color32::from_gray(0x76);
        assert!((contrast(grey, Color32::WHITE) - 4.54).abs() < 0.01);
    }

    #[test]
    fn every_token_is_read_on_every_ground_of_both_themes() {
        for theme in THEMES {
            let visuals = visuals(theme);
            let methods = estimator::methods().map(method);
            let states = (0..FeatureState::NAMES.len()).map(state);
            let meanings = MEANINGS.into_iter().chain(methods).chain(states);
            let told = meanings.map(|color| text(&visuals, color));
            let plain = [
                visuals.text_color(),
                visuals.strong_text_color(),
                visuals.weak_text_color(),
                visuals.warn_fg_color,
                visuals.error_fg_color,
                visuals.hyperlink_color,
            ];
            for color in told.chain(plain) {
                for ground in grounds(&visuals) {
                    let contrast = contrast(color, ground);
                    assert!(contrast >= CONTRAST, "{theme:?} {color:?} on {ground:?}: {contrast}");
                }
            }
            let widgets = &visuals.widgets;
            for widget in [&widgets.inactive, &widgets.hovered, &widgets.active, &widgets.open] {
                let contrast = contrast(widget.text_color(), widget.weak_bg_fill);
                assert!(contrast >= CONTRAST, "{theme:?} {widget:?}: {contrast}");
            }
            let selection = &visuals.selection;
            let contrast = contrast(selection.stroke.color, selection.bg_fill);
            assert!(contrast >= CONTRAST, "{theme:?} selection: {contrast}");
        }
    }

    #[test]
    fn a_colour_that_can_be_read_stays_what_it_is() {
        let dark = visuals(egui::Theme::Dark);
        let orange = Color32::from_rgb(0xE6, 0x9F, 0x00);
        assert_eq!(text(&dark, orange), orange);
    }
}
