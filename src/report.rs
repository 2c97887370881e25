//! `report.html`: a run in one file that a browser opens, without a network or a server.
//!
//! It follows from the run folder, and from its scenes where they can be opened: those have the photos.

mod charts;
mod page;
mod pictures;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use posescope_core::files::write_whole;

use crate::localize::{LocalizeError, Localizer, QueryResult, Request};
use crate::measure::{
    Change, GateResult, Measures, Row, RunComparison, Table, measure, plots, read_gate_results,
    read_rows, tables,
};
use crate::method::Method;
use crate::params::Params;
use crate::run::{
    FAILURES, FolderError, RunFile, ScenePair, Scenes, read_results, read_run, recording_name,
};
use crate::scene::{self, Scene, SceneError};
use pictures::{FailurePictures, Witness, thumbnail};

/// Pictures of so many failures, where nobody says how many.
pub const PICTURES: usize = 24;

/// Queries that have a photo in the report, at most: more would make it too large to be sent around, and take
/// longer than the run itself.
const MOST_PHOTOS: usize = 500;

/// The name of the file in a run folder.
pub const REPORT: &str = "report.html";

/// All that the page tells of a run.
struct RunReport {
    run: RunFile,
    /// Parameters that are not at their defaults.
    changes: Vec<String>,
    results: Vec<ReportedResult>,
    measures: Vec<Measures>,
    tables: Vec<Table>,
    gates: Vec<GateResult>,
    /// Plots with what they show.
    plots: Vec<(String, String)>,
    /// Thumbnails of the queries, by the class that shows them.
    thumbnails: BTreeMap<usize, String>,
    /// What is missing, and why.
    notes: Vec<String>,
    baseline: Option<Baseline>,
}

/// The run that this one is held against.
struct Baseline {
    /// Its folder, as it was named.
    name: String,
    comparison: RunComparison,
    tables: Vec<Table>,
}

/// A result, and what the page makes of it.
struct ReportedResult {
    /// Its place among the results of the run.
    number: usize,
    /// The number of its query.
    query: usize,
    result: QueryResult,
    /// The recording that was kept, seen from the run folder.
    recording: Option<String>,
    /// What happened to it since the baseline.
    change: Option<Change>,
    pictures: FailurePictures,
}

impl ReportedResult {
    /// Query, method, error and verdict in a line.
    fn headline(&self) -> String {
        let QueryResult {
            query,
            method,
            error,
            diagnosis,
            ..
        } = &self.result;
        let mut text = format!("{query} {}", method.name().to_uppercase());
        if let Some(fusion) = &self.result.fusion {
            text += &format!(" {fusion}");
        }
        text += &match error {
            Some(error) => format!(", {}", error.translation()),
            None => format!(", {}", self.result.grade),
        };
        if let Some(primary) = diagnosis.first() {
            text += &format!(": {} {}", primary.code, primary.text);
        }
        text
    }
}

/// Writes the report of a run into its folder or to `out`, held against a baseline if there is one, with
/// pictures of at most so many failures.
///
/// # Errors
/// A run that cannot be read, or a file that cannot be written. A scene that cannot be opened is a note in
/// the report.
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
        let rows = read_rows(folder)?;
        let measures = measure(&rows, run.failure_radius_m);
        let mut params = Params::default();
        let mut notes = Vec::new();
        if let Err(error) = params.merge_toml(&run.params.to_string()) {
            notes.push(format!("Parameters of another version: {error}"));
        }
        let results: Vec<QueryResult> = read_results(folder)?.collect::<Result<_, _>>()?;
        let mut results = reported(folder, &run, results);
        let baseline = match baseline {
            Some(before) => Some(held_against(before, &rows, &mut results)?),
            None => None,
        };
        let mut thumbnails = BTreeMap::new();
        match open(&run) {
            Ok(scenes) => {
                thumbnails = self::thumbnails(&run, &scenes, &results);
                let queries = results.iter().map(|one| one.query + 1).max();
                if let Some(queries) = queries.filter(|queries| *queries > MOST_PHOTOS) {
                    notes.push(format!(
                        "The first {MOST_PHOTOS} of {queries} queries have photos"
                    ));
                }
                draw_failures(&run, &scenes, &params, &mut results, pictures);
                let failures = results
                    .iter()
                    .filter(|one| one.result.grade.is_failure())
                    .count();
                if failures > pictures {
                    notes.push(format!(
                        "{pictures} of {failures} failures have pictures; posescope report RUN \
                         --pictures {failures} draws all"
                    ));
                }
            }
            Err(error) => notes.push(format!("There are no photos: {error}")),
        }
        let plots = drawn(&run, &measures, &rows, &results, &mut notes);
        Ok(Self {
            changes: params.changes(),
            tables: tables(&run, &measures),
            gates: read_gate_results(folder)?,
            run,
            results,
            measures,
            plots,
            thumbnails,
            notes,
            baseline,
        })
    }
}

