//! The verdict card: what each method's answer is worth, why, and what helped, above everything else.

use egui::{Align, Layout, RichText, Ui};

use super::command::{Command, Queue};
use super::state::AppState;
use super::theme;
use crate::diagnosis::{Confidence, Diagnosis, Grade, confidence};
use crate::localize::{Helped, QueryResult};
use crate::method::Method;
use crate::session::{Part, RunState, Span};

/// Widths of the columns before the sentence \[points\].
const METHOD: f32 = 64.0;
const GRADE: f32 = 128.0;
const ERROR: f32 = 128.0;

/// The card, which is never lower for a query than it was: what is below does not move while a person looks
/// back and ahead.
#[derive(Default)]
pub(super) struct Card {
    /// The query and the width that the height is of.
    of: (usize, f32),
    height: f32,
}

impl Card {
    /// One row for each method that was asked for.
    pub(super) fn ui(&mut self, ui: &mut Ui, state: &AppState, commands: &Queue) {
        let of = (state.setup.query, ui.available_width());
        if self.of != of {
            *self = Self { of, height: 0.0 };
        }
        ui.set_min_height(self.height);
        let is_waiting = matches!(state.run_state(), RunState::Paused { .. });
        if is_waiting && state.run().results().next().is_none() {
            ui.label(
                "Space runs the query to its end, I steps into the next event, ? lists all keys",
            );
        }
        for &method in &state.setup.task.protocol.methods {
            row(ui, state, commands, method);
        }
        self.height = ui.min_rect().height();
    }
}

fn row(ui: &mut Ui, state: &AppState, commands: &Queue, method: Method) {
    ui.horizontal_top(|ui| {
        cell(ui, METHOD, |ui| {
            let name = RichText::new(method.label())
                .color(theme::text(ui.visuals(), theme::method(method)));
            let button = ui.add(egui::Button::new(name.strong()).frame(false));
            if button.on_hover_text("Show what it did").clicked() {
                commands.send(Command::SelectMethod(method));
            }
        });
        let Some(span) = deciding(state, method) else {
            if state.options.hides_future {
                return;
            }
            if let Some(known) = known(state, method) {
                told(ui, state, commands, known, true);
                return;
            }
            let has_begun =
                state.run().spans().last().is_some_and(|span| {
                    span.part.method() == Some(method) && span.result.is_none()
                });
            cell(ui, GRADE, |ui| {
                ui.weak(if has_begun {
                    state.run_state().of_what_has_begun()
                } else {
                    "not run yet"
                });
            });
            return;
        };
        if let Some(result) = &span.result {
            told(ui, state, commands, result, false);
        }
    });
}

/// What is known of a method on the query from before this run, such as from the folder of a run.
fn known(state: &AppState, method: Method) -> Option<&QueryResult> {
    let known = state.results.get(&state.setup.query)?;
    known.iter().rfind(|result| result.method == method)
}

/// A column of a width.
fn cell(ui: &mut Ui, width: f32, content: impl FnOnce(&mut Ui)) {
    let size = egui::vec2(width, ui.spacing().interact_size.y);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_width(width);
        content(ui);
    });
}

/// The part of the run that a method is judged by: its fused pose, else the answer on the reference
/// that is looked at, else the last one.
fn deciding(state: &AppState, method: Method) -> Option<&Span> {
    let run = state.run();
    let reference = run.reference_at(state.cursor());
    let has_come = |span: &&Span| state.has_come(span);
    let own = || {
        let spans = run.spans().iter().filter(has_come);
        spans.filter(|span| span.part.method() == Some(method) && span.result.is_some())
    };
    let fused = own().rfind(|span| span.part == Part::Fusion(method));
    let here = || own().find(|span| span.part == Part::Reference(method, reference));
    fused.or_else(here).or_else(|| own().next_back())
}

