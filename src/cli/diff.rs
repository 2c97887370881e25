//! `posescope diff`: what changed from one run to another.

use std::fmt::Write as _;
use std::path::Path;

use posescope::diagnosis::Tolerance;
use posescope::measure::{Change, Migration, RunComparison, read_rows};
use posescope::run::{FolderError, read_results, read_run};
use posescope::sink::rerun::{Targets, record_comparison};

use super::args::DiffArgs;
use super::columns::{Columns, wrapped};
use super::failure::CliError;
use super::output;
use super::terminal::Terminal;

/// Runs the command.
pub fn diff(args: &DiffArgs, terminal: &Terminal) -> Result<(), CliError> {
    let tolerance = Tolerance {
        translation_m: args.tolerance_m,
        rotation_deg: args.tolerance_deg,
    };
    for run in [&args.before, &args.after] {
        read_run(run)?;
    }
    let comparison = RunComparison::of(
        &read_rows(&args.before)?,
        &read_rows(&args.after)?,
        &tolerance,
    );
    if comparison.common == 0 {
        return Err(CliError::Usage(format!(
            "{} and {} have no result in common: scenes, queries, methods and settings differ",
            args.before.display(),
            args.after.display()
        )));
    }
    output::print(&shown(&comparison, terminal.width()).trim_end())?;
    record(
        &comparison,
        (&args.before, &args.after),
        args.save.as_deref(),
        terminal,
    )?;
    if comparison.is_regression() {
        let broken = comparison.count(Change::Broken);
        return Err(CliError::NotGoodEnough(format!(
            "{broken} queries are broken"
        )));
    }
    Ok(())
}

/// Records both runs on the same timelines, in the second one's folder unless told otherwise.
pub fn record(
    comparison: &RunComparison,
    (before, after): (&Path, &Path),
    save: Option<&Path>,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let save = save.map_or_else(|| after.join("diff.rrd"), Path::to_owned);
    let targets = Targets {
        save: Some(save.clone()),
        ..Targets::default()
    };
    let name = |run: &Path| {
        let name = run.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let results = |run: &Path| read_results(run)?.collect::<Result<Vec<_>, FolderError>>();
    let (names, results) = (
        [name(before), name(after)],
        [results(before)?, results(after)?],
    );
    record_comparison(&targets, names, &results, &text(comparison))?;
    if !terminal.is_quiet() {
        eprintln!("Recording: {0} (open it with `rerun {0}`)", save.display());
    }
    Ok(())
}

/// The comparison in lines of at most `width` characters; without a width, for a pipe, as Markdown.
pub fn shown(comparison: &RunComparison, width: Option<usize>) -> String {
    if width.is_none() {
        return text(comparison);
    }
    let header = ["change", "query", "method", "before", "after"];
    let mut table = Columns::new(header, "where", 0, &[3, 4]);
    for one in &comparison.differences {
        let cells = [
            one.change.name().to_owned(),
            one.before.query.clone(),
            one.before.method.to_string(),
            one.grades[0].words(one.before.error.as_ref()),
            one.grades[1].words(one.after.error.as_ref()),
        ];
        table.push(cells, one.before.group().to_string());
    }
    let counted = wrapped(&counted(comparison), width.unwrap_or(usize::MAX), "");
    match comparison.differences.is_empty() {
        true => counted,
        false => format!("{counted}\n{}", table.text(width)),
    }
}

fn counted(comparison: &RunComparison) -> String {
    let mut text = format!(
        "{} broken, {} fixed, {} worse, {} better, of {} results in both runs",
        comparison.count(Change::Broken),
        comparison.count(Change::Fixed),
        comparison.count(Change::Worse),
        comparison.count(Change::Better),
        comparison.common
    );
    if comparison.only_before + comparison.only_after > 0 {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            " ({} only in the first, {} only in the second)",
            comparison.only_before, comparison.only_after
        );
    }
    let moved: Vec<String> = comparison.migrations.iter().map(moved).collect();
    if !moved.is_empty() {
        let _ = write!(text, ". Verdicts: {}", moved.join(", "));
    }
    text
}

/// Such as `mi D3 → ok 3`.
fn moved(migration: &Migration) -> String {
    let Migration {
        method,
        before,
        after,
        count,
    } = migration;
    format!("{method} {before} → {after} {count}")
}

/// The comparison in words, as Markdown.
fn text(comparison: &RunComparison) -> String {
    let mut text = counted(comparison) + "\n";
    if !comparison.differences.is_empty() {
        text +=
            "\n| change | query | method | before | after | where |\n|:--|:--|:--|--:|--:|:--|\n";
    }
    for one in &comparison.differences {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} |",
            one.change.name(),
            one.before.query,
            one.before.method,
            one.grades[0].words(one.before.error.as_ref()),
            one.grades[1].words(one.after.error.as_ref()),
            one.before.group()
        );
    }
    text
}
