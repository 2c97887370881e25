//! Reading a run folder.

use std::collections::{BTreeMap, HashMap};
use std::io;
use std::path::Path;

use posescope_core::files::{self, expect_no_link};
use posescope_core::text::json_message;

use super::checking::{self, Line, PlannedLines};
use super::{FolderError, RESULTS, RUN};
use crate::localize::QueryResult;
use crate::params::Params;
use crate::run::run_file::RunFileError;
use crate::run::{RunFile, ScenePair};
use crate::scene::Scene;

/// Reads the description of the run in a folder.
///
/// # Errors
/// [`FolderError::NoRun`], or an error in the file.
pub fn read_run(folder: &Path) -> Result<RunFile, FolderError> {
    let path = folder.join(RUN);
    expect_no_link(&path).map_err(FolderError::io(&path))?;
    let text = match files::read_text(&path, files::DESCRIPTION) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(FolderError::NoRun(folder.to_owned()));
        }
        read => read.map_err(FolderError::io(&path))?,
    };
    let mut run = RunFile::read(&text)
        .map_err(|RunFileError { line, message }| FolderError::Damaged { path, line, message })?;
    run.params = completed(run.params);
    Ok(run.found_from(folder))
}

/// The parameters of a run, with defaults for those that its version did not know or write.
fn completed(params: toml::Table) -> toml::Table {
    let mut all = Params::default();
    match all.merge_toml(&params.to_string()) {
        Ok(()) => all.to_toml().parse().unwrap_or(params),
        // The user of the parameters reports the error.
        Err(_) => params,
    }
}

/// Reads the results of a run in a folder, in the order of its plan. There may be fewer than the plan has.
///
/// # Errors
/// A line that is no result, or not the one that the plan has in its place.
pub fn read_results(folder: &Path, run: &RunFile) -> Result<Vec<QueryResult>, FolderError> {
    let path = folder.join(RESULTS);
    let mut planned = PlannedLines::of(run);
    let lines = result_lines(folder)?.enumerate();
    lines
        .map(|(index, line)| {
            let result: Result<QueryResult, String> =
                serde_json::from_str(&line?).map_err(|error| json_message(&error));
            let checked = result.and_then(|result| {
                planned.check(&Line::of(&result))?;
                expect_numbers(&result)?;
                Ok(result)
            });
            checked.map_err(|expected| checking::damaged(&path, index + 1, &expected))
        })
        .collect()
}

/// Refuses numbers that nothing can be computed with: what is made of them is not to be lost for one line.
fn expect_numbers(result: &QueryResult) -> Result<(), String> {
    /// The square of a number is one, too.
    const LARGEST: f64 = 1e150;
    let all = std::iter::once(result).chain(result.per_reference.iter().flatten());
    for QueryResult { pose, error, initial_error, confidence, opinion, .. } in all {
        let mut lengths = Vec::new();
        for error in [error, initial_error].into_iter().flatten() {
            lengths.push(error.translation_m);
            let angles = [error.rotation_deg, error.max_euler_deg];
            // Rounding may exceed a half turn.
            if error.translation_m < 0.0 || !angles.iter().all(|angle| (0.0..181.0).contains(angle))
            {
                return Err(format!(
                    "an error from 0 on, with angles up to 180° expected, {:e} and {angles:?} found",
                    error.translation_m
                ));
            }
        }
        let probabilities = [
            confidence.as_ref().map(|confidence| confidence.probability),
            opinion.as_ref().map(|opinion| opinion.probability),
        ];
        for probability in probabilities.into_iter().flatten() {
            if !(0.0..=1.0).contains(&probability) {
                return Err(format!("a probability from 0 to 1 expected, {probability:e} found"));
            }
        }
        lengths.extend(opinion.iter().filter_map(|opinion| opinion.offset_m).flatten());
        if let Some(pose) = pose {
            lengths.extend(pose.position_m);
            let length = pose.quaternion_xyzw.map(|part| part * part).iter().sum::<f64>().sqrt();
            if !(0.98..1.02).contains(&length) {
                return Err(format!("a quaternion of length 1 expected, one of {length} found"));
            }
        }
        if let Some(large) =
            lengths.into_iter().find(|length| !(-LARGEST..=LARGEST).contains(length))
        {
            return Err(format!("lengths up to {LARGEST:e} expected, {large:e} found"));
        }
    }
    Ok(())
}

/// The results of a run that are about a pair of its scenes, by the frames of the queries, and how many are about others.
///
/// # Errors
/// Results that cannot be read.
pub fn results_of_pair(
    folder: &Path,
    run: &RunFile,
    pair: &ScenePair,
    queries: &dyn Scene,
) -> Result<(BTreeMap<usize, Vec<QueryResult>>, usize), FolderError> {
    let frames = queries.frames().iter().enumerate();
    let frames: HashMap<&str, usize> = frames.map(|(at, name)| (name.as_str(), at)).collect();
    let mut results = BTreeMap::<usize, Vec<QueryResult>>::new();
    let mut elsewhere = 0;
    for result in read_results(folder, run)? {
        let of_queries = result.query_scene.as_ref().unwrap_or(&result.scene);
        let is_of_pair = result.scene == pair.scene && *of_queries == pair.query_scene;
        match frames.get(result.query.as_str()).filter(|_| is_of_pair) {
            Some(&frame) => results.entry(frame).or_default().push(result),
            None => elsewhere += 1,
        }
    }
    Ok((results, elsewhere))
}

/// The raw lines of `results.jsonl`, in the order of [`read_results`].
///
/// # Errors
/// A file that cannot be read.
pub fn result_lines(
    folder: &Path,
) -> Result<impl Iterator<Item = Result<String, FolderError>>, FolderError> {
    let path = folder.join(RESULTS);
    let lines = lines_of(folder, RESULTS)?;
    Ok(lines.map(move |line| line.map_err(FolderError::io(&path))))
}

/// The lines of a file of the run.
pub(super) fn lines_of(
    folder: &Path,
    name: &str,
) -> Result<impl Iterator<Item = io::Result<String>>, FolderError> {
    let path = folder.join(name);
    expect_no_link(&path).and_then(|()| files::lines(&path)).map_err(FolderError::io(path))
}
