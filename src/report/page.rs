//! The page. External text (names, paths, reasons) is escaped on insertion.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Baseline, ReportedResult, RunReport};
use crate::chart::hex;
use crate::diagnosis::{Code, Grade};
use crate::measure::{GateResult, Group};
use crate::palette;
use crate::run::{Protocol, RunFile};
use crate::session::Task;
use crate::table::{Align, Table};

const STYLE: &str = include_str!("../../assets/report/report.css");
const SCRIPT: &str = include_str!("../../assets/report/report.js");

/// Rerun's web viewer in the version of our recordings. It reads the recording at the URL appended to this one.
const WEB_VIEWER: &str = "https://app.rerun.io/version/0.36.3/?url=";

pub(super) fn page(report: &RunReport) -> String {
    let title = title(&report.run);
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "posescope: " (title) }
                style { (PreEscaped(colors())) (PreEscaped(STYLE)) (PreEscaped(thumbnails(report))) }
            }
            body {
                header {
                    h1 { (title) }
                    nav aria-label="Parts of the report" {
                        a href="#asked" { "What was run" }
                        @if !report.gates.is_empty() { a href="#gates" { "Gates" } }
                        @if report.baseline.is_some() { a href="#changes" { "Changes" } }
                        a href="#figures" { "Figures" }
                        a href="#plots" { "Plots" }
                        a href="#queries" { "All results" }
                        a href="#failures" { "Failures" }
                    }
                }
                main {
                    (request(report))
                    (gates(report))
                    @if let Some(baseline) = &report.baseline { (changes(report, baseline)) }
                    section aria-labelledby="figures" {
                        h2 id="figures" { "Figures" }
                        @for one in &report.tables { (table(one)) }
                    }
                    (plots(report))
                    (results(report))
                    (failures(report))
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    }
    .into_string()
}

/// The text colours, for light and dark pages.
fn colors() -> String {
    let of = |shade: fn(palette::Rgb) -> palette::Rgb| {
        let [right, wrong, none] = [palette::TRUTH, palette::ESTIMATE, palette::NO_POSE];
        let [right, wrong, none] = [right, wrong, none].map(|color| hex(shade(color)));
        format!(":root{{--right:{right};--wrong:{wrong};--none:{none}}}")
    };
    let (light, dark) = (of(palette::dark), of(palette::light));
    format!("{light}\n@media (prefers-color-scheme: dark) {{{dark}}}\n")
}

fn title(run: &RunFile) -> String {
    let names = run.pairs.iter().map(|pair| {
        if pair.scene == pair.query_scene {
            pair.scene.clone()
        } else {
            format!("{} ← {}", pair.scene, pair.query_scene)
        }
    });
    names.collect::<Vec<_>>().join(", ")
}

/// One CSS class per query photo, shared by its results. Our own data URIs contain no markup.
fn thumbnails(report: &RunReport) -> String {
    let photos = report.thumbnails.iter();
    photos
        .map(|(query, uri)| format!(".q{query}{{background-image:url({uri})}}\n"))
        .collect()
}

fn request(report: &RunReport) -> Markup {
    let (run, protocol) = (&report.run, &report.run.protocol);
    html! {
        section aria-labelledby="asked" {
            h2 id="asked" { "What was run" }
            dl {
                dt { "scenes" } dd { (run.scenes.join(", ")) }
                dt { "queries" } dd { (run.items().count()) }
                @if let Some(shard) = run.shard { dt { "part" } dd { (shard) } }
                dt { "methods" } dd { (protocol.methods.iter().map(|method| method.name()).collect::<Vec<_>>().join(", ")) }
                dt { "right" } dd { "within " (protocol.right) " of the truth; wrong otherwise" }
                dt { "success, as the paper counts it" } dd { "within " (run.failure_radius_m()) " m of the truth" }
                @for (option, value) in protocol.options() { dt { (option) } dd { (value) } }
                dt { "parameters" }
                dd {
                    @if report.changes.is_empty() { "all at their defaults" }
                    @for change in &report.changes { code { (change) } " " }
                }
                dt { "version" } dd { "posescope " (run.version) }
            }
            @for note in &report.notes { p { (note) } }
        }
    }
}

