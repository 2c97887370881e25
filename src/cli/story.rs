//! What is said below the table: why poses are wrong or missing, and what would have helped.

use std::time::Duration;

use posescope::localize::QueryResult;

use super::columns::wrapped;

/// The verdicts of all results in sentences, one paragraph each, in lines of at most `width` characters, if
/// they have a limit; nothing where all is well.
pub fn story(results: &[(QueryResult, Duration)], width: Option<usize>) -> String {
    let mut text = String::new();
    let lines = |paragraph: String| wrapped(&paragraph, width.unwrap_or(usize::MAX), "    ");
    for (result, _) in results {
        let Some(primary) = result.diagnosis.first() else {
            continue;
        };
        let name = match &result.fusion {
            Some(fusion) => format!("{} {fusion}", result.method),
            None => result.method.to_string(),
        };
        let sentence = format!("{} {name}: {} {}", result.query, primary.code, primary.text);
        text += &format!("\n{}", lines(sentence));
        for other in result.diagnosis.iter().skip(1) {
            text += &lines(format!("  also {}: {}", other.code, other.text));
        }
        let Some(explanation) = &result.explanation else {
            if result.grade.is_failure() {
                text += &lines(format!("  try: {}", primary.code.rule().advice));
            }
            continue;
        };
        for helped in &explanation.helped {
            text += &lines(format!(
                "  helped: {} ({})",
                helped.args.join(" "),
                helped.error
            ));
        }
        if explanation.helped.is_empty() {
            text += &lines(format!("  none of {} remedies helped", explanation.runs));
        }
        if !explanation.complete {
            text += &lines("  stopped before all remedies were tried".to_owned());
        }
    }
    text
}
