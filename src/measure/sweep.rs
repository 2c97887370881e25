//! The results of a sweep: a table, and curves over the values of the setting.

use std::path::Path;

use super::groups::grouped;
use super::metrics::{Group, Measures};
use super::plots;
use super::report::write;
use super::tables::NOTHING;
use crate::chart;
use crate::method::Method;
use crate::run::{FolderError, Sweep};
use crate::table::Table;

/// The figures at one value of a sweep.
#[derive(Clone, Debug)]
pub struct SweptRun {
    /// The value as text.
    pub value: String,
    /// The figures by group and method.
    pub measures: Vec<Measures>,
}

/// Writes `sweep.csv`, `success.svg` and `median.svg` into the folder of all runs.
///
/// # Errors
/// A file that cannot be written.
pub fn write_sweep(folder: &Path, sweep: &Sweep, runs: &[SweptRun]) -> Result<Table, FolderError> {
    let table = table(sweep, runs);
    write(&folder.join("sweep.csv"), table.to_csv().as_bytes())?;
    let axis = match sweep.unit() {
        "" => sweep.key().to_owned(),
        unit => format!("{} ({unit})", sweep.key()),
    };
    for (what, label, figure) in CURVES {
        let charts = groups(runs).into_iter().filter_map(|(group, measures)| {
            let title = format!("{label} over {axis}: {group}");
            plots::curves(title, &axis, label, curves(measures, figure))
        });
        let charts: Vec<_> = charts.collect();
        let path = folder.join(format!("{what}.svg"));
        write(&path, chart::file(&charts).as_bytes())?;
    }
    Ok(table)
}

/// A curve: its file name, its axis label, and its figure.
type Curve = (&'static str, &'static str, fn(&Measures) -> Option<f64>);

const CURVES: [Curve; 2] = [
    ("success", "success rate (%)", |one| Some(100.0 * one.success_rate)),
    ("median", "median error of successes (m)", |one| one.of_successes.median_m),
];

/// The groups of all runs, each with its figures and their values.
fn groups(runs: &[SweptRun]) -> Vec<(&Group, Vec<(&str, &Measures)>)> {
    grouped(runs.iter().flat_map(|run| {
        let measures = run.measures.iter();
        measures.map(|one| (&one.group, (run.value.as_str(), one)))
    }))
}

/// One line per method. Missing figures have no point.
fn curves(
    measures: Vec<(&str, &Measures)>,
    figure: fn(&Measures) -> Option<f64>,
) -> Vec<(Method, Vec<(f64, f64)>)> {
    grouped(
        measures
            .into_iter()
            .filter_map(|(value, one)| Some((one.method, (value.parse().ok()?, figure(one)?)))),
    )
}

fn table(sweep: &Sweep, runs: &[SweptRun]) -> Table {
    let mut header = vec![sweep.key().to_owned()];
    let several = groups(runs).len() > 1;
    header.extend(several.then(|| "where".to_owned()));
    header.extend(
        [
            "method",
            "queries",
            "success (%)",
            "median (m)",
            "median max Euler (°)",
            "within 0.5 m, 5° (%)",
        ]
        .map(str::to_owned),
    );
    let caption = format!("Success and median error of successes over {}", sweep.key());
    let mut table = Table::new("sweep", caption, header);
    let number = |value: Option<f64>, digits: usize| {
        value.map_or(NOTHING.to_owned(), |value| format!("{value:.digits$}"))
    };
    for run in runs {
        for one in &run.measures {
            let mut cells = vec![run.value.clone()];
            cells.extend(several.then(|| one.group.to_string()));
            cells.extend([
                one.method.to_string(),
                one.queries.to_string(),
                number(Some(100.0 * one.success_rate), 1),
                number(one.of_successes.median_m, 3),
                number(one.of_successes.median_deg, 2),
                number(one.recall.map(|recall| 100.0 * recall[1]), 1),
            ]);
            table.push(cells);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::super::metrics::{measure, tests::row};
    use super::*;

    fn runs() -> Vec<SweptRun> {
        let run = |value: &str, error: Option<f64>| SweptRun {
            value: value.to_owned(),
            measures: measure(&[row("a", "fb", error), row("a", "mi", Some(0.5))], 10.0),
        };
        vec![run("0.5", Some(0.25)), run("1.0", None)]
    }

    #[test]
    fn a_line_has_a_point_for_each_value_with_a_figure() {
        let runs = runs();
        let measures = || groups(&runs).remove(0).1;
        let medians = curves(measures(), |one| one.of_successes.median_m);
        assert_eq!(medians[0].1, [(0.5, 0.25)]);
        assert_eq!(medians[1].1, [(0.5, 0.5), (1.0, 0.5)]);
        let successes = curves(measures(), |one| Some(one.success_rate));
        assert_eq!(successes[0].1, [(0.5, 1.0), (1.0, 0.0)]);
    }

    #[test]
    fn the_table_has_a_row_per_value_and_method() {
        let sweep = "fb.ratio=0.5:1:0.5".parse().expect("a sweep");
        let table = table(&sweep, &runs());
        assert_eq!(table.header[..2], ["fb.ratio", "method"]);
        let row = |at: usize| table.rows[at].join(" ");
        assert_eq!(row(0), "0.5 fb 1 100.0 0.250 0.12 100.0");
        assert_eq!(row(2), "1.0 fb 1 0.0 – – 0.0");
    }
}
