//! The funnel: how many features each test threw out, and which of them are shown.

use egui::{Align2, Role, Sense, Stroke, TextStyle, Ui, WidgetInfo, pos2, vec2};

use super::marks::{color, mark};
use super::progress::{KINDS, UNDECIDED, name};
use crate::app::views::mesh_painter::MeshPainter;

/// Height of the bar \[points\].
const HEIGHT: f32 = 34.0;
/// The share of the width that is the same for all segments, so that each can be clicked.
const EQUAL_SHARE: f32 = 0.75;
/// Below this width a segment shows its mark and its count only \[points\].
const NAMED_WIDTH: f32 = 78.0;

/// One segment per state, each a switch; a secondary click shows that state alone.
pub(super) fn ui(ui: &mut Ui, counts: &[usize; KINDS], shown: &mut [bool; KINDS]) {
    let all: usize = counts.iter().sum();
    let segments = match counts[UNDECIDED] {
        0 => UNDECIDED,
        _ => KINDS,
    };
    let width = ui.available_width();
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        let free = width - 2.0 * (segments - 1) as f32;
        let mut left = all;
        for kind in 0..segments {
            let share = counts[kind] as f32 / all.max(1) as f32;
            let share = EQUAL_SHARE / segments as f32 + (1.0 - EQUAL_SHARE) * share;
            left -= counts[kind];
            let segment = Segment {
                kind,
                count: counts[kind],
                passed: left,
                is_begun: counts[UNDECIDED] < all,
                width: free * share,
            };
            match segment.ui(ui, shown[kind]) {
                Some(Click::Switch) => shown[kind] = !shown[kind],
                Some(Click::Alone) => *shown = std::array::from_fn(|other| other == kind),
                None => {}
            }
        }
    });
}

struct Segment {
    kind: usize,
    count: usize,
    /// Features that go on to the next test.
    passed: usize,
    /// Whether any test has thrown out a feature yet.
    is_begun: bool,
    width: f32,
}

enum Click {
    Switch,
    Alone,
}

impl Segment {
    fn ui(&self, ui: &mut Ui, is_shown: bool) -> Option<Click> {
        let size = vec2(self.width.max(16.0), HEIGHT);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let state = if is_shown { "shown" } else { "hidden" };
        let label = format!("{}: {}, {state}", name(self.kind), self.count);
        response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_shown, &label));
        let response = response.on_hover_text(format!(
            "{label}\n{}\nClick to show or hide, right-click to show these alone",
            about(self.kind)
        ));
        self.paint(ui, rect, is_shown, response.hovered());
        if response.secondary_clicked() {
            Some(Click::Alone)
        } else {
            response.clicked().then_some(Click::Switch)
        }
    }

    fn paint(&self, ui: &Ui, rect: egui::Rect, is_shown: bool, is_hovered: bool) {
        let visuals = ui.visuals();
        let painter = ui.painter_at(rect);
        let color = color(self.kind);
        let (fill, text) = if is_shown {
            (color.gamma_multiply(0.38), visuals.strong_text_color())
        } else {
            (visuals.faint_bg_color, visuals.text_color())
        };
        painter.rect_filled(rect, 3.0, fill);
        let outline = match (is_hovered, is_shown) {
            (true, _) => Stroke::new(1.5, visuals.strong_text_color()),
            (false, true) => Stroke::new(1.0, color),
            (false, false) => Stroke::new(1.0, visuals.weak_text_color().gamma_multiply(0.5)),
        };
        painter.rect_stroke(rect, 3.0, outline, egui::StrokeKind::Inside);

        let small = TextStyle::Small.resolve(ui.style());
        let body = TextStyle::Body.resolve(ui.style());
        let (upper, lower) = (rect.top() + 10.0, rect.bottom() - 9.0);
        let mut mesh = MeshPainter::new(ui.pixels_per_point());
        // Pale colours are hard to see on their own tints.
        let mark_color = if is_shown {
            color.lerp_to_gamma(visuals.strong_text_color(), 0.3)
        } else {
            visuals.weak_text_color()
        };
        mesh.mark(
            mark(self.kind),
            pos2(rect.left() + 10.0, upper),
            4.0,
            mark_color,
        );
        mesh.paint_on(&painter);
        let write = |at, anchor, words: &str, font: &egui::FontId, color| {
            painter.text(at, anchor, words, font.clone(), color)
        };
        let is_wide = rect.width() >= NAMED_WIDTH;
        if is_wide {
            let at = pos2(rect.left() + 19.0, upper);
            let written = write(at, Align2::LEFT_CENTER, name(self.kind), &small, text);
            if !is_shown {
                painter.hline(
                    written.x_range(),
                    written.center().y,
                    Stroke::new(1.0, text),
                );
            }
        }
        let at = pos2(rect.left() + 6.0, lower);
        let count = self.count.to_string();
        write(at, Align2::LEFT_CENTER, &count, &body, text);
        // The last test of the known ones lets nobody on.
        if is_wide && self.is_begun && self.passed > 0 {
            let at = pos2(rect.right() - 5.0, lower);
            let words = format!("{} →", self.passed);
            write(at, Align2::RIGHT_CENTER, &words, &small, text);
        }
    }
}

fn about(kind: usize) -> &'static str {
    match kind {
        0 => "The second-nearest reference feature is nearly as near as the nearest",
        1 => "The nearest reference feature resembles another query feature more",
        2 => "No LiDAR depth near the reference keypoint",
        3 => "The estimated pose does not explain it, or there is no pose",
        4 => "The estimated pose explains it",
        _ => "Not decided at this step",
    }
}
