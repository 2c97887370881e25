//! Both photos, their features, and where each feature ended.

mod arrangement;
mod detail;
mod funnel;
mod lidar;
mod marks;
mod photos;
mod progress;
mod truth;
mod visible;

use egui::{Ui, UiBuilder};

pub(super) use self::arrangement::Arrangement;
use self::detail::{Detail, Subject};
use self::marks::draw_truth;
use self::photos::{PhotoOnScreen, PhotoPanZoom, Photos};
use self::progress::{FeatureProgress, KINDS};
use self::truth::TrueMatch;
use self::visible::VisibleFeatures;
use super::View;
use super::mesh_painter::MeshPainter;
use crate::app::{Command, ViewContext};
use crate::event::Side;
use crate::method::Method;
use crate::problem::Problem;

/// How strong features are drawn while the pointer is on another one.
const PALE: f32 = 0.2;

/// Query above or beside reference.
pub struct ImagesView {
    /// Which states are shown.
    shown: [bool; KINDS],
    pan_zoom: PhotoPanZoom,
    detail: Detail,
}

impl Default for ImagesView {
    fn default() -> Self {
        let mut shown = [true; KINDS];
        // Most features fail the first two tests; their lines would bury all others.
        shown[..2].fill(false);
        Self {
            shown,
            pan_zoom: PhotoPanZoom::default(),
            detail: Detail::default(),
        }
    }
}

impl View for ImagesView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(problem) = context.problem() else {
            ui.weak("The photos are being read");
            return;
        };
        let photos = Photos::of(ui, context, problem);
        let progress = FeatureProgress::at(context);
        let kinds = progress.kinds();
        let differing = differing(context, &progress);
        self.toolbar(ui, context, &progress, differing.as_deref());
        if !kinds.is_empty() {
            let mut counts = [0; KINDS];
            for &kind in &kinds {
                counts[kind] += 1;
            }
            funnel::ui(ui, &counts, &mut self.shown);
        }

        let selected = context
            .options
            .selected_feature
            .filter(|&i| i < kinds.len());
        let area = ui.available_rect_before_wrap();
        let (pictures, panel) = match selected {
            Some(_) => {
                let (query, reference) = (photos.query.size(), photos.reference.size());
                let (pictures, panel) = arrangement::split(area, query, reference);
                (pictures, Some(panel))
            }
            None => (area, None),
        };
        let (query, reference) = self.pan_zoom.show(ui, problem, &photos, pictures);

        let is_wanted = |feature: usize| {
            self.shown[kinds[feature]] && differing.as_ref().is_none_or(|differ| differ[feature])
        };
        let is_shown = |feature: usize| selected == Some(feature) || is_wanted(feature);
        let visible = VisibleFeatures::new(&progress, &kinds, &query.at, &reference.at, is_shown);
        let hovered = point_at(ui, context, &visible, &progress, [&query, &reference]);
        let truth = selected.and_then(|feature| true_match(context, &progress, problem, feature));

        let mut mesh = MeshPainter::new(ui.pixels_per_point());
        let strength = if hovered.is_some() { PALE } else { 1.0 };
        if progress.is_unmatched() || self.shown[0] {
            visible.draw_unmatched(&mut mesh, &progress, &reference.at, strength);
        }
        for shown in visible.all() {
            shown.draw(&mut mesh, strength, query.at.scale);
        }
        for feature in [selected, hovered].into_iter().flatten() {
            visible.draw_accent(&mut mesh, feature);
        }
        mesh.paint_on(ui.painter());
        if let Some(truth) = &truth {
            draw_truth(&mut mesh, &query.at, &problem.query.intrinsics, truth);
            mesh.paint_on(&query.at.painter(ui.painter()));
        }
        let labels = [Side::Query, Side::Reference].map(|side| context.frame_label(side, problem));
        photos::name(ui, &labels, &query.at, &reference.at);

        if let (Some(feature), Some(panel)) = (selected, panel) {
            let params = &context.run.params.fb;
            let subject = Subject {
                feature,
                progress: &progress,
                problem,
                photos: &photos,
                truth,
                inlier_px: params.mlesac.inlier_threshold_px,
                depth_radius_px: params.depth_radius_px,
            };
            ui.scope_builder(UiBuilder::new().max_rect(panel.area), |ui| {
                ui.shrink_clip_rect(panel.area);
                self.detail.ui(ui, context, &subject, panel.is_wide);
            });
        }
        ui.advance_cursor_after_rect(area);
    }
}

impl ImagesView {
    fn toolbar(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        progress: &FeatureProgress<'_>,
        differing: Option<&[bool]>,
    ) {
        ui.horizontal_wrapped(|ui| {
            ui.label(summary(progress));
            self.pan_zoom.ui(ui);
            if context.options.only_differences {
                ui.weak(match differing {
                    Some(differing) => {
                        let count = differing.iter().filter(|differs| **differs).count();
                        format!("{count} features end in another state than in the other run")
                    }
                    None => "Differences need another run: keep one as A (P)".to_owned(),
                });
            }
        });
    }
}

/// What was found, in words.
fn summary(progress: &FeatureProgress<'_>) -> String {
    let (query, reference) = (progress.query().len(), progress.reference().len());
    let by = match progress.method {
        Some(method) if method != Method::FB => format!("FB within {}", method.label()),
        _ => "FB".to_owned(),
    };
    match (query, reference) {
        (0, 0) => "No features yet: FB finds them first".to_owned(),
        _ => format!("{by}: {query} query keypoints, {reference} reference keypoints"),
    }
}

/// Which features differ from the other run, where only those are wanted.
fn differing(context: &ViewContext<'_>, progress: &FeatureProgress<'_>) -> Option<Vec<bool>> {
    let wanted = context.options.only_differences;
    let other = context.other_run().filter(|_| wanted)?;
    let other = FeatureProgress::counterpart(context, progress.method?, other)?;
    Some(progress.differing(&other))
}

/// What the ground truth says about a feature's match, if it is shown.
fn true_match(
    context: &ViewContext<'_>,
    progress: &FeatureProgress<'_>,
    problem: &Problem,
    feature: usize,
) -> Option<TrueMatch> {
    let found = progress.matched(feature)?;
    let lifted = progress.lifted(feature);
    Some(TrueMatch::of(
        problem,
        context.truth()?,
        &progress.query().get(feature)?.pixel(),
        &progress.reference().get(found.reference)?.pixel(),
        lifted.and_then(|lifted| lifted.point.as_ref()),
    ))
}

/// The feature under the pointer; a click selects it.
fn point_at(
    ui: &Ui,
    context: &ViewContext<'_>,
    visible: &VisibleFeatures,
    progress: &FeatureProgress<'_>,
    photos: [&PhotoOnScreen; 2],
) -> Option<usize> {
    let over = photos.into_iter().find(|photo| photo.response.hovered())?;
    let hovered = visible.nearest(over.response.hover_pos()?);
    if over.response.clicked() && context.options.selected_feature != hovered {
        context.send(Command::SelectFeature(hovered));
    }
    if let Some(feature) = hovered {
        ui.ctx().set_cursor_icon(egui::CursorIcon::PointingHand);
        let words = progress.words(feature);
        let response = over.response.clone();
        response.on_hover_text_at_pointer(format!("query feature {feature}, {words}"));
    }
    hovered
}
