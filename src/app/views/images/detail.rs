//! One match from near: both patches, and the numbers that decided it.

use std::sync::Arc;

use egui::{Button, Color32, Grid, Painter, Rect, Sense, TextureHandle, Ui, UiBuilder, Vec2, vec2};
use nalgebra::Point2;

use super::truth::{TrueMatch, draw_truth};
use crate::app::memo::{Memo, Same};
use crate::app::views::canvas::Placement;
use crate::app::views::features::{UNDECIDED, color, error_px, mark, name, position};
use crate::app::views::legend::name_picture;
use crate::app::{Sends, ViewContext, theme};
use crate::feature_progress::FeatureProgress;
use crate::features::{FeatureState, Keypoint};
use crate::palette;
use crate::problem::{Problem, ReferenceTuple};

/// Side of a patch on the screen \[points\].
const PATCH: f32 = 112.0;
/// Room for two patches with the numbers below \[points\].
pub(super) const SIZE: Vec2 = vec2(2.0 * PATCH + 20.0, 306.0);
/// LiDAR points are shown within this distance of the reference keypoint \[px\].
const LIDAR_RADIUS_PX: f64 = 15.0;
/// Half the side of a patch in scales: a little more than the window of the descriptor, 20 scales.
const HALF_PATCH_SCALES: f32 = 11.0;
/// Half the side of a patch is not below this \[px\]: the LiDAR points fit in.
const MIN_HALF_PATCH_PX: f32 = 16.0;

/// The LiDAR points around the keypoint that was shown last.
#[derive(Default)]
pub(super) struct Detail {
    seen: Memo<(Same<ReferenceTuple>, Point2<f64>), Vec<SeenPoint>>,
}

/// A point of the scan: its pixel in the reference \[px\] and its depth \[m\].
type SeenPoint = (Point2<f64>, f64);

/// What the details are about.
pub(super) struct Subject<'a> {
    pub(super) feature: usize,
    pub(super) progress: &'a FeatureProgress<'a>,
    pub(super) problem: &'a Problem,
    pub(super) photos: [&'a TextureHandle; 2],
    /// What the ground truth says, if it is shown.
    pub(super) truth: Option<TrueMatch>,
    /// Points within this distance of the keypoint give its depth \[px\].
    pub(super) depth_radius_px: f64,
}

impl Subject<'_> {
    fn reference(&self) -> Option<&Keypoint> {
        let found = self.progress.matched(self.feature)?;
        self.progress.reference.get(found.reference)
    }

    /// The numbers of the match, each with its name.
    fn facts(&self) -> Vec<(&'static str, String)> {
        let mut facts = Vec::new();
        if let Some(found) = self.progress.matched(self.feature) {
            facts.push(("Ratio to second best", format!("{:.3}", found.ratio)));
            facts.push(("Descriptor distance", format!("{:.3}", found.distance)));
        }
        if let Some(lifted) = self.progress.lifted(self.feature) {
            let depth = lifted.point.map(|point| format!("{:.2} m", point.z));
            facts.push(("Depth", depth.unwrap_or_else(|| "none".to_owned())));
            if let Some((least, greatest)) = lifted.depth_range_m {
                facts.push(("Depths around it", format!("{least:.2} … {greatest:.2} m")));
            }
            let distance = format!("{:.2} px", lifted.lidar_distance_px);
            facts.push(("Nearest LiDAR point", distance));
        }
        if let Some(FeatureState::Outlier { residual_px } | FeatureState::Inlier { residual_px }) =
            self.progress.state(self.feature)
        {
            facts.push(("Reprojection error", error_px(residual_px)));
        }
        if let Some(truth) = &self.truth {
            facts.push(("By the truth", truth.verdict().to_owned()));
            if let Some(distance) = truth.place_px {
                facts.push(("Off at the truth", format!("{distance:.2} px")));
            }
            if let Some(distance) = truth.line_px {
                facts.push(("Off the epipolar line", format!("{distance:.2} px")));
            }
        }
        facts
    }
}

