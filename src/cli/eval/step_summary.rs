//! The summary on the page of a CI job, appended to the file that `GITHUB_STEP_SUMMARY` names.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;

use posescope::measure::{Report, RunComparison, plain};
use posescope::run::RunFile;

/// The variable that names the summary file of a step in GitHub Actions.
const VARIABLE: &str = "GITHUB_STEP_SUMMARY";

/// Appends the text if a job wants a summary. A file that cannot be written is only a warning.
pub fn append(text: &str) {
    let Some(path) = std::env::var_os(VARIABLE).filter(|path| !path.is_empty()) else {
        return;
    };
    let file = OpenOptions::new().create(true).append(true).open(&path);
    let written = file.and_then(|mut file| file.write_all(text.as_bytes()));
    if let Err(error) = written {
        log::warn!("{}: {error}", Path::new(&path).display());
    }
}

/// The summary of a run: gates, figures by method, changes since the baseline.
pub fn of_run(
    run: &RunFile,
    folder: &Path,
    report: &Report,
    comparison: Option<&RunComparison>,
    failures: &[String],
) -> String {
    let scenes: Vec<&str> = run.pairs.iter().map(|pair| pair.scene.as_str()).collect();
    let verdict = if failures.is_empty() { "✅" } else { "❌" };
    format!(
        "### {verdict} posescope: {}\n\n{} queries, in `{}`\n\n{}",
        plain(&scenes.join(", ")),
        run.items().count(),
        plain(&folder.display().to_string()),
        report.markdown(comparison)
    )
}
