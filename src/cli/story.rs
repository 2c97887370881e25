//! The text below the table of results: why poses are wrong or missing, and what would have helped.

use std::time::Duration;

use posescope::localize::QueryResult;
use posescope::table::wrapped;

/// The verdicts of all results in sentences, wrapped at `width` characters if given; empty if there is no
/// verdict.
pub fn story(results: &[(QueryResult, Duration)], width: Option<usize>) -> String {
    let mut text = String::new();
    let lines = |paragraph: String| wrapped(&paragraph, width.unwrap_or(usize::MAX), "    ");
    for (result, _) in results {
        let Some(verdict) = result.verdict() else {
            continue;
        };
        // With several references, the sentence names the one that gave the pose.
        let is_same = |other: &QueryResult| {
            other.query == result.query && other.method_name() == result.method_name()
        };
        let against = match results.iter().filter(|(other, _)| is_same(other)).count() {
            1 => String::new(),
            _ => format!(" against {}", result.references.join(" ")),
        };
        let sentence = format!("{} {}{against}: {verdict}", result.query, result.method_name());
        text += &format!("\n{}", lines(sentence));
        for paragraph in result.paragraphs() {
            text += &lines(format!("  {paragraph}"));
        }
    }
    text
}
