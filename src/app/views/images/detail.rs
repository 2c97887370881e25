//! One feature from near: both patches, and every number that was told about it.

use std::sync::Arc;

use egui::{Button, Color32, Rect, RichText, Role, ScrollArea, Sense, Ui, Vec2, WidgetInfo, vec2};
use nalgebra::Point2;

use super::arrangement::PATCH;
use super::lidar::{self, SeenPoint};
use super::marks::{color, draw_truth, mark, position};
use super::photos::{PhotoTexture, Photos};
use super::progress::{FeatureProgress, UNDECIDED, name};
use super::truth::TrueMatch;
use crate::app::views::canvas::Placement;
use crate::app::views::legend;
use crate::app::views::mesh_painter::MeshPainter;
use crate::app::{Command, ViewContext, theme};
use crate::features::FeatureState;
use crate::features::Keypoint;
use crate::palette;
use crate::problem::{Problem, ReferenceTuple};

/// LiDAR points are shown within this distance of the reference keypoint \[px\].
const LIDAR_RADIUS_PX: f64 = 15.0;
/// Half the side of a patch in scales: a little more than the window of the descriptor, 20 scales.
const HALF_PATCH_SCALES: f32 = 11.0;
/// Half the side of a patch is not below this \[px\]: the LiDAR points fit in.
const LEAST_HALF_PATCH_PX: f32 = 16.0;

/// The selected feature, with what was worked out to show it.
#[derive(Default)]
pub(super) struct Detail {
    /// The points around a reference keypoint.
    seen: Option<(Arc<ReferenceTuple>, Point2<f64>, Vec<SeenPoint>)>,
}

/// What the panel is about.
pub(super) struct Subject<'a> {
    pub(super) feature: usize,
    pub(super) progress: &'a FeatureProgress<'a>,
    pub(super) problem: &'a Problem,
    pub(super) photos: &'a Photos,
    /// What the ground truth says, if it is shown.
    pub(super) truth: Option<TrueMatch>,
    /// The inlier threshold \[px\].
    pub(super) inlier_px: f64,
    /// Points within this distance of the keypoint give its depth \[px\].
    pub(super) depth_radius_px: f64,
}

impl Subject<'_> {
    fn query(&self) -> &Keypoint {
        &self.progress.query()[self.feature]
    }

    fn reference(&self) -> Option<&Keypoint> {
        let found = self.progress.matched(self.feature)?;
        self.progress.reference().get(found.reference)
    }

    fn kind(&self) -> usize {
        let state = self.progress.state(self.feature);
        state.map_or(UNDECIDED, |state| state.index())
    }

    /// Every number that was told about the feature, a line each: about its match, its depth, and how
    /// poses explain it.
    fn facts(&self) -> [(&'static str, Vec<String>); 3] {
        [
            ("Match", self.about_match()),
            ("Depth", self.about_depth()),
            ("Pose", self.about_pose()),
        ]
    }

    fn about_match(&self) -> Vec<String> {
        let Some(found) = self.progress.matched(self.feature) else {
            return Vec::new();
        };
        vec![
            format!("ratio {:.4}", found.ratio),
            format!("distance {:.4}", found.distance),
            format!("reference feature {}", found.reference),
        ]
    }

    fn about_depth(&self) -> Vec<String> {
        let Some(lifted) = self.progress.lifted(self.feature) else {
            return Vec::new();
        };
        let mut facts = vec![format!("LiDAR {:.2} px away", lifted.lidar_distance_px)];
        if let Some((least, greatest)) = lifted.depth_range_m {
            facts.push(format!("depths {least:.2} … {greatest:.2} m"));
        }
        facts.push(match &lifted.point {
            Some(p) => format!("3-D point ({:.2}, {:.2}, {:.2}) m", p.x, p.y, p.z),
            None => "no 3-D point".to_owned(),
        });
        facts
    }

    fn about_pose(&self) -> Vec<String> {
        let mut facts = Vec::new();
        match self.progress.state(self.feature) {
            Some(FeatureState::Outlier { residual_px }) if residual_px.is_infinite() => {
                facts.push("no pose to explain it".to_owned());
            }
            Some(FeatureState::Outlier { residual_px } | FeatureState::Inlier { residual_px }) => {
                facts.push(format!("residual {residual_px:.2} px"));
            }
            _ => {}
        }
        if let Some(truth) = &self.truth {
            facts.push(truth.verdict(self.inlier_px));
            if let Some(distance) = truth.line_px {
                facts.push(format!("epipolar line {distance:.2} px off"));
            }
        }
        facts
    }
}