fn gates(report: &RunReport) -> Markup {
    html! {
        @if !report.gates.is_empty() {
            section aria-labelledby="gates" {
                h2 id="gates" { "Gates" }
                (table(&GateResult::table(&report.gates)))
            }
        }
    }
}

/// A table, with good and bad words coloured.
fn table(table: &Table) -> Markup {
    let class = |at: usize| match table.align.get(at) {
        Some(Align::Right) => Some("number"),
        Some(Align::Note) => Some("words"),
        _ => None,
    };
    let tone = |cell: &str| match cell {
        "passed" | "fixed" | "better" => Some("right"),
        "failed" | "broken" | "worse" => Some("wrong"),
        _ => None,
    };
    html! {
        div.scroll tabindex="0" role="region" aria-label=(table.name) style="margin-bottom:1rem" {
            table {
                caption { span { (if table.caption.is_empty() { &table.name } else { &table.caption }) } }
                thead {
                    tr { @for (at, cell) in table.header.iter().enumerate() { th scope="col" class=[class(at)] { (cell) } } }
                }
                tbody {
                    @for row in &table.rows {
                        tr { @for (at, cell) in row.iter().enumerate() { td class=[tone(cell).or(class(at))] { (cell) } } }
                    }
                }
            }
        }
    }
}

fn changes(report: &RunReport, baseline: &Baseline) -> Markup {
    let comparison = &baseline.comparison;
    html! {
        section aria-labelledby="changes" {
            h2 id="changes" { "Changes since " code { (baseline.name) } }
            p { (comparison.summary()) }
            @if !comparison.differences.is_empty() { (table(&comparison.table())) }
            @if let (Some(there), Some(here)) = (baseline.tables.first(), report.tables.first()) {
                h3 { "Before" } (table(there))
                h3 { "Now" } (table(here))
            }
        }
    }
}

fn plots(report: &RunReport) -> Markup {
    html! {
        section aria-labelledby="plots" {
            h2 id="plots" { "Plots" }
            @if report.charts.is_empty() { p { "There are no plots, because the ground truth is unknown." } }
            div.plots {
                @for chart in &report.charts {
                    figure.plot { (chart.markup()) figcaption { (chart.title) } }
                }
            }
        }
    }
}

/// The columns of the table of results with their classes; wide ones are hidden on a phone.
const COLUMNS: [(&str, &str); 12] = [
    ("photo", ""),
    ("query", ""),
    ("method", ""),
    ("where", "wide"),
    ("reference", "wide"),
    ("grade", ""),
    ("error (m)", "number"),
    ("rotation (°)", "number"),
    ("start (m)", "number wide"),
    ("probability", "number wide"),
    ("code", ""),
    ("change", "wide"),
];

