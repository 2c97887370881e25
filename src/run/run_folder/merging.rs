//! Putting the parts of a run together.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use super::reading::{lines_of, read_run};
use super::{FolderError, RESULTS, RUN, RunFolder, TIMINGS, same_run};
use crate::run::RunFile;

/// Merges the shards of a run into one folder, with the same content as an unsplit run.
///
/// # Errors
/// [`FolderError`]: parts of different runs, or a missing, repeated or incomplete part.
pub fn merge(shards: &[PathBuf], target: &Path) -> Result<RunFile, FolderError> {
    let mut runs = Vec::new();
    for path in shards {
        runs.push((path, read_run(path)?));
    }
    let Some((first_path, first)) = runs.first() else {
        return Err(FolderError::NoRun(target.to_owned()));
    };
    let whole = first.whole();
    for (path, run) in &runs {
        same_run(path, &run.whole(), &whole)?;
    }
    let per_item = whole.results_per_item();
    let mut sources = Vec::new();
    for (path, run) in &runs {
        let lines = (lines_of(path, RESULTS)?, lines_of(path, TIMINGS)?);
        let lines_in = |name: &str| Ok::<usize, FolderError>(lines_of(path, name)?.count());
        let complete = lines_in(RESULTS)?.min(lines_in(TIMINGS)?) / per_item;
        let items = run.items().count();
        if complete != items {
            return Err(FolderError::Incomplete { path: (*path).clone(), done: complete, items });
        }
        sources.push((run.shard, lines));
    }
    let mut folder = RunFolder::create(target, &whole)?;
    for item in whole.plan() {
        let mut owners =
            sources.iter_mut().filter(|(shard, _)| shard.is_none_or(|shard| shard.has(item.index)));
        let problem = |message: &str| FolderError::Damaged {
            path: first_path.join(RUN),
            line: 1,
            message: format!("query {} is in {message} of the parts to merge", item.query),
        };
        let Some((_, (results, timings))) = owners.next() else {
            return Err(problem("none"));
        };
        if owners.next().is_some() {
            return Err(problem("more than one"));
        }
        for _ in 0..per_item {
            copy_line(timings, &mut folder.timings, target)?;
        }
        for _ in 0..per_item {
            copy_line(results, &mut folder.results, target)?;
        }
        folder.done += 1;
    }
    Ok(whole)
}

fn copy_line(
    lines: &mut impl Iterator<Item = io::Result<String>>,
    file: &mut File,
    target: &Path,
) -> Result<(), FolderError> {
    let Some(line) = lines.next() else { return Ok(()) };
    let written = line.and_then(|line| writeln!(file, "{line}"));
    written.map_err(FolderError::io(target))
}
