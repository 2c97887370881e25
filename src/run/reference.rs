//! The argument of `--reference`.

use std::fmt;
use std::str::FromStr;

use crate::localize::Selection;
use crate::text::UnknownWord;

/// A frame, or a way of choosing frames: `000062`, `nearest:3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The frame of this name.
    Frame(String),
    /// Frames chosen for each query.
    Chosen(Selection),
}

impl FromStr for Reference {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        let is_choice = text.split_once(':').is_some_and(|(how, count)| {
            let is_word = !how.is_empty() && how.chars().all(|c| c.is_ascii_lowercase());
            is_word && (Selection::is_name(how) || count.parse::<usize>().is_ok())
        });
        if is_choice { text.parse().map(Self::Chosen) } else { Ok(Self::Frame(text.to_owned())) }
    }
}

impl fmt::Display for Reference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame(name) => f.write_str(name),
            Self::Chosen(selection) => selection.fmt(f),
        }
    }
}

posescope_core::serde_as_text!(Reference);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_of_choosing_is_told_from_a_frame() {
        let read = |text: &str| text.parse::<Reference>();
        assert_eq!(read("matches:3"), Ok(Reference::Chosen(Selection::Matched(3))));
        for frame in ["000062", "a/b.jpg", "12:30:00", "random"] {
            assert_eq!(read(frame), Ok(Reference::Frame(frame.to_owned())), "{frame}");
        }
        assert!(read("random:0").is_err());
        assert!(read("nearest:many").is_err());
        assert!(read("best:2").is_err());
    }
}