fn results(report: &RunReport) -> Markup {
    let mut groups = report.measures.iter().map(|one| &one.group);
    let first = groups.next();
    let has_several_groups = groups.any(|group| Some(group) != first);
    let is_shown = |name: &str| match name {
        "where" => has_several_groups,
        "change" => report.baseline.is_some(),
        "photo" => !report.thumbnails.is_empty(),
        _ => true,
    };
    let columns: Vec<_> = COLUMNS.iter().filter(|(name, _)| is_shown(name)).collect();
    let is_any = |is: &dyn Fn(&ReportedResult) -> bool| report.results.iter().any(is);
    let methods = &report.run.protocol.methods;
    let methods = methods.iter().map(|method| (method, method.to_string()));
    let grades = Grade::ALL.into_iter();
    let grades = grades.filter(|grade| is_any(&|one| one.result.grade == *grade));
    let grades = grades.map(|grade| (grade, grade.to_string()));
    let codes = Code::all().into_iter();
    let codes = codes.filter(|code| is_any(&|one| primary(one) == Some(*code)));
    let codes = codes.map(|code| (code, format!("{code} {}", code.title())));
    html! {
        section aria-labelledby="queries" {
            h2 id="queries" { "All results" }
            form.filters id="filters" hidden {
                label { "Words" input type="search" name="words" autocomplete="off"; }
                (choice("method", "Method", methods))
                (choice("grade", "Grade", grades))
                (choice("code", "Verdict", codes))
                button type="reset" { "No filter" }
            }
            p id="count" role="status" { (report.results.len()) " results" }
            div.scroll tabindex="0" role="region" aria-label="All results" {
                table id="results" {
                    caption { "One row per result; a verdict links to the details of the failure" }
                    thead {
                        tr {
                            @for (name, class) in &columns {
                                th scope="col" class=[Some(*class).filter(|class| !class.is_empty())] {
                                    @if *name == "photo" { (name) } @else { button type="button" { (name) } }
                                }
                            }
                        }
                    }
                    tbody {
                        @for one in &report.results {
                            (row(report, one, &columns))
                        }
                    }
                }
            }
            p { button type="button" id="more" hidden { "Show all" } }
        }
    }
}

fn choice(
    name: &str,
    label: &str,
    values: impl Iterator<Item = (impl ToString, String)>,
) -> Markup {
    html! {
        label {
            (label)
            select name=(name) {
                option value="" { "all" }
                @for (value, words) in values { option value=(value.to_string()) { (words) } }
            }
        }
    }
}

fn primary(one: &ReportedResult) -> Option<Code> {
    one.result.diagnosis.first().map(|primary| primary.code)
}

fn row(report: &RunReport, one: &ReportedResult, columns: &[&(&str, &str)]) -> Markup {
    let code = primary(one).map_or(String::new(), |code| code.to_string());
    html! {
        tr id={ "r" (one.number) } data-method=(one.result.method) data-grade=(one.result.grade) data-code=(code) {
            @for (name, class) in columns { (cell(report, one, name, class)) }
        }
    }
}

fn cell(report: &RunReport, one: &ReportedResult, name: &str, class: &str) -> Markup {
    let result = &one.result;
    let class = Some(class).filter(|class| !class.is_empty());
    let number = |value: Option<f64>, digits: usize| {
        html! {
            td class=[class] data-v=(value.map_or(String::new(), |value| value.to_string())) {
                @if let Some(value) = value { (format!("{value:.digits$}")) }
            }
        }
    };
    match name {
        "photo" => html! {
            td {
                @if report.thumbnails.contains_key(&one.query) {
                    span class={ "photo q" (one.query) } role="img" aria-label={ "photo of query " (result.query) } {}
                }
            }
        },
        "query" => html! { td { (result.query) } },
        "method" => html! { td { (result.method_name()) } },
        "where" => {
            let place = Group {
                fusion: None,
                ..Group::of(result)
            };
            html! { td class=[class] { (place) } }
        }
        "reference" => html! { td class=[class] { (result.references.join(" ")) } },
        "grade" => {
            let grade = result.grade;
            let class = match grade {
                Grade::Right => "right",
                Grade::Wrong => "wrong",
                Grade::NoPose => "none",
                Grade::Unmeasured => "",
            };
            html! { td class=(class) { (grade.glyph()) " " (grade) } }
        }
        "error (m)" => number(result.error.map(|error| error.translation_m), 3),
        "rotation (°)" => number(result.error.map(|error| error.rotation_deg), 2),
        "start (m)" => number(result.initial_error.map(|error| error.translation_m), 3),
        "probability" => number(result.confidence.as_ref().map(|one| one.probability), 3),
        "code" => html! {
            td {
                @if let Some(primary) = result.diagnosis.first() {
                    @if one.result.grade.is_failure() {
                        a href={ "#f" (one.number) } title=(primary.text) { (primary.code) }
                    } @else {
                        span title=(primary.text) { (primary.code) }
                    }
                }
            }
        },
        _ => html! { td class=[class] { @if let Some(change) = one.change { (change.name()) } } },
    }
}

