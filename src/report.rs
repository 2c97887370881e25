//! `report.html`: a run in one file that a browser opens, without a network or a server.
//!
//! It is made from the run folder, and from its scenes if they can be opened, which have the photos.

mod page;
mod pictures;

pub use page::repeat_command;
pub(crate) use page::{document, table};

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use clap::ValueEnum as _;
use rayon::prelude::*;

use posescope_core::files::write_whole;

use crate::chart::Chart;
use crate::localize::{LocalizeError, Localizer, QueryResult, Request};
use crate::measure::{
    Change, Measures, Plot, RunComparison, RunResults, StoredSummary, tables, worst_first,
};
use crate::params::Params;
use crate::run::{FAILURES, FolderError, RecordingNames, RunFile, Scenes, read_results, read_run};
use crate::scale::LengthUnit;
use crate::table::Table;
use pictures::thumbnail;
pub use pictures::{DrawnProof, Witness};

/// The default number of failures with a picture.
pub const PICTURES: usize = 16;

/// The most queries with a photo in the report: more would make it too large to send, and take longer than the run.
const MAX_PHOTOS: usize = 250;

/// The name of the file in a run folder.
pub const REPORT: &str = "report.html";

/// The content of the page.
struct RunReport {
    run: RunFile,
    /// Parameters that are not at their defaults.
    changes: Vec<String>,
    results: Vec<ReportedResult>,
    /// The positions of the failures among the results, the worst first.
    worst: Vec<usize>,
    measures: Vec<Measures>,
    tables: Vec<Table>,
    summary: StoredSummary,
    charts: Vec<Chart>,
    /// Thumbnails of the queries, by the number of their CSS class.
    thumbnails: BTreeMap<usize, String>,
    /// Notes on missing parts.
    notes: Vec<String>,
    baseline: Option<Baseline>,
}

/// The run that this one is compared with.
struct Baseline {
    /// Its folder, as given.
    name: String,
    comparison: RunComparison,
    tables: Vec<Table>,
}

/// A result with its parts of the page.
struct ReportedResult {
    /// Its position among the results of the run.
    number: usize,
    /// The number of its query.
    query: usize,
    result: QueryResult,
    /// Its recording, relative to the run folder.
    recording: Option<String>,
    /// Its change since the baseline.
    change: Option<Change>,
    proof: Option<DrawnProof>,
}

/// Writes the report of a run into its folder or to `out`, compared with a baseline if given, and with pictures of
/// at most `pictures` failures, the worst.
///
/// # Errors
/// A run that cannot be read, or a file that cannot be written. A scene that cannot be opened becomes a note.
pub fn write_html(
    folder: &Path,
    baseline: Option<&Path>,
    pictures: usize,
    out: Option<&Path>,
) -> Result<PathBuf, FolderError> {
    let report = RunReport::of(folder, baseline, pictures)?;
    let path = out.map_or_else(|| folder.join(REPORT), Path::to_owned);
    write_whole(&path, page::page(&report).as_bytes()).map_err(FolderError::io(&path))?;
    Ok(path)
}

impl RunReport {
    fn of(folder: &Path, baseline: Option<&Path>, pictures: usize) -> Result<Self, FolderError> {
        let run = read_run(folder)?;
        let measured = RunResults::of(read_results(folder, &run)?, run.failure_radius_m());
        let charts = Plot::value_variants().iter().flat_map(|plot| plot.charts(&measured));
        let charts = charts.collect();
        let tables = tables(&measured, run.protocol.preset.map(|one| one.name()));
        let mut params = Params::default();
        let mut notes = Vec::new();
        if let Err(error) = params.merge_toml(&run.params.to_string()) {
            notes.push(format!("Parameters of another version: {error}"));
        }
        let mut results = reported(folder, &run, &measured.results);
        let compared = |before| compared_with(before, &measured.results, &mut results);
        let baseline = baseline.map(compared).transpose()?;
        let mut worst = worst_first(&measured.results);
        // Those that a change broke come first.
        worst.sort_by_key(|&at| results[at].change != Some(Change::Broken));
        let mut thumbnails = BTreeMap::new();
        let protocol = &run.protocol;
        let scenes = Scenes::open(&run.scenes, &protocol.query_scene, protocol.format.as_deref());
        match scenes.and_then(|scenes| scenes.with_protocol(protocol)) {
            Ok(scenes) => {
                thumbnails = self::thumbnails(&run, &scenes, &results);
                let queries = results.iter().map(|one| one.query + 1).max();
                if let Some(queries) = queries.filter(|queries| *queries > MAX_PHOTOS) {
                    notes.push(format!(
                        "Only the first {MAX_PHOTOS} of {queries} queries have photos"
                    ));
                }
                let drawn = &worst[..pictures.min(worst.len())];
                draw_failures(&run, &scenes, &params, &mut results, drawn);
                if worst.len() > pictures {
                    notes.push(format!(
                        "Only the {pictures} worst of {} failures have pictures",
                        worst.len()
                    ));
                }
            }
            Err(error) => notes.push(format!("There are no photos: {error}")),
        }
        Ok(Self {
            changes: params.changes(),
            tables,
            charts,
            summary: StoredSummary::read(folder)?,
            run,
            results,
            worst,
            measures: measured.measures,
            thumbnails,
            notes,
            baseline,
        })
    }

