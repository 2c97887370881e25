//! How features are marked: those of a state, and where the ground truth has them.

use egui::{Color32, Painter};
use nalgebra::Point2;

use super::truth::TrueMatch;
use crate::app::theme;
use crate::app::views::canvas::Placement;
use crate::app::views::features::UNDECIDED;
use crate::app::views::mark_shape::MarkShape;
use crate::camera::Intrinsics;
use crate::features::Keypoint;

/// The colour of a state, or of none yet.
pub(super) fn color(kind: usize) -> Color32 {
    if kind == UNDECIDED { theme::CAMERA } else { theme::state(kind) }
}

/// The mark of a state, or of none yet.
pub(super) fn mark(kind: usize) -> MarkShape {
    const MARKS: [MarkShape; UNDECIDED] = [
        MarkShape::Cross,
        MarkShape::Triangle,
        MarkShape::Ring,
        MarkShape::Diamond,
        MarkShape::Disc,
    ];
    MARKS.get(kind).copied().unwrap_or(MarkShape::Square)
}

/// Where a keypoint is \[px\].
pub(super) fn position(keypoint: &Keypoint) -> [f32; 2] {
    [keypoint.x, keypoint.y]
}

/// The epipolar line, and where the true pose sees the lifted point.
pub(super) fn draw_truth(
    painter: &Painter,
    at: &Placement,
    camera: &Intrinsics,
    truth: &TrueMatch,
) {
    let place = |pixel: &Point2<f64>| at.on_screen(pixel.cast::<f32>().into());
    let shade = Color32::from_black_alpha(140);
    if let Some([from, to]) = truth.line.and_then(|line| line.within(camera)) {
        painter.line_segment([place(&from), place(&to)], (3.5, shade));
        painter.line_segment([place(&from), place(&to)], (1.8, theme::TRUTH));
    }
    if let Some(pixel) = &truth.place {
        painter.circle_filled(place(pixel), 8.0, shade);
        MarkShape::Plus.paint(painter, place(pixel), 6.0, theme::TRUTH);
    }
}
