//! Publishes what is judged: the files of the run folder, and the page of a CI job.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;

use super::judge::Judgement;
use super::run_file::RunFile;
use super::run_folder::FolderError;
use crate::measure::plain;
use crate::report::{PICTURES, write_html};

/// The variable that names the file of a step's summary in GitHub Actions.
const STEP_SUMMARY: &str = "GITHUB_STEP_SUMMARY";

/// Writes `summary.json`, `junit.xml` and `report.html`. Each is tried, whatever becomes of the others.
///
/// # Errors
/// The first file that cannot be written.
pub fn publish(folder: &Path, judgement: &Judgement) -> Result<(), FolderError> {
    let Judgement { report, before, .. } = judgement;
    let written = [
        report.write_summary(folder),
        report.write_junit(folder),
        write_html(folder, before.as_deref(), PICTURES, None).map(drop),
    ];
    written.into_iter().collect()
}

/// The summary of a run for the page of a CI job: gates, figures by method, changes since the baseline.
pub fn step_summary(run: &RunFile, folder: &Path, judgement: &Judgement) -> String {
    let scenes: Vec<&str> = run.pairs.iter().map(|pair| pair.scene.as_str()).collect();
    let verdict = if judgement.failures.is_empty() { "✅" } else { "❌" };
    format!(
        "### {verdict} posescope: {}\n\n{} queries, in `{}`\n\n{}",
        plain(&scenes.join(", ")),
        run.items().count(),
        plain(&folder.display().to_string()),
        judgement.report.markdown(judgement.comparison.as_ref())
    )
}

/// Appends to the page of a CI job, if there is one. A file that cannot be written is only a warning.
pub fn append_step_summary(text: &str) {
    let Some(path) = std::env::var_os(STEP_SUMMARY).filter(|path| !path.is_empty()) else {
        return;
    };
    let file = OpenOptions::new().create(true).append(true).open(&path);
    if let Err(error) = file.and_then(|mut file| file.write_all(text.as_bytes())) {
        log::warn!("{}: {error}", Path::new(&path).display());
    }
}
