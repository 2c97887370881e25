//! Text files of numbers, line by line, with errors that name file and line.

use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use posescope_core::files;

use super::SceneError;
use super::folder::Bounds;
use crate::geometry::Pose;

pub(super) struct TextFile {
    path: PathBuf,
    text: String,
}

/// The most lines of a file with something of each frame. What is made of a line may take half a kilobyte.
const MAX_LINES: usize = 2_000_000;

/// A line of a [`TextFile`].
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    path: &'a Path,
    /// Counted from 1.
    pub number: usize,
    /// Without white space at both ends.
    pub text: &'a str,
}

impl TextFile {
    /// Reads a file of a scene. A link must not lead out of it: errors show words of the file.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        Bounds::Layout.check(path)?;
        Self::named(path)
    }

    /// Reads a file that the user named.
    pub fn named(path: &Path) -> Result<Self, SceneError> {
        Self { path: path.to_owned(), text: read_text(path, files::TABLE)? }.with_few_lines()
    }

    /// Reads a file of a map with a line for each point.
    pub fn of_points(path: &Path) -> Result<Self, SceneError> {
        Bounds::Layout.check(path)?;
        Ok(Self { path: path.to_owned(), text: read_text(path, files::TEXT)? })
    }

    /// Reads a file of a map with lines for each image, of which some list all features.
    pub fn of_images(path: &Path) -> Result<Self, SceneError> {
        Self::of_points(path)?.with_few_lines()
    }

    fn with_few_lines(self) -> Result<Self, SceneError> {
        // No line has less than a byte.
        if self.text.len() > MAX_LINES && self.text.lines().nth(MAX_LINES).is_some() {
            return Err(
                self.error(format!("at most {MAX_LINES} lines expected; leave out some frames"))
            );
        }
        Ok(self)
    }

    /// A text that is not from a file; errors use `name` in place of the file.
    pub fn from_text(name: &str, text: &str) -> Self {
        Self { path: name.into(), text: text.to_owned() }
    }

    /// The lines that are neither empty nor comments (`#`).
    pub fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        self.all_lines().filter(Line::has_content)
    }

    /// All lines, including empty ones and comments.
    pub fn all_lines(&self) -> impl Iterator<Item = Line<'_>> {
        let lines = self.text.lines().enumerate();
        lines.map(|(index, text)| Line { path: &self.path, number: index + 1, text: text.trim() })
    }

    /// The path, for messages.
    pub fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// An error if a comment names all of these columns in another order.
    pub fn expect_order(&self, columns: &[&str]) -> Result<(), SceneError> {
        let separators = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '#' | '[' | ']');
        for line in self.all_lines().filter(|line| line.text.starts_with('#')) {
            let named: Vec<String> = line.text.split(separators).map(str::to_lowercase).collect();
            let place = |column: &&str| named.iter().position(|name| name == column);
            let places: Option<Vec<usize>> = columns.iter().map(place).collect();
            if places.is_some_and(|places| !places.is_sorted()) {
                let columns = columns.join(", ");
                return Err(line.error(format!("the columns in the order {columns} expected")));
            }
        }
        Ok(())
    }

    /// An error about the file as a whole.
    pub fn error(&self, expected: impl Into<String>) -> SceneError {
        SceneError::expected(&self.path, expected)
    }

    /// The first `ROWS` lines as rows of numbers, such as a matrix.
    pub fn rows<const ROWS: usize, const COLUMNS: usize>(
        &self,
    ) -> Result<[[f64; COLUMNS]; ROWS], SceneError> {
        let mut rows = [[0.0; COLUMNS]; ROWS];
        let mut lines = self.lines();
        for (found, row) in rows.iter_mut().enumerate() {
            let line = lines.next().ok_or_else(|| {
                self.error(format!("{ROWS} lines of {COLUMNS} numbers expected, {found} found"))
            })?;
            *row = line.numbers()?;
        }
        Ok(rows)
    }
}

impl<'a> Line<'a> {
    /// Whether the line is neither empty nor a comment (`#`).
    pub fn has_content(&self) -> bool {
        !self.text.is_empty() && !self.text.starts_with('#')
    }

    pub fn error(&self, expected: impl Into<String>) -> SceneError {
        SceneError::line(self.path, self.number, expected)
    }

    /// The [`fields`].
    pub fn fields(&self) -> Vec<&'a str> {
        fields(self.text)
    }

    /// The names of the columns, in lower case, if the line is a header: several words and no number.
    pub fn header(&self) -> Option<Vec<String>> {
        let columns: Vec<String> = self.fields().into_iter().map(str::to_lowercase).collect();
        let has_numbers = columns.iter().any(|word| word.parse::<f64>().is_ok());
        (columns.len() > 1 && !has_numbers).then_some(columns)
    }

    /// As many finite numbers as are asked for, and nothing else.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N], SceneError> {
        self.numbers_of(self.text)
    }

    /// The finite numbers of a part of the line.
    pub fn numbers_of<const N: usize>(&self, part: &str) -> Result<[f64; N], SceneError> {
        numbers(part).map_err(|expected| self.error(expected))
    }

    pub fn number(&self, word: &str) -> Result<f64, SceneError> {
        number(word).map_err(|expected| self.error(expected))
    }

    /// The pose of a position and a quaternion, whose parts are in the order x y z w.
    pub fn pose(&self, position: [f64; 3], quaternion: [f64; 4]) -> Result<Pose, SceneError> {
        pose(position, quaternion).map_err(|expected| self.error(expected))
    }
}

