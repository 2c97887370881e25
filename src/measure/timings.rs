//! How long results took: `timings.jsonl`, which stands beside them line by line.

use std::fs;
use std::path::Path;

use super::metrics::Row;
use crate::run::FolderError;

/// Adds to each result how long its method took. A folder without timings, or with others than those of its
/// results, leaves them without.
///
/// # Errors
/// A file that cannot be read.
pub fn add_times(folder: &Path, rows: &mut [Row]) -> Result<(), FolderError> {
    let path = folder.join("timings.jsonl");
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(FolderError::io(path)(error)),
    };
    for (row, line) in rows.iter_mut().zip(text.lines()) {
        row.seconds = seconds(row, line);
    }
    Ok(())
}

/// The milliseconds under the method's own name: the whole of it.
fn seconds(row: &Row, line: &str) -> Option<f64> {
    let timing: serde_json::Value = serde_json::from_str(line).ok()?;
    let is_of_row = timing["query"] == row.query && timing["method"] == row.method.name();
    let milliseconds = timing.get(row.method.name())?.as_f64()?;
    is_of_row.then_some(milliseconds / 1000.0)
}
