//! Where features are on the screen, and which of them is pointed at.

use egui::{Color32, Painter, Pos2};

use crate::app::theme;
use crate::app::views::canvas::Placement;
use crate::app::views::features::{INLIER, KINDS, UNDECIDED, color, mark, position};
use crate::app::views::legend::MarkShape;
use crate::feature_progress::FeatureProgress;

/// How near the pointer must be \[points\].
const REACH: f32 = 6.0;
/// States from the back to the front.
const LAYERS: [usize; KINDS] = [0, 1, 2, 3, UNDECIDED, INLIER];

/// A query feature on the screen, with the match that it made or missed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct VisibleFeature {
    feature: usize,
    kind: usize,
    color: Color32,
    /// Its keypoint in the query and that of its nearest reference feature, if they are in view.
    ends: [Option<Pos2>; 2],
}

/// All features in view, the hindmost first.
pub(super) struct VisibleFeatures {
    all: Vec<VisibleFeature>,
    /// Whether a reference keypoint has a mark of a match.
    is_matched: Vec<bool>,
}

impl VisibleFeatures {
    /// The features that are shown and in view. `is_false` are inliers that the truth refutes.
    pub(super) fn new(
        progress: &FeatureProgress<'_>,
        kinds: &[usize],
        at: &[Placement; 2],
        is_shown: impl Fn(usize) -> bool,
        is_false: impl Fn(usize) -> bool,
    ) -> Self {
        let mut all = Vec::new();
        let mut is_matched = vec![false; progress.reference.len()];
        for layer in LAYERS {
            let of_layer = (0..kinds.len()).filter(|&feature| kinds[feature] == layer);
            for feature in of_layer.filter(|&feature| is_shown(feature)) {
                let there = progress.matched(feature).map(|found| found.reference);
                let there = there.filter(|&index| index < is_matched.len());
                if let Some(index) = there {
                    is_matched[index] = true;
                }
                let keypoints =
                    [Some(&progress.query[feature]), there.map(|index| &progress.reference[index])];
                let ends = [0, 1].map(|side| {
                    let end = at[side].on_screen(position(keypoints[side]?));
                    at[side].visible().contains(end).then_some(end)
                });
                if ends != [None; 2] {
                    all.push(VisibleFeature {
                        feature,
                        kind: layer,
                        color: if is_false(feature) { theme::ESTIMATE } else { color(layer) },
                        ends,
                    });
                }
            }
        }
        Self { all, is_matched }
    }

    /// The feature whose keypoint is nearest to the pointer, else the one whose line is; none where
    /// none is near.
    pub(super) fn nearest(&self, pointer: Pos2) -> Option<usize> {
        let to_keypoint = |shown: &VisibleFeature| {
            let ends = shown.ends.into_iter().flatten();
            ends.map(|end| end.distance(pointer)).fold(f32::INFINITY, f32::min)
        };
        let to_line = |shown: &VisibleFeature| {
            let line = shown.line();
            line.map_or(f32::INFINITY, |[from, to]| distance_to_segment(pointer, from, to))
        };
        self.nearest_by(to_keypoint).or_else(|| self.nearest_by(to_line))
    }

    fn nearest_by(&self, distance: impl Fn(&VisibleFeature) -> f32) -> Option<usize> {
        // Of equally near ones the foremost, which is the visible one.
        let all = self.all.iter().rev();
        let nearest =
            all.map(|shown| (distance(shown), shown.feature)).min_by(|a, b| a.0.total_cmp(&b.0))?;
        (nearest.0 <= REACH).then_some(nearest.1)
    }

    /// Lines and marks: inliers thick, the others faint.
    pub(super) fn draw(&self, painter: &Painter, strength: f32) {
        for shown in &self.all {
            let (width, line_strength) = match shown.kind {
                INLIER => (2.2, 1.0),
                UNDECIDED => (1.1, 0.7),
                _ => (1.0, 0.3),
            };
            let color = shown.color.gamma_multiply(strength);
            if let Some([from, to]) = shown.line() {
                painter.line_segment([from, to], (width, color.gamma_multiply(line_strength)));
            }
            let radius = if shown.kind == INLIER { 4.0 } else { 2.3 };
            for end in shown.ends.into_iter().flatten() {
                mark(shown.kind).paint(painter, end, radius, color);
            }
        }
    }

    /// One feature once more, to stand out from all others.
    pub(super) fn draw_accent(&self, painter: &Painter, feature: usize) {
        let Some(shown) = self.all.iter().find(|shown| shown.feature == feature) else {
            return;
        };
        if let Some([from, to]) = shown.line() {
            painter.line_segment([from, to], (4.5, Color32::from_black_alpha(170)));
            painter.line_segment([from, to], (2.2, shown.color));
        }
        for end in shown.ends.into_iter().flatten() {
            painter.circle_filled(end, 8.7, Color32::from_black_alpha(170));
            painter.circle_stroke(end, 7.7, (1.6, Color32::WHITE));
            mark(shown.kind).paint(painter, end, 4.0, shown.color);
        }
    }

    /// The reference keypoints that no shown match has.
    pub(super) fn draw_unmatched(
        &self,
        painter: &Painter,
        progress: &FeatureProgress<'_>,
        at: &Placement,
        strength: f32,
    ) {
        let (mark, radius, color) = if progress.is_unmatched() {
            (MarkShape::Square, 2.3, color(UNDECIDED))
        } else {
            (MarkShape::Disc, 1.3, color(0))
        };
        let color = color.gamma_multiply(strength);
        for (keypoint, is_matched) in progress.reference.iter().zip(&self.is_matched) {
            let place = at.on_screen(position(keypoint));
            if !is_matched && at.visible().contains(place) {
                mark.paint(painter, place, radius, color);
            }
        }
    }
}

impl VisibleFeature {
    /// Its line, where both ends are in view.
    fn line(&self) -> Option<[Pos2; 2]> {
        Some([self.ends[0]?, self.ends[1]?])
    }
}

fn distance_to_segment(point: Pos2, from: Pos2, to: Pos2) -> f32 {
    let along = to - from;
    let share = (point - from).dot(along) / along.length_sq().max(1e-9);
    point.distance(from + share.clamp(0.0, 1.0) * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    fn shown(feature: usize, query: Option<Pos2>, reference: Option<Pos2>) -> VisibleFeature {
        VisibleFeature { feature, kind: INLIER, color: color(INLIER), ends: [query, reference] }
    }

    #[test]
    fn a_keypoint_is_picked_before_a_line_and_nothing_from_afar() {
        let visible = VisibleFeatures {
            all: vec![
                shown(7, Some(pos2(0.0, 0.0)), Some(pos2(0.0, 100.0))),
                shown(8, Some(pos2(5.0, 50.0)), None),
            ],
            is_matched: Vec::new(),
        };
        assert_eq!(visible.nearest(pos2(1.0, 30.0)), Some(7));
        assert_eq!(visible.nearest(pos2(1.0, 50.0)), Some(8));
        assert_eq!(visible.nearest(pos2(6.5, 30.0)), None);
        assert_eq!(visible.nearest(pos2(0.0, 106.5)), None);
        assert_eq!(visible.nearest(pos2(0.0, 105.5)), Some(7));
    }

    #[test]
    fn a_match_without_both_ends_in_view_has_no_line() {
        assert_eq!(shown(1, Some(pos2(0.0, 0.0)), None).line(), None);
    }
}
