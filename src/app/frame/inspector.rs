//! The inspector: why, the numbers, the parameters and the log of what is selected.

mod numbers;

use egui::collapsing_header::CollapsingState;
use egui::{Button, Frame, Grid, Label, RichText, ScrollArea, Sense, Stroke, Ui, vec2};
use serde_json::Value;

use super::Panes;
use super::storyboard::part_name;
use super::verdicts::{short, split, words_of};
use crate::app::theme;
use crate::app::view_options::Tab;
use crate::app::{Sends, ViewContext, ViewName};
use crate::diagnosis::{Code, Confidence, Diagnosis, Grade, confidence};
use crate::geometry::PoseError;
use crate::localize::{Explanation, Helped, PoseReport, QueryResult};
use crate::method::Method;
use crate::session::{Part, Run};
use crate::table::three_digits;

pub(crate) fn ui(ui: &mut Ui, context: &ViewContext<'_>, panes: &mut Panes) {
    let tab = context.options.tab;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        for (other, title) in Tab::ALL {
            let text = RichText::new(title).size(12.5);
            let button = Button::selectable(tab == other, text).frame_when_inactive(false);
            ui.add(button).sends(context, move |app| app.state.show_tab(other));
        }
    });
    ui.separator();
    match tab {
        Tab::Why => {
            let area = ScrollArea::vertical().id_salt("why").auto_shrink(false);
            area.show(ui, |ui| why(ui, context));
        }
        Tab::Numbers => {
            let area = ScrollArea::vertical().id_salt("numbers").auto_shrink(false);
            area.show(ui, |ui| numbers::ui(ui, context));
        }
        Tab::Parameters => panes.show(ui, ViewName::Parameters, context),
        Tab::Log => panes.show(ui, ViewName::Log, context),
    }
}

fn why(ui: &mut Ui, context: &ViewContext<'_>) {
    let Some(span) = context.span() else {
        ui.weak("Nothing has run yet. Space runs the query.");
        return;
    };
    let Some(result) = context.state.outcome(span) else {
        ui.weak(format!("{} has no result yet.", part_name(span.part)));
        return;
    };
    match result.diagnosis.split_first() {
        Some((primary, others)) => {
            finding(ui, primary);
            changed(ui, context.run);
            helped(ui, context, &result, primary);
            if !others.is_empty() {
                heading(ui, "Also found");
                for (index, other) in others.iter().enumerate() {
                    let id = ui.make_persistent_id(("also", index));
                    let state = CollapsingState::load_with_default_open(ui.ctx(), id, false);
                    let mut is_clicked = false;
                    let mut header = state.show_header(ui, |ui| {
                        let title = Label::new(capital(other.code.title())).wrap();
                        is_clicked = ui.add(title.sense(Sense::click())).clicked();
                    });
                    if is_clicked {
                        header.toggle();
                    }
                    header.body(|ui| {
                        ui.label(&other.text);
                        evidence(ui, other);
                    });
                }
            }
        }
        None => {
            let truth = match result.grade {
                Grade::Unmeasured => " (no ground truth)",
                _ => "",
            };
            ui.strong(format!("{}: {}{truth}", part_name(span.part), result.grade));
            ui.label(words_of(&result));
            changed(ui, context.run);
        }
    }
    if let Some(known) = &result.confidence {
        ui.add_space(8.0);
        let mut words = format!(
            "Confidence: {} ({} likely within {} m)",
            known.word,
            confidence::percent(known.probability),
            known.within.m
        );
        if let Some(interval) = known.interval() {
            words = format!("{words}; if so, {interval}");
        }
        if let Some(because) = known.because() {
            words =
                context.in_unit(&format!("{words}; less sure than it seems, because {because}"));
        }
        if known.word == Confidence::Trusted && result.grade == Grade::Wrong {
            words += ", although the pose is wrong";
        }
        ui.weak(words)
            .on_hover_text("Computed without the truth, from what the method itself leaves behind");
    }
    if let Some(opinion) = &result.opinion {
        ui.add_space(8.0);
        ui.label(format!("Opinion: {}", context.in_unit(&opinion.words())));
        ui.weak(&opinion.because).on_hover_text(
            "Posescope localises the query itself, without the truth, and compares the poses",
        );
    }
    if let Some(pose) = &result.pose {
        if result.grade == Grade::Unmeasured {
            heading(ui, "Pose");
            let ([x, y, z], [qx, qy, qz, qw]) = (pose.position_m, pose.quaternion_xyzw);
            ui.label(result.unit.words(&format!("x {x:.3}, y {y:.3}, z {z:.3} m")))
                .on_hover_text("The camera's position in the world");
            ui.weak(format!("quaternion x y z w: {qx:.5} {qy:.5} {qz:.5} {qw:.5}"));
        }
        others(ui, context, span.part, pose);
    }
}

