//! The funnel: how many features each test rejected, and which of them are shown.

use egui::{Align2, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::app::theme;
use crate::app::views::features::{KINDS, UNDECIDED, about, color, mark, name};

/// Height of the chips \[points\].
pub(super) const HEIGHT: f32 = 38.0;
const GAP: f32 = 4.0;
/// The share of the width that is the same for all chips, so that each has room for its words.
const EQUAL_SHARE: f32 = 0.75;
/// Below this width a chip shows its mark and its count only \[points\].
const NAMED_WIDTH: f32 = 78.0;

/// One chip per state, each a switch; a secondary click shows that state alone.
pub(super) fn ui(ui: &mut Ui, kinds: &[usize], shown: &mut [bool; KINDS]) {
    let mut counts = [0; KINDS];
    for &kind in kinds {
        counts[kind] += 1;
    }
    let chips = if counts[UNDECIDED] == 0 { UNDECIDED } else { KINDS };
    let free = ui.available_width() - GAP * (chips - 1) as f32;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        for kind in 0..chips {
            let share = counts[kind] as f32 / kinds.len().max(1) as f32;
            let share = EQUAL_SHARE / chips as f32 + (1.0 - EQUAL_SHARE) * share;
            let response = chip(ui, kind, counts[kind], free * share, shown[kind]);
            if response.secondary_clicked() {
                *shown = std::array::from_fn(|other| other == kind);
            } else if response.clicked() {
                shown[kind] = !shown[kind];
            }
        }
    });
}

fn chip(ui: &mut Ui, kind: usize, count: usize, width: f32, is_shown: bool) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(width.max(16.0), HEIGHT), Sense::click());
    let state = if is_shown { "shown" } else { "hidden" };
    let label = format!("{}: {count}, {state}", name(kind));
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_shown, &label));
    let visuals = ui.visuals();
    let painter = ui.painter_at(rect);
    let (fill, outline, text) = if is_shown {
        let color = color(kind);
        (color.gamma_multiply(0.3), color, visuals.strong_text_color())
    } else {
        let outline = visuals.widgets.noninteractive.bg_stroke.color;
        (visuals.faint_bg_color, outline, visuals.text_color())
    };
    let outline = if response.hovered() { visuals.strong_text_color() } else { outline };
    let stroke = Stroke::new(1.0, outline);
    painter.rect(rect, 3.0, fill, stroke, egui::StrokeKind::Inside);
    let left = rect.left() + 8.0;
    let (upper, lower) = (rect.top() + 12.0, rect.bottom() - 10.0);
    // Pale colours are hard to see on their own tints.
    let mark_color = color(kind).lerp_to_gamma(visuals.strong_text_color(), 0.3);
    mark(kind).paint(&painter, pos2(left + 4.0, upper), 4.0, mark_color);
    let write = |at, words: String, font| {
        painter.text(at, Align2::LEFT_CENTER, words, font, text);
    };
    write(pos2(left + 13.0, upper), count.to_string(), theme::BODY);
    if rect.width() >= NAMED_WIDTH {
        write(pos2(left, lower), name(kind).to_owned(), theme::CAPTION);
    }
    response.on_hover_text(format!(
        "{label}\n{}\nClick to show or hide, right-click to show these alone",
        about(kind)
    ))
}