/// `is_old` where it was known before this run.
fn told(ui: &mut Ui, state: &AppState, commands: &Queue, result: &QueryResult, is_old: bool) {
    let shows_truth = state.options.shows_truth;
    let grade = result.grade_shown(shows_truth);
    cell(ui, GRADE, |ui| {
        let text = format!("{} {grade}", grade.glyph());
        ui.label(
            RichText::new(text)
                .color(theme::grade(ui.visuals(), grade))
                .strong(),
        );
    });
    cell(ui, ERROR, |ui| match (&result.error, shows_truth) {
        (Some(error), true) => {
            let text = format!("{}, {}", error.translation(), error.rotation());
            let text = match grade {
                Grade::Wrong => RichText::new(text).strong(),
                _ => RichText::new(text),
            };
            ui.label(text).on_hover_text("From the truth");
        }
        _ => {
            if let Some(known) = &result.confidence {
                let percent = confidence::percent(known.probability);
                let text = match known.word {
                    Confidence::Low => format!("{} {percent}", known.word.glyph()),
                    Confidence::Trusted | Confidence::Unsure => percent,
                };
                let help = format!(
                    "{}: probability that this pose is within 1 m of the truth",
                    known.word
                );
                ui.label(text).on_hover_text(help);
            }
        }
    });
    ui.horizontal_wrapped(|ui| {
        if is_old {
            ui.weak("known before:")
                .on_hover_text("From before this run, which has not come so far yet");
        }
        why(ui, state, commands, result, grade);
    });
}

/// The cause in one sentence, and what helped.
fn why(ui: &mut Ui, state: &AppState, commands: &Queue, result: &QueryResult, grade: Grade) {
    let shows_truth = state.options.shows_truth;
    let may_be_told = |finding: &&Diagnosis| shows_truth || !finding.code.is_failure();
    let mut findings = result.diagnosis.iter().filter(may_be_told);
    match (findings.next(), &result.reason) {
        (Some(finding), _) => {
            let code = RichText::new(finding.code.name()).strong();
            ui.label(code).on_hover_text(finding.code.title());
            ui.label(&finding.text);
            let others: Vec<&str> = findings.map(|finding| finding.code.name()).collect();
            if !others.is_empty() {
                ui.weak(format!("also {}", others.join(", ")))
                    .on_hover_text("The report says why");
            }
        }
        (None, Some(reason)) => {
            ui.label(RichText::new(reason.code.name()).strong());
            ui.label(&reason.text);
        }
        (None, None) => {
            ui.weak(supported_by(result, shows_truth));
        }
    }
    if shows_truth && grade.is_failure() {
        helped(ui, state, commands, result);
    }
}

/// What an answer without a fault rests on.
fn supported_by(result: &QueryResult, shows_truth: bool) -> String {
    if let Some(cost) = &result.cost {
        let truth = cost.truth.filter(|_| shows_truth);
        let truth = truth.map(|truth| format!(", {truth:.4} at the truth"));
        return format!("cost {:.4}{}", cost.best, truth.unwrap_or_default());
    }
    let counts = result.counts.map(|counts| {
        format!(
            "{} of {} matches with depth agree",
            counts.inliers, counts.with_depth
        )
    });
    counts.unwrap_or_default()
}

/// What made it right, with a button that does it; or the offer to look for that.
fn helped(ui: &mut Ui, state: &AppState, commands: &Queue, result: &QueryResult) {
    let Some(explanation) = &result.explanation else {
        let can_be_explained = result.error.or(result.initial_error).is_some();
        let is_asked_for = state.setup.task.protocol.explain > 0;
        if can_be_explained && !is_asked_for {
            let button = ui.small_button("What would have helped?");
            let help = "Localise what went wrong again in other ways (E)";
            if button.on_hover_text(help).clicked() {
                commands.send(Command::Explain);
            }
        }
        return;
    };
    match explanation.best() {
        Some(Helped { args, error }) => {
            let button = ui.small_button(format!("Try {}", args.join(" ")));
            let help = "Keep this run as A and localise with this";
            if button.on_hover_text(help).clicked() {
                commands.send(Command::Try(args.clone()));
            }
            let more = explanation.helped.len() - 1;
            let more = match more {
                0 => String::new(),
                more => format!(", {more} more helped"),
            };
            ui.weak(format!("→ {}{more}", error.translation()));
        }
        None if explanation.complete => {
            ui.weak(format!("none of {} remedies helped", explanation.runs));
        }
        None => {
            ui.weak("the explanation was stopped before its end");
        }
    }
}
