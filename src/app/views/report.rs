//! Verdicts, errors, features, costs, timings, parameters.

use egui::{Color32, Grid, RichText, ScrollArea, Ui};

use super::View;
use crate::app::{ViewContext, theme};
use crate::diagnosis::{Code, Grade};
use crate::localize::QueryResult;
use crate::session::Span;

/// The report of the run, so far.
#[derive(Default)]
pub struct ReportView {}

impl View for ReportView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            if context.run.spans().is_empty() {
                ui.weak("Nothing has run yet");
                return;
            }
            let others: Vec<&QueryResult> = other_results(context);
            verdicts(ui, context, &others);
            features(ui, context, &others);
            costs(ui, context, &others);
            times(ui, context);
            changes(ui, context);
        });
    }
}

/// The results of the run that this one is compared with.
fn other_results<'a>(context: &ViewContext<'a>) -> Vec<&'a QueryResult> {
    let other = context.other_run();
    other.map_or(Vec::new(), |run| run.results().collect())
}

fn counterpart<'a>(span: &Span, others: &[&'a QueryResult]) -> Option<&'a QueryResult> {
    let result = span.result.as_ref()?;
    others
        .iter()
        .find(|other| {
            other.method == result.method
                && other.fusion == result.fusion
                && other.references == result.references
        })
        .copied()
}

/// A number, marked where the other run has another.
fn cell(ui: &mut Ui, text: String, other: Option<String>) {
    match other {
        Some(other) if other != text => {
            ui.label(RichText::new(format!("{text} ≠")).strong())
                .on_hover_text(format!("the other run: {other}"));
        }
        _ => {
            ui.label(text);
        }
    }
}

fn heading(ui: &mut Ui, columns: &[&str]) {
    for column in columns {
        ui.label(RichText::new(*column).weak().small());
    }
    ui.end_row();
}

fn name(ui: &mut Ui, span: &Span) {
    let Some(method) = span.part.method() else {
        return;
    };
    let fusion = span
        .result
        .as_ref()
        .and_then(|result| result.fusion.as_ref());
    let name = match fusion {
        Some(fusion) => format!("{} {fusion}", method.name().to_uppercase()),
        None => method.name().to_uppercase(),
    };
    ui.label(
        RichText::new(name)
            .color(theme::text(ui.visuals(), theme::method(method)))
            .strong(),
    );
}

/// The grade in words and its colour. An error reveals the ground truth, which may be hidden.
fn verdict(result: &QueryResult, context: &ViewContext<'_>) -> (String, Option<Color32>) {
    let shows_truth = context.options.shows_truth;
    let grade = result.grade_shown(shows_truth);
    let words = match grade {
        // The reason stands below, in full: with the truth hidden, the estimator's own.
        Grade::NoPose => {
            let found = result.diagnosis.first().filter(|_| shows_truth);
            let code = found.map(|finding| finding.code);
            let code = code.or_else(|| result.reason.as_ref().map(|reason| reason.code));
            let code = code.map_or(String::new(), |code| format!(", {code}"));
            format!("{grade}{code}")
        }
        _ => grade.words(result.error.as_ref().filter(|_| shows_truth)),
    };
    let color = grade.is_failure().then_some(theme::ESTIMATE);
    (format!("{} {words}", grade.glyph()), color)
}

fn verdicts(ui: &mut Ui, context: &ViewContext<'_>, others: &[&QueryResult]) {
    let shows_truth = context.options.shows_truth;
    Grid::new("verdicts").striped(true).show(ui, |ui| {
        heading(ui, &["method", "reference", "result"]);
        let parts = context.run.spans().iter();
        for span in parts.filter(|span| span.part.method().is_some()) {
            name(ui, span);
            let Some(result) = &span.result else {
                ui.weak(context.run_state().of_what_has_begun());
                ui.end_row();
                continue;
            };
            ui.label(result.references.join(", "));
            let (text, color) = verdict(result, context);
            let other = counterpart(span, others).map(|other| verdict(other, context).0);
            let marked = other.is_some_and(|other| other != text);
            let text = RichText::new(if marked { format!("{text} ≠") } else { text });
            ui.label(color.map_or(text.clone(), |color| text.color(color)));
            ui.end_row();
        }
    });
    let initial = context
        .run
        .results()
        .find_map(|result| result.initial_error);
    if let (Some(error), true) = (initial, shows_truth) {
        ui.weak(format!("The reference itself, from the truth: {error}"));
    }
    let with_result = context
        .run
        .spans()
        .iter()
        .filter(|span| span.result.is_some());
    for span in with_result {
        findings(ui, span, shows_truth);
    }
    ui.separator();
}

