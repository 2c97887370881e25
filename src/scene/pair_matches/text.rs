//! Matches as text, one per line: `x y` in the first photo, `x y` in the second \[px\].

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use posescope_core::features::{Features, Keypoint, Match, MatchVerdict};

use super::{PixelMaps, RawMatches, pair};
use crate::scene::lines::TextFile;
use crate::scene::{PixelMap, SceneError};

/// Reads a file of matches. A fifth column and more, such as a score, are ignored.
pub(super) fn read(path: &Path) -> Result<RawMatches, SceneError> {
    let file = TextFile::read(path)?;
    let mut found = RawMatches { first: Vec::new(), second: Vec::new(), partners: Vec::new() };
    let mut count = None;
    for line in file.lines() {
        let fields = line.fields();
        if fields.len() < 4 {
            return Err(line.error("a line `x y x y` expected, it is cut off"));
        }
        let columns = *count.get_or_insert(fields.len());
        if fields.len() != columns {
            let found = fields.len();
            return Err(line.error(format!("{columns} columns as above expected, {found} found")));
        }
        // More whole numbers between commas may be halves of numbers with decimal commas.
        if columns > 4 && line.text.contains(',') && !line.text.contains(['.', ';']) {
            return Err(line.error("numbers with decimal points expected, commas alone found"));
        }
        let mut numbers = [0.0_f32; 4];
        for (number, word) in numbers.iter_mut().zip(fields) {
            line.number(word)?;
            // Not via `f64`, which would round twice.
            *number = word.parse().unwrap_or(f32::INFINITY);
        }
        let [x, y, other_x, other_y] = numbers;
        found.partners.push(Some(found.second.len()));
        found.first.push([x, y]);
        found.second.push([other_x, other_y]);
    }
    Ok(found)
}

/// The pixel of a keypoint in the file of its photo.
fn in_file(keypoint: &Keypoint, map: Option<&dyn PixelMap>) -> [f32; 2] {
    match map {
        Some(map) => {
            let pixel = map.to_file(keypoint.pixel()).cast::<f32>();
            [pixel.x, pixel.y]
        }
        None => [keypoint.x, keypoint.y],
    }
}

/// Writes the accepted matches (distinct and mutual) into a folder, in the pixels of the image files. Reading them back
/// gives the same bits where photos are not undistorted.
///
/// # Errors
/// When the file cannot be written.
pub fn write_matches(
    folder: &Path,
    (query, features): (&str, &Features),
    (reference, others): (&str, &Features),
    decisions: &[Option<Match>],
    [of_queries, of_references]: [&PixelMaps; 2],
) -> io::Result<()> {
    let mut text = format!(
        "# matches of {query} with {reference}: x y in each [px], the centre of the top-left pixel at 0 0\n"
    );
    let is_match = |found: &&Match| found.verdict == MatchVerdict::Candidate;
    for found in decisions.iter().flatten().filter(is_match) {
        let [x, y] = in_file(&features.keypoints[found.query], of_queries.get(query));
        let [u, v] = in_file(&others.keypoints[found.reference], of_references.get(reference));
        // Rust prints enough digits to read back the same number.
        let _ = writeln!(text, "{x} {y} {u} {v}");
    }
    std::fs::create_dir_all(folder)?;
    let path = folder.join(format!("{}.txt", pair(query, reference)));
    posescope_core::files::write_whole(&path, text.as_bytes())
}