fn reported(folder: &Path, run: &RunFile, results: Vec<QueryResult>) -> Vec<ReportedResult> {
    let mut queries: BTreeMap<[String; 3], usize> = BTreeMap::new();
    let several_pairs = run.pairs.len() > 1;
    let results = results.into_iter().enumerate().map(|(number, result)| {
        let query_scene = result.query_scene.clone();
        let key = [
            result.scene.clone(),
            query_scene.unwrap_or_default(),
            result.query.clone(),
        ];
        let next = queries.len();
        let query = *queries.entry(key).or_insert(next);
        let recording = pair_of(run, &result)
            .map(|pair| recording_name(pair, &result.query, result.method, several_pairs))
            .map(|name| format!("{FAILURES}/{name}.rrd"))
            .filter(|name| folder.join(name).is_file());
        ReportedResult {
            number,
            query,
            recording,
            change: None,
            pictures: FailurePictures::default(),
            result,
        }
    });
    results.collect()
}

/// The scenes that a result is of.
fn pair_of<'a>(run: &'a RunFile, result: &QueryResult) -> Option<&'a ScenePair> {
    let queries = result.query_scene.as_ref().unwrap_or(&result.scene);
    let mut pairs = run.pairs.iter();
    pairs.find(|pair| pair.scene == result.scene && pair.query_scene == *queries)
}

fn held_against(
    before: &Path,
    rows: &[Row],
    results: &mut [ReportedResult],
) -> Result<Baseline, FolderError> {
    let run_before = read_run(before)?;
    let rows_before = read_rows(before)?;
    let comparison = RunComparison::of(&rows_before, rows, &RunComparison::TOLERANCE);
    for one in &comparison.differences {
        // Rows and results are the same lines.
        let at = rows.iter().position(|row| *row == one.after);
        if let Some(result) = at.and_then(|at| results.get_mut(at)) {
            result.change = Some(one.change);
        }
    }
    let measures = measure(&rows_before, run_before.failure_radius_m);
    Ok(Baseline {
        name: before.display().to_string(),
        comparison,
        tables: tables(&run_before, &measures),
    })
}

fn open(run: &RunFile) -> Result<Scenes, SceneError> {
    let open_all = |arguments: &[String]| -> Result<Vec<Arc<dyn Scene>>, SceneError> {
        let scenes = arguments.iter();
        scenes
            .map(|argument| scene::open(argument, run.format.as_deref()).map(Arc::from))
            .collect()
    };
    let scenes = Scenes {
        references: open_all(&run.scenes)?,
        queries: open_all(&run.queries)?,
    };
    scenes.as_asked(&run.protocol)
}

