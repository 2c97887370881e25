//! Words of a line, and numbers as programs write them.

use crate::scene::lines::excerpt;

/// What separates the columns of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Semicolon,
    Tab,
    Comma,
    /// White space of any kind and length.
    Blanks,
}

impl Separator {
    pub const ALL: [Self; 4] = [Self::Semicolon, Self::Tab, Self::Comma, Self::Blanks];

    /// The words of a line. A separator at its end begins no further word.
    pub fn words(self, line: &str) -> Words<'_> {
        let line = match self {
            Self::Semicolon => line.strip_suffix(';').unwrap_or(line),
            Self::Comma => line.strip_suffix(',').unwrap_or(line),
            Self::Tab => line.strip_suffix('\t').unwrap_or(line),
            Self::Blanks => line.trim(),
        };
        Words { rest: Some(line), separator: self }
    }
}

pub(super) struct Words<'a> {
    rest: Option<&'a str>,
    separator: Separator,
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let rest = self.rest?;
        let bytes = rest.as_bytes();
        let end = match self.separator {
            Separator::Semicolon => bytes.iter().position(|byte| *byte == b';'),
            Separator::Tab => bytes.iter().position(|byte| *byte == b'\t'),
            Separator::Comma => bytes.iter().position(|byte| *byte == b','),
            Separator::Blanks => bytes.iter().position(u8::is_ascii_whitespace),
        };
        let Some(end) = end else {
            self.rest = None;
            return Some(rest.trim());
        };
        let after = &rest[end + 1..];
        self.rest = Some(match self.separator {
            Separator::Blanks => after.trim_start(),
            _ => after,
        });
        Some(rest[..end].trim())
    }
}

/// Whether a line says nothing about points.
pub(super) fn is_comment(line: &str) -> bool {
    line.trim_start().is_empty() || line.starts_with('#') || line.starts_with("//")
}

/// The number of points that a line of its own announces.
pub(super) fn lone_count(line: &str) -> Option<u64> {
    let is_count = !line.is_empty() && line.bytes().all(|byte| byte.is_ascii_digit());
    is_count.then(|| line.parse().ok())?
}

/// The number of a word; NaN for what programs write in place of one.
pub(in crate::scene::cloud_file) fn number(word: &str, has_decimal_comma: bool) -> Option<f64> {
    let word = word.trim_matches('"');
    if has_decimal_comma && word.contains([',', '.']) && !is_no_number(word) {
        // Points, or several commas, are those of thousands.
        let is_decimal = !word.contains('.') && word.matches(',').count() == 1;
        return is_decimal.then(|| word.replace(',', ".").parse().ok())?;
    }
    word.parse().ok().or_else(|| is_no_number(word).then_some(f64::NAN))
}

/// `-nan(ind)`, `1.#QNAN` and such, which the libraries of Windows write.
fn is_no_number(word: &str) -> bool {
    const NAMES: [&str; 9] = [
        "nan",
        "nan(ind)",
        "nan(snan)",
        "1.#ind",
        "1.#qnan",
        "1.#snan",
        "1.#inf",
        "1.#j",
        "nan(0x0)",
    ];
    let word = word.trim_start_matches(['-', '+']).to_ascii_lowercase();
    NAMES.contains(&word.as_str()) || word.starts_with("1.#inf") || word.starts_with("1.#ind")
}

pub(super) fn expected_number(word: &str) -> String {
    match word {
        "" => "a number expected, an empty column found".to_owned(),
        _ => format!("a number expected, `{}` found", excerpt(word)),
    }
}
