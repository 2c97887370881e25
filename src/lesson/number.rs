//! Numbers in the words of a lesson, which come from the results of its runs: `{fb.matches}`.

use std::collections::BTreeMap;
use std::iter;

use crate::localize::QueryResult;
use crate::measure::Field;
use crate::method::Method;

/// The results of a lesson's variants by name, as far as they have been run.
pub type Results = BTreeMap<String, Vec<QueryResult>>;

/// Stands for a number that is not known yet.
const UNKNOWN: &str = "…";

/// A placeholder without its braces: `[VARIANT:]METHOD[.FUSION or .REFERENCE].FIELD[ %]`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Number<'a> {
    variant: Option<&'a str>,
    method: Method,
    /// The fusion or the reference.
    of: Option<&'a str>,
    field: &'static Field,
    is_percent: bool,
}

impl<'a> Number<'a> {
    fn parse(text: &'a str) -> Result<Self, String> {
        let expected = || format!("`{{{text}}}`: METHOD.FIELD expected, such as {{fb.matches}}");
        let (path, is_percent) = match text.strip_suffix(" %") {
            Some(path) => (path, true),
            None => (text, false),
        };
        let (variant, path) = match path.split_once(':') {
            Some((variant, path)) => (Some(variant), path),
            None => (None, path),
        };
        let (method, field) = path.split_once('.').ok_or_else(expected)?;
        let (of, field) = match field.rsplit_once('.') {
            Some((of, field)) => (Some(of), field),
            None => (None, field),
        };
        let unknown = |why: &dyn std::fmt::Display| format!("`{{{text}}}`: {why}");
        Ok(Self {
            variant,
            method: method.parse().map_err(|why| unknown(&why))?,
            of,
            field: Field::find(field).map_err(|why| unknown(&why))?,
            is_percent,
        })
    }

    /// Its words, from the first result that it means.
    fn of(&self, results: &[QueryResult]) -> Option<String> {
        let each = |result| {
            let alone: &QueryResult = result;
            iter::once(alone).chain(alone.per_reference.iter().flatten())
        };
        let is_of = |result: &QueryResult, name: &str| {
            let fusion = result.fusion.as_ref().map(ToString::to_string);
            fusion.as_deref() == Some(name) || (fusion.is_none() && result.references == [name])
        };
        let result = results.iter().flat_map(each).find(|result| {
            result.method == self.method && self.of.is_none_or(|name| is_of(result, name))
        })?;
        Some(self.field.spoken(result, self.is_percent)).filter(|words| !words.is_empty())
    }
}

/// The parts of a text in order: words, and placeholders without their braces. `{{` is a brace.
fn parts(text: &str) -> impl Iterator<Item = (&str, Option<&str>)> {
    let mut rest = text;
    iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let Some((words, after)) = rest.split_once('{') else {
            return Some((std::mem::take(&mut rest), None));
        };
        if let Some(after) = after.strip_prefix('{') {
            let words = &rest[..=words.len()];
            rest = after;
            return Some((words, None));
        }
        // Without its end it is none, and its brace says so.
        let (number, after) = after.split_once('}').unwrap_or((&rest[words.len()..], ""));
        rest = after;
        Some((words, Some(number)))
    })
}

/// The variants that the placeholders of a text name.
///
/// # Errors
/// What is no placeholder, with what was expected.
pub(super) fn variants(text: &str) -> Result<Vec<&str>, String> {
    let numbers = parts(text).filter_map(|(_, number)| Some(Number::parse(number?)));
    let variants = numbers.filter_map(|number| number.map(|number| number.variant).transpose());
    variants.collect()
}

/// A text with its numbers. `variant` is that of its page; `missing` collects placeholders without a value.
pub(super) fn filled(
    text: &str,
    variant: &str,
    results: &Results,
    missing: &mut Vec<String>,
) -> String {
    let mut all = String::new();
    for (words, placeholder) in parts(text) {
        all += words;
        let Some(placeholder) = placeholder else { continue };
        let number = Number::parse(placeholder)
            .ok()
            .and_then(|number| number.of(results.get(number.variant.unwrap_or(variant))?));
        if number.is_none() {
            missing.push(format!("{{{placeholder}}}"));
        }
        all += number.as_deref().unwrap_or(UNKNOWN);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_placeholder_names_a_variant_a_method_a_fusion_or_a_reference_and_a_field() {
        let number = Number::parse("night:fb.r-wavg.probability %").expect("all of it");
        assert_eq!((number.variant, number.of), (Some("night"), Some("r-wavg")));
        assert_eq!((number.method, number.field.name), (Method::FB, "probability"));
        assert!(number.is_percent);
        assert_eq!(Number::parse("fb.000059.error").expect("a reference").of, Some("000059"));
        assert_eq!(variants("{fb.error}, {{x}, {dark:mi.cost}"), Ok(vec!["dark"]));
        for (text, why) in [
            ("{matches}", "METHOD.FIELD"),
            ("{fb.machtes}", "matches"),
            ("{sift.matches}", "sift"),
            ("{fb.matches", "{fb"),
            ("{}", "METHOD.FIELD"),
        ] {
            let found = variants(text).expect_err(text);
            assert!(found.contains(why), "{text}: {found}");
        }
    }

    #[test]
    fn what_is_not_known_yet_is_left_open_and_named() {
        let mut missing = Vec::new();
        let text = filled("{{a} {fb.matches} of {b}", "first", &Results::new(), &mut missing);
        assert_eq!(text, "{a} … of …");
        assert_eq!(missing, ["{fb.matches}", "{b}"]);
    }
}
