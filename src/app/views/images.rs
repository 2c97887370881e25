//! Both photos, their features, and where each feature ended.

mod detail;
mod funnel;
mod pair;
mod truth;
mod visible;

use egui::{Rect, Response, Ui, UiBuilder, vec2};

use self::detail::{Detail, Subject};
pub(super) use self::pair::{PhotoPair, photo};
use self::truth::{TrueMatch, draw_truth};
use self::visible::VisibleFeatures;
use super::View;
use super::canvas::PanZoom;
use super::features::{self, INLIER, KINDS};
use super::ovals::Ovals;
use crate::app::ViewContext;
use crate::diagnosis::true_match_px;
use crate::feature_progress::FeatureProgress;
use crate::problem::Problem;

/// How strong features are drawn while the pointer is on another one.
const PALE: f32 = 0.2;
/// Between the photos, the details and the funnel \[points\].
const GAP: f32 = 6.0;

/// Query above or beside reference, with the funnel below.
pub struct ImagesView {
    /// Which states are shown.
    shown: [bool; KINDS],
    pan_zoom: PanZoom,
    detail: Detail,
}

impl Default for ImagesView {
    fn default() -> Self {
        let mut shown = [true; KINDS];
        // Most features fail the first two tests; their lines would bury all others.
        shown[..2].fill(false);
        Self { shown, pan_zoom: PanZoom::default(), detail: Detail::default() }
    }
}

impl View for ImagesView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(problem) = context.problem() else {
            ui.weak("Reading the photos");
            return;
        };
        let progress = features::at(context);
        let kinds = features::kinds(&progress);
        let selected = context.options.selected_feature.filter(|&feature| feature < kinds.len());
        let textures = [problem.query().photo(), problem.reference().photo()]
            .map(|source| photo(ui, context, source));
        let [query, reference] = &textures;

        let area = ui.available_rect_before_wrap();
        let (photos, chips) = area.split_top_bottom_at_y(area.bottom() - funnel::HEIGHT - GAP);
        let chips = chips.with_min_y(chips.top() + GAP);
        let names = [
            format!("query photo {}", problem.query().name()),
            format!("reference photo {}", problem.reference().name()),
        ];
        let ovals = context.method().map(|method| Ovals::of(context, problem, method));
        let ovals = ovals.unwrap_or_default();
        let captions = [
            caption("Query", progress.query.len()) + ovals.words(),
            caption("Reference", progress.reference.len()),
        ];
        let pair = PhotoPair::show(ui, photos, [query, reference], names, &mut self.pan_zoom);

        let is_shown = |feature| selected == Some(feature) || self.shown[kinds[feature]];
        let is_false = |feature| {
            kinds[feature] == INLIER
                && true_match(context, &progress, problem, feature)
                    .is_some_and(|truth| truth.is_true() == Some(false))
        };
        let visible = VisibleFeatures::new(&progress, &kinds, &pair.at, is_shown, is_false);
        let hovered = point_at(ui, context, &visible, &progress, &pair.over);
        let painter = ui.painter();
        let strength = if hovered.is_some() { PALE } else { 1.0 };
        if progress.is_unmatched() || self.shown[0] {
            visible.draw_unmatched(painter, &progress, &pair.at[1], strength);
        }
        visible.draw(painter, strength);
        ovals.draw(&pair.at[0].painter(painter), &pair.at[0]);
        for feature in [selected, hovered].into_iter().flatten() {
            visible.draw_accent(painter, feature);
        }
        let truth = selected.and_then(|feature| true_match(context, &progress, problem, feature));
        if let Some(truth) = &truth {
            let painter = pair.at[0].painter(painter);
            draw_truth(&painter, &pair.at[0], problem.query().intrinsics(), truth);
        }
        pair.name(ui, captions);

        if let Some(feature) = selected.filter(|_| photos.width() > 2.0 * detail::SIZE.x) {
            let subject = Subject {
                feature,
                progress: &progress,
                problem,
                photos: [query, reference],
                truth,
                depth_radius_px: context.run.params.fb.depth_radius_px,
            };
            // On the side where the match is not. Making room for it would move the photos under the pointer.
            let keypoint = &progress.query[feature];
            let at = pair.at[0].on_screen([keypoint.x, keypoint.y]);
            let corner = if at.x < photos.center().x {
                photos.right_bottom() - detail::SIZE
            } else {
                photos.left_bottom() - vec2(0.0, detail::SIZE.y)
            };
            let panel = Rect::from_min_size(corner, detail::SIZE);
            self.detail.ui(ui, context, &subject, panel);
        }
        ui.scope_builder(UiBuilder::new().max_rect(chips), |ui| {
            if kinds.is_empty() && progress.has_begun {
                ui.weak("The query has no keypoints");
            } else if kinds.is_empty() {
                ui.weak("No features yet: FB finds them first");
            } else {
                funnel::ui(ui, &kinds, &mut self.shown);
            }
        });
        ui.advance_cursor_after_rect(area);
    }
}

fn caption(name: &str, keypoints: usize) -> String {
    match keypoints {
        0 => name.to_owned(),
        _ => format!("{name} · {keypoints} keypoints"),
    }
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
        &progress.query.get(feature)?.pixel(),
        &progress.reference.get(found.reference)?.pixel(),
        lifted.and_then(|lifted| lifted.point.as_ref()),
        true_match_px(features::mlesac(context).inlier_threshold_px),
    ))
}

/// The feature under the pointer; a click selects it.
fn point_at(
    ui: &Ui,
    context: &ViewContext<'_>,
    visible: &VisibleFeatures,
    progress: &FeatureProgress<'_>,
    over: &[Response; 2],
) -> Option<usize> {
    let over = over.iter().find(|over| over.hovered())?;
    let hovered = visible.nearest(over.hover_pos()?);
    if over.clicked() && context.options.selected_feature != hovered {
        context.send(move |app| app.state.options.selected_feature = hovered);
    }
    if let Some(feature) = hovered {
        ui.ctx().set_cursor_icon(egui::CursorIcon::PointingHand);
        let words = format!("Query feature {feature}, {}", features::words(progress, feature));
        over.clone().on_hover_text_at_pointer(words);
    }
    hovered
}
