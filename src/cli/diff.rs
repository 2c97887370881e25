//! `posescope diff`: what changed from one run to another.

use std::path::Path;

use posescope::diagnosis::Tolerance;
use posescope::measure::{Change, RunComparison, read_rows};
use posescope::run::{FolderError, read_results, read_run};
use posescope::sink::rerun::{Targets, record_comparison};
use posescope::table::wrapped;

use super::args::DiffArgs;
use super::failure::CliError;
use super::output;
use super::table::figures;
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
    record_comparison(&targets, names, &results, &shown(comparison, None))?;
    if !terminal.is_quiet() {
        eprintln!("Recording: {0} (open it with `rerun {0}`)", save.display());
    }
    Ok(())
}

/// The comparison in lines of at most `width` characters; without a width, for a pipe, as Markdown.
pub fn shown(comparison: &RunComparison, width: Option<usize>) -> String {
    let summary = wrapped(&comparison.summary(), width.unwrap_or(usize::MAX), "");
    match comparison.differences.is_empty() {
        true => summary,
        false => format!("{summary}\n{}", figures(&comparison.table(), width)),
    }
}
