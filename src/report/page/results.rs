//! The table of all results, with filters and a choice of columns.

use maud::{Markup, html};

use super::super::{ReportedResult, RunReport};
use super::words::{capital, class_of};
use crate::diagnosis::{Code, Grade};
use crate::measure::{Field, Group};

/// A column of the table.
#[derive(Clone, Copy)]
pub(super) enum Column {
    /// A field of the results.
    Field(&'static Field),
    /// The scenes and the setting.
    Where,
    /// The change since the baseline.
    Change,
    /// The photo of the query.
    Photo,
}

/// The columns; the first of them are shown at first.
const COLUMNS: [Column; 15] = [
    Column::Field(Field::named("query")),
    Column::Field(Field::named("method")),
    Column::Where,
    Column::Field(Field::named("grade")),
    Column::Field(Field::named("error")),
    Column::Field(Field::named("opinion")),
    Column::Field(Field::named("off")),
    Column::Field(Field::named("cause")),
    Column::Change,
    Column::Field(Field::named("rotation")),
    Column::Field(Field::named("probability")),
    Column::Field(Field::named("interval")),
    Column::Field(Field::named("start")),
    Column::Field(Field::named("reference")),
    Column::Photo,
];

/// How many columns are shown at first.
const SHOWN: usize = 9;

impl Column {
    fn heading(self) -> String {
        match self {
            Self::Field(field) => field.heading(),
            Self::Where => "where".to_owned(),
            Self::Change => "change".to_owned(),
            Self::Photo => "photo".to_owned(),
        }
    }

    /// The CSS class of its cells.
    fn class(self) -> Option<&'static str> {
        match self {
            Self::Field(field) if field.decimals.is_some() => Some("number"),
            Self::Field(field) if field.name == "cause" => Some("words"),
            _ => None,
        }
    }
}

/// The columns of which the run has values, and whether each is shown at first.
pub(super) fn columns(report: &RunReport) -> Vec<(Column, bool)> {
    let has_any = |column: &Column| match column {
        Column::Where => report.has_several_groups(),
        Column::Change => report.baseline.is_some(),
        Column::Photo => !report.thumbnails.is_empty(),
        Column::Field(field) if ["opinion", "off", "turned"].contains(&field.name) => {
            report.results.iter().any(|one| one.result.opinion.is_some())
        }
        Column::Field(_) => true,
    };
    let columns = COLUMNS.into_iter().enumerate().map(|(at, column)| (column, at < SHOWN));
    columns.filter(|(column, _)| has_any(column)).collect()
}

/// The rules that hide the columns that are not chosen; they work without a script.
pub(super) fn column_rules(columns: &[(Column, bool)]) -> String {
    let rule = |at: usize| {
        format!("section:has(#c{at}:not(:checked)) #results tr>:nth-child({at}){{display:none}}\n")
    };
    (1..=columns.len()).map(rule).collect()
}

pub(super) fn results(report: &RunReport, columns: &[(Column, bool)]) -> Markup {
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
                @for (at, (column, is_shown)) in columns.iter().enumerate() {
                    label {
                        input type="checkbox" id={ "c" (at + 1) } checked[*is_shown] autocomplete="off";
                        " " (unit.words(&column.heading()))
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
                            @for (column, _) in columns {
                                th scope="col" class=[column.class()] {
                                    @if matches!(column, Column::Photo) { (column.heading()) }
                                    @else { button type="button" { (unit.words(&column.heading())) } }
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

fn row(report: &RunReport, one: &ReportedResult, columns: &[(Column, bool)]) -> Markup {
    let code = primary(one).map_or(String::new(), |code| code.to_string());
    html! {
        tr id={ "r" (one.number) } data-method=(one.result.method) data-grade=(one.result.grade) data-code=(code) {
            @for (column, _) in columns { (cell(report, one, *column)) }
        }
    }
}

fn cell(report: &RunReport, one: &ReportedResult, column: Column) -> Markup {
    let (result, class) = (&one.result, column.class());
    let field = match column {
        Column::Photo => {
            return html! {
                td {
                    @if report.thumbnails.contains_key(&one.query) {
                        span class={ "photo q" (one.query) } role="img" aria-label={ "photo of query " (result.query) } {}
                    }
                }
            };
        }
        Column::Where => return html! { td { (place(one)) } },
        Column::Change => {
            return html! { td { @if let Some(change) = one.change { (change.name()) } } };
        }
        Column::Field(field) => field,
    };
    match field.name {
        "method" => html! { td { (result.method_name()) } },
        "grade" => html! {
            td class=(class_of(result.grade)) { (result.grade.glyph()) " " (result.grade) }
        },
        "opinion" => html! {
            td {
                @if let Some(opinion) = &result.opinion {
                    (opinion.standing.glyph()) " " (opinion.standing)
                }
            }
        },
        "cause" => html! {
            td class=[class] {
                @if let Some(primary) = result.diagnosis.first() {
                    @let title = capital(primary.code.title());
                    @if result.is_suspect() {
                        a href={ "#f" (one.number) } { (title) }
                    } @else { (title) }
                    " " span.code { (primary.code) }
                }
            }
        },
        "probability" => html! {
            td class=[class] data-v=(field.whole(result)) {
                @if let Some(known) = &result.confidence { (known.likely()) }
            }
        },
        _ if field.decimals.is_some() => html! {
            td class=[class] data-v=(field.whole(result)) { (field.text(result)) }
        },
        _ => html! { td { (field.text(result)) } },
    }
}

/// The scene and the setting of a result.
pub(super) fn place(one: &ReportedResult) -> Group {
    Group { fusion: None, ..Group::of(&one.result) }
}
