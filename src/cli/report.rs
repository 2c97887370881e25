//! `posescope report`: a run in one file for a browser.

use posescope::report::write_html;

use super::args::ReportArgs;
use super::failure::CliError;
use super::run::use_threads;
use super::terminal::Terminal;

/// Writes the report of the last run that was named, against the one before it.
pub fn report(args: &ReportArgs, terminal: &Terminal) -> Result<(), CliError> {
    use_threads(args.threads)?;
    let (folder, baseline) = match args.runs.as_slice() {
        [baseline, folder] => (folder, Some(baseline.as_path())),
        [folder] => (folder, None),
        _ => unreachable!("one run or two"),
    };
    let path = write_html(folder, baseline, args.pictures, args.out.as_deref())?;
    if !terminal.is_quiet() {
        eprintln!("Report: {}", path.display());
    }
    Ok(())
}
