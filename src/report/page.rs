//! The page, in the order in which a reader asks: what came of the run, why queries failed, all results, and what
//! was run. External text (names, paths, reasons) is escaped on insertion.

mod failures;
mod glance;
mod results;
mod route;
mod words;

pub use failures::repeat_command;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Baseline, RunReport};
use crate::chart::hex;
use crate::measure::{GateResult, Overview};
use crate::palette;
use crate::run::RunFile;
use crate::table::{Align, Table};
use words::with_code;

const STYLE: &str = include_str!("../../assets/report/report.css");
const SCRIPT: &str = include_str!("../../assets/report/report.js");

pub(super) fn page(report: &RunReport) -> String {
    let title = title(&report.run);
    let all: Vec<_> = report.results.iter().map(|one| &one.result).collect();
    let overview = Overview::of(&all, &report.summary.doctor);
    let columns = results::columns(report);
    let rules = results::column_rules(&columns);
    let rules = format!("{rules}{}", thumbnails(report));
    let body = html! {
        header {
            h1 { (title) }
            @for finding in &overview.findings { p.headline { b.wrong { (finding.text) } } }
            p.headline { (with_code(&overview.headline)) }
            nav aria-label="Parts of the report" {
                @if !report.summary.gates.is_empty() { a href="#gates" { "Gates" } " " }
                @if report.baseline.is_some() { a href="#changes" { "Changes" } " " }
                a href="#methods" { "Methods" } " "
                @if !overview.causes.is_empty() { a href="#causes" { "Causes" } " " }
                a href="#failures" { "Failures" } " "
                a href="#queries" { "All results" } " "
                a href="#plots" { "Plots" } " "
                a href="#figures" { "Figures" } " "
                a href="#asked" { "What was run" }
            }
        }
        main {
            (gates(report))
            @if let Some(baseline) = &report.baseline { (changes(report, baseline)) }
            (glance::methods(&overview))
            (glance::causes(&overview))
            (route::routes(report, &overview.remarks))
            (failures::failures(report))
            (results::results(report, &columns))
            (plots(report))
            section aria-labelledby="figures" {
                h2 id="figures" { "Figures" }
                @for one in &report.tables { (table(one)) }
            }
            (request(report))
        }
        script { (PreEscaped(SCRIPT)) }
    };
    document(&title, &rules, &body)
}

/// A page in one file, with these rules besides the common ones.
pub(crate) fn document(title: &str, rules: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "posescope: " (title) }
                style { (PreEscaped(colors())) (PreEscaped(STYLE)) (PreEscaped(rules)) }
            }
            body { (body) }
        }
    }
    .into_string()
}

/// The colours of grades: of text on light and dark pages, and of bars with white words.
fn colors() -> String {
    let of = |prefix: &str, shade: fn(palette::Rgb) -> palette::Rgb| {
        let [right, wrong, none] = [palette::TRUTH, palette::ESTIMATE, palette::NO_POSE];
        let [right, wrong, none] = [right, wrong, none].map(|color| hex(shade(color)));
        format!(":root{{--{prefix}right:{right};--{prefix}wrong:{wrong};--{prefix}none:{none}}}")
    };
    let (light, dark) = (of("", palette::dark), of("", palette::light));
    let bars = of("bar-", palette::dark);
    format!("{light}{bars}\n@media (prefers-color-scheme: dark) {{{dark}}}\n")
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
    photos.map(|(query, uri)| format!(".q{query}{{background-image:url({uri})}}\n")).collect()
}

fn gates(report: &RunReport) -> Markup {
    let failed = report.summary.gates.iter().filter(|gate| !gate.passed).count();
    html! {
        @if !report.summary.gates.is_empty() {
            section aria-labelledby="gates" {
                h2 id="gates" { "Gates" }
                p {
                    @if failed == 0 { b.right { "All gates passed." } }
                    @else { b.wrong { (failed) " of " (report.summary.gates.len()) " gates failed." } }
                }
                (table(&GateResult::table(&report.summary.gates)))
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
                details.more {
                    summary { "Figures before and now" }
                    h3 { "Before" } (table(there))
                    h3 { "Now" } (table(here))
                }
            }
        }
    }
}

/// A table, with good and bad words coloured.
pub(crate) fn table(table: &Table) -> Markup {
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
                        tr { @for (at, cell) in row.iter().enumerate() { td class=[tone(cell).or(class(at))] { (with_code(cell)) } } }
                    }
                }
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
                    figure.plot { (chart.svg(None)) figcaption { (chart.title) } }
                }
            }
        }
    }
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
                dt { "success, as the paper counts it" } dd { (report.unit().words(&format!("within {} m of the truth", run.failure_radius_m()))) }
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