/// The pose of a position and a quaternion, whose parts are in the order x y z w.
pub(super) fn pose(position: [f64; 3], quaternion: [f64; 4]) -> Result<Pose, String> {
    let [x, y, z, w] = quaternion;
    let quaternion = Quaternion::new(w, x, y, z);
    let length = quaternion.norm();
    if !position.iter().all(|part| part.is_finite()) {
        return Err(format!("a finite position expected, {position:?} found"));
    }
    if !position.iter().all(is_near) {
        return Err(format!("a position within {FARTHEST:e} of 0 expected, {position:?} found"));
    }
    // Rounding changes the length slightly; more means another convention.
    if !length.is_finite() || (length - 1.0).abs() > 0.02 {
        return Err(format!(
            "a quaternion of length 1 expected, {x} {y} {z} {w} (x y z w) has length {length:.3}"
        ));
    }
    Ok(Pose::from_parts(Translation3::from(position), UnitQuaternion::from_quaternion(quaternion)))
}

/// The largest coordinate \[m\]: of anything on Earth, in millimetres too, and what is computed of it stays finite.
pub(super) const FARTHEST: f64 = 1e12;

/// Whether a coordinate is no larger than [`FARTHEST`].
pub(super) fn is_near(coordinate: &f64) -> bool {
    coordinate.abs() <= FARTHEST
}

/// What a header calls the column of the frames' names.
pub(super) const NAMES: &[&str] = &["name", "frame", "image", "file", "filename"];

/// The fields of a line: separated by `;`, or else by commas, or else by white space. So a decimal comma gives other
/// fields than the format has, and never another number.
pub(super) fn fields(text: &str) -> Vec<&str> {
    let separator = [';', ','].into_iter().find(|&separator| text.contains(separator));
    let mut fields = Vec::with_capacity(16);
    match separator {
        Some(separator) => fields.extend(text.split(separator).map(str::trim)),
        None => fields.extend(text.split_ascii_whitespace()),
    }
    if text.contains('"') {
        for field in &mut fields {
            *field = field.trim_matches('"');
        }
    }
    fields
}

/// As many finite numbers as are asked for, and nothing else.
pub(super) fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let mut numbers = [0.0; N];
    let mut count = 0;
    for word in fields(text) {
        let number = number(word)?;
        if let Some(place) = numbers.get_mut(count) {
            *place = number;
        }
        count += 1;
    }
    if count != N {
        return Err(format!("{N} numbers expected, {count} found"));
    }
    Ok(numbers)
}

/// The finite numbers of a text, and nothing else.
pub(super) fn parsed_numbers(text: &str) -> Result<Vec<f64>, String> {
    fields(text).into_iter().map(number).collect()
}

fn number(word: &str) -> Result<f64, String> {
    if word.is_empty() {
        return Err("a number expected, an empty column found".to_owned());
    }
    let number: f64 =
        word.parse().map_err(|_| format!("a number expected, `{}` found", excerpt(word)))?;
    if !number.is_finite() {
        return Err(format!("finite numbers expected, `{}` found", excerpt(word)));
    }
    Ok(number)
}

/// A word, shortened for an error: a binary file read as text has long words.
pub(super) fn excerpt(word: &str) -> String {
    excerpt_of(word, 40)
}

/// The first characters of a text, without control characters.
pub(super) fn excerpt_of(text: &str, most: usize) -> String {
    let printable = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let short: String = text.chars().take(most).map(printable).collect();
    if text.chars().nth(most).is_some() { short + "…" } else { short }
}

/// Reads a text of at most so many bytes, without a byte order mark.
pub(super) fn read_text(path: &Path, most: u64) -> Result<String, SceneError> {
    let mut bytes = files::read(path, most).map_err(SceneError::io(path))?;
    let start = text_start(&bytes).map_err(|expected| SceneError::expected(path, expected))?;
    bytes.drain(..start);
    String::from_utf8(bytes).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = before.iter().filter(|byte| **byte == b'\n').count() + 1;
        SceneError::line(
            path,
            line,
            "text in UTF-8 expected, other bytes found; save the file as UTF-8",
        )
    })
}

