//! `posescope triage`: the results of a run that meet a condition, in an order.

use posescope::localize::QueryResult;
use posescope::measure::{Field, read_rows, rows, select};
use posescope::run::{read_run, result_lines};

use super::args::TriageArgs;
use super::failure::CliError;
use super::output::{self, JsonLines};
use super::terminal::Terminal;

/// Prints the table, or writes the results.
pub fn triage(args: &TriageArgs, terminal: &Terminal) -> Result<(), CliError> {
    read_run(&args.run)?;
    let mut results: Vec<QueryResult> = read_rows(&args.run)?;
    if let Some(right) = args.right {
        let graded = results.into_iter().map(|result| result.graded(right));
        results = graded.collect();
    }
    let all: Vec<&QueryResult> = results.iter().collect();
    let chosen = select(&all, args.condition.as_ref(), args.sort);
    let shown = &chosen[..chosen.len().min(args.limit.unwrap_or(usize::MAX))];
    match &args.json {
        // The run's own bytes.
        Some(path) => {
            let lines: Vec<String> = result_lines(&args.run)?.collect::<Result<_, _>>()?;
            let mut output = JsonLines::create(path)?;
            for &index in shown {
                output.write_line(&lines[index])?;
            }
        }
        None => {
            let shown = shown.iter().map(|&index| &results[index]);
            let table = rows(shown, args.columns.iter().copied(), Field::text);
            output::print(&table.to_text(None).trim_end())?;
        }
    }
    if !terminal.is_quiet() {
        let (shown, met, all) = (shown.len(), chosen.len(), results.len());
        let of_those = match shown == met {
            true => String::new(),
            false => format!(" of {met} that meet it,"),
        };
        eprintln!("{shown}{of_those} of {all} results");
    }
    Ok(())
}
