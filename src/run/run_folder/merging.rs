//! Putting the parts of a run together.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::checking::PlannedLines;
use super::reading::{lines_of, read_run};
use super::{FolderError, Head, RESULTS, RUN, RunFolder, TIMINGS, checking, same_run};
use crate::run::{RunFile, RunItem};
use posescope_core::text::json_message;

/// Merges the shards of a run into one folder, with the same content as an unsplit run. If that fails, the folder has
/// no run.
///
/// # Errors
/// [`FolderError`]: parts of different runs, or a missing, repeated, damaged or incomplete part.
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
        for name in [TIMINGS, RESULTS] {
            expect_whole(path, name, run)?;
        }
    }
    // Which part each query is in.
    let owner = |item: &RunItem<'_>| {
        let mut owners = (0..runs.len())
            .filter(|&part| runs[part].1.shard.is_none_or(|shard| shard.has(item.index)));
        let problem = |message: &str| FolderError::Damaged {
            path: first_path.join(RUN),
            line: 1,
            message: format!("query {} is in {message} of the parts to merge", item.query),
        };
        let owner = owners.next().ok_or_else(|| problem("none"))?;
        match owners.next() {
            Some(_) => Err(problem("more than one")),
            None => Ok(owner),
        }
    };
    let owners = whole.plan().map(|item| owner(&item)).collect::<Result<Vec<usize>, _>>()?;
    let mut folder = RunFolder::create(target, &whole)?;
    let parts: Vec<&Path> = runs.iter().map(|(path, _)| path.as_path()).collect();
    let copied = copy(&parts, &owners, whole.results_per_item(), &mut folder);
    if copied.is_err() {
        folder.discard();
    }
    copied.map(|()| whole)
}

/// Copies the lines of all queries, each from its owner among the parts.
fn copy(
    parts: &[&Path],
    owners: &[usize],
    per_item: usize,
    folder: &mut RunFolder,
) -> Result<(), FolderError> {
    for (name, file) in [(TIMINGS, &mut folder.timings), (RESULTS, &mut folder.results)] {
        let sources = parts.iter().map(|part| lines_of(part, name));
        let mut sources = sources.collect::<Result<Vec<_>, _>>()?;
        for &owner in owners {
            for line in sources[owner].by_ref().take(per_item) {
                let line = line.map_err(FolderError::io(parts[owner].join(name)))?;
                writeln!(file, "{line}").map_err(FolderError::io(&folder.path))?;
            }
        }
    }
    Ok(())
}

/// Checks that the lines of a file are those of the run, and that none is missing.
fn expect_whole(folder: &Path, name: &str, run: &RunFile) -> Result<(), FolderError> {
    let path = folder.join(name);
    let mut planned = PlannedLines::of(run);
    let mut count = 0;
    for line in lines_of(folder, name)? {
        let line = line.map_err(FolderError::io(&path))?;
        count += 1;
        let head = serde_json::from_str::<Head>(&line).map_err(|error| json_message(&error));
        head.and_then(|head| planned.check(&head.line()))
            .map_err(|expected| checking::damaged(&path, count, &expected))?;
    }
    if planned.are_all() {
        return Ok(());
    }
    Err(FolderError::Incomplete {
        path: folder.to_owned(),
        done: count / run.results_per_item(),
        items: run.items().count(),
    })
}
