//! A few lines for the page of a CI job: where `GITHUB_STEP_SUMMARY` names a file, they are appended to it.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;

use posescope::measure::{Report, RunComparison, plain};
use posescope::run::RunFile;

/// The variable by which GitHub Actions says where the summary of a step goes.
const VARIABLE: &str = "GITHUB_STEP_SUMMARY";

/// Appends the text where a job wants one. That nobody can write there is no reason to fail.
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

/// What a run came to: gates, figures by method, what is new since the baseline.
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
