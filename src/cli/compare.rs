//! `posescope compare`: the changes between two runs.

use std::path::Path;

use posescope::measure::{Change, RunComparison};
use posescope::report::{PICTURES, write_html};
use posescope::run::{read_results, read_run};
use posescope::sink::rerun::{Targets, record_comparison};
use posescope::table::wrapped;

use super::args::CompareArgs;
use super::failure::CliError;
use super::output;
use super::table::figures;
use super::terminal::Terminal;

pub fn compare(args: &CompareArgs, terminal: &Terminal) -> Result<(), CliError> {
    let (before, after) = (read_run(&args.before)?, read_run(&args.after)?);
    let results = [read_results(&args.before, &before)?, read_results(&args.after, &after)?];
    let comparison = RunComparison::of(&results[0], &results[1], &args.tolerance);
    if comparison.common == 0 {
        return Err(CliError::Usage(format!(
            "{} and {} have no result in common; compare runs of the same scenes, queries, methods and settings",
            args.before.display(),
            args.after.display()
        )));
    }
    output::print(&shown(&comparison, terminal.width()).trim_end())?;
    if let Some(path) = &args.html {
        write_html(&args.after, Some(&args.before), PICTURES, Some(path))?;
        terminal.say(|| format!("Report: {}", path.display()));
    }
    if let Some(path) = &args.save {
        let name = |run: &Path| {
            let name = run.file_name().unwrap_or_default();
            name.to_string_lossy().into_owned()
        };
        let names = [name(&args.before), name(&args.after)];
        record_comparison(&Targets::file(path), names, &results, &shown(&comparison, None))?;
        terminal.say(|| format!("Recording: {0} (open it with `rerun {0}`)", path.display()));
    }
    if comparison.is_regression() {
        let broken = comparison.count(Change::Broken);
        return Err(CliError::NotGoodEnough(format!("{broken} queries broke")));
    }
    Ok(())
}

/// The comparison in lines of at most `width` characters; without a width, for a pipe, as Markdown.
pub fn shown(comparison: &RunComparison, width: Option<usize>) -> String {
    let summary = wrapped(&comparison.summary(), width.unwrap_or(usize::MAX), "");
    if comparison.differences.is_empty() {
        summary
    } else {
        format!("{summary}\n{}", figures(&comparison.table(), width))
    }
}
