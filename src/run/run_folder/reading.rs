//! Reading a run folder.

use std::collections::{BTreeMap, HashMap};
use std::fs::{self, File};
use std::io::{self, BufRead as _, BufReader};
use std::path::Path;

use posescope_core::text::json_message;
use serde::de::DeserializeOwned;

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
    let text = match fs::read_to_string(&path) {
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

/// Reads the lines of `results.jsonl` one by one, as the fields of `T`.
///
/// # Errors
/// A line that is not a result.
pub fn read_results<T: DeserializeOwned>(
    folder: &Path,
) -> Result<impl Iterator<Item = Result<T, FolderError>>, FolderError> {
    let path = folder.join(RESULTS);
    Ok(result_lines(folder)?.enumerate().map(move |(index, line)| {
        serde_json::from_str(&line?).map_err(|error| FolderError::Damaged {
            path: path.clone(),
            line: index + 1,
            message: json_message(&error),
        })
    }))
}

/// The results that are about a pair of the run's scenes, by the frames of the queries, and how many are about others.
///
/// # Errors
/// Results that cannot be read.
pub fn results_of_pair(
    folder: &Path,
    pair: &ScenePair,
    queries: &dyn Scene,
) -> Result<(BTreeMap<usize, Vec<QueryResult>>, usize), FolderError> {
    let frames = queries.frames().iter().enumerate();
    let frames: HashMap<&str, usize> = frames.map(|(at, name)| (name.as_str(), at)).collect();
    let mut results = BTreeMap::<usize, Vec<QueryResult>>::new();
    let mut elsewhere = 0;
    for result in read_results::<QueryResult>(folder)? {
        let result = result?;
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
    let file = File::open(&path).map_err(FolderError::io(path))?;
    Ok(BufReader::new(file).lines())
}
