//! For posescope's own crates: may change in any version.
//!
//! Words on the command line, in files and in tables.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use serde::Deserializer;
use serde::de::Visitor;

/// A word that is none of those expected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no {kind}; {expected} expected")]
pub struct UnknownWord {
    /// The word.
    pub found: String,
    /// What it should have named.
    pub kind: &'static str,
    /// The words there are.
    pub expected: String,
}

impl UnknownWord {
    /// One of `names` expected.
    pub fn among(
        found: &str,
        kind: &'static str,
        names: impl IntoIterator<Item = &'static str>,
    ) -> Self {
        let names: Vec<&str> = names.into_iter().collect();
        let expected = match names.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            _ => names.concat(),
        };
        Self { found: found.to_owned(), kind, expected }
    }
}

/// Refuses a name of a scene, a photo or a query that no line has room for, or that controls a terminal.
///
/// # Errors
/// What is expected of names.
pub fn expect_name(name: &str) -> Result<(), String> {
    /// Longer than any path that a photo has below its scene \[bytes\].
    const LONGEST: usize = 4096;
    let shown = || name.escape_default().take(100).collect::<String>();
    if name.contains(char::is_control) {
        Err(format!("names without control characters expected, `{}` found", shown()))
    } else if name.len() > LONGEST {
        Err(format!("names of at most {LONGEST} bytes expected, `{}…` found", shown()))
    } else {
        Ok(())
    }
}

/// An enum each of whose values is one word, on the command line, in files and in tables.
macro_rules! words {
    ($type:ident, $kind:literal: $($variant:ident = $word:literal),+ $(,)?) => {
        impl $type {
            /// All of them, in order.
            pub const ALL: [Self; [$($word),+].len()] = [$(Self::$variant),+];

            /// The word, the same everywhere.
            pub fn word(self) -> &'static str {
                match self { $(Self::$variant => $word),+ }
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.word())
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::text::UnknownWord;

            fn from_str(word: &str) -> Result<Self, Self::Err> {
                let found = Self::ALL.into_iter().find(|one| one.word() == word);
                let unknown = || Self::Err::among(word, $kind, Self::ALL.map(Self::word));
                found.ok_or_else(unknown)
            }
        }

        $crate::serde_as_text!($type);
    };
}
pub(crate) use words;

/// The first sentence of a text, and the rest. A point inside a number ends no sentence.
pub fn first_sentence(text: &str) -> (&str, &str) {
    match text.find(". ") {
        Some(end) => (&text[..=end], text[end + 1..].trim_start()),
        None => (text, ""),
    }
}

/// The name that is most like a mistyped word, if one is.
pub fn similar<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    names
        .into_iter()
        .map(|name| (strsim::jaro_winkler(name, word), name))
        .filter(|(similarity, _)| *similarity > 0.8)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, name)| name)
}

/// The message of a JSON error, without the line, which its reader counts in the whole file.
pub fn json_message(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    match text.strip_suffix(&place) {
        Some(message) => format!("column {}: {message}", error.column()),
        None => text,
    }
}

/// Reads a string as what it says. An error has the place of the string.
///
/// # Errors
/// No string, or what `FromStr` says of it.
pub fn parsed<'de, T, D>(deserializer: D) -> Result<T, D::Error>
where
    T: FromStr,
    T::Err: fmt::Display,
    D: Deserializer<'de>,
{
    // Parsed within the visitor: what is refused only later has a later place.
    struct Words<T>(PhantomData<T>);

    impl<T: FromStr<Err: fmt::Display>> Visitor<'_> for Words<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a string")
        }

        fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<T, E> {
            text.parse().map_err(E::custom)
        }
    }

    deserializer.deserialize_str(Words(PhantomData))
}

/// Reads and writes a type that has `Display` and `FromStr` as a string. What `FromStr` says of a
/// wrong one reaches the reader of the file.
#[doc(hidden)]
#[macro_export]
macro_rules! serde_as_text {
    ($type:ty) => {
        impl ::serde::Serialize for $type {
            fn serialize<S: ::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> ::serde::Deserialize<'de> for $type {
            fn deserialize<D: ::serde::Deserializer<'de>>(
                deserializer: D,
            ) -> Result<Self, D::Error> {
                $crate::text::parsed(deserializer)
            }
        }
    };
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
    fn an_unknown_word_is_told_which_there_are() {
        let unknown = UnknownWord::among("xx", "method", ["fb", "pm", "mi"]);
        assert_eq!(unknown.to_string(), "`xx` is no method; fb, pm or mi expected");
        assert_eq!(UnknownWord::among("xx", "fusion", ["avg"]).expected, "avg");
    }
}
