//! What stands below the table: why poses are wrong or missing, and what would have helped.

use std::time::Duration;

use posescope::localize::QueryResult;
use posescope::table::wrapped;

/// The verdicts of all results in sentences, in lines of at most `width` characters, if they have a limit;
/// nothing where all is well.
pub fn story(results: &[(QueryResult, Duration)], width: Option<usize>) -> String {
    let mut text = String::new();
    let lines = |paragraph: String| wrapped(&paragraph, width.unwrap_or(usize::MAX), "    ");
    for (result, _) in results {
        let Some(verdict) = result.verdict() else {
            continue;
        };
        let sentence = format!("{} {}: {verdict}", result.query, result.method_name());
        text += &format!("\n{}", lines(sentence));
        for paragraph in result.paragraphs() {
            text += &lines(format!("  {paragraph}"));
        }
    }
    text
}