/// Why a pose is wrong, missing or hardly to be believed. Verdicts tell the ground truth, which may be
/// hidden; that the method doubts its pose does not.
fn findings(ui: &mut Ui, span: &Span, shows_truth: bool) {
    let Some(result) = &span.result else { return };
    if let (Some(reason), false) = (&result.reason, shows_truth) {
        ui.horizontal_wrapped(|ui| {
            name(ui, span);
            ui.label(&reason.text);
        });
    }
    let may_show = |code: Code| shows_truth || !code.is_failure();
    let findings = result
        .diagnosis
        .iter()
        .filter(|finding| may_show(finding.code));
    // The tables may be wider than what is seen; sentences are not.
    let width = ui.clip_rect().width() - 2.0 * ui.spacing().item_spacing.x;
    for (rank, finding) in findings.enumerate() {
        ui.horizontal_wrapped(|ui| {
            ui.set_max_width(width);
            name(ui, span);
            let code = RichText::new(finding.code.name());
            let code = if rank == 0 {
                code.strong()
            } else {
                code.weak()
            };
            ui.label(code).on_hover_text(finding.code.title());
            ui.label(&finding.text);
        });
    }
    let Some(explanation) = result.explanation.as_ref().filter(|_| shows_truth) else {
        return;
    };
    for helped in &explanation.helped {
        ui.horizontal_wrapped(|ui| {
            ui.weak("helped:");
            ui.monospace(helped.args.join(" "));
            ui.label(helped.error.to_string());
        });
    }
    if explanation.helped.is_empty() {
        ui.weak(format!("None of {} remedies helped", explanation.runs));
    }
    if !explanation.complete {
        ui.weak("The explanation was stopped before its end");
    }
}

fn features(ui: &mut Ui, context: &ViewContext<'_>, others: &[&QueryResult]) {
    let mut spans = with_result(context, |result| result.counts.is_some()).peekable();
    if spans.peek().is_none() {
        return;
    }
    Grid::new("features").striped(true).show(ui, |ui| {
        let columns = [
            "features",
            "query",
            "reference",
            "ratio",
            "unique",
            "depth",
            "inliers",
        ];
        heading(ui, &columns);
        for span in spans {
            name(ui, span);
            let numbers = |result: &QueryResult| {
                let counts = result.counts.unwrap_or_default();
                [
                    counts.query_keypoints,
                    counts.reference_keypoints,
                    counts.ratio_passed,
                    counts.unique,
                    counts.with_depth,
                    counts.inliers,
                ]
                .map(|count| count.to_string())
            };
            row(ui, span, others, numbers);
        }
    });
    ui.separator();
}

fn costs(ui: &mut Ui, context: &ViewContext<'_>, others: &[&QueryResult]) {
    let mut spans = with_result(context, |result| result.cost.is_some()).peekable();
    if spans.peek().is_none() {
        return;
    }
    let shows_truth = context.options.shows_truth;
    Grid::new("costs").striped(true).show(ui, |ui| {
        let columns = [
            "costs",
            "result",
            "truth",
            "start",
            "shuffled",
            "runner-up",
            "coverage",
        ];
        heading(ui, &columns);
        for span in spans {
            name(ui, span);
            let number = |value: Option<f64>| value.map_or("–".to_owned(), |v| format!("{v:.4}"));
            let numbers = |result: &QueryResult| match &result.cost {
                Some(cost) => [
                    number(Some(cost.best)),
                    number(cost.truth.filter(|_| shows_truth)),
                    number(cost.initial),
                    number(cost.shuffled),
                    number(cost.runner_up),
                    format!("{:.2} %", 100.0 * cost.coverage_best),
                ],
                None => Default::default(),
            };
            row(ui, span, others, numbers);
        }
    });
    ui.separator();
}

fn with_result<'a>(
    context: &ViewContext<'a>,
    wanted: impl Fn(&QueryResult) -> bool,
) -> impl Iterator<Item = &'a Span> {
    context
        .run
        .spans()
        .iter()
        .filter(move |span| span.result.as_ref().is_some_and(&wanted))
}

fn row<const N: usize>(
    ui: &mut Ui,
    span: &Span,
    others: &[&QueryResult],
    numbers: impl Fn(&QueryResult) -> [String; N],
) {
    let other = counterpart(span, others).map(&numbers);
    if let Some(result) = &span.result {
        for (index, text) in numbers(result).into_iter().enumerate() {
            cell(ui, text, other.as_ref().map(|other| other[index].clone()));
        }
    }
    ui.end_row();
}

fn times(ui: &mut Ui, context: &ViewContext<'_>) {
    ui.collapsing("Timings", |ui| {
        Grid::new("times").striped(true).show(ui, |ui| {
            heading(ui, &["stage", "ms"]);
            for span in context.run.spans() {
                let Some(times) = &span.times else { continue };
                for (stage, time) in times.iter() {
                    ui.monospace(stage);
                    ui.label(format!("{:.2}", 1e3 * time.as_secs_f64()));
                    ui.end_row();
                }
            }
        });
        ui.weak("A paused run counts its pauses; a reused stage takes next to nothing");
    });
}

fn changes(ui: &mut Ui, context: &ViewContext<'_>) {
    let changes = context.run.params.changes();
    if changes.is_empty() {
        ui.weak("All parameters at their defaults");
    } else {
        ui.label("Parameters that differ from their defaults:");
        for change in changes {
            ui.monospace(change);
        }
    }
}
