//! Tables for terminals and pipes.

use std::time::Duration;

use posescope::geometry::PoseError;
use posescope::localize::QueryResult;
use posescope::table::{Align, Table};

/// A column: its heading, its alignment, and its cell for a result that took so long.
type Column = (&'static str, Align, fn(&QueryResult, Duration) -> String);

const COLUMNS: [Column; 10] = [
    ("query", Align::Left, |result, _| result.query.clone()),
    ("reference", Align::Left, |result, _| result.references.join(" ")),
    ("distance", Align::Right, |result, _| {
        result.initial_error.as_ref().map_or(String::new(), PoseError::translation)
    }),
    ("method", Align::Left, |result, _| result.method_name()),
    ("grade", Align::Left, |result, _| format!("{} {}", result.grade.glyph(), result.grade)),
    ("error", Align::Right, |result, _| part(result, PoseError::translation)),
    ("rotation", Align::Right, |result, _| part(result, PoseError::rotation)),
    ("max Euler", Align::Right, |result, _| part(result, PoseError::max_euler)),
    ("time", Align::Right, |_, time| format!("{:.2} s", time.as_secs_f64())),
    ("verdict or evidence", Align::Note, |result, _| result.evidence()),
];

/// The leading columns that are equal for all methods of a query.
const OF_QUERY: usize = 3;

fn part(result: &QueryResult, part: fn(&PoseError) -> String) -> String {
    result.error.as_ref().map_or(String::new(), part)
}

/// One row per query, reference and method, in lines of at most `width` characters if given.
pub fn results(results: &[(QueryResult, Duration)], width: Option<usize>) -> String {
    let mut table = Table::new("", "", COLUMNS.map(|(heading, ..)| heading));
    table.align = COLUMNS.map(|(_, align, _)| align).to_vec();
    table.shared = OF_QUERY;
    for (result, time) in results {
        // The evidence is in words of the unit already.
        let cell = |(_, align, cell): Column| match align {
            Align::Right => result.unit.words(&cell(result, *time)),
            _ => cell(result, *time),
        };
        table.push(COLUMNS.map(cell));
    }
    table.to_text(width)
}

/// A table for a terminal of this width, or without a width, for a pipe, as Markdown.
pub fn figures(table: &Table, width: Option<usize>) -> String {
    match width {
        Some(_) => table.to_text(width),
        None => table.to_markdown(),
    }
}
