//! The figures of a finished run, in `summary.json` and `junit.xml`. But for what `posescope doctor` says of the scenes,
//! both are derived from `run.toml` and `results.jsonl`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::diff::{Change, RunComparison};
use super::finding::Finding;
use super::findings::{failing_scenes, findings};
use super::gate::{Gate, GateResult};
use super::known::{KnownFailures, KnownReport};
use super::metrics::{Measures, measure};
use super::results::RunResults;
use super::tables::{brief, tables};
use super::{junit, timings};
use crate::diagnosis::Code;
use crate::localize::QueryResult;
use crate::run::{FolderError, RunFile};
use crate::table::Table;
use posescope_core::files::{self, write_whole};
use posescope_core::text::json_message;

/// The version of `summary.json`.
pub const SUMMARY_SCHEMA: &str = "posescope.summary/1";

const SUMMARY: &str = "summary.json";

/// The figures of a run.
#[derive(Clone, Debug)]
pub struct Report {
    /// The results with their figures.
    pub results: RunResults,
    /// The mistakes of whole scenes.
    pub findings: Vec<Finding>,
    /// The outcomes of the gates.
    pub gate_results: Vec<GateResult>,
    /// The known failures.
    pub known: KnownReport,
    /// The tables, the summary first.
    pub tables: Vec<Table>,
    /// How many queries have files that cannot be read, and the first such file; `None` if there are none.
    pub unread: Option<String>,
    /// The time of each result \[s\].
    times: Vec<Option<f64>>,
    /// What `posescope doctor` says of the scenes.
    doctor: Vec<Finding>,
    known_failures: KnownFailures,
}

/// The most rows of a list on the page of a CI job.
const ROWS: usize = 10;

impl Report {
    /// The summary for the page of a CI job: gates, figures, known failures, and failures since a baseline.
    pub fn markdown(&self, since: Option<&RunComparison>) -> String {
        let mut text = String::new();
        if !self.gate_results.is_empty() {
            text += &(GateResult::table(&self.gate_results).to_markdown() + "\n");
        }
        for finding in &self.findings {
            text += &format!("**{}**\n\n", plain(&finding.text));
        }
        let verdicts = self.tables.iter().find(|table| table.name == "verdicts");
        for mut table in brief(&self.results.measures).into_iter().chain(verdicts.cloned()) {
            table.rows.truncate(2 * ROWS);
            for row in &mut table.rows {
                row[0] = plain(&row[0]);
            }
            text += &(table.to_markdown() + "\n");
        }
        let mut lines = self.known.lines();
        let differences = since.iter().flat_map(|since| &since.differences);
        let broken = differences.filter(|one| one.change == Change::Broken);
        lines.extend(broken.map(|one| {
            let [before, after] =
                [&one.before, &one.after].map(|row| row.grade.words(row.error.as_ref()));
            let query = &one.before.query;
            format!("broken: {query} {}, {before} → {after}", one.before.method)
        }));
        for line in lines.iter().take(ROWS) {
            text += &format!("- {}\n", plain(line));
        }
        if lines.len() > ROWS {
            text += &format!("- and {} more\n", lines.len() - ROWS);
        }
        if let Some(since) = since {
            text += &format!("\n{}\n", since.summary());
        }
        text
    }
}

/// Escapes a name, so it is not read as markup.
pub fn plain(text: &str) -> String {
    let text = text.replace(['\n', '\r', '`'], " ");
    text.replace('&', "&amp;").replace('<', "&lt;")
}

#[derive(Serialize)]
struct Summary<'a> {
    schema: &'a str,
    failure_radius_m: f64,
    groups: &'a [Measures],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    gates: &'a [GateResult],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    findings: &'a [Finding],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    doctor: &'a [Finding],
}

/// The part of a summary that does not follow from the results.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct StoredSummary {
    /// The outcomes of the gates.
    #[serde(default)]
    pub gates: Vec<GateResult>,
    /// What `posescope doctor` says of scenes whose queries fail often.
    #[serde(default)]
    pub doctor: Vec<Finding>,
}

