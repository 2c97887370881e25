//! Words of the page.

use maud::{Markup, html};

use crate::diagnosis::{Confidence, Grade, PoseConfidence, confidence};
use crate::localize::QueryResult;

/// A text in which words between backticks are code.
pub(super) fn with_code(text: &str) -> Markup {
    let parts: Vec<&str> = text.split('`').collect();
    let is_paired = parts.len() % 2 == 1;
    html! {
        @if is_paired {
            @for (at, part) in parts.iter().enumerate() {
                @if at % 2 == 1 { code { (part) } } @else { (part) }
            }
        } @else { (text) }
    }
}

/// The first sentence of a text, and the rest.
pub(super) fn first_sentence(text: &str) -> (&str, &str) {
    match text.find(". ") {
        Some(end) => (&text[..=end], text[end + 1..].trim_start()),
        None => (text, ""),
    }
}

/// With a capital first letter.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

/// The CSS class of a grade.
pub(super) fn class_of(grade: Grade) -> &'static str {
    match grade {
        Grade::Right => "right",
        Grade::Unmeasured => "unmeasured",
        Grade::Wrong => "wrong",
        Grade::NoPose => "none",
    }
}

/// The probability of being right, with a filled diamond before a low one.
pub(super) fn likely(known: &PoseConfidence) -> String {
    let percent = confidence::percent(known.probability);
    match known.word {
        Confidence::Low => format!("{} {percent}", Confidence::Low.glyph()),
        _ => percent,
    }
}

/// What is wrong with a result, in sentences.
pub(super) fn sentences(result: &QueryResult) -> String {
    match (result.diagnosis.first(), &result.reason) {
        (Some(primary), _) => primary.text.clone(),
        (None, Some(reason)) => reason.text.clone(),
        (None, None) => capital(&result.grade.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_with_a_point_does_not_end_the_first_sentence() {
        assert_eq!(
            first_sentence("Cost 0.915 at 5.08 m. The lowest is 0.929."),
            ("Cost 0.915 at 5.08 m.", "The lowest is 0.929.")
        );
        assert_eq!(first_sentence("No pose"), ("No pose", ""));
    }

    #[test]
    fn words_between_backticks_are_code_and_a_single_backtick_is_none() {
        assert_eq!(
            with_code("`--method <x>` mends 3.").into_string(),
            "<code>--method &lt;x&gt;</code> mends 3."
        );
        assert_eq!(with_code("a ` b").into_string(), "a ` b");
    }
}