/// The length of the byte order mark that a text begins with \[bytes\]. The error names UTF-16, which Windows programs
/// write.
pub(super) fn text_start(bytes: &[u8]) -> Result<usize, String> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err("text in UTF-8 expected, UTF-16 found; save the file as UTF-8".to_owned());
    }
    Ok(if bytes.starts_with("\u{feff}".as_bytes()) { 3 } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> TextFile {
        TextFile { path: "a.txt".into(), text: text.to_owned() }
    }

    fn said<T>(result: Result<T, SceneError>) -> Result<T, String> {
        result.map_err(|error| error.to_string())
    }

    #[test]
    fn lines_are_counted_with_those_that_say_nothing() {
        let file = file("# a comment\n\n 1, 2,3\nx 1 2\n4 5\n1 nan 2\n");
        let read: Vec<_> = file.lines().map(|line| said(line.numbers::<3>())).collect();
        assert_eq!(read[0], Ok([1.0, 2.0, 3.0]));
        let errors: Vec<_> = read[1..].iter().filter_map(|r| r.as_ref().err()).collect();
        assert_eq!(
            errors,
            [
                "a.txt:4: a number expected, `x` found",
                "a.txt:5: 3 numbers expected, 2 found",
                "a.txt:6: finite numbers expected, `nan` found",
            ]
        );
    }

    #[test]
    fn more_lines_than_frames_are_refused_but_of_points() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let path = folder.path().join("a.txt");
        let read = |lines: usize| {
            std::fs::write(&path, "1\n".repeat(lines)).expect("writable");
            said(TextFile::named(&path)).map(|file| file.lines().count())
        };
        assert_eq!(read(MAX_LINES), Ok(MAX_LINES));
        let refused = read(MAX_LINES + 1);
        assert!(refused.is_err_and(|said| said.contains("at most 2000000 lines expected")));
        assert!(TextFile::of_images(&path).is_err());
        let points = said(TextFile::of_points(&path)).map(|file| file.lines().count());
        assert_eq!(points, Ok(MAX_LINES + 1));
    }

    #[test]
    fn numbers_with_decimal_commas_are_no_others() {
        let read = |text: &str| said(file(text).rows::<1, 4>()).map(|[row]| row);
        for text in ["1.5 2 3.5 4", "1.5,2,3.5,4", "1.5; 2;3.5;4", " 1.5\t2\t3.5\t4 "] {
            assert_eq!(read(text), Ok([1.5, 2.0, 3.5, 4.0]), "{text}");
        }
        for text in ["1,5 2 3,5 4", "1,5;2;3,5;4", "1,5,2,3,5,4", "1 2,3 4", "1,2,,4", "1,5 2,5 3"]
        {
            assert!(read(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_comment_that_names_the_columns_in_another_order_is_an_error() {
        let order = |text: &str| said(file(text).expect_order(&["fx", "fy", "cx"]));
        for text in ["", "# fx, fy, cx\n", "#FX[] fy cx more\n1 2 3\n", "# cx and fx\n"] {
            assert_eq!(order(text), Ok(()), "{text}");
        }
        let error = "a.txt:2: the columns in the order fx, fy, cx expected".to_owned();
        assert_eq!(order("1 2 3\n# fx cx fy\n"), Err(error));
    }

    #[test]
    fn a_matrix_in_a_file_of_its_own_needs_all_its_rows() {
        let whole = file("1 2\n\n3 4\n5 6\n").rows::<2, 2>();
        assert_eq!(said(whole), Ok([[1.0, 2.0], [3.0, 4.0]]));
        let short = file("1 2\n").rows::<2, 2>();
        let expected = "a.txt: 2 lines of 2 numbers expected, 1 found";
        assert_eq!(said(short), Err(expected.to_owned()));
    }

    #[test]
    fn a_quaternion_of_another_length_is_refused() {
        let file = file("anything");
        let line = file.lines().next().expect("one line");
        let pose = said(line.pose([1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8]));
        let turned = pose.map(|pose| pose * nalgebra::Point3::new(1.0, 0.0, 0.0));
        let distance = turned.map(|point| (point - nalgebra::Point3::new(1.28, 2.96, 3.0)).norm());
        assert!(distance.is_ok_and(|distance| distance < 1e-9));
        let error = said(line.pose([0.0; 3], [0.0, 0.0, 90.0, 0.0])).err();
        assert!(error.is_some_and(|error| error.contains("length 90.000")));
    }

    #[test]
    fn a_byte_order_mark_is_skipped_and_other_encodings_are_named() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let path = folder.path().join("a.txt");
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("writable");
            read_text(&path, 99).map_err(|error| error.to_string())
        };
        assert_eq!(read(b"1 2\n").as_deref(), Ok("1 2\n"));
        assert_eq!(read(b"\xef\xbb\xbf1 2\n").as_deref(), Ok("1 2\n"));
        for utf16 in [b"\xff\xfe1\0 \0".as_slice(), b"\xfe\xff\x001\0 "] {
            assert!(read(utf16).is_err_and(|said| said.contains("UTF-16 found")));
        }
        let other = read(b"1\n2\xb0\n");
        assert!(other.is_err_and(|said| said.contains("a.txt:2: text in UTF-8 expected")));
    }

    #[test]
    fn a_long_word_is_cut() {
        assert_eq!(excerpt("short"), "short");
        assert_eq!(excerpt(&"x".repeat(99)).chars().count(), 41);
        assert_eq!(excerpt("\u{0}"), "\u{fffd}");
    }
}