impl StoredSummary {
    /// That of a run; empty if it has none.
    ///
    /// # Errors
    /// A summary that cannot be read.
    pub fn read(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(SUMMARY);
        let text = match files::read_text(&path, files::DESCRIPTION) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Ok(Self::default());
            }
            Err(error) => return Err(FolderError::io(path)(error)),
        };
        serde_json::from_str(&text).map_err(|error| FolderError::Damaged {
            path,
            line: error.line(),
            message: json_message(&error),
        })
    }

    /// What `posescope doctor` says in the summaries of parts of a run, once each.
    ///
    /// # Errors
    /// A summary that cannot be read.
    pub fn examined_in(parts: &[PathBuf]) -> Result<Vec<Finding>, FolderError> {
        let mut examined: Vec<Finding> = Vec::new();
        for part in parts {
            let said = Self::read(part)?.doctor.into_iter();
            examined.extend(said.filter(|one| !examined.contains(one)).collect::<Vec<_>>());
        }
        Ok(examined)
    }
}

impl Report {
    /// Measures the results of a run. `examined` is what `posescope doctor` says of its scenes.
    ///
    /// # Errors
    /// Timings that cannot be read.
    pub fn of(
        folder: &Path,
        run: &RunFile,
        rows: Vec<QueryResult>,
        examined: &[Finding],
        gates: &[Gate],
        known: &KnownFailures,
    ) -> Result<Self, FolderError> {
        let times = timings::read(folder, &rows)?;
        let failure_radius_m = run.failure_radius_m();
        let timed = rows.iter().zip(times.iter().copied());
        let measured = |timed: Vec<(&QueryResult, Option<f64>)>| {
            let mut measures = measure(timed.iter().map(|one| one.0), failure_radius_m);
            timings::add_medians(&mut measures, timed.into_iter());
            measures
        };
        let measures = measured(timed.clone().collect());
        let gated = measured(timed.filter(|(row, _)| !known.has(row)).collect());
        let of_run: Vec<&QueryResult> = rows.iter().collect();
        let failing = failing_scenes(&of_run);
        let is_kept = |one: &&Finding| run.shard.is_some() || failing.contains(&one.of);
        let findings = findings(&of_run, examined);
        let results = RunResults { results: rows, measures, failure_radius_m };
        Ok(Self {
            findings,
            gate_results: gates.iter().map(|gate| gate.check(&gated)).collect(),
            known: known.report(&results.results),
            tables: tables(&results, run.protocol.preset.map(|one| one.name())),
            unread: unread(&results.results),
            doctor: examined.iter().filter(is_kept).cloned().collect(),
            known_failures: known.clone(),
            results,
            times,
        })
    }

    /// Writes `summary.json`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_summary(&self, folder: &Path) -> Result<(), FolderError> {
        let summary = Summary {
            schema: SUMMARY_SCHEMA,
            failure_radius_m: self.results.failure_radius_m,
            groups: &self.results.measures,
            gates: &self.gate_results,
            findings: &self.findings,
            doctor: &self.doctor,
        };
        let json = serde_json::to_vec_pretty(&summary);
        let json = json.map_err(|error| FolderError::io(folder)(error.into()))?;
        write(&folder.join(SUMMARY), &json)
    }

    /// Writes `junit.xml`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_junit(&self, folder: &Path) -> Result<(), FolderError> {
        let rows = &self.results.results;
        let xml = junit::junit(rows, &self.times, &self.gate_results, &self.known_failures);
        let path = folder.join("junit.xml");
        let xml = xml.map_err(|error| FolderError::io(&path)(std::io::Error::other(error)))?;
        write(&path, xml.as_bytes())
    }
}

fn unread(rows: &[QueryResult]) -> Option<String> {
    let reason = |row: &QueryResult| row.reason.clone().filter(|reason| reason.code == Code::I1);
    let first = rows.iter().find_map(|row| Some((&row.query, reason(row)?.text)))?;
    let queries: BTreeSet<_> = (rows.iter().filter(|row| reason(row).is_some()))
        .map(|row| (&row.scene, &row.query_scene, &row.query))
        .collect();
    let (query, text) = first;
    Some(match queries.len() {
        1 => format!("query {query} was not localised: {text}"),
        count => format!("{count} queries were not localised, the first is {query}: {text}"),
    })
}

pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), FolderError> {
    write_whole(path, bytes).map_err(FolderError::io(path))
}