fn failures(report: &RunReport) -> Markup {
    let failures: Vec<&ReportedResult> = report
        .results
        .iter()
        .filter(|one| one.result.grade.is_failure())
        .collect();
    html! {
        section aria-labelledby="failures" {
            h2 id="failures" { "Failures (" (failures.len()) ")" }
            p {
                "The green plus is the truth, the vermilion diamond the result, the white ring the reference."
                @if failures.iter().any(|one| one.recording.is_some()) {
                    " Recordings are in the run folder; type the commands that open them there."
                }
            }
            @for one in &failures { (failure(report, one)) }
        }
    }
}

fn failure(report: &RunReport, one: &ReportedResult) -> Markup {
    let result = &one.result;
    html! {
        details id={ "f" (one.number) } {
            summary { (result.headline()) }
            @for paragraph in result.paragraphs() { p { (paragraph) } }
            dl {
                dt { "References" } dd { (result.references.join(", ")) }
                @if let Some(error) = &result.error { dt { "Error" } dd { (error) } }
                @if let Some(error) = &result.initial_error { dt { "Reference, distance from the truth" } dd { (error) } }
                @if let Some(counts) = &result.counts {
                    dt { "Features" }
                    dd {
                        (counts.query_keypoints) " and " (counts.reference_keypoints) " keypoints, "
                        (counts.ratio_passed) " passed the ratio test, " (counts.unique) " unique, "
                        (counts.with_depth) " with a depth, " (counts.inliers) " inliers"
                    }
                }
                @if let Some(cost) = &result.cost {
                    dt { "Cost" }
                    dd {
                        (format!("{:.4}", cost.best)) " at the result"
                        @if let Some(truth) = cost.truth { (format!(", {truth:.4} at the truth")) }
                        @if let Some(initial) = cost.initial { (format!(", {initial:.4} at the reference")) }
                        (format!(", covering {:.1} % of the photo", 100.0 * cost.coverage_best))
                    }
                }
                dt { "Repeat" } dd { code { (again(&report.run, one)) } }
                @if let Some(recording) = &one.recording {
                    dt { "Recording" }
                    dd {
                        code { "rerun " (recording) } " "
                        // The script makes it a link if a server delivers the page.
                        a hidden data-viewer=(WEB_VIEWER) data-recording=(recording) { "in Rerun's web viewer" }
                    }
                }
            }
            @if let Some(proof) = &one.proof { img.proof src=(proof.picture) alt=(proof.words); }
        }
    }
}

/// The command line that repeats the query as in the run.
fn again(run: &RunFile, one: &ReportedResult) -> String {
    let result = &one.result;
    let place = run.pairs.iter().find(|pair| pair.scene == result.scene);
    let scene = place.and_then(|pair| run.scenes.get(pair.scene_index));
    let mut protocol = Protocol {
        methods: vec![result.method],
        fusions: result.fusion.into_iter().collect(),
        explain: 0,
        limit: None,
        preset: None,
        failure_radius_m: None,
        index: Vec::new(),
        ..run.protocol.clone()
    };
    if let Some(setting) = result.setting {
        protocol.radii_m = vec![setting.radius_m];
    }
    protocol
        .query_scene
        .truncate(usize::from(result.query_scene.is_some()));
    let task = Task {
        protocol,
        // A run of another version is repeated with the parameters that this one knows.
        params: run.params().unwrap_or_default(),
        ..Task::of(scene.cloned().unwrap_or_else(|| result.scene.clone()))
    };
    task.command_line(&result.query, &result.references)
}
