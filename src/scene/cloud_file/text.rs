//! Text: one point per line, also PTS and PTX of laser scanners.
//!
//! The first lines decide separator, decimal sign and columns. Every other line must follow them.

mod layout;
mod ptx;
mod words;

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use posescope_core::files;

use self::layout::Layout;
pub(super) use self::words::number;
use super::super::lines::text_start;
use super::{Collector, MapCloud, no_point};
use crate::scene::SceneError;

/// How much of a file decides its layout \[bytes\].
const SAMPLE: usize = 65_536;

/// Reads the points.
pub(super) fn read(path: &Path) -> Result<MapCloud, SceneError> {
    let sample = sample(path)?;
    let mut cloud = Collector::default();
    let mut lines = Lines::open(path)?;
    if ptx::is_ptx(&sample) {
        ptx::read(&mut lines, &mut cloud)?;
    } else {
        let layout = Layout::of(&sample)
            .map_err(|(line, expected)| SceneError::line(path, line + 1, expected))?;
        let layout = layout.ok_or_else(|| {
            SceneError::expected(path, "lines `x y z` expected, none found at its beginning")
        })?;
        read_points(&mut lines, &layout, &mut cloud)?;
    }
    let cloud = cloud.finish();
    if cloud.points.is_empty() {
        return Err(SceneError::expected(path, no_point(&cloud)));
    }
    Ok(cloud)
}

/// The first lines of a file.
fn sample(path: &Path) -> Result<Vec<String>, SceneError> {
    let mut lines = Lines::open(path)?;
    let mut sample = Vec::new();
    let mut bytes = 0;
    while bytes < SAMPLE
        && let Some(line) = lines.next()?
    {
        if line.contains('\r') {
            let expected = "lines that end in a line feed expected, carriage returns found; save the file with \
                            the line ends of Unix or Windows";
            return Err(lines.error(expected));
        }
        bytes += line.len() + 1;
        sample.push(line.to_owned());
    }
    Ok(sample)
}

fn read_points(
    lines: &mut Lines,
    layout: &Layout,
    cloud: &mut Collector,
) -> Result<(), SceneError> {
    for _ in 0..layout.first {
        lines.next()?;
    }
    // PTS: each scan begins with its number of points.
    let mut scan = layout.count.map(|count| Scan { line: layout.first, count, found: 0 });
    while let Some(line) = lines.next()? {
        if words::is_comment(line) {
            continue;
        }
        if let Some(this) = &mut scan {
            if let Some(count) = words::lone_count(line) {
                this.expect_whole(lines)?;
                scan = Some(Scan { line: lines.number, count, found: 0 });
                continue;
            }
            this.found += 1;
        }
        let added = layout.point(line).and_then(|point| cloud.add(point));
        added.map_err(|expected| lines.error(expected))?;
    }
    scan.map_or(Ok(()), |scan| scan.expect_whole(lines))
}

/// A scan of a PTS file.
struct Scan {
    /// The line of its count, counted from 1.
    line: usize,
    count: u64,
    found: u64,
}

impl Scan {
    fn expect_whole(&self, lines: &Lines) -> Result<(), SceneError> {
        if self.found == self.count {
            return Ok(());
        }
        let expected = format!(
            "{} points expected below their number, {} found; the file is cut off, or the line is to be deleted",
            self.count, self.found
        );
        Err(SceneError::line(&lines.path, self.line, expected))
    }
}

/// The lines of a file, one by one.
struct Lines {
    path: PathBuf,
    reader: BufReader<File>,
    bytes: Vec<u8>,
    text: String,
    /// The number of the current line, counted from 1.
    number: usize,
}

impl Lines {
    fn open(path: &Path) -> Result<Self, SceneError> {
        let mut reader = BufReader::new(files::open(path).map_err(SceneError::io(path))?);
        let start = reader.fill_buf().map_err(SceneError::io(path))?;
        let skipped = text_start(start).map_err(|expected| SceneError::expected(path, expected))?;
        reader.consume(skipped);
        let (bytes, text) = (Vec::new(), String::new());
        Ok(Self { path: path.to_owned(), reader, bytes, text, number: 0 })
    }

    /// The next line, without white space at both ends. What is no UTF-8, such as a degree sign in a title, is
    /// replaced.
    fn next(&mut self) -> Result<Option<&str>, SceneError> {
        self.bytes.clear();
        let read = self.reader.read_until(b'\n', &mut self.bytes);
        if read.map_err(SceneError::io(&self.path))? == 0 {
            return Ok(None);
        }
        self.number += 1;
        Ok(Some(match std::str::from_utf8(&self.bytes) {
            Ok(line) => line.trim_matches(is_blank),
            Err(_) => {
                self.text = String::from_utf8_lossy(&self.bytes).into_owned();
                self.text.trim_matches(is_blank)
            }
        }))
    }

    fn error(&self, expected: impl Into<String>) -> SceneError {
        SceneError::line(&self.path, self.number, expected)
    }
}

/// White space but tabs, which may stand beside an empty column.
fn is_blank(c: char) -> bool {
    c.is_whitespace() && c != '\t'
}
