//! What each reference gives alone, how much it has to say, and where the fused pose is.

use egui::{Color32, Grid, Rect, RichText, ScrollArea, Sense, Ui, vec2};
use egui_plot::{MarkerShape, Plot, PlotUi, Points};

use super::View;
use crate::app::{ViewContext, theme};
use crate::event::{Event, ReferencesFused};
use crate::fusion::{Share, ShareOutcome};
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::session::Part;

/// Width of the bar of a weight of 1 \[points\].
const FULL_BAR: f32 = 56.0;
/// Height of the map \[points\].
const MAP_HEIGHT: f32 = 230.0;

/// The fusions of a method, in a table and on a map.
#[derive(Default)]
pub struct FusionView {}

impl View for FusionView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some((method, fused)) = told(context) else {
            ui.weak(
                "No poses were fused so far. Choose two references or more and a fusion in the \
                 view References.",
            );
            return;
        };
        ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            let name = method.name().to_uppercase();
            ui.label(
                RichText::new(format!("{name}, {} references", fused[0].shares.len()))
                    .color(theme::text(ui.visuals(), theme::method(method)))
                    .strong(),
            );
            table(ui, context, method, &fused);
            refused(ui, context, method);
            map(ui, context, method, &fused);
        });
    }
}

/// The fusions that were told up to the cursor, of the method at the cursor if it has any, else of
/// the latest that has.
fn told<'a>(context: &ViewContext<'a>) -> Option<(Method, Vec<&'a ReferencesFused>)> {
    let of = |wanted: Method| -> Vec<&'a ReferencesFused> {
        let spans = context.run.spans().iter();
        spans
            .filter(|span| span.part == Part::Fusion(wanted))
            .flat_map(|span| {
                let end = span.records.end.min(context.cursor + 1);
                &context.run.records()[span.records.start.min(end)..end]
            })
            .filter_map(|record| match &record.event {
                Event::ReferencesFused(fused) => Some(fused),
                _ => None,
            })
            .collect()
    };
    let others = context.setup.task.protocol.methods.iter().copied().rev();
    context
        .method()
        .into_iter()
        .chain(others)
        .map(|method| (method, of(method)))
        .find(|(_, fused)| !fused.is_empty())
}

/// How far a pose is from the truth, or why there is nothing to say.
fn error(context: &ViewContext<'_>, pose: Option<&Pose>) -> String {
    match (pose, context.truth()) {
        (None, _) => "× no pose".to_owned(),
        (Some(_), None) => "a pose".to_owned(),
        (Some(pose), Some(truth)) => PoseError::between(truth, pose).to_string(),
    }
}

fn table(ui: &mut Ui, context: &ViewContext<'_>, method: Method, fused: &[&ReferencesFused]) {
    let weak = |ui: &mut Ui, text: &str| ui.label(RichText::new(text).weak().small());
    Grid::new("fusion").striped(true).show(ui, |ui| {
        for text in ["reference", "matches", "alone"] {
            weak(ui, text);
        }
        for fusion in fused {
            weak(ui, fusion.fusion);
        }
        ui.end_row();
        for (index, share) in fused[0].shares.iter().enumerate() {
            ui.label(
                RichText::new(&share.reference).color(theme::text(ui.visuals(), theme::REFERENCE)),
            );
            ui.label(share.matches.to_string());
            ui.label(error(context, share.pose.as_ref()));
            for fusion in fused {
                weight(ui, &fusion.shares[index], theme::method(method));
            }
            ui.end_row();
        }
        ui.strong("fused");
        ui.label("");
        ui.label("");
        for fusion in fused {
            ui.strong(error(context, fusion.pose.as_ref()));
        }
        ui.end_row();
    });
}

/// Why there is no fused pose.
fn refused(ui: &mut Ui, context: &ViewContext<'_>, method: Method) {
    let spans = context.run.spans().iter();
    let results = spans
        .filter(|span| span.part == Part::Fusion(method) && context.cursor + 1 >= span.records.end)
        .filter_map(|span| span.result.as_ref());
    for result in results {
        if let (None, Some(reason)) = (&result.pose, &result.reason) {
            ui.label(format!("× {} {}", reason.code, reason.text));
        }
    }
}

