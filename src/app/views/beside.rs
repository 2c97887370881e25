//! Two poses beside each other: what the cost compares at each of them, and which parts of the query speak
//! for which.

use egui::{Color32, ComboBox, ScrollArea, Sense, Ui, vec2};

use super::View;
use super::histogram::HistogramView;
use super::synthetic::SynthesisView;
use crate::app::textures::color_image;
use crate::app::{Command, NamedPose, ShownView, ViewContext};
use crate::method::Method;
use crate::picture;
use crate::problem::Problem;

/// The result and the truth, unless somebody chooses others.
const FIRST: [NamedPose; 2] = [NamedPose::Estimate, NamedPose::Truth];

/// The synthetic view and the histogram at two poses.
#[derive(Default)]
pub struct BesideView {
    pictures: [SynthesisView; 2],
    histograms: [HistogramView; 2],
}

impl View for BesideView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(poses) = context.options.beside else {
            context.send(Command::LookBeside(FIRST));
            return;
        };
        let method = context.direct_method();
        let sides = [0, 1].map(|side| context.beside(side));
        choose(ui, context, poses);
        let shown = [0, 1].map(|side| sides[side].and_then(|here| here.shown(method)));
        if let [Some(first), Some(second)] = &shown {
            ui.label(comparison(
                &costs_of(context, method),
                poses,
                [first, second],
            ));
        }
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            if let (Some(problem), [Some(first), Some(second)]) = (context.problem(), &shown) {
                preference(ui, context, problem, poses, [first, second]);
            }
            ui.columns(2, |columns| {
                for (side, ui) in columns.iter_mut().enumerate() {
                    ui.push_id(("beside", side), |ui| match &sides[side] {
                        Some(here) => {
                            // Below its words, a photo of a drive: wide.
                            let width = ui.available_width();
                            let height = 230.0 + 0.32 * width;
                            ui.allocate_ui(vec2(width, height), |ui| {
                                ui.set_max_height(height);
                                self.pictures[side].ui(ui, here);
                            });
                            ui.separator();
                            ui.allocate_ui(vec2(ui.available_width(), 360.0), |ui| {
                                ui.set_max_height(360.0);
                                self.histograms[side].ui(ui, here);
                            });
                        }
                        None if context.is_looking_beside(side) => {
                            ui.spinner();
                        }
                        None => {
                            let name = poses[side].name();
                            ui.weak(format!("{name}: there is no such pose at this step"));
                        }
                    });
                }
            });
        });
    }
}

fn choose(ui: &mut Ui, context: &ViewContext<'_>, poses: [NamedPose; 2]) {
    ui.horizontal_wrapped(|ui| {
        for (side, spoken) in ["First pose", "Second pose"].into_iter().enumerate() {
            let label = ui.label(spoken);
            let combo = ComboBox::from_id_salt(spoken).selected_text(poses[side].name());
            let answer = combo.show_ui(ui, |ui| {
                for pose in NamedPose::ALL {
                    if ui
                        .selectable_label(pose == poses[side], pose.name())
                        .clicked()
                    {
                        let mut wanted = poses;
                        wanted[side] = pose;
                        context.send(Command::LookBeside(wanted));
                    }
                }
            });
            answer.response.labelled_by(label.id);
        }
        let swap = ui.button("Swap").on_hover_text("Exchange the two");
        if swap.clicked() {
            context.send(Command::LookBeside([poses[1], poses[0]]));
        }
    });
}

/// Whose costs are compared: a method that searches no cost of its own is seen through that of another.
fn costs_of(context: &ViewContext<'_>, method: Method) -> String {
    match context.method() {
        Some(looked_at) if looked_at != method => {
            format!("{}, by the cost of {}", looked_at.label(), method.label())
        }
        _ => method.label().clone(),
    }
}

/// Which of the two costs less, in words.
fn comparison(costs_of: &str, poses: [NamedPose; 2], shown: [&ShownView; 2]) -> String {
    let [first, second] = poses.map(NamedPose::word);
    let costs = shown.map(|shown| shown.comparison.score.cost);
    let covered = shown.map(|shown| shown.comparison.score.covered);
    match costs {
        [Some(a), Some(b)] => {
            let (cheaper, less) = if a <= b {
                (first, b - a)
            } else {
                (second, a - b)
            };
            format!(
                "{costs_of}: {a:.4} at {first}, {b:.4} at {second}: {cheaper} is cheaper by {less:.4}; \
                 {} and {} px covered",
                covered[0], covered[1]
            )
        }
        [None, _] => format!("{costs_of}: there is no cost at {first}"),
        [_, None] => format!("{costs_of}: there is no cost at {second}"),
    }
}

/// The query with the parts coloured that speak for one of the poses.
fn preference(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    problem: &Problem,
    poses: [NamedPose; 2],
    shown: [&ShownView; 2],
) {
    let [first, second] = shown.map(|shown| &shown.comparison);
    let query = &problem.query.photo.gray;
    // Made anew only where one of the two has changed; the key holds the first, the picture both.
    let key = context.textures.pair(first, second);
    let texture = context
        .textures
        .of(ui.ctx(), "beside/preference", &key, |[first, second]| {
            let picture = picture::preference(query, first, second);
            let picture = picture.map_or_else(|| query.clone().into(), image::DynamicImage::from);
            color_image(&picture)
        });
    let size = texture.size_vec2();
    let scale = (ui.available_width() / size.x).min(220.0 / size.y);
    let (rect, answer) = ui.allocate_exact_size(size * scale, Sense::hover());
    let whole = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
    ui.painter()
        .image(texture.id(), rect, whole, Color32::WHITE);
    let words = format!(
        "Orange parts of the query speak for {}, blue ones for {}",
        poses[0].word(),
        poses[1].word()
    );
    answer.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &words));
    ui.weak(words);
}
