//! Scene arguments: a path with an optional word, such as `street:night`.

use std::path::Path;

/// Splits `PATH:WORD` if the word is one of these.
pub(super) fn split_word<'a>(argument: &'a str, words: &[&str]) -> (&'a Path, Option<&'a str>) {
    match argument.rsplit_once(':') {
        Some((path, word)) if words.contains(&word) => (Path::new(path), Some(word)),
        _ => (Path::new(argument), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_known_words_are_split_off() {
        let split = |argument| split_word(argument, &["test"]);
        assert_eq!(split("a/b:test"), (Path::new("a/b"), Some("test")));
        assert_eq!(split("a/b:c"), (Path::new("a/b:c"), None));
        assert_eq!(split(r"c:\a"), (Path::new(r"c:\a"), None));
    }
}
