//! What a finished run is boiled down to: `summary.json`, `summary.md`, `junit.xml`, `tables/` and
//! `plots/`. All of it follows from `run.toml` and `results.jsonl`, so that it can be written again.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::gate::{Gate, GateResult};
use super::known::{KnownFailures, KnownReport};
use super::metrics::{Measures, Row, measure};
use super::table::Table;
use super::timings::add_times;
use super::{junit, plots, tables};
use crate::run::RunFile;
use crate::run::{FolderError, read_results};
use posescope_core::files::write_whole;
use posescope_core::text::json_message;

/// The version of `summary.json`.
pub const SUMMARY_SCHEMA: &str = "posescope.summary/1";

const SUMMARY: &str = "summary.json";

/// The figures of a run.
#[derive(Clone, Debug)]
pub struct Report {
    /// The figures by group and method.
    pub measures: Vec<Measures>,
    /// What became of the gates.
    pub gate_results: Vec<GateResult>,
    /// What became of failures that are known.
    pub known: KnownReport,
    /// The tables, the overview first.
    pub tables: Vec<Table>,
}

#[derive(Serialize)]
struct Summary<'a> {
    schema: &'a str,
    failure_radius_m: f64,
    groups: &'a [Measures],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    gates: &'a [GateResult],
}

/// What is read of a summary again.
#[derive(Deserialize)]
struct GatesOfSummary {
    #[serde(default)]
    gates: Vec<GateResult>,
}

/// What became of the gates of a run, as its summary says; none where it has no summary.
///
/// # Errors
/// A summary that cannot be read.
pub fn read_gate_results(folder: &Path) -> Result<Vec<GateResult>, FolderError> {
    let path = folder.join(SUMMARY);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(FolderError::io(path)(error)),
    };
    let summary: Result<GatesOfSummary, _> = serde_json::from_str(&text);
    match summary {
        Ok(summary) => Ok(summary.gates),
        Err(error) => Err(FolderError::Damaged {
            path,
            line: error.line(),
            message: json_message(&error),
        }),
    }
}

/// Reads the results of a folder, without what nobody measures.
///
/// # Errors
/// A line that is no result.
pub fn read_rows(folder: &Path) -> Result<Vec<Row>, FolderError> {
    read_results(folder)?.collect()
}

/// Measures a run and writes everything that follows from its results.
///
/// # Errors
/// When a result cannot be read or a file not be written.
pub fn write_report(
    folder: &Path,
    run: &RunFile,
    gates: &[Gate],
    known: &KnownFailures,
) -> Result<Report, FolderError> {
    let mut rows = read_rows(folder)?;
    add_times(folder, &mut rows)?;
    let radius_m = run.failure_radius_m;
    let measures = measure(&rows, radius_m);
    let mut gated = rows.clone();
    gated.retain(|row| !known.has(row));
    let gated = measure(&gated, radius_m);
    let gate_results: Vec<GateResult> = gates.iter().map(|gate| gate.check(&gated)).collect();
    let known_report = known.report(&rows);
    let tables = tables::tables(run, &measures);
    let summary = Summary {
        schema: SUMMARY_SCHEMA,
        failure_radius_m: run.failure_radius_m,
        groups: &measures,
        gates: &gate_results,
    };
    let json = serde_json::to_vec_pretty(&summary);
    let json = json.map_err(|error| FolderError::io(folder)(error.into()))?;
    write(&folder.join(SUMMARY), &json)?;
    let text = markdown(run, &tables, &gate_results, &known_report);
    write(&folder.join("summary.md"), text.as_bytes())?;
    for table in &tables {
        write_table(folder, table)?;
    }
    for (name, svg) in plots::plots(run, &measures, &rows) {
        let path = folder.join("plots").join(format!("{name}.svg"));
        let svg = svg.map_err(|message| FolderError::io(&path)(std::io::Error::other(message)))?;
        write(&path, svg.as_bytes())?;
    }
    let path = folder.join("junit.xml");
    let xml = junit::junit(folder, &gate_results, known)?;
    write(&path, xml.as_bytes())?;
    Ok(Report {
        measures,
        gate_results,
        known: known_report,
        tables,
    })
}

/// Writes a table into the run folder's `tables/` in each of its forms.
pub(super) fn write_table(folder: &Path, table: &Table) -> Result<(), FolderError> {
    let path = |extension: &str| {
        folder
            .join("tables")
            .join(format!("{}.{extension}", table.name))
    };
    let csv = table.csv();
    let csv = csv.map_err(|error| FolderError::io(path("csv"))(error.into()))?;
    write(&path("md"), table.markdown().as_bytes())?;
    write(&path("csv"), &csv)?;
    write(&path("tex"), table.latex().as_bytes())
}

pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), FolderError> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent).map_err(FolderError::io(parent))?;
    }
    write_whole(path, bytes).map_err(FolderError::io(path))
}

fn markdown(
    run: &RunFile,
    tables: &[Table],
    gate_results: &[GateResult],
    known: &KnownReport,
) -> String {
    let scenes: Vec<String> = run
        .pairs
        .iter()
        .map(|pair| match pair.scene == pair.query_scene {
            true => pair.scene.clone(),
            false => format!("{} ← {}", pair.scene, pair.query_scene),
        })
        .collect();
    let prior = run.protocol.prior_m.map_or(String::new(), |metres| {
        format!(" within {metres} m of the known position")
    });
    let degradation = run.protocol.degrade;
    let degraded = match degradation.is_none() {
        true => String::new(),
        false => format!(", photos of queries degraded by {degradation}"),
    };
    let mut text = format!(
        "# {}\n\n{} queries, references {}{prior}, seed {}{degraded}; a pose {} m off or more is a failure.\n\n",
        scenes.join(", "),
        run.plan().count(),
        run.protocol.references,
        run.protocol.seed,
        run.failure_radius_m
    );
    for gate_result in gate_results {
        let verdict = if gate_result.passed {
            "passed"
        } else {
            "FAILED"
        };
        text += &format!(
            "- {verdict}: `{}`: {}\n",
            gate_result.gate, gate_result.found
        );
    }
    for line in known.lines() {
        text += &format!("- {line}\n");
    }
    if !gate_results.is_empty() || *known != KnownReport::default() {
        text += "\n";
    }
    for table in tables {
        text += &table.markdown();
        text += "\n";
    }
    text
}