impl Detail {
    /// Both patches with the numbers below them, on the photos.
    pub(super) fn ui(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        subject: &Subject<'_>,
        area: Rect,
    ) {
        // What lies below is not pointed at.
        ui.interact(area, ui.scope_id().with("details"), Sense::click());
        let (fill, stroke) = (ui.visuals().panel_fill, ui.visuals().window_stroke);
        ui.painter().rect(area, 4.0, fill, stroke, egui::StrokeKind::Inside);
        ui.scope_builder(UiBuilder::new().max_rect(area.shrink(8.0)), |ui| {
            ui.shrink_clip_rect(area);
            ui.spacing_mut().item_spacing = vec2(4.0, 2.0);
            ui.horizontal_top(|ui| self.patches(ui, subject));
            numbers(ui, context, subject);
        });
    }

    fn patches(&mut self, ui: &mut Ui, subject: &Subject<'_>) {
        let query = &subject.progress.query[subject.feature];
        let reference = subject.reference();
        // The same number of scales in both, so that a true match looks the same.
        let least = reference.map_or(query.scale, |other| other.scale.min(query.scale));
        let scales = HALF_PATCH_SCALES.max(MIN_HALF_PATCH_PX / least.max(0.1));
        let [query_photo, reference_photo] = subject.photos;
        let at = patch(ui, "query patch", query, scales, query_photo);
        if let Some(truth) = &subject.truth {
            let painter = at.painter(ui.painter());
            draw_truth(&painter, &at, subject.problem.query().intrinsics(), truth);
        }
        let Some(reference) = reference else {
            ui.weak("Nothing to match");
            return;
        };
        let at = patch(ui, "reference patch", reference, scales, reference_photo);
        let tuple = subject.problem.reference();
        let painter = at.painter(ui.painter());
        self.draw_lidar(&painter, tuple, &reference.pixel(), &at);
        let radius = subject.depth_radius_px as f32 * at.scale;
        let middle = at.on_screen(position(reference));
        painter.circle_stroke(middle, radius, (1.0, Color32::WHITE.gamma_multiply(0.8)));
    }

    /// Draws the LiDAR points around a pixel in the colours of their depths.
    fn draw_lidar(
        &mut self,
        painter: &Painter,
        tuple: &Arc<ReferenceTuple>,
        pixel: &Point2<f64>,
        at: &Placement,
    ) {
        let key = (Same(Arc::clone(tuple)), *pixel);
        let seen = self.seen.get(key, || lidar_around(tuple, pixel, LIDAR_RADIUS_PX));
        let radius = (0.35 * at.scale).clamp(1.5, 4.0);
        for (rank, (pixel, depth_m)) in seen.iter().enumerate() {
            let place = at.on_screen(pixel.cast::<f32>().into());
            painter.circle_filled(place, radius + 0.8, Color32::from_black_alpha(150));
            painter.circle_filled(place, radius, theme::rgb(palette::depth(*depth_m)));
            if rank == 0 {
                painter.circle_stroke(place, radius + 2.0, (1.2, Color32::WHITE));
            }
        }
    }
}

/// What the match is, and its numbers.
fn numbers(ui: &mut Ui, context: &ViewContext<'_>, subject: &Subject<'_>) {
    let state = subject.progress.state(subject.feature);
    let kind = state.map_or(UNDECIDED, |state| state.index());
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(Vec2::splat(14.0), Sense::hover());
        mark(kind).paint(ui.painter(), rect.center(), 4.5, color(kind));
        ui.strong(format!("Feature {}: {}", subject.feature, name(kind)));
        let close = ui.add(Button::new("×").small()).on_hover_text("Close");
        close
            .accessible_name("Close feature")
            .sends(context, |app| app.state.options.selected_feature = None);
    });
    if let Some(FeatureState::NotUnique { rival }) = state {
        let help = "The reference feature resembles this query feature more; click to select it";
        let link = ui.link(format!("Nearer to query feature {rival}"));
        link.on_hover_text(help)
            .sends(context, move |app| app.state.options.selected_feature = Some(rival));
    }
    let grid = Grid::new("facts").num_columns(2).min_row_height(0.0);
    grid.spacing(vec2(10.0, 2.0)).show(ui, |ui| {
        for (name, value) in subject.facts() {
            ui.weak(name);
            ui.label(context.in_unit(&value));
            ui.end_row();
        }
    });
}

