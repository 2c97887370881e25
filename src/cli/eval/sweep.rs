//! `eval --sweep`: the same evaluation at each value of a setting.

use std::path::Path;

use posescope::measure::{SweptRun, write_sweep};
use posescope::run::Sweep;

use super::{Judged, execute, step_summary};
use crate::cli::args::EvalArgs;
use crate::cli::failure::CliError;
use crate::cli::terminal::Terminal;
use crate::cli::{output, table::figures};

/// Runs every value into a folder of its own below `folder`, and writes there how the results follow it.
pub fn sweep(
    args: &EvalArgs,
    sweep: &Sweep,
    folder: &Path,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let mut runs = Vec::new();
    let mut failures = Vec::new();
    for value in sweep.values() {
        let name = format!("{}={value}", sweep.key());
        let path = folder.join(&name);
        let run = execute(&with(args, sweep, value), &path, terminal)?;
        let Judged {
            report,
            failures: of_run,
            ..
        } = Judged::of(args, &path, &run)?;
        failures.extend(
            of_run
                .into_iter()
                .map(|failure| format!("{name}: {failure}")),
        );
        runs.push(SweptRun {
            value: value.clone(),
            measures: report.measures,
        });
    }
    let table = write_sweep(folder, sweep, &runs)?;
    step_summary::append(&format!("{}\n", table.to_markdown()));
    if !terminal.is_quiet() {
        output::print(&figures(&table, terminal.width()))?;
        eprintln!("Runs and curves: {}", folder.display());
    }
    match failures.is_empty() {
        true => Ok(()),
        false => Err(CliError::NotGoodEnough(failures.join("; "))),
    }
}

/// The arguments of one value. The sweep has made sure that its setting takes it.
fn with(args: &EvalArgs, sweep: &Sweep, value: &str) -> EvalArgs {
    let mut args = args.clone();
    let protocol = &mut args.protocol;
    match sweep.is_degradation() {
        true => {
            let mut degradation = protocol.degrade.unwrap_or_default();
            if let Err(error) = degradation.set(sweep.key(), value) {
                unreachable!("the sweep was checked: {error}");
            }
            protocol.degrade = Some(degradation);
        }
        false => {
            let assignment = format!("{}={value}", sweep.key());
            protocol.config.assignments.push(assignment);
        }
    }
    args
}
