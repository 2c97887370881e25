//! The table of all results, with filters and a choice of columns.

use maud::{Markup, html};

use super::super::{ReportedResult, RunReport};
use super::words::{capital, class_of};
use crate::diagnosis::{Code, Grade};
use crate::measure::Group;

/// A column of the table.
pub(super) struct Column {
    name: &'static str,
    /// The CSS class of its cells.
    class: &'static str,
    /// Whether it is shown at first.
    is_default: bool,
}

const fn column(name: &'static str, class: &'static str, is_default: bool) -> Column {
    Column { name, class, is_default }
}

const COLUMNS: [Column; 12] = [
    column("query", "", true),
    column("method", "", true),
    column("where", "", true),
    column("result", "", true),
    column("error (m)", "number", true),
    column("cause", "words", true),
    column("change", "", true),
    column("rotation (°)", "number", false),
    column("confidence", "number", false),
    column("distance (m)", "number", false),
    column("reference", "", false),
    column("photo", "", false),
];

/// The columns of which the run has values.
pub(super) fn columns(report: &RunReport) -> Vec<&'static Column> {
    let has_any = |column: &&Column| match column.name {
        "where" => report.has_several_groups(),
        "change" => report.baseline.is_some(),
        "photo" => !report.thumbnails.is_empty(),
        _ => true,
    };
    COLUMNS.iter().filter(has_any).collect()
}

/// The rules that hide the columns that are not chosen; they work without a script.
pub(super) fn column_rules(columns: &[&Column]) -> String {
    let rule = |at: usize| {
        format!("section:has(#c{at}:not(:checked)) #results tr>:nth-child({at}){{display:none}}\n")
    };
    (1..=columns.len()).map(rule).collect()
}

pub(super) fn results(report: &RunReport, columns: &[&Column]) -> Markup {
    let unit = report.unit();
    let is_any = |is: &dyn Fn(&ReportedResult) -> bool| report.results.iter().any(is);
    let methods = &report.run.protocol.methods;
    let methods = methods.iter().map(|method| (method, method.to_string()));
    let grades = Grade::ALL.into_iter();
    let grades = grades.filter(|grade| is_any(&|one| one.result.grade == *grade));
    let grades = grades.map(|grade| (grade, grade.to_string()));
    let codes = Code::all().into_iter();
    let codes = codes.filter(|code| is_any(&|one| primary(one) == Some(*code)));
    let codes = codes.map(|code| (code, format!("{} ({code})", capital(code.title()))));
    html! {
        section aria-labelledby="queries" {
            h2 id="queries" { "All results" }
            form.filters id="filters" hidden {
                label { "Words" input type="search" name="words" autocomplete="off"; }
                (choice("method", "Method", methods))
                (choice("grade", "Result", grades))
                (choice("code", "Cause", codes))
                button type="reset" { "No filter" }
            }
            fieldset.columns {
                legend { "Columns" }
                @for (at, column) in columns.iter().enumerate() {
                    label {
                        input type="checkbox" id={ "c" (at + 1) } checked[column.is_default] autocomplete="off";
                        " " (unit.words(column.name))
                    }
                    " "
                }
            }
            p id="count" role="status" { (report.results.len()) " results" }
            div.scroll tabindex="0" role="region" aria-label="All results" {
                table id="results" {
                    caption { span { "One row for each result. The cause of a failure leads to its picture." } }
                    thead {
                        tr {
                            @for column in columns {
                                th scope="col" class=[class(column)] {
                                    @if column.name == "photo" { (column.name) }
                                    @else { button type="button" { (unit.words(column.name)) } }
                                }
                            }
                        }
                    }
                    tbody {
                        @for one in &report.results { (row(report, one, columns)) }
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

fn class(column: &Column) -> Option<&'static str> {
    Some(column.class).filter(|class| !class.is_empty())
}

fn row(report: &RunReport, one: &ReportedResult, columns: &[&Column]) -> Markup {
    let code = primary(one).map_or(String::new(), |code| code.to_string());
    html! {
        tr id={ "r" (one.number) } data-method=(one.result.method) data-grade=(one.result.grade) data-code=(code) {
            @for column in columns { (cell(report, one, column)) }
        }
    }
}

fn cell(report: &RunReport, one: &ReportedResult, column: &Column) -> Markup {
    let result = &one.result;
    let class = class(column);
    let number = |value: Option<f64>, digits: usize| {
        html! {
            td class=[class] data-v=(value.map_or(String::new(), |value| value.to_string())) {
                @if let Some(value) = value { (format!("{value:.digits$}")) }
            }
        }
    };
    match column.name {
        "photo" => html! {
            td {
                @if report.thumbnails.contains_key(&one.query) {
                    span class={ "photo q" (one.query) } role="img" aria-label={ "photo of query " (result.query) } {}
                }
            }
        },
        "query" => html! { td { (result.query) } },
        "method" => html! { td { (result.method_name()) } },
        "where" => html! { td { (place(one)) } },
        "reference" => html! { td { (result.references.join(" ")) } },
        "result" => html! {
            td class=(class_of(result.grade)) { (result.grade.glyph()) " " (result.grade) }
        },
        "error (m)" => number(result.error.map(|error| error.translation_m), 3),
        "rotation (°)" => number(result.error.map(|error| error.rotation_deg), 2),
        "distance (m)" => number(result.initial_error.map(|error| error.translation_m), 3),
        "confidence" => match &result.confidence {
            Some(known) => {
                html! { td class=[class] data-v=(known.probability) { (known.likely()) } }
            }
            None => html! { td class=[class] data-v="" {} },
        },
        "cause" => html! {
            td class=[class] {
                @if let Some(primary) = result.diagnosis.first() {
                    @let title = capital(primary.code.title());
                    @if result.grade.is_failure() {
                        a href={ "#f" (one.number) } { (title) }
                    } @else { (title) }
                    " " span.code { (primary.code) }
                }
            }
        },
        _ => html! { td { @if let Some(change) = one.change { (change.name()) } } },
    }
}

/// The scene and the setting of a result.
pub(super) fn place(one: &ReportedResult) -> Group {
    Group { fusion: None, ..Group::of(&one.result) }
}