impl Detail {
    /// The panel; where it `is_wide`, its words are beside the patches.
    pub(super) fn ui(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        subject: &Subject<'_>,
        is_wide: bool,
    ) {
        const LEGEND: f32 = 190.0;
        ui.horizontal(|ui| {
            heading(ui, context, subject);
            if is_wide {
                legend::depth_bar(ui, LEGEND);
                ui.weak("LiDAR depth");
            }
        });
        if is_wide {
            ui.horizontal_top(|ui| {
                self.patches(ui, subject);
                ui.vertical(|ui| words(ui, context, subject));
            });
        } else {
            ui.horizontal_top(|ui| self.patches(ui, subject));
            legend::depth_bar(ui, LEGEND.min(ui.available_width()));
            words(ui, context, subject);
        }
    }

    fn patches(&mut self, ui: &mut Ui, subject: &Subject<'_>) {
        let query = subject.query();
        let reference = subject.reference();
        // The same number of scales in both, so that a true match looks the same.
        let least = reference.map_or(query.scale, |other| other.scale.min(query.scale));
        let scales = HALF_PATCH_SCALES.max(LEAST_HALF_PATCH_PX / least.max(0.1));
        let photos = subject.photos;

        let at = patch(
            ui,
            "query patch",
            query,
            scales * query.scale,
            &photos.query,
        );
        if let (Some(at), Some(truth)) = (at, &subject.truth) {
            let painter = at.painter(ui.painter());
            let mut mesh = MeshPainter::new(ui.pixels_per_point());
            draw_truth(&mut mesh, &at, &subject.problem.query.intrinsics, truth);
            mesh.paint_on(&painter);
        }

        let Some(reference) = reference else {
            ui.weak("The reference\nhas no feature");
            return;
        };
        let half = scales * reference.scale;
        let at = patch(ui, "reference patch", reference, half, &photos.reference);
        if let Some(at) = at {
            self.lidar(ui, subject, reference, &at);
        }
    }

    fn lidar(&mut self, ui: &Ui, subject: &Subject<'_>, keypoint: &Keypoint, at: &Placement) {
        let (tuple, pixel) = (&subject.problem.reference, keypoint.pixel());
        let is_known = self
            .seen
            .as_ref()
            .is_some_and(|(of, around, _)| Arc::ptr_eq(of, tuple) && *around == pixel);
        if !is_known {
            let seen = lidar::around(tuple, &pixel, LIDAR_RADIUS_PX);
            self.seen = Some((Arc::clone(tuple), pixel, seen));
        }
        let mut mesh = MeshPainter::new(ui.pixels_per_point());
        let radius = (0.35 * at.scale).clamp(1.5, 4.0);
        let seen = self.seen.iter().flat_map(|(_, _, seen)| seen);
        for (rank, point) in seen.enumerate() {
            let place = at.on_screen(point.pixel.cast::<f32>().into());
            let color = theme::rgb(palette::depth(point.depth_m));
            mesh.disc(place, radius + 0.8, Color32::from_black_alpha(150));
            mesh.disc(place, radius, color);
            if rank == 0 {
                mesh.ring(place, radius + 2.0, 1.2, Color32::WHITE);
            }
        }
        let radius = subject.depth_radius_px as f32 * at.scale;
        let middle = at.on_screen(position(keypoint));
        mesh.ring(middle, radius, 1.0, Color32::WHITE.gamma_multiply(0.8));
        mesh.paint_on(&at.painter(ui.painter()));
    }
}

