//! `timestamps.txt`: line k is the time of frame k, `2011-09-26 13:10:51.168593664`.

use std::path::Path;

use chrono::NaiveDateTime;

use super::super::SceneError;
use super::super::lines::{Line, TextFile, excerpt};

/// The times by frame number \[s since 1970\]; a blank line is a frame without one. Empty if there is no file, and with a
/// warning if the file has no line for the last frame: a lost line would shift the times of all that follow.
pub(super) fn read(path: &Path, last_frame: usize) -> Result<Vec<Option<f64>>, SceneError> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let file = TextFile::read(path)?;
    let times: Vec<Option<f64>> = file.all_lines().map(time).collect::<Result<_, _>>()?;
    if times.len() <= last_frame {
        log::warn!(
            "{}: line k is the time of frame k, so {} lines expected for frames up to {last_frame}, {} found; \
             the file is not used",
            path.display(),
            last_frame + 1,
            times.len()
        );
        return Ok(Vec::new());
    }
    Ok(times)
}

fn time(line: Line) -> Result<Option<f64>, SceneError> {
    if line.text.is_empty() {
        return Ok(None);
    }
    let time = NaiveDateTime::parse_from_str(line.text, "%Y-%m-%d %H:%M:%S%.f").map_err(|_| {
        let found = excerpt(line.text);
        line.error(format!(
            "a time such as 2011-09-26 13:10:51.168593664 expected, `{found}` found"
        ))
    })?;
    let time = time.and_utc();
    Ok(Some(time.timestamp() as f64 + f64::from(time.timestamp_subsec_nanos()) * 1e-9))
}