/// How far the poses of the other methods are, whichever ran first.
fn others(ui: &mut Ui, context: &ViewContext<'_>, part: Part, pose: &PoseReport) {
    let is_beside = |other: Part| match (part, other) {
        (Part::Reference(own, here), Part::Reference(method, there)) => {
            own != method && here == there
        }
        (Part::Fusion(own), Part::Fusion(method)) => own != method,
        _ => false,
    };
    let beside = context.run.spans().iter().filter(|span| is_beside(span.part));
    let errors = beside.filter_map(|span| {
        let result = span.result.as_ref()?;
        let other = result.pose.as_ref()?.to_pose()?;
        Some((result.method, PoseError::between(&other, &pose.to_pose()?)))
    });
    let errors: Vec<(Method, PoseError)> = errors.collect();
    if errors.is_empty() {
        return;
    }
    heading(ui, "Poses of the other methods");
    for (method, error) in errors {
        let (metres, degrees) = (error.translation_m, error.rotation_deg);
        let words = format!("{}: {metres:.2} m and {degrees:.1}° away", method.label());
        ui.label(context.in_unit(&words));
    }
}

/// The settings that are not at their defaults: they may be the cause.
fn changed(ui: &mut Ui, run: &Run) {
    const MAX: usize = 5;
    let default_m = run.params.scale.radius();
    let radius = (run.radius_m != default_m)
        .then(|| format!("--radius {} (default {default_m})", run.radius_m));
    let rows = run.params.list().into_iter().zip(run.params.defaults().list());
    let params = rows.filter(|(row, default)| row.value != default.value);
    let params = params
        .map(|(row, default)| format!("{}={} (default {})", row.key, row.value, default.value));
    let changes: Vec<String> = radius.into_iter().chain(params).collect();
    if changes.is_empty() {
        return;
    }
    heading(ui, "Changed from the default");
    for change in changes.iter().take(MAX) {
        ui.label(RichText::new(change).monospace().size(12.0));
    }
    if let Some(more) = changes.len().checked_sub(MAX + 1) {
        ui.weak(format!("and {} more", more + 1));
    }
}

/// Where nothing that was tried helped against a cause that wrong data would have too.
const NO_SETTING_HELPS: &str = "No setting and no other method made it right. The data may be wrong: check camera, \
                                poses and clouds with `posescope doctor`.";

fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(10.0);
    ui.label(RichText::new(text).size(12.0).color(ui.visuals().weak_text_color()));
}

/// The cause in plain words, its code after it, its sentence and its numbers.
fn finding(ui: &mut Ui, found: &Diagnosis) {
    ui.horizontal_wrapped(|ui| {
        ui.strong(capital(found.code.title()));
        ui.weak(found.code.name());
    });
    let (_, others) = split(&found.text);
    if !others.is_empty() {
        ui.label(others);
    }
    evidence(ui, found);
}

