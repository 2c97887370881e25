//! What each reference gives alone, its weight, and where the fused pose is.

use egui::{Grid, RichText, ScrollArea, Ui};
use egui_plot::{Legend, Plot, PlotUi, Points};

use super::View;
use super::legend::{from_truth, name_picture, plot_shape, result};
use crate::app::{ViewContext, theme};
use crate::event::{DebugEvent, ReferencesFused};
use crate::fusion::ShareOutcome;
use crate::geometry::Pose;
use crate::method::Method;
use crate::palette;
use crate::proof::Thing;
use crate::session::{Part, Span};

/// Share of the height that the map has.
const MAP_SHARE: f32 = 0.6;

/// The fusions of a method on a map and in a table.
#[derive(Default)]
pub struct FusionView {}

impl View for FusionView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some((method, fused)) = reported(context) else {
            ui.weak(
                "No pose was fused so far. Choose two references or more and a fusion in the list of references.",
            );
            return;
        };
        let name = format!("{}, {} references", method.label(), fused[0].shares.len());
        let color = theme::text(ui.visuals(), theme::method(method));
        ui.label(RichText::new(name).color(color).strong());
        let height = MAP_SHARE * ui.available_height();
        map(ui, context, &fused, height);
        ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            table(ui, context, &fused);
            // Why there is no fused pose.
            let over = spans(context, method).filter(|span| context.cursor + 1 >= span.records.end);
            for result in over.filter_map(|span| span.result.as_ref()) {
                if let (None, Some(reason)) = (&result.pose, &result.reason) {
                    ui.label(format!("× {} {}", reason.code, reason.text));
                }
            }
        });
    }
}

/// The fusions of a method.
fn spans<'a>(context: &ViewContext<'a>, method: Method) -> impl Iterator<Item = &'a Span> {
    let spans = context.run.spans().iter();
    spans.filter(move |span| span.part == Part::Fusion(method))
}

/// The fusions that were reported up to the cursor, of the method at the cursor if it has any, else of the latest
/// that has.
fn reported<'a>(context: &ViewContext<'a>) -> Option<(Method, Vec<&'a ReferencesFused>)> {
    let of = |method: Method| -> Vec<&'a ReferencesFused> {
        let records = spans(context, method);
        let records = records.flat_map(|span| context.run.until(span, context.cursor));
        records.filter_map(|record| DebugEvent::from_event(&record.event)).collect()
    };
    let others = context.setup.task.protocol.methods.iter().copied().rev();
    let methods = context.method().into_iter().chain(others);
    methods.map(|method| (method, of(method))).find(|(_, fused)| !fused.is_empty())
}

/// How far a pose is from the truth.
fn error(context: &ViewContext<'_>, pose: Option<&Pose>) -> String {
    let known = |pose| from_truth(context, pose).unwrap_or_else(|| "a pose".to_owned());
    pose.map_or_else(|| "× no pose".to_owned(), known)
}

fn table(ui: &mut Ui, context: &ViewContext<'_>, fused: &[&ReferencesFused]) {
    Grid::new("fusion").striped(true).show(ui, |ui| {
        let fusions = fused.iter().map(|fusion| fusion.fusion);
        for text in ["reference", "matches", "alone"].into_iter().chain(fusions) {
            ui.label(RichText::new(text).weak().small());
        }
        ui.end_row();
        for (index, share) in fused[0].shares.iter().enumerate() {
            ui.label(&share.reference);
            ui.label(share.matches.to_string());
            ui.label(error(context, share.pose.as_ref()));
            for fusion in fused {
                let share = &fusion.shares[index];
                let weight = ui.label(share.words());
                if let Some(support) = share.support {
                    weight.on_hover_text(support.words());
                }
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

/// Seen from above, in the frame of the first reference: references, what each gives alone (larger with more
/// weight), the fused pose, where the photos agree with a contradicted query, the truth.
fn map(ui: &mut Ui, context: &ViewContext<'_>, fused: &[&ReferencesFused], height: f32) {
    let problems = context.run.problems();
    let Some(first) = problems.first() else { return };
    let camera_from_world = first.reference().world_from_camera().inverse();
    let strong = ui.visuals().strong_text_color();
    let mark = |plot: &mut PlotUi<'_>, name: &str, pose: &Pose, thing: Thing, radius: f32| {
        let color = match thing {
            Thing::Reference => strong,
            _ => theme::rgb(thing.color()),
        };
        let centre = camera_from_world * nalgebra::Point3::from(pose.translation.vector);
        let points = Points::new(name, vec![[centre.x, centre.z]]);
        let points = points.color(color).shape(plot_shape(thing));
        plot.points(points.filled(false).radius(radius));
    };
    // The fusion at the cursor says what was left out.
    let present = context.latest::<ReferencesFused>();
    let present = present.unwrap_or(fused[fused.len() - 1]);
    let answer = Plot::new("fusion map")
        .height(height)
        .data_aspect(1.0)
        .allow_scroll(false)
        .x_axis_label(context.in_unit("right of the first reference [m]"))
        .y_axis_label(context.in_unit("ahead [m]"))
        .legend(Legend::default())
        .show(ui, |plot| {
            for problem in problems {
                let pose = problem.reference().world_from_camera();
                mark(plot, "○ references", pose, Thing::Reference, 5.0);
            }
            for share in present.shares.iter() {
                let Some(pose) = &share.pose else { continue };
                let has_weight =
                    matches!(share.outcome, ShareOutcome::Kept | ShareOutcome::Outvoted);
                let (name, thing) = if has_weight {
                    ("◇ alone", result(context, pose))
                } else {
                    ("◇ alone, not used", Thing::Result(palette::NO_POSE))
                };
                let radius = 3.0 + 4.0 * share.weight.sqrt() as f32;
                mark(plot, name, pose, thing, radius);
            }
            if let Some(pose) = &present.pose {
                let name = format!("◇ fused ({})", present.fusion);
                mark(plot, &name, pose, result(context, pose), 10.0);
            }
            if let Some(better) = context.better_pose() {
                mark(plot, "● where the photos agree", &better, Thing::Dot(palette::TRUTH), 7.0);
            }
            if let Some(truth) = context.truth() {
                mark(plot, "+ truth", truth, Thing::Truth, 7.0);
            }
        });
    name_picture(&answer.response, format!("Map of the fusion {}", present.fusion));
}
