//! `timestamps.txt`: line k is the time of frame k, `2011-09-26 13:10:51.168593664`.

use std::path::Path;

use chrono::NaiveDateTime;

use super::super::SceneError;
use super::super::lines::{TextFile, excerpt};

/// The times by frame number \[s since 1970\]; empty if there is no file.
pub(super) fn read(path: &Path) -> Result<Vec<f64>, SceneError> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let file = TextFile::read(path)?;
    file.lines()
        .map(|line| {
            NaiveDateTime::parse_from_str(line.text, "%Y-%m-%d %H:%M:%S%.f")
                .map(|time| {
                    let time = time.and_utc();
                    time.timestamp() as f64 + f64::from(time.timestamp_subsec_nanos()) * 1e-9
                })
                .map_err(|_| {
                    line.error(format!(
                        "a time such as 2011-09-26 13:10:51.168593664 expected, `{}` found",
                        excerpt(line.text)
                    ))
                })
        })
        .collect()
}
