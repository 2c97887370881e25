//! `eval --sweep`: the same evaluation at each value of a setting.

use std::path::Path;

use posescope::measure::{SweptRun, write_sweep};
use posescope::run::Sweep;

use super::{Executed, Judged, examined, execute, good_unless, step_summary};
use crate::cli::args::EvalArgs;
use crate::cli::failure::CliError;
use crate::cli::stderr::tell;
use crate::cli::terminal::Terminal;
use crate::cli::{output, table::figures};

/// Runs every value into its own folder below `folder`, and writes table and curves over the values there.
pub fn sweep(
    args: &EvalArgs,
    sweep: &Sweep,
    folder: &Path,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let mut runs = Vec::new();
    let (mut failures, mut unread) = (Vec::new(), Vec::new());
    let mut written = Ok(());
    for value in sweep.values() {
        let name = format!("{}={value}", sweep.key());
        let path = folder.join(&name);
        let Executed { run, scenes } = execute(args, Some((sweep, value)), &path, terminal)?;
        let examined = examined(&run, &scenes, &path)?;
        let judged = Judged::of(&args.judging, None, &path, &run, &examined)?;
        let of_run = judged.failures.iter();
        failures.extend(of_run.map(|failure| format!("{name}: {failure}")));
        unread.extend(judged.report.unread.map(|unread| format!("{name}: {unread}")));
        written = written.and(judged.written);
        runs.push(SweptRun { value: value.clone(), measures: judged.report.measures });
    }
    let table = write_sweep(folder, sweep, &runs)?;
    step_summary::append(&format!("{}\n", table.to_markdown()));
    if !terminal.is_quiet {
        output::print(&figures(&table, terminal.width()))?;
        tell(&format!("Runs and curves: {}", folder.display()));
    }
    written?;
    good_unless(&unread, &failures)
}
