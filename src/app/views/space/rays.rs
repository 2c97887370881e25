//! Rays from a camera to the points that FB lifted from the reference keypoints.

use egui::Color32;
use nalgebra::Point3;

use super::gpu::Line;
use super::scene_geometry::SceneGeometry;
use crate::app::theme;
use crate::app::views::features::FeatureProgress;
use crate::features::FeatureState;

/// The rays, and how many of each kind.
#[derive(Default)]
pub(super) struct Rays {
    pub(super) lines: Vec<Line>,
    pub(super) inliers: usize,
    pub(super) outliers: usize,
    pub(super) undecided: usize,
}

/// From the estimated camera; before there is one, from the reference camera that saw the points.
/// Rays of outliers are dashed. `selected` is drawn broad.
pub(super) fn rays(
    geometry: &SceneGeometry,
    features: &FeatureProgress<'_>,
    selected: Option<usize>,
) -> Rays {
    let centre = match &features.reference_from_query {
        Some(pose) => Point3::from(pose.translation.vector),
        None => Point3::origin(),
    };
    let mut rays = Rays::default();
    for lifted in features.lifted {
        let Some(point) = lifted.point else { continue };
        let state = features.states.and_then(|states| states.get(lifted.query));
        let is_outlier = state.is_some_and(|state| !matches!(state, FeatureState::Inlier { .. }));
        let (color, count) = match state {
            Some(_) if is_outlier => (outlier_color(), &mut rays.outliers),
            Some(_) => (inlier_color(), &mut rays.inliers),
            None => (theme::CAMERA, &mut rays.undecided),
        };
        *count += 1;
        let (color, width) = if selected == Some(lifted.query) {
            (color, 4.0)
        } else {
            // Pale: the cameras matter more.
            (color.gamma_multiply(0.25), 1.0)
        };
        let along = |share: f64| geometry.spot(&(centre + share * (point - centre)));
        let mut piece = |from: f64, to: f64| {
            rays.lines.push(Line { ends: [along(from), along(to)], color, width });
        };
        if is_outlier {
            const DASHES: u32 = 12;
            for dash in 0..DASHES {
                let from = f64::from(dash) / f64::from(DASHES);
                piece(from, from + 0.5 / f64::from(DASHES));
            }
        } else {
            piece(0.0, 1.0);
        }
    }
    rays
}

pub(super) fn inlier_color() -> Color32 {
    theme::state(FeatureState::Inlier { residual_px: 0.0 }.index())
}

pub(super) fn outlier_color() -> Color32 {
    theme::state(FeatureState::Outlier { residual_px: 0.0 }.index())
}
