//! What is said below the table: why poses are wrong or missing, and what would have helped.

use std::time::Duration;

use posescope::localize::QueryResult;

/// The verdicts of all results in sentences, one paragraph each; nothing where all is well.
pub fn story(results: &[(QueryResult, Duration)]) -> String {
    let mut text = String::new();
    for (result, _) in results {
        let Some(primary) = result.diagnosis.first() else {
            continue;
        };
        let name = match &result.fusion {
            Some(fusion) => format!("{} {fusion}", result.method),
            None => result.method.to_string(),
        };
        text += &format!(
            "\n{} {name}: {} {}.\n",
            result.query, primary.code, primary.text
        );
        for other in result.diagnosis.iter().skip(1) {
            text += &format!("  also {}: {}\n", other.code, other.text);
        }
        let Some(explanation) = &result.explanation else {
            continue;
        };
        for helped in &explanation.helped {
            text += &format!("  helped: {} ({})\n", helped.args.join(" "), helped.error);
        }
        if explanation.helped.is_empty() {
            text += &format!("  none of {} remedies helped\n", explanation.runs);
        }
        if !explanation.complete {
            text += "  stopped before all remedies were tried\n";
        }
    }
    text
}