/// The numbers of a verdict, in its own order.
fn evidence(ui: &mut Ui, found: &Diagnosis) {
    let Value::Object(fields) = &found.evidence else {
        return;
    };
    const GAP: f32 = 10.0;
    ui.add_space(4.0);
    Grid::new(("evidence", found.code.name()))
        .num_columns(2)
        .max_col_width((ui.available_width() - GAP) / 2.0)
        .spacing(vec2(GAP, 4.0))
        .show(ui, |ui| {
            for (key, value) in fields {
                let text = match value {
                    Value::Number(number) if number.is_u64() => number.to_string(),
                    Value::Number(number) => number.as_f64().map(three_digits).unwrap_or_default(),
                    // The sentence says it already.
                    Value::String(text) if found.text.contains(text.as_str()) => continue,
                    Value::String(text) => text.replace('_', " "),
                    Value::Bool(is_so) => if *is_so { "yes" } else { "no" }.to_owned(),
                    Value::Null | Value::Array(_) | Value::Object(_) => continue,
                };
                let (name, unit) = readable(found.code, key);
                ui.label(name);
                ui.label(format!("{text}{unit}"));
                ui.end_row();
            }
        });
}

/// Fields of evidence whose key says too little, as people read them; of one verdict, or of all.
const NAMES: &[(&str, &str)] = &[
    ("after", "Keypoints left after the worst step"),
    ("before", "Keypoints before the worst step"),
    ("chance_deviation", "Spread of chance"),
    ("chance_level", "Cost of shuffled pixels"),
    ("deviation", "Contrast of the costs"),
    ("D2.distance_m", "Result to the truth"),
    ("D3.distance_m", "Pose near the truth, to it"),
    ("D4.distance_m", "Truth to the reference"),
    ("D8.distance_m", "Result to the reference"),
    ("R9.distance_m", "From the reference"),
    ("deviations", "Below chance by spreads"),
    ("explained", "Matches explained as stated"),
    ("explained_otherwise", "Matches explained otherwise"),
    ("first_distance_m", "Distance of the first"),
    ("gain_at_result", "Gain over chance, result"),
    ("gain_at_truth", "Gain over chance, truth"),
    ("is_turned", "Turned too far"),
    ("lost_at", "Most are lost at"),
    ("lost_in", "Lost in the phase"),
    ("margin", "Cost above the best cell"),
    ("missing", "True matches without depth"),
    ("not_asked", "Method that was not run"),
    ("overlap", "Share of the cloud in view"),
    ("passed_over", "Method that was passed over"),
    ("query", "Keypoints in the query"),
    ("rank", "Rank of the right cell"),
    ("ranked", "Frames kept of the ranking"),
    ("R2.reference", "Keypoints in the reference"),
    ("right", "True matches, right depth"),
    ("share_of_reference", "Coverage, of the reference's"),
    ("supports_truth", "Matches that fit the truth"),
    ("taken", "References that were used"),
    ("wrong", "True matches, wrong depth"),
];

/// A field of evidence as people read it: its name, and the unit behind its value.
fn readable(code: Code, key: &str) -> (String, &'static str) {
    let units = [("_m", " m"), ("_deg", "°"), ("_px", " px")];
    let found =
        units.into_iter().find_map(|(ending, unit)| Some((key.strip_suffix(ending)?, unit)));
    let (name, unit) = found.unwrap_or((key, ""));
    let of_code = format!("{}.{key}", code.name());
    let known = NAMES.iter().find(|(known, _)| *known == key || *known == of_code);
    let name =
        known.map_or_else(|| capital(&name.replace('_', " ")), |(_, name)| (*name).to_owned());
    (name, unit)
}

/// With a capital letter first.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

/// What made the result right, in groups; what may, where nothing was tried.
fn helped(ui: &mut Ui, context: &ViewContext<'_>, result: &QueryResult, primary: &Diagnosis) {
    if !result.is_suspect() {
        return;
    }
    let Some(explanation) = &result.explanation else {
        heading(ui, "What may help");
        ui.label(result.advice(primary));
        if result.error.or(result.initial_error).is_some()
            && context.setup.task.protocol.explain == 0
        {
            let button = ui
                .button("Try what would help")
                .on_hover_text("Run the query again in other ways (E)");
            button.sends(context, |app| app.state.switch_explaining());
        }
        return;
    };
    let is_other = |helped: &&Helped| helped.args.iter().any(|arg| arg == "--method");
    let (other, own): (Vec<&Helped>, Vec<&Helped>) = explanation.helped.iter().partition(is_other);
    for (title, group) in [("This helps", own), ("Another method", other)] {
        if group.is_empty() {
            continue;
        }
        heading(ui, title);
        for helped in group {
            ui.push_id(("remedy", &helped.args), |ui| remedy(ui, context, helped));
        }
    }
    heading(ui, "Tried, did not help");
    ui.weak(without_help(explanation));
    if !explanation.helped.is_empty() {
        ui.weak("Found with the help of the truth. Click one to run it.");
    } else if explanation.complete {
        heading(ui, "What may help");
        ui.label(result.advice(primary));
        if matches!(primary.code, Code::R3 | Code::R8 | Code::D2 | Code::D6) {
            ui.label(NO_SETTING_HELPS);
        }
    }
}

