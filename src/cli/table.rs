//! Tables for terminals and pipes.

use std::time::Duration;

use posescope::geometry::PoseError;
use posescope::localize::QueryResult;
use posescope::table::Table;

/// One row per query, reference and method, in lines of at most `width` characters if given.
pub fn results(results: &[(QueryResult, Duration)], width: Option<usize>) -> String {
    let header = [
        "query",
        "reference",
        "distance",
        "method",
        "grade",
        "error",
        "rotation",
        "max Euler",
        "time",
        "verdict or evidence",
    ];
    // Rows of the same query and references differ only in the method.
    let mut table = Table::with_notes(header, &[2, 5, 6, 7, 8], 3);
    for (result, time) in results {
        let words = |text: String| result.unit.words(&text);
        let part = |part: fn(&PoseError) -> String| result.error.as_ref().map(part).map(words);
        let start = result.initial_error.as_ref().map(PoseError::translation).map(words);
        table.push([
            result.query.clone(),
            result.references.join(" "),
            start.unwrap_or_default(),
            result.method_name(),
            format!("{} {}", result.grade.glyph(), result.grade),
            part(PoseError::translation).unwrap_or_default(),
            part(PoseError::rotation).unwrap_or_default(),
            part(PoseError::max_euler).unwrap_or_default(),
            format!("{:.2} s", time.as_secs_f64()),
            result.evidence(),
        ]);
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