/// A bar as long as the weight; what has none says why.
fn weight(ui: &mut Ui, share: &Share, color: Color32) {
    match share.outcome {
        ShareOutcome::Dropped => {
            ui.weak("left out")
                .on_hover_text("The fusion gives it no weight");
        }
        ShareOutcome::FallbackUnneeded => {
            ui.weak("fallback not needed").on_hover_text(
                "Its pose is that of the hybrid's second method; another reference has one of the first",
            );
        }
        ShareOutcome::Failed => {
            ui.label(RichText::new("× failed").color(theme::text(ui.visuals(), theme::ESTIMATE)))
                .on_hover_text("It had a weight, but no pose");
        }
        ShareOutcome::Unsupportive => {
            let response = ui.weak(share.words());
            if let Some(support) = share.support {
                response.on_hover_text(support.words());
            }
        }
        ShareOutcome::Kept | ShareOutcome::Outvoted => {
            let row = ui.horizontal(|ui| {
                let size = vec2(FULL_BAR, 10.0);
                let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
                let filled = vec2(share.weight as f32 * FULL_BAR, size.y);
                let painter = ui.painter();
                painter.rect_filled(rect, 1.0, ui.visuals().faint_bg_color);
                painter.rect_filled(Rect::from_min_size(rect.min, filled), 1.0, color);
                ui.label(format!("{:.0} %", 100.0 * share.weight));
                if share.outcome == ShareOutcome::Outvoted {
                    ui.label(
                        RichText::new("outvoted").color(theme::text(ui.visuals(), theme::ESTIMATE)),
                    )
                    .on_hover_text("Alone it puts the query elsewhere, more than 1 m away");
                }
            });
            if let Some(support) = share.support {
                row.response.on_hover_text(support.words());
            }
        }
    }
}

/// Seen from above, in the frame of the first reference: references, what each gives alone, the
/// fused poses, the truth.
fn map(ui: &mut Ui, context: &ViewContext<'_>, method: Method, fused: &[&ReferencesFused]) {
    let Some(loaded) = context.run.loaded.as_deref() else {
        return;
    };
    let Some(first) = loaded.problems.first() else {
        return;
    };
    let camera_from_world = first.reference.world_from_camera.inverse();
    let place = |pose: &Pose| {
        let centre = camera_from_world * nalgebra::Point3::from(pose.translation.vector);
        [centre.x, centre.z]
    };
    // The fusion at the cursor says who was left out.
    let present = context
        .latest::<ReferencesFused>()
        .unwrap_or(fused[fused.len() - 1]);
    let answer = Plot::new("fusion map")
        .height(MAP_HEIGHT)
        .data_aspect(1.0)
        .allow_scroll(false)
        .x_axis_label("right of the first reference [m]")
        .y_axis_label("ahead [m]")
        .legend(egui_plot::Legend::default())
        .show(ui, |plot| {
            for problem in &loaded.problems {
                let at = place(&problem.reference.world_from_camera);
                mark(
                    plot,
                    "□ references",
                    at,
                    theme::REFERENCE,
                    MarkerShape::Square,
                    5.0,
                );
            }
            for share in present.shares.iter() {
                let Some(pose) = &share.pose else { continue };
                let (name, shape) = match share.outcome {
                    ShareOutcome::Kept => ("○ alone, kept", MarkerShape::Circle),
                    ShareOutcome::Outvoted => ("× alone, outvoted", MarkerShape::Cross),
                    ShareOutcome::Dropped
                    | ShareOutcome::Failed
                    | ShareOutcome::FallbackUnneeded
                    | ShareOutcome::Unsupportive => ("+ alone, left out", MarkerShape::Plus),
                };
                let radius = 3.0 + 6.0 * share.weight.sqrt() as f32;
                mark(
                    plot,
                    name,
                    place(pose),
                    theme::method(method),
                    shape,
                    radius,
                );
            }
            if let Some(pose) = &present.pose {
                let shape = MarkerShape::Diamond;
                mark(
                    plot,
                    &format!("◇ {}", present.fusion),
                    place(pose),
                    theme::ESTIMATE,
                    shape,
                    8.0,
                );
            }
            if let Some(truth) = context.truth() {
                mark(
                    plot,
                    "△ truth",
                    place(truth),
                    theme::TRUTH,
                    MarkerShape::Up,
                    7.0,
                );
            }
        });
    let name = format!("Map of the fusion {}", present.fusion);
    answer
        .response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
}

fn mark(
    plot: &mut PlotUi<'_>,
    name: &str,
    at: [f64; 2],
    color: Color32,
    shape: MarkerShape,
    radius: f32,
) {
    let points = Points::new(name, vec![at])
        .color(color)
        .shape(shape)
        .filled(false)
        .radius(radius);
    plot.points(points);
}
