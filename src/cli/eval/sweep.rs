//! `eval --sweep`: the same evaluation at each value of a setting.

use std::path::Path;

use posescope::measure::{SweptRun, write_sweep};
use posescope::run::{Judging, Sweep, append_step_summary, publish};

use super::good_unless;
use super::one::{Evaluated, evaluate};
use crate::cli::args::EvalArgs;
use crate::cli::failure::CliError;
use crate::cli::stderr::tell;
use crate::cli::terminal::Terminal;
use crate::cli::{output, table::figures};

/// Runs every value into its own folder below `folder`, and writes table and curves over the values there.
pub fn sweep(
    args: &EvalArgs,
    sweep: &Sweep,
    judging: &Judging,
    folder: &Path,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let (mut runs, mut failures, mut unread) = (Vec::new(), Vec::new(), Vec::new());
    let mut published = Ok(());
    for value in sweep.values() {
        let name = format!("{}={value}", sweep.key());
        let path = folder.join(&name);
        let swept = Some((sweep, value.as_str()));
        let Evaluated { judgement, .. } = evaluate(args, swept, judging, &path, terminal)?;
        published = published.and(publish(&path, &judgement));
        failures.extend(judgement.failures.iter().map(|failure| format!("{name}: {failure}")));
        let report = judgement.report;
        unread.extend(report.unread.map(|unread| format!("{name}: {unread}")));
        runs.push(SweptRun { value: value.clone(), measures: report.results.measures });
    }
    let table = write_sweep(folder, sweep, &runs)?;
    append_step_summary(&format!("{}\n", table.to_markdown()));
    if !terminal.is_quiet {
        output::print(&figures(&table, terminal.width()))?;
        tell(&format!("Runs and curves: {}", folder.display()));
    }
    published?;
    good_unless(&unread, &failures)
}
