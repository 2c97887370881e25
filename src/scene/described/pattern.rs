//! Files by a pattern: a path whose last part may have stars, which stand for anything.

use std::cmp::Ordering;
use std::io;
use std::path::{Path, PathBuf};

/// The files that the pattern names: by number where they are called by numbers, such as times, and in
/// natural order otherwise, `a2.png` before `a10.png`.
pub(super) fn files(pattern: &Path) -> io::Result<Vec<PathBuf>> {
    let folder = match pattern.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let name = pattern.file_name().unwrap_or_default().to_string_lossy();
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let is_named = path.file_name().and_then(|found| found.to_str());
        if is_named.is_some_and(|found| matches(&name, found)) && path.is_file() {
            found.push(path);
        }
    }
    found.sort_by_cached_key(|path| natural(&path.to_string_lossy()));
    if found.iter().all(|path| number(path).is_some()) {
        found.sort_by(|a, b| number(a).partial_cmp(&number(b)).unwrap_or(Ordering::Equal));
    }
    Ok(found)
}

/// The number that a file is called by.
fn number(path: &Path) -> Option<f64> {
    let number: f64 = path.file_stem()?.to_str()?.parse().ok()?;
    number.is_finite().then_some(number)
}

fn matches(pattern: &str, name: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else {
        return pattern == name;
    };
    let Some(mut name) = name.strip_prefix(start) else {
        return false;
    };
    // Each part between two stars where it is first found; the last at the end.
    let mut parts = rest.split('*').peekable();
    while let Some(part) = parts.next() {
        if parts.peek().is_none() {
            return name.ends_with(part);
        }
        match name.find(part) {
            Some(at) => name = &name[at + part.len()..],
            None => return false,
        }
    }
    true
}

/// A name in parts that compare as people order names: digits by their number.
fn natural(name: &str) -> Vec<(String, usize, String)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let text = rest
            .find(|c: char| c.is_ascii_digit())
            .unwrap_or(rest.len());
        let (text, after) = rest.split_at(text);
        let digits = after
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(after.len());
        let (digits, after) = after.split_at(digits);
        let digits = digits.trim_start_matches('0');
        parts.push((text.to_owned(), digits.len(), digits.to_owned()));
        rest = after;
    }
    // Names that differ in leading zeros alone still have an order.
    parts.push((name.to_owned(), 0, String::new()));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_anything() {
        for (pattern, name, is_match) in [
            ("*.jpg", "a.jpg", true),
            ("*.jpg", "a.jpg.txt", false),
            ("frame*.color.*", "frame12.color.png", true),
            ("frame*.color.*", "frame12.depth.png", false),
            ("a.jpg", "a.jpg", true),
            ("a*a", "a", false),
            ("a*b*", "axxbyy", true),
        ] {
            assert_eq!(matches(pattern, name), is_match, "{pattern} {name}");
        }
    }

    #[test]
    fn numbers_are_ordered_by_their_value() {
        let mut names = ["img10", "img9", "img009", "a2b10", "a2b9", "img1"];
        names.sort_by_cached_key(|name| natural(name));
        assert_eq!(names, ["a2b9", "a2b10", "img1", "img009", "img9", "img10"]);
    }
}
