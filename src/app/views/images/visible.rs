//! Where features are on the screen, and which of them is pointed at.

use egui::{Color32, Pos2};

use super::marks::{color, mark, position};
use super::progress::{FeatureProgress, KINDS, UNDECIDED};
use crate::app::views::canvas::Placement;
use crate::app::views::mesh_painter::{MarkShape, MeshPainter};

/// How near the pointer must be \[points\].
const REACH: f32 = 6.0;
/// Scales are drawn as circles where they are larger than this \[points\].
const LEAST_SCALE: f32 = 7.0;
/// States from the back to the front.
const LAYERS: [usize; KINDS] = [0, 1, 2, 3, UNDECIDED, 4];

/// A query feature on the screen, with the match that it made or missed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct VisibleFeature {
    pub(super) feature: usize,
    kind: usize,
    /// Its keypoint in the query, if that is in view.
    query: Option<Pos2>,
    /// The keypoint of its nearest reference feature, if that is in view.
    reference: Option<Pos2>,
    /// Scales of both \[px\].
    scales: [f32; 2],
}

/// All features in view, the hindmost first.
pub(super) struct VisibleFeatures {
    all: Vec<VisibleFeature>,
    /// Whether a reference keypoint has a mark of a match.
    is_matched: Vec<bool>,
}

impl VisibleFeatures {
    /// The features that are shown and in view.
    pub(super) fn new(
        progress: &FeatureProgress<'_>,
        kinds: &[usize],
        query: &Placement,
        reference: &Placement,
        is_shown: impl Fn(usize) -> bool,
    ) -> Self {
        let mut all = Vec::with_capacity(kinds.len());
        let mut is_matched = vec![false; progress.reference().len()];
        let areas = [query.visible(), reference.visible()];
        for layer in LAYERS {
            for (feature, &kind) in kinds.iter().enumerate() {
                if kind != layer || !is_shown(feature) {
                    continue;
                }
                let here = &progress.query()[feature];
                let there = progress.matched(feature).and_then(|found| {
                    Some((found.reference, progress.reference().get(found.reference)?))
                });
                if let Some((index, _)) = there {
                    is_matched[index] = true;
                }
                let seen = |at: Pos2, area: usize| areas[area].contains(at).then_some(at);
                let shown = VisibleFeature {
                    feature,
                    kind,
                    query: seen(query.on_screen(position(here)), 0),
                    reference: there
                        .and_then(|(_, there)| seen(reference.on_screen(position(there)), 1)),
                    scales: [here.scale, there.map_or(0.0, |(_, there)| there.scale)],
                };
                if shown.query.is_some() || shown.reference.is_some() {
                    all.push(shown);
                }
            }
        }
        Self { all, is_matched }
    }

    /// All of them, the hindmost first.
    pub(super) fn all(&self) -> &[VisibleFeature] {
        &self.all
    }

    /// The feature whose keypoint is nearest to the pointer, else the one whose line is; none where
    /// none is near.
    pub(super) fn nearest(&self, pointer: Pos2) -> Option<usize> {
        let to_keypoint = |shown: &VisibleFeature| {
            let ends = [shown.query, shown.reference].into_iter().flatten();
            ends.map(|end| end.distance(pointer))
                .fold(f32::INFINITY, f32::min)
        };
        let to_line = |shown: &VisibleFeature| match shown.line() {
            Some([from, to]) => distance_to_segment(pointer, from, to),
            None => f32::INFINITY,
        };
        self.nearest_by(to_keypoint)
            .or_else(|| self.nearest_by(to_line))
    }

    fn nearest_by(&self, distance: impl Fn(&VisibleFeature) -> f32) -> Option<usize> {
        // Of equally near ones the foremost, which is the one to be seen.
        let distances = self
            .all
            .iter()
            .rev()
            .map(|shown| (distance(shown), shown.feature));
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (nearest.0 <= REACH).then_some(nearest.1)
    }

    /// One feature once more, to stand out from all others.
    pub(super) fn draw_accent(&self, mesh: &mut MeshPainter, feature: usize) {
        if let Some(shown) = self.all.iter().find(|shown| shown.feature == feature) {
            shown.draw_accent(mesh);
        }
    }

    /// The reference keypoints that no shown match has.
    pub(super) fn draw_unmatched(
        &self,
        mesh: &mut MeshPainter,
        progress: &FeatureProgress<'_>,
        at: &Placement,
        strength: f32,
    ) {
        let area = at.visible();
        let (mark, radius, color) = if progress.is_unmatched() {
            (MarkShape::Square, radius(UNDECIDED), color(UNDECIDED))
        } else {
            (MarkShape::Disc, 1.3, color(0))
        };
        let color = color.gamma_multiply(strength);
        for (keypoint, is_matched) in progress.reference().iter().zip(&self.is_matched) {
            let place = at.on_screen(position(keypoint));
            if !is_matched && area.contains(place) {
                mesh.mark(mark, place, radius, color);
            }
        }
    }
}

impl VisibleFeature {
    /// Its line, where both ends are in view.
    fn line(&self) -> Option<[Pos2; 2]> {
        Some([self.query?, self.reference?])
    }

    /// Line and marks; `points_per_pixel` tells how large the scales are.
    pub(super) fn draw(&self, mesh: &mut MeshPainter, strength: f32, points_per_pixel: f32) {
        let color = color(self.kind);
        if let Some([from, to]) = self.line() {
            let pale = color.gamma_multiply(strength * line_strength(self.kind));
            mesh.line(from, to, 1.1, pale);
        }
        let color = color.gamma_multiply(strength);
        for (end, scale) in [self.query, self.reference].into_iter().zip(self.scales) {
            let Some(end) = end else { continue };
            mesh.mark(mark(self.kind), end, radius(self.kind), color);
            let radius = scale * points_per_pixel;
            if radius > LEAST_SCALE {
                mesh.ring(end, radius, 1.0, color.gamma_multiply(0.7));
            }
        }
    }

    fn draw_accent(&self, mesh: &mut MeshPainter) {
        let color = color(self.kind);
        if let Some([from, to]) = self.line() {
            mesh.line(from, to, 4.5, Color32::from_black_alpha(170));
            mesh.line(from, to, 2.2, color);
        }
        for end in [self.query, self.reference].into_iter().flatten() {
            mesh.disc(end, 8.7, Color32::from_black_alpha(170));
            mesh.ring(end, 7.7, 1.6, Color32::WHITE);
            mesh.mark(mark(self.kind), end, 4.0, color);
        }
    }
}

/// Radius of a state's mark \[points\]: smaller for the states that most features are in.
fn radius(kind: usize) -> f32 {
    match kind {
        0 | UNDECIDED => 2.3,
        _ => 3.2,
    }
}

fn line_strength(kind: usize) -> f32 {
    match kind {
        0 => 0.25,
        1 | 2 => 0.45,
        3 => 0.6,
        _ => 0.85,
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
        VisibleFeature {
            feature,
            kind: 4,
            query,
            reference,
            scales: [2.0; 2],
        }
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