/// The photo of each query, as the methods saw it; one that cannot be read is missing.
fn thumbnails(
    run: &RunFile,
    scenes: &Scenes,
    results: &[ReportedResult],
) -> BTreeMap<usize, String> {
    let mut seen = BTreeSet::new();
    let firsts: Vec<&ReportedResult> = results
        .iter()
        .filter(|one| seen.insert(one.query))
        .take(MOST_PHOTOS)
        .collect();
    let painted = firsts.par_iter().filter_map(|one| {
        let scene = scenes.of_queries(pair_of(run, &one.result)?);
        let photo = scene.photo(scene.find(&one.result.query).ok()?).ok()?;
        Some((one.query, thumbnail(&photo)?))
    });
    painted.collect()
}

/// Localises the first failures once more and draws what is told.
fn draw_failures(
    run: &RunFile,
    scenes: &Scenes,
    params: &Params,
    results: &mut [ReportedResult],
    most: usize,
) {
    let failures: Vec<usize> = (0..results.len())
        .filter(|&at| results[at].result.grade.is_failure())
        .take(most)
        .collect();
    for pair in &run.pairs {
        let references = scenes.references[pair.scene_index].as_ref();
        let queries = scenes.of_queries(pair);
        let localizer = Localizer::new(references, queries, params, run.protocol.seed);
        let Ok(foreign) = run.protocol.foreign(queries) else {
            continue;
        };
        let localizer = run.protocol.configured(localizer);
        let localizer = localizer.with_foreign(foreign).explaining(0);
        for &at in &failures {
            let result = &results[at].result;
            let is_of_pair = pair_of(run, result).is_some_and(|found| std::ptr::eq(found, pair));
            if is_of_pair && let Some(pictures) = drawn_failure(&localizer, run, result) {
                results[at].pictures = pictures;
            }
        }
    }
}

fn drawn_failure(
    localizer: &Localizer<'_>,
    run: &RunFile,
    result: &QueryResult,
) -> Option<FailurePictures> {
    let method: Method = result.method;
    let query = localizer.queries().find(&result.query).ok()?;
    let reference = result.references.first()?;
    let reference = localizer.references().find(reference).ok()?;
    let radius_m = match &result.setting {
        Some(setting) => setting.radius_m,
        None => *run.radii_m.first()?,
    };
    let request = Request {
        radius_m,
        references: vec![reference].into(),
        fusions: Vec::new(),
        setting: None,
    };
    let mut witness = Witness::default();
    let mut again = None;
    localizer
        .localize(
            0,
            query,
            &[request],
            &[method],
            &mut witness,
            |result, _| {
                again = Some(result);
                Ok::<(), LocalizeError>(())
            },
        )
        .ok()?;
    let truth = localizer.queries().pose(query);
    let pose = again.as_ref().and_then(|result| result.pose.as_ref());
    Some(witness.pictures(truth.as_ref(), pose))
}

/// All plots with what they show.
fn drawn(
    run: &RunFile,
    measures: &[Measures],
    rows: &[Row],
    results: &[ReportedResult],
    notes: &mut Vec<String>,
) -> Vec<(String, String)> {
    let mut all = Vec::new();
    let mut add = |caption: String, svg: Result<String, String>| match svg {
        Ok(svg) => all.push((caption, svg)),
        Err(why) => notes.push(format!("{caption} could not be drawn: {why}")),
    };
    if let Some(svg) = charts::errors(results) {
        add(
            "Error over the distance of the reference; a point leads to its row".to_owned(),
            svg,
        );
    }
    if let Some(svg) = charts::verdicts(measures) {
        add("Primary verdicts by method and condition".to_owned(), svg);
    }
    for (name, svg) in plots(run, measures, rows) {
        let what = match name.split('-').next().unwrap_or_default() {
            "recall" => "Share of queries within an error",
            "success" => "Success rate",
            "causes" => "What went wrong over the distance of the reference",
            "basin" => "From how far around the truth the search finds it",
            "margin" => "What the cheapest minimum elsewhere costs more",
            other => other,
        };
        let svg = svg.map(|svg| charts::with_methods_named(&svg, &run.protocol.methods));
        add(format!("{what} ({name})"), svg);
    }
    all
}
