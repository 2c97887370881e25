//! `posescope results`: lists, filters and exports the results of a run.

use std::path::{Path, PathBuf};

use posescope::localize::QueryResult;
use posescope::measure::{
    Export, ExportError, Field, Format, Plot, RunResults, TableName, export, rows, select,
};
use posescope::report::{PICTURES, write_html};
use posescope::run::{FolderError, RunFile, read_results, read_run, result_lines};
use posescope::table::Table;
use posescope_core::files::write_whole;

use super::args::{Form, ResultsArgs};
use super::failure::CliError;
use super::output::{self, JsonLines};
use super::terminal::Terminal;

/// The fields shown in a terminal by default.
const COLUMNS: [&Field; 8] = [
    Field::named("query"),
    Field::named("reference"),
    Field::named("method"),
    Field::named("grade"),
    Field::named("error"),
    Field::named("rotation"),
    Field::named("code"),
    Field::named("probability"),
];

pub fn results(args: &ResultsArgs, terminal: &Terminal) -> Result<(), CliError> {
    args.refuse_unused()?;
    let form = args.form;
    if form == Form::Html && args.plot.is_none() {
        let path = write_html(&args.run, None, PICTURES, args.out.as_deref())?;
        terminal.say(|| format!("Report: {}", path.display()));
        return Ok(());
    }
    let run = read_run(&args.run)?;
    if let Some(plot) = args.plot {
        return draw(args, &run, plot, terminal);
    }
    if let Some(format) = form.poses() {
        return poses(args, &run, format, terminal);
    }
    let results = graded(args, &run)?;
    let all: Vec<&QueryResult> = results.iter().collect();
    let chosen = select(&all, args.condition.as_ref(), args.sort);
    let shown = &chosen[..chosen.len().min(args.rows.unwrap_or(usize::MAX))];
    if form == Form::Json {
        // The lines of the run folder as they are, unless they are graded anew.
        let lines: Vec<String> = result_lines(&args.run)?.collect::<Result<_, _>>()?;
        let stdout = PathBuf::from("-");
        let mut output = JsonLines::create(args.out.as_ref().unwrap_or(&stdout))?;
        for &index in shown {
            match args.right {
                Some(_) => output.write(&results[index])?,
                None => output.write_line(&lines[index])?,
            }
        }
    } else {
        let results = shown.iter().map(|&index| &results[index]);
        let tables = match args.table {
            TableName::Rows => vec![row_table(args, form, results)],
            table => table.of(&RunResults::of(results.cloned().collect(), run.failure_radius_m())),
        };
        if tables.is_empty() {
            return Err(CliError::Usage(
                "the run has no results for this table; --table summary shows what it has"
                    .to_owned(),
            ));
        }
        let width = terminal.width().filter(|_| args.out.is_none());
        let texts = tables.iter().map(|table| match form {
            Form::Csv => table.to_csv(),
            Form::Markdown => table.to_markdown(),
            Form::Latex => table.to_latex(),
            _ => table.to_text(width),
        });
        let texts: Vec<String> = texts.collect();
        write(&texts.join("\n"), args.out.as_deref())?;
    }
    terminal.say(|| {
        let (shown, met, all) = (shown.len(), chosen.len(), results.len());
        let of_those = if shown == met {
            String::new()
        } else {
            format!(" of {met} that meet the condition,")
        };
        format!("{shown}{of_those} of {all} results")
    });
    Ok(())
}

/// The results of the run, graded by `--right` if it is given.
fn graded(args: &ResultsArgs, run: &RunFile) -> Result<Vec<QueryResult>, CliError> {
    let results = read_results(&args.run, run)?;
    Ok(match args.right {
        Some(right) => results.into_iter().map(|result| result.graded(right)).collect(),
        None => results,
    })
}

/// One row per result, with the named columns; by default a few in a terminal, all in files.
fn row_table<'a>(
    args: &ResultsArgs,
    form: Form,
    results: impl Iterator<Item = &'a QueryResult> + Clone,
) -> Table {
    let is_text = form == Form::Text;
    let has_opinions = results.clone().any(|result| result.opinion.is_some());
    let columns: Vec<&Field> = match args.columns.as_slice() {
        [] if is_text && has_opinions => {
            let own = ["opinion", "off", "turned"].map(Field::named);
            let (before, behind) = COLUMNS.split_at(4);
            before.iter().copied().chain(own).chain(behind.iter().copied()).collect()
        }
        [] if is_text => COLUMNS.to_vec(),
        [] => Field::ALL.iter().chain(Field::POSE).collect(),
        named => named.to_vec(),
    };
    let text = if is_text { Field::text } else { Field::whole };
    rows(results, columns, text)
}

/// Writes a figure of the run as SVG.
fn draw(
    args: &ResultsArgs,
    run: &RunFile,
    plot: Plot,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let svg =
        plot.svg(&RunResults::of(graded(args, run)?, run.failure_radius_m())).ok_or_else(|| {
            CliError::Usage(format!(
                "the run has too few results for this plot, which needs {}",
                plot.needs()
            ))
        })?;
    write(&svg, args.out.as_deref())?;
    if let Some(path) = &args.out {
        terminal.say(|| format!("Plot: {}", path.display()));
    }
    Ok(())
}

/// Writes the poses of the chosen results, one per query.
fn poses(
    args: &ResultsArgs,
    run: &RunFile,
    format: Format,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let condition = args.condition.as_ref();
    let takes = |result: &QueryResult| {
        let graded = args.right.map(|right| result.clone().graded(right));
        condition.is_none_or(|one| one.is_met(graded.as_ref().unwrap_or(result)))
    };
    let exported = export(&args.run, run, format, &takes);
    let Export { files, excluded } = exported.map_err(|error| match error {
        ExportError::Folder(error) => CliError::Folder(error),
        error => CliError::Usage(error.to_string()),
    })?;
    match (files.as_slice(), &args.out) {
        ([(_, only)], out) => write(only, out.as_deref())?,
        (_, None) => {
            let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
            return Err(CliError::Usage(format!(
                "this format has several files ({}); name a folder with --out",
                names.join(", ")
            )));
        }
        (files, Some(folder)) => {
            std::fs::create_dir_all(folder).map_err(FolderError::io(folder))?;
            for (name, text) in files {
                // A link in the folder is replaced, not followed.
                let path = folder.join(name);
                write_whole(&path, text.as_bytes()).map_err(FolderError::io(path))?;
            }
        }
    }
    if excluded > 0 {
        terminal.say(|| format!("{excluded} queries have no pose and are left out"));
    }
    Ok(())
}

fn write(text: &str, out: Option<&Path>) -> Result<(), CliError> {
    match out {
        Some(path) => Ok(std::fs::write(path, text).map_err(FolderError::io(path))?),
        None => output::print(&text.trim_end_matches('\n')),
    }
}