fn heading(ui: &mut Ui, context: &ViewContext<'_>, subject: &Subject<'_>) {
    let kind = subject.kind();
    let (rect, _) = ui.allocate_exact_size(Vec2::splat(14.0), Sense::hover());
    let mut mesh = MeshPainter::new(ui.pixels_per_point());
    mesh.mark(mark(kind), rect.center(), 4.5, color(kind));
    mesh.paint_on(ui.painter());
    ui.strong(format!("query feature {}: {}", subject.feature, name(kind)));
    let close = ui.add(Button::new("×").small()).on_hover_text("Close");
    if close.accessible_name("Close feature").clicked() {
        context.send(Command::SelectFeature(None));
    }
}

fn words(ui: &mut Ui, context: &ViewContext<'_>, subject: &Subject<'_>) {
    let area = ScrollArea::vertical().id_salt("facts").auto_shrink(false);
    area.show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        let [matching, depth, pose] = subject.facts();
        ui.horizontal_top(|ui| {
            ui.vertical(|ui| {
                group(ui, &matching);
                rival(ui, context, subject);
            });
            ui.add_space(8.0);
            ui.vertical(|ui| group(ui, &depth));
        });
        group(ui, &pose);
    });
}

fn group(ui: &mut Ui, (title, facts): &(&str, Vec<String>)) {
    if facts.is_empty() {
        return;
    }
    ui.label(RichText::new(*title).small().weak());
    for fact in facts {
        ui.label(fact);
    }
}

/// The query feature that the nearest reference feature resembles more.
fn rival(ui: &mut Ui, context: &ViewContext<'_>, subject: &Subject<'_>) {
    let Some(FeatureState::NotUnique { rival }) = subject.progress.state(subject.feature) else {
        return;
    };
    let help = "The reference feature resembles this query feature more; click to look at it";
    let link = ui.link(format!("rival: query feature {rival}"));
    if link.on_hover_text(help).clicked() {
        context.send(Command::SelectFeature(Some(rival)));
    }
}

/// The surroundings of a keypoint, magnified, with a circle of its scale and the descriptor's window.
fn patch(
    ui: &mut Ui,
    name: &str,
    keypoint: &Keypoint,
    half: f32,
    photo: &PhotoTexture,
) -> Option<Placement> {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(PATCH), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    response.on_hover_text(format!(
        "{name}: scale {:.1} px; the square is what the descriptor saw",
        keypoint.scale
    ));
    if !ui.is_rect_visible(rect) {
        return None;
    }
    let at = Placement::around(position(keypoint), half, rect, photo.size());
    ui.painter()
        .rect_filled(rect, 0.0, theme::rgb(palette::NOTHING));
    at.paint(ui.painter(), photo.id(), Color32::WHITE);
    let mut mesh = MeshPainter::new(ui.pixels_per_point());
    let middle = rect.center();
    let radius = (keypoint.scale * at.scale).max(2.0);
    for (width, color) in [(3.0, Color32::from_black_alpha(120)), (1.4, Color32::WHITE)] {
        mesh.ring(middle, radius, width, color);
        let reach = 10.0 * keypoint.scale * at.scale;
        let corner = |x: f32, y: f32| {
            let turn = egui::emath::Rot2::from_angle(keypoint.angle);
            middle + turn * (reach * vec2(x, y))
        };
        let corners =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| corner(x, y));
        for side in 0..4 {
            mesh.line(corners[side], corners[(side + 1) % 4], 0.5 * width, color);
        }
    }
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    mesh.paint_on(&painter);
    outline(ui, rect);
    Some(at)
}

fn outline(ui: &Ui, rect: Rect) {
    let stroke = ui.visuals().widgets.noninteractive.bg_stroke;
    ui.painter()
        .rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Outside);
}