/// The remedies that made nothing right, by name where this run tried them.
fn without_help(explanation: &Explanation) -> String {
    let number = explanation.runs.saturating_sub(explanation.helped.len());
    let mut words = match explanation.failed.as_slice() {
        _ if number == 0 => "none".to_owned(),
        [] => format!("{number} of {} remedies", explanation.runs),
        failed => failed.iter().map(|args| short(args)).collect::<Vec<_>>().join(", "),
    };
    if !explanation.complete {
        words.push_str(", then the search was stopped");
    }
    words
}

fn remedy(ui: &mut Ui, context: &ViewContext<'_>, helped: &Helped) {
    let args = short(&helped.args);
    let stroke = Stroke::new(1.0, ui.visuals().widgets.noninteractive.bg_stroke.color);
    let frame = Frame::new().stroke(stroke).corner_radius(3.0).inner_margin(vec2(8.0, 4.0));
    let response = frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label(RichText::new(&args).monospace().size(12.0));
        let color = theme::grade(ui.visuals(), Grade::Right);
        ui.label(
            RichText::new(format!("● {}", context.in_unit(&helped.error.translation())))
                .color(color),
        );
    });
    let response = response.response.interact(Sense::click());
    let spoken = format!("Run with {args}");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &spoken));
    if response.on_hover_text("Keeps this run as A and runs the query with this").clicked() {
        let args = helped.args.clone();
        context.send(move |app| app.state.try_again(&args));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remedies_that_failed_are_named_where_this_run_tried_them() {
        let args = |value: &str| vec!["--set".to_owned(), format!("fb.ratio={value}")];
        let mut explanation = Explanation { runs: 2, complete: true, ..Explanation::default() };
        assert_eq!(without_help(&explanation), "2 of 2 remedies");
        explanation.failed = vec![args("0.7"), args("0.6")];
        assert_eq!(without_help(&explanation), "fb.ratio=0.7, fb.ratio=0.6");
        explanation.complete = false;
        let stopped = "fb.ratio=0.7, fb.ratio=0.6, then the search was stopped";
        assert_eq!(without_help(&explanation), stopped);
        assert_eq!(without_help(&Explanation { complete: true, ..Explanation::default() }), "none");
    }

    /// Words that are wider than the inspector are wrapped; nothing is pushed out of the window.
    #[test]
    fn the_numbers_of_a_verdict_stay_within_the_inspector() {
        const WIDTH: f32 = 228.0;
        let words = "too few inliers to rule out that chance alone explains them";
        let found = Diagnosis {
            code: Code::R7,
            text: "It was refused: 5 of 31.".to_owned(),
            evidence: serde_json::json!({
                "reason": words, "said": "5 of 31", "correspondences_with_a_depth": 31, "error_m": 0.361
            }),
        };
        let ctx = egui::Context::default();
        theme::install(&ctx);
        let mut width = 0.0;
        // A grid knows the width of its columns from the frame before.
        for _ in 0..3 {
            let mut output = ctx.run_ui(egui::RawInput::default(), |ui| {
                let size = vec2(WIDTH, 400.0);
                let area = egui::Rect::from_min_size(egui::Pos2::ZERO, size);
                let builder = egui::UiBuilder::new().max_rect(area);
                let used = ui.scope_builder(builder, |ui| {
                    evidence(ui, &found);
                    ui.min_rect()
                });
                width = used.inner.width();
            });
            output.textures_delta.clear();
        }
        assert!((0.5 * WIDTH..=WIDTH).contains(&width), "{width}");
    }
}