/// The surroundings of a keypoint, magnified. The crosshair has the keypoint's direction and reaches as far as the
/// descriptor; the circle is its scale.
fn patch(
    ui: &mut Ui,
    name: &str,
    keypoint: &Keypoint,
    half_scales: f32,
    photo: &TextureHandle,
) -> Placement {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(PATCH), Sense::hover());
    name_picture(&response, name);
    response.on_hover_text(format!(
        "{name}: scale {:.1} px; the crosshair reaches as far as the descriptor. Dots are LiDAR points by depth",
        keypoint.scale
    ));
    let half = half_scales * keypoint.scale;
    let at = Placement::around(position(keypoint), half, rect, photo.size_vec2());
    let nothing = theme::rgb(palette::NOTHING);
    ui.painter().rect_filled(rect, 0.0, nothing);
    at.paint(ui.painter(), photo.id(), Color32::WHITE);
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let (middle, scale) = (rect.center(), keypoint.scale * at.scale);
    let turn = egui::emath::Rot2::from_angle(keypoint.angle);
    for (width, color) in [(3.0, Color32::from_black_alpha(120)), (1.4, Color32::WHITE)] {
        painter.circle_stroke(middle, scale.max(2.0), (width, color));
        for arm in [Vec2::RIGHT, Vec2::LEFT, Vec2::UP, Vec2::DOWN] {
            let arm = turn * (scale * arm);
            painter.line_segment([middle + 2.5 * arm, middle + 10.0 * arm], (width, color));
        }
    }
    at
}

/// The points within a radius \[px\] of a pixel, the nearest to it first.
fn lidar_around(tuple: &ReferenceTuple, pixel: &Point2<f64>, radius_px: f64) -> Vec<SeenPoint> {
    let points = tuple.cloud().points.iter();
    let seen = points.filter_map(|point| {
        let seen = tuple.intrinsics().project(&point.cast())?;
        Some((seen, f64::from(point.z)))
    });
    let distance = |seen: &SeenPoint| (seen.0 - pixel).norm_squared();
    let mut seen: Vec<SeenPoint> =
        seen.filter(|seen| distance(seen) <= radius_px * radius_px).collect();
    seen.sort_by(|a, b| {
        let by_distance = distance(a).total_cmp(&distance(b));
        by_distance.then(a.1.total_cmp(&b.1))
    });
    seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;
    use crate::cloud::Cloud;
    use crate::geometry::Pose;
    use crate::image::{GrayImage, Photo};

    #[test]
    fn only_points_near_the_pixel_and_in_front_are_seen_the_nearest_first() {
        let intrinsics =
            Intrinsics { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0, width: 101, height: 81 };
        let at = |x: f64, y: f64, z: f64| intrinsics.unproject(&Point2::new(x, y), z).cast();
        let mut points = vec![at(20.0, 20.0, 10.0), at(22.0, 20.0, 30.0), at(60.0, 60.0, 5.0)];
        points.push(-points[0]);
        let photo = Photo::from_gray(GrayImage::new(101, 81));
        let (pose, cloud) = (Pose::identity(), Cloud { points });
        let tuple = ReferenceTuple::new("reference", photo, intrinsics, pose, cloud);
        let tuple = tuple.expect("fits");
        let seen = lidar_around(&tuple, &Point2::new(22.5, 20.0), 15.0);
        let depths: Vec<f64> = seen.iter().map(|(_, depth_m)| depth_m.round()).collect();
        assert_eq!(depths, [30.0, 10.0]);
    }
}
