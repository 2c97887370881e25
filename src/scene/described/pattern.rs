//! File patterns: a path whose last part may contain `*`, which matches anything.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use super::super::SceneError;
use super::super::folder::entries;

/// The files that match the pattern. If all names are numbers, such as times, they are sorted by number; otherwise
/// in natural order, `a2.png` before `a10.png`.
pub(super) fn files(pattern: &Path) -> Result<Vec<PathBuf>, SceneError> {
    let folder = match pattern.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let name = pattern.file_name().unwrap_or_default().to_string_lossy();
    let mut found = entries(folder)?;
    found.retain(|path| {
        let is_named = path.file_name().and_then(|found| found.to_str());
        is_named.is_some_and(|found| matches(&name, found)) && path.is_file()
    });
    found.sort_by_cached_key(|path| natural(&path.to_string_lossy()));
    if found.iter().all(|path| number(path).is_some()) {
        found.sort_by(|a, b| number(a).partial_cmp(&number(b)).unwrap_or(Ordering::Equal));
    }
    Ok(found)
}

/// The number in a file's name.
fn number(path: &Path) -> Option<f64> {
    let number: f64 = path.file_stem()?.to_str()?.parse().ok()?;
    number.is_finite().then_some(number)
}

fn matches(pattern: &str, name: &str) -> bool {
    let parts: Vec<&str> = pattern.split('*').collect();
    let [first, middle @ .., last] = parts.as_slice() else {
        return pattern == name;
    };
    let Some(mut rest) = name.strip_prefix(first).and_then(|name| name.strip_suffix(last)) else {
        return false;
    };
    // Each part between two stars matches at its first occurrence.
    middle.iter().all(|part| {
        let found = rest.split_once(part);
        rest = found.map_or(rest, |(_, after)| after);
        found.is_some()
    })
}

/// The sort key of natural order: runs of digits, compared by number and before other characters, and the name for
/// ties of leading zeros.
fn natural(name: &str) -> (Vec<(bool, usize, Vec<u8>)>, String) {
    let is_digit = u8::is_ascii_digit;
    let runs = name.as_bytes();
    let runs = runs.chunk_by(|a, b| is_digit(a) == is_digit(b));
    let key = |run: &[u8]| {
        if !is_digit(&run[0]) {
            return (true, 0, run.to_vec());
        }
        let zeros = run.iter().take_while(|digit| **digit == b'0').count();
        (false, run.len() - zeros, run[zeros..].to_vec())
    };
    (runs.map(key).collect(), name.to_owned())
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