    /// The unit of lengths.
    fn unit(&self) -> LengthUnit {
        self.results.first().map(|one| one.result.unit).unwrap_or_default()
    }

    /// Whether the results come from several scenes or settings.
    fn has_several_groups(&self) -> bool {
        let mut groups = self.measures.iter().map(|one| &one.group);
        let first = groups.next();
        groups.any(|group| Some(group) != first)
    }
}

fn reported(folder: &Path, run: &RunFile, results: &[QueryResult]) -> Vec<ReportedResult> {
    let mut queries: BTreeMap<[String; 3], usize> = BTreeMap::new();
    let names = RecordingNames::of(run);
    let results = results.iter().enumerate().map(|(number, result)| {
        let query_scene = result.query_scene.clone();
        let key = [result.scene.clone(), query_scene.unwrap_or_default(), result.query.clone()];
        let next = queries.len();
        let query = *queries.entry(key).or_insert(next);
        let recording = names
            .of_result(result)
            .map(|file| format!("{FAILURES}/{file}"))
            .filter(|file| folder.join(file).is_file());
        ReportedResult {
            number,
            query,
            recording,
            change: None,
            proof: None,
            result: result.clone(),
        }
    });
    results.collect()
}

fn compared_with(
    before: &Path,
    rows: &[QueryResult],
    results: &mut [ReportedResult],
) -> Result<Baseline, FolderError> {
    let run = read_run(before)?;
    let measured = RunResults::of(read_results(before, &run)?, run.failure_radius_m());
    let comparison = RunComparison::of(&measured.results, rows, &RunComparison::TOLERANCE);
    let changes: HashMap<String, Change> = comparison
        .differences
        .iter()
        .map(|one| (RunComparison::key(&one.after), one.change))
        .collect();
    // Rows and results have the same order.
    for (row, result) in rows.iter().zip(results) {
        result.change = changes.get(&RunComparison::key(row)).copied();
    }
    Ok(Baseline {
        name: before.display().to_string(),
        comparison,
        tables: tables(&measured, run.protocol.preset.map(|one| one.name())),
    })
}

/// The photo of each query as the methods saw it; unreadable photos are left out.
fn thumbnails(
    run: &RunFile,
    scenes: &Scenes,
    results: &[ReportedResult],
) -> BTreeMap<usize, String> {
    let mut seen = BTreeSet::new();
    let firsts: Vec<&ReportedResult> =
        results.iter().filter(|one| seen.insert(one.query)).take(MAX_PHOTOS).collect();
    let painted = firsts.par_iter().filter_map(|one| {
        let scene = scenes.of_queries(run.pair_of(&one.result)?);
        let photo = scene.photo(scene.find(&one.result.query).ok()?).ok()?;
        Some((one.query, thumbnail(&photo)?))
    });
    painted.collect()
}

/// Localises these results again and draws their proofs.
fn draw_failures(
    run: &RunFile,
    scenes: &Scenes,
    params: &Params,
    results: &mut [ReportedResult],
    failures: &[usize],
) {
    for pair in &run.pairs {
        let references = scenes.references[pair.scene_index].as_ref();
        let queries = scenes.of_queries(pair);
        let localizer = Localizer::new(references, queries, params, run.protocol.seed);
        let Ok(localizer) = run.protocol.configured(localizer) else {
            continue;
        };
        let localizer = localizer.explaining(0);
        for &at in failures {
            let result = &results[at].result;
            let is_of_pair = run.pair_of(result).is_some_and(|found| std::ptr::eq(found, pair));
            if is_of_pair {
                results[at].proof = drawn_failure(&localizer, run, result, params);
            }
        }
    }
}

fn drawn_failure(
    localizer: &Localizer<'_>,
    run: &RunFile,
    result: &QueryResult,
    params: &Params,
) -> Option<DrawnProof> {
    let query = localizer.queries().find(&result.query).ok()?;
    // What one reference alone gave proves nothing of a fusion.
    let count = if result.fusion.is_some() { result.references.len() } else { 1 };
    let references = result.references.iter().take(count);
    let references: Result<Vec<usize>, _> =
        references.map(|name| localizer.references().find(name)).collect();
    let radius_m = match &result.setting {
        Some(setting) => setting.radius_m,
        None => run.protocol.radius_m(),
    };
    let request = Request {
        radius_m,
        references: references.ok()?.into(),
        fusions: result.fusion.into_iter().collect(),
        setting: None,
    };
    let mut witness = Witness::default();
    let keep = |_, _| Ok::<(), LocalizeError>(());
    localizer.localize(0, query, &[request], &[result.method], &mut witness, keep).ok()?;
    let truth = localizer.queries().pose(query);
    witness.proof(truth.as_ref(), result, params)
}
