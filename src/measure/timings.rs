//! The times of results: `timings.jsonl`, which corresponds to them line by line.

use std::path::Path;

use posescope_core::files;

use super::metrics::{Group, Measures, median};
use crate::localize::QueryResult;
use crate::run::FolderError;

/// The time of each result \[s\]; `None` if its line is missing or belongs to another result.
///
/// # Errors
/// A file that cannot be read.
pub fn read(folder: &Path, results: &[QueryResult]) -> Result<Vec<Option<f64>>, FolderError> {
    let path = folder.join("timings.jsonl");
    let text = match files::read_text(&path, files::TEXT) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(error) => return Err(FolderError::io(path)(error)),
    };
    let mut lines = text.lines();
    let times = results.iter().map(|result| seconds(result, lines.next()?));
    Ok(times.collect())
}

/// Adds median times to figures.
pub fn add_medians<'a>(
    measures: &mut [Measures],
    timed: impl Iterator<Item = (&'a QueryResult, Option<f64>)> + Clone,
) {
    for one in measures {
        let is_of =
            |result: &QueryResult| result.method == one.method && Group::of(result) == one.group;
        let times = timed.clone().filter(|(result, _)| is_of(result));
        let times: Vec<f64> = times.filter_map(|(_, seconds)| seconds).collect();
        one.median_s = median(&times);
    }
}

/// The total time of the method, which is stored under its own name in milliseconds.
fn seconds(result: &QueryResult, line: &str) -> Option<f64> {
    let timing: serde_json::Value = serde_json::from_str(line).ok()?;
    let is_its = timing["query"] == result.query && timing["method"] == result.method.name();
    let milliseconds = timing.get(result.method.name())?.as_f64()?;
    is_its.then_some(milliseconds / 1000.0)
}
