//! A few lines for the page of a CI job: where `GITHUB_STEP_SUMMARY` names a file, they are appended to it.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;

use posescope::measure::{Change, Report, RunComparison, Table};
use posescope::run::RunFile;

/// The variable by which GitHub Actions says where the summary of a step goes.
const VARIABLE: &str = "GITHUB_STEP_SUMMARY";
/// Rows of a list; a page is no log.
const ROWS: usize = 10;

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
    let mut text = format!(
        "### {verdict} posescope: {}\n\n{} queries, in `{}`\n\n",
        plain(&scenes.join(", ")),
        run.items().count(),
        plain(&folder.display().to_string())
    );
    if !report.gate_results.is_empty() {
        let mut gates = Table::new("", "", ["gate", "", "found"]);
        for one in &report.gate_results {
            let passed = if one.passed { "passed" } else { "**failed**" };
            gates.push([
                format!("`{}`", one.gate),
                passed.to_owned(),
                one.found.clone(),
            ]);
        }
        text += gates.markdown().trim_start();
        text += "\n";
    }
    text += figures(report).markdown().trim_start();
    text += "\n";
    text += &list(report.known.lines().iter().map(|line| plain(line)));
    if let Some(comparison) = comparison {
        let broken = comparison.differences.iter();
        let broken = broken.filter(|one| one.change == Change::Broken);
        text += &list(broken.map(|one| {
            format!(
                "broken: {} {}, {} → {}",
                plain(&one.before.query),
                one.before.method,
                one.grades[0].words(one.before.error.as_ref()),
                one.grades[1].words(one.after.error.as_ref())
            )
        }));
        text += &format!("{} fixed\n\n", comparison.count(Change::Fixed));
    }
    text
}

fn figures(report: &Report) -> Table {
    let header = [
        "",
        "method",
        "success (%)",
        "median (m)",
        "median (s)",
        "verdicts",
    ];
    let mut table = Table::new("", "", header);
    let number = |value: Option<f64>, digits: usize| {
        value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
    };
    for one in report.measures.iter().take(2 * ROWS) {
        let mut verdicts: Vec<_> = one.verdicts.iter().collect();
        verdicts.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
        let verdicts = verdicts.iter().take(4);
        let verdicts: Vec<String> = verdicts
            .map(|(code, count)| format!("{code} {count}"))
            .collect();
        table.push([
            plain(&one.group.to_string()),
            one.method.to_string(),
            format!("{:.1}", 100.0 * one.success_rate),
            number(one.of_successes.median_m, 3),
            number(one.median_s, 2),
            verdicts.join(", "),
        ]);
    }
    table
}

/// The first of some lines as a list, and how many more there are.
fn list(lines: impl Iterator<Item = String>) -> String {
    let lines: Vec<String> = lines.collect();
    let mut text: String = (lines.iter().take(ROWS))
        .map(|line| format!("- {line}\n"))
        .collect();
    if lines.len() > ROWS {
        text += &format!("- and {} more\n", lines.len() - ROWS);
    }
    match text.is_empty() {
        true => text,
        false => text + "\n",
    }
}

/// Names from elsewhere, which are no markup here.
fn plain(text: &str) -> String {
    let text = text.replace(['\n', '\r', '`'], " ");
    text.replace('&', "&amp;").replace('<', "&lt;")
}
