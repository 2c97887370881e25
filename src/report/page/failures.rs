//! The failures, the worst first: a sentence, the picture that proves it, and what repeats it.

use maud::{Markup, html};

use super::super::{ReportedResult, RunReport};
use super::results::place;
use super::words::{class_of, sentences, with_code};
use crate::localize::QueryResult;
use crate::run::{Protocol, RunFile};
use crate::session::Task;
use posescope_core::text::first_sentence;

/// Rerun's web viewer in the version of our recordings. It reads the recording at the URL appended to this one.
const WEB_VIEWER: &str = "https://app.rerun.io/version/0.36.3/?url=";

/// The number of failures that are open at first.
const OPEN: usize = 3;

pub(super) fn failures(report: &RunReport) -> Markup {
    let failures = || report.worst.iter().filter_map(|&at| report.results.get(at));
    let count = report.worst.len();
    html! {
        section aria-labelledby="failures" {
            h2 id="failures" { @if count == 0 { "No failures" } @else { "Worst failures" } }
            @if count > 0 {
                p.legend {
                    span { b.right { "+" } " truth" } " "
                    span { b.wrong { "◇" } " result" } " "
                    span { b { "○" } " reference" } " "
                    span { b { "◆" } " low confidence: more likely wrong than right" }
                }
                @for one in failures().take(OPEN) { (failure(report, one, true)) }
                @if count > OPEN {
                    details.others {
                        summary { "All other failures (" (count - OPEN) ")" }
                        @for one in failures().skip(OPEN) { (failure(report, one, false)) }
                    }
                }
            }
        }
    }
}

fn failure(report: &RunReport, one: &ReportedResult, is_open: bool) -> Markup {
    let result = &one.result;
    let text = sentences(result);
    let (first, rest) = first_sentence(&text);
    html! {
        details.failure id={ "f" (one.number) } open[is_open] {
            summary {
                span.about {
                    (result.query) " · " (result.method_name())
                    @if report.has_several_groups() { " · " (place(one)) }
                    " · " span class=(class_of(result.grade)) { (score(result)) }
                    @if let Some(known) = result.confidence.as_ref().filter(|_| result.pose.is_some()) {
                        " · " (known.likely()) " likely right"
                    }
                    @if let Some(opinion) = &result.opinion {
                        " · " (result.unit.words(&opinion.words()))
                    }
                    @if let Some(change) = one.change { " · " (change.name()) " since the baseline" }
                }
                " "
                span.sentence { (with_code(first)) }
            }
            p.rest {
                (with_code(rest))
                @if let Some(primary) = result.diagnosis.first() { " " span.code { (primary.code) } }
            }
            @if let Some(proof) = &one.proof { img.proof src=(proof.picture) alt=(proof.words); }
            @for paragraph in result.paragraphs() { p.rest { (paragraph) } }
            (details(report, one))
        }
    }
}

/// The error, or that there is no pose.
fn score(result: &QueryResult) -> String {
    let glyph = result.grade.glyph();
    let off = result.off().map(|off| format!("{off} off"));
    format!("{glyph} {}", off.unwrap_or_else(|| result.grade.to_string()))
}

fn details(report: &RunReport, one: &ReportedResult) -> Markup {
    let result = &one.result;
    html! {
        details.more {
            summary { "Numbers, and how to repeat it" }
            dl {
                dt { "References" } dd { (result.references.join(", ")) }
                @if let Some(error) = &result.error { dt { "Error" } dd { (result.unit.words(&error.to_string())) } }
                @if let Some(error) = &result.initial_error { dt { "Reference, distance from the truth" } dd { (result.unit.words(&error.to_string())) } }
                @if let Some(counts) = &result.counts {
                    dt { "Features" }
                    dd {
                        (counts.query_keypoints) " and " (counts.reference_keypoints) " keypoints, "
                        (counts.ratio_passed) " passed the ratio test, " (counts.unique) " unique, "
                        (counts.with_depth) " with a depth, " (counts.inliers) " inliers"
                    }
                }
                @if let Some(cost) = &result.cost {
                    dt { "Cost (lower is better)" }
                    dd {
                        (format!("{:.4}", cost.best)) " at the result"
                        @if let Some(truth) = cost.truth { (format!(", {truth:.4} at the truth")) }
                        @if let Some(initial) = cost.initial { (format!(", {initial:.4} at the reference")) }
                        (format!("; the map covers {:.1} % of the photo", 100.0 * cost.coverage_best))
                    }
                }
                dt { "Repeat it" } dd { code { (repeat_command(&report.run, &one.result)) } }
                @if let Some(recording) = &one.recording {
                    dt { "Recording" }
                    dd {
                        "in the run folder: " code { "rerun " (recording) } " "
                        // The script makes it a link if a server delivers the page.
                        a hidden data-viewer=(WEB_VIEWER) data-recording=(recording) { "in Rerun's web viewer" }
                    }
                }
            }
        }
    }
}

/// The command line that repeats the query of a result as in the run.
pub fn repeat_command(run: &RunFile, result: &QueryResult) -> String {
    let pair = run.pair_of(result);
    let scene = pair.and_then(|pair| run.scenes.get(pair.scene_index));
    let query_scene = pair.filter(|pair| pair.query_index.is_some());
    let query_scene = query_scene.and_then(|pair| run.query_argument(pair)).map(str::to_owned);
    let mut protocol = Protocol {
        methods: vec![result.method],
        fusions: result.fusion.into_iter().collect(),
        explain: 0,
        limit: None,
        preset: None,
        failure_radius_m: None,
        index: Vec::new(),
        query_scene: query_scene.into_iter().collect(),
        ..run.protocol.clone()
    };
    if let Some(setting) = result.setting {
        protocol.radii_m = vec![setting.radius_m];
    }
    let task = Task {
        protocol,
        // A run of another version is repeated with the parameters that this one knows.
        params: run.params().unwrap_or_default(),
        ..Task::of(scene.cloned().unwrap_or_else(|| result.scene.clone()))
    };
    task.command_line(&result.query, &result.references)
}
