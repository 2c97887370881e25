//! What `eval` prints at the end: how each method did, why the worst failed, and what to type next.

use std::collections::BTreeSet;
use std::path::Path;

use posescope::diagnosis::{Grade, confidence};
use posescope::localize::QueryResult;
use posescope::measure::{Bar, Finding, Overview, Report, worst_first};
use posescope::report::repeat_command;
use posescope::run::RunFile;
use posescope::session::command_line;
use posescope::table::{Table, wrapped};

/// The most characters of a line.
const WIDEST: usize = 100;
/// The most failures that are listed, each with the command that opens it.
const WORST: usize = 3;

/// The text, in lines that fit a terminal of this width.
pub fn ending(run: &RunFile, report: &Report, folder: &Path, width: Option<usize>) -> String {
    let results = &report.results.results;
    let width = width.unwrap_or(WIDEST).min(WIDEST);
    let lines = |text: &str| wrapped(text, width, "  ");
    let overview = Overview::of(&results.iter().collect::<Vec<_>>(), &[]);
    let table = methods(&overview.bars).in_words_of(report.results.unit());
    let mut text = lines(&overview.headline) + "\n" + &table.to_text(Some(width));
    let meanings = report.results.unit().words(&meanings(run, &overview.bars));
    text += &(meanings.lines().map(lines).collect::<String>() + "\n");
    for Finding { text: found, .. } in &report.findings {
        text += &lines(&format!("Finding: {found}"));
    }
    for one in &report.gate_results {
        let verdict = if one.passed { "passed" } else { "FAILED" };
        text += &lines(&format!("{verdict}: {}: {}", one.gate, one.found));
    }
    for line in report.known.lines() {
        text += &lines(&line);
    }
    text += &worst(run, results, folder, width);
    let path = |words: &str, path: &Path| format!("{words} {}\n", path.display());
    text += &path("Report:", &folder.join(posescope::report::REPORT));
    let all = ["results", &folder.display().to_string(), "--table", "summary"];
    text + &format!("All figures: {}\n", command_line(&all.map(str::to_owned)))
}

/// One row per method.
fn methods(bars: &[Bar]) -> Table {
    let grades = Grade::ALL.into_iter();
    let grades: Vec<Grade> =
        grades.filter(|grade| bars.iter().any(|bar| bar.count(*grade) > 0)).collect();
    let names = grades.iter().map(|grade| grade.word());
    let header = ["method"].into_iter().chain(names);
    let header = header.chain(["trusted", "median error", "cause of failures"]);
    let mut table = Table::new("", "", header);
    if let Some(cause) = table.align.last_mut() {
        *cause = posescope::table::Align::Note;
    }
    for bar in bars {
        let counts = grades.iter().map(|grade| bar.count(*grade).to_string());
        let error = bar.median_m.map_or("–".to_owned(), |median| format!("{median:.3} m"));
        let cause =
            bar.cause.map(|(code, times)| format!("mostly {code} {} ({times})", code.title()));
        let cells = [bar.name.clone()].into_iter().chain(counts);
        table.push(cells.chain([bar.trusted.to_string(), error, cause.unwrap_or_default()]));
    }
    table
}

/// What the columns of the table count, in lines.
fn meanings(run: &RunFile, bars: &[Bar]) -> String {
    let right = run.protocol.right;
    let (metres, degrees) = (right.translation_m, right.rotation_deg);
    let measured = format!(
        "Right: within {metres} m and {degrees}° of the truth. Median error: over all poses, right or wrong.\n"
    );
    let trusted = format!(
        "Trusted: by the method's own evidence at least {} likely right.\n",
        confidence::percent(confidence::TRUSTED_FROM)
    );
    let is_measured = bars.iter().any(|bar| bar.median_m.is_some());
    if is_measured { measured + &trusted } else { trusted }
}

/// The worst failures, each of another query, with the commands that open them. One without a pose is among them
/// if there is any.
fn worst(run: &RunFile, results: &[QueryResult], folder: &Path, width: usize) -> String {
    let failures: Vec<&QueryResult> =
        worst_first(results).into_iter().map(|at| &results[at]).collect();
    let mut seen = BTreeSet::new();
    let distinct =
        failures.iter().filter(|one| seen.insert((&one.scene, &one.query_scene, &one.query)));
    let mut worst: Vec<&QueryResult> = distinct.copied().take(WORST).collect();
    let is_missing = |one: &QueryResult| one.grade == Grade::NoPose;
    let missing = failures.iter().find(|one| is_missing(one));
    if let Some(missing) = missing.filter(|_| !worst.iter().any(|one| is_missing(one))) {
        worst.truncate(WORST - 1);
        worst.push(missing);
    }
    if worst.is_empty() {
        return String::new();
    }
    let missing = failures.iter().filter(|one| is_missing(one)).count();
    let wrong = failures.len() - missing;
    let mut text = wrapped(
        &format!("Failures: {wrong} wrong, {missing} without a pose. The worst:"),
        width,
        "  ",
    );
    for one in worst {
        let off = one.off().map_or_else(|| one.grade.to_string(), |off| format!("{off} off"));
        let cause = one.diagnosis.first().map(|found| format!(", {}", found.code.title()));
        let line =
            format!("  {} {}: {off}{}", one.query, one.method_name(), cause.unwrap_or_default());
        text += &wrapped(&line, width, "    ");
        text += &format!("    {}\n", opening(run, one, folder));
    }
    let all = [
        "results",
        &folder.display().to_string(),
        "--where",
        "grade = wrong or grade = \"no pose\"",
    ];
    text + &format!("All failures: {}\n\n", command_line(&all.map(str::to_owned)))
}

/// The command that opens a query: in the run, whose window shows its first pair of scenes, or alone.
fn opening(run: &RunFile, result: &QueryResult, folder: &Path) -> String {
    let first = run.pairs.first();
    let is_first = run.pair_of(result).zip(first).is_some_and(|(own, first)| own == first);
    if is_first {
        let folder = folder.display().to_string();
        return command_line(&[
            "view".to_owned(),
            folder,
            "--query".to_owned(),
            result.query.clone(),
            "--method".to_owned(),
            result.method.to_string(),
        ]);
    }
    repeat_command(run, result).replacen("posescope run", "posescope view", 1)
}
