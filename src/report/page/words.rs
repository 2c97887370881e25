//! Words of the page.

use maud::{Markup, html};

use crate::diagnosis::Grade;
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
    fn words_between_backticks_are_code_and_a_single_backtick_is_none() {
        assert_eq!(
            with_code("`--method <x>` mends 3.").into_string(),
            "<code>--method &lt;x&gt;</code> mends 3."
        );
        assert_eq!(with_code("a ` b").into_string(), "a ` b");
    }
}
