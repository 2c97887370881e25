//! `posescope triage`: the results of a run that meet a condition, in an order.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use posescope::localize::QueryResult;
use posescope::measure::{Field, select};
use posescope::run::{read_results, read_run, result_lines};

use super::args::TriageArgs;
use super::failure::CliError;
use super::output::{self, JsonLines};
use super::terminal::Terminal;

/// Prints the table, or writes the results.
pub fn triage(args: &TriageArgs, terminal: &Terminal) -> Result<(), CliError> {
    read_run(&args.run)?;
    let mut results: Vec<QueryResult> = read_results(&args.run)?.collect::<Result<_, _>>()?;
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
            let rows = shown.iter().map(|&index| {
                let cells = args.columns.iter();
                cells.map(|field| field.text(&results[index])).collect()
            });
            output::print(&table(&args.columns, rows).to_string())?;
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

fn table(columns: &[&Field], rows: impl Iterator<Item = Vec<String>>) -> Table {
    let mut table = Table::new();
    table
        .load_preset(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(columns.iter().map(|field| field.name));
    for (index, field) in columns.iter().enumerate() {
        if field.decimals.is_some()
            && let Some(column) = table.column_mut(index)
        {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.add_rows(rows);
    table
}
