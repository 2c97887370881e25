//! The folder of a run, written query by query.
//!
//! A query's results are appended together once all are computed, so a killed run loses at most the current
//! query. Resuming cuts off incomplete lines and ends with the same bytes.

mod checking;
mod merging;
mod reading;
mod recording_names;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufReader, Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::run_file::RunFile;
use crate::diagnosis::Code;
use crate::fusion::Fusion;
use crate::localize::{QueryResult, Setting, StageTimes};
use crate::method::Method;
use posescope_core::files::{
    self, expect_own, is_temporary, next_line, replaced_with, write_whole,
};
use posescope_core::text::json_message;

use checking::{Line, PlannedLines};
pub use merging::merge;
pub use reading::{read_results, read_run, result_lines, results_of_pair};
pub use recording_names::RecordingNames;

const RUN: &str = "run.toml";
const RESULTS: &str = "results.jsonl";
const TIMINGS: &str = "timings.jsonl";

/// The folder of the failures' recordings, inside the run folder.
pub const FAILURES: &str = "failures";

/// Why a run folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// A new run needs an empty folder.
    #[error("{}: the folder is not empty{}", path.display(), if *.is_run {
        "; continue its run with --resume, or name another folder with --out"
    } else {
        " and contains no run to resume; name another folder with --out"
    })]
    NotEmpty {
        /// The folder.
        path: PathBuf,
        /// Whether there is a run in it.
        is_run: bool,
    },
    /// The folder contains another run.
    #[error(
        "{}: the folder contains a run with other settings, `{there}` instead of `{here}`; name another with --out",
        path.display()
    )]
    OtherRun {
        /// The folder.
        path: PathBuf,
        /// The first line of its `run.toml` that differs.
        there: String,
        /// The same line of the new run.
        here: String,
    },
    /// A file is damaged.
    #[error("{}:{line}: {message}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The error.
        message: String,
    },
    /// There is no run.
    #[error("{}: not a run folder, {RUN} is missing; `posescope eval` writes run folders", .0.display())]
    NoRun(PathBuf),
    /// Another process writes to the folder.
    #[error("{}: another process is writing to this run; wait until it ends", .0.display())]
    InUse(PathBuf),
    /// Not all queries are done.
    #[error("{}: {done} of {items} queries done; finish the run with --resume first", path.display())]
    Incomplete {
        /// The folder.
        path: PathBuf,
        /// Queries done.
        done: usize,
        /// Queries in all.
        items: usize,
    },
}

impl FolderError {
    /// Makes errors of this path, for `map_err`.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        |source| Self::Io { path, source }
    }
}

/// A run folder that is being written.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    results: File,
    timings: File,
    done: usize,
    unread: Vec<usize>,
    /// What the run made before its first query.
    made: Made,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Made {
    /// Nothing: the run was there.
    Nothing,
    /// Its files, in an empty folder.
    Files,
    /// The folder too.
    Folder,
}

/// A line of `timings.jsonl`.
#[derive(Serialize)]
struct Timing<'a> {
    query: &'a str,
    method: Method,
    #[serde(flatten)]
    stages: &'a StageTimes,
}

impl RunFolder {
    /// Starts a run in a new or empty folder.
    ///
    /// # Errors
    /// [`FolderError::NotEmpty`], or an error of the disk.
    pub fn create(path: &Path, run: &RunFile) -> Result<Self, FolderError> {
        if holds_anything(path)? {
            return Err(FolderError::NotEmpty {
                path: path.to_owned(),
                is_run: path.join(RUN).exists(),
            });
        }
        let made = if path.exists() { Made::Files } else { Made::Folder };
        fs::create_dir_all(path).map_err(FolderError::io(path))?;
        let folder = Self { made, ..Self::open(path)? };
        let file = path.join(RUN);
        // Another process may have run in the meantime.
        if file.is_symlink() || file.exists() {
            return Err(FolderError::NotEmpty { path: path.to_owned(), is_run: true });
        }
        let text = toml_of(&run.located_in(path));
        write_whole(&file, text.as_bytes()).map_err(FolderError::io(&file))?;
        Ok(folder)
    }

    /// Continues the run in the folder, or starts it if the folder is new or empty.
    ///
    /// # Errors
    /// [`FolderError`]: another run, a damaged one, or one that is in use.
    pub fn resume(path: &Path, run: &RunFile) -> Result<Self, FolderError> {
        let results_per_item = run.results_per_item();
        if !holds_anything(path)? {
            return Self::create(path, run);
        }
        let file = path.join(RUN);
        if !file.exists() {
            return Err(FolderError::NotEmpty { path: path.to_owned(), is_run: false });
        }
        same_run(path, &read_run(path)?, run)?;
        let mut folder = Self::open(path)?;
        remove_temporary_files(path).map_err(FolderError::io(path))?;
        let results: Prefix = folder.prefix(RESULTS, run)?;
        let timings: Prefix = folder.prefix(TIMINGS, run)?;
        let whole = |prefix: &Prefix| prefix.ends.len() / results_per_item;
        let done = whole(&results).min(whole(&timings));
        let is_unread = |query: &usize| {
            let lines = query * results_per_item..(query + 1) * results_per_item;
            results.unread[lines].contains(&true)
        };
        // The last queries are cut off and localised as if they had never been.
        folder.done = (0..done).rfind(|query| !is_unread(query)).map_or(0, |last| last + 1);
        folder.unread = (0..folder.done).filter(is_unread).collect();
        let lines = folder.done * results_per_item;
        for (file, prefix) in [(&mut folder.results, results), (&mut folder.timings, timings)] {
            let end = lines.checked_sub(1).map_or(0, |last| prefix.ends[last]);
            let cut = file.set_len(end);
            cut.and_then(|()| file.seek(SeekFrom::End(0)).map(drop))
                .map_err(FolderError::io(path))?;
        }
        Ok(folder)
    }

    fn open(path: &Path) -> Result<Self, FolderError> {
        let open = |name: &str| {
            let file = path.join(name);
            expect_own(&file).map_err(FolderError::io(&file))?;
            let options = OpenOptions::new().create(true).read(true).append(true).open(&file);
            options.map_err(FolderError::io(file))
        };
        let results = open(RESULTS)?;
        // A file system without locks returns another error, which is ignored.
        if matches!(results.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(FolderError::InUse(path.to_owned()));
        }
        Ok(Self {
            path: path.to_owned(),
            results,
            timings: open(TIMINGS)?,
            done: 0,
            unread: Vec::new(),
            made: Made::Nothing,
        })
    }

    /// Removes what a run has made that failed before its first result, so that its folder is as it was.
    pub(super) fn discard(&self) {
        if self.done > 0 || self.made == Made::Nothing {
            return;
        }
        for name in [RUN, TIMINGS, RESULTS] {
            fs::remove_file(self.path.join(name)).ok();
        }
        // Only empty folders can be removed.
        fs::remove_dir(self.path.join(FAILURES)).ok();
        if self.made == Made::Folder {
            fs::remove_dir(&self.path).ok();
        }
    }

    /// The path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Queries that are done, in the order of the run's items.
    pub fn done(&self) -> usize {
        self.done
    }

    /// The done queries, by their positions among them, whose files could not be read.
    pub fn unread(&self) -> &[usize] {
        &self.unread
    }

    /// Appends all results of the next query.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn append(&mut self, results: &[(QueryResult, StageTimes)]) -> Result<(), FolderError> {
        let (lines, times) = self.lines(results)?;
        // Results last: a query with results is complete.
        (self.timings.write_all(&times)).map_err(FolderError::io(self.path.join(TIMINGS)))?;
        (self.results.write_all(&lines)).map_err(FolderError::io(self.path.join(RESULTS)))?;
        self.done += 1;
        Ok(())
    }

    /// Replaces all results of a query that is done.
    ///
    /// # Errors
    /// When they cannot be written. The files keep their content.
    pub fn replace(
        &mut self,
        query: usize,
        results: &[(QueryResult, StageTimes)],
    ) -> Result<(), FolderError> {
        let (lines, times) = self.lines(results)?;
        let of_query = query * results.len()..(query + 1) * results.len();
        self.timings = self.replaced(TIMINGS, of_query.clone(), &times)?;
        self.results = self.replaced(RESULTS, of_query, &lines)?;
        Ok(())
    }

    /// A file with other lines in the place of some, open and locked.
    fn replaced(&self, name: &str, lines: Range<usize>, new: &[u8]) -> Result<File, FolderError> {
        let path = self.path.join(name);
        let replace = || {
            let old = files::read(&path, u64::MAX - 1)?;
            let old: Vec<&[u8]> = old.split_inclusive(|byte| *byte == b'\n').collect();
            let whole = [&old[..lines.start].concat(), new, &old[lines.end..].concat()].concat();
            replaced_with(&path, |file| {
                // The lock of the old file ends with it.
                file.try_lock().ok();
                file.write_all(&whole)
            })
        };
        replace().map_err(FolderError::io(&path))
    }

    /// The lines of a query in both files.
    fn lines(
        &self,
        results: &[(QueryResult, StageTimes)],
    ) -> Result<(Vec<u8>, Vec<u8>), FolderError> {
        let (mut lines, mut times) = (Vec::new(), Vec::new());
        for (result, stages) in results {
            push_line(&mut lines, result).map_err(FolderError::io(&self.path))?;
            let timing = Timing { query: &result.query, method: result.method, stages };
            push_line(&mut times, &timing).map_err(FolderError::io(&self.path))?;
        }
        Ok((lines, times))
    }

    /// Complete lines of a file of the run.
    fn prefix(&self, name: &str, run: &RunFile) -> Result<Prefix, FolderError> {
        let path = self.path.join(name);
        let file = files::open(&path).map_err(FolderError::io(&path))?;
        let mut reader = BufReader::new(file);
        let mut prefix = Prefix::default();
        let mut planned = PlannedLines::of(run);
        let (mut line, mut end) = (Vec::new(), 0);
        loop {
            line.clear();
            let length = next_line(&mut reader, &mut line).map_err(FolderError::io(&path))?;
            let head = serde_json::from_slice::<Head>(&line).map_err(|error| json_message(&error));
            let head = head.and_then(|head| planned.check(&head.line()).map(|()| head));
            match head {
                Ok(head) if line.ends_with(b"\n") => {
                    end += length as u64;
                    prefix.ends.push(end);
                    prefix
                        .unread
                        .push(head.reason.is_some_and(|reason| reason.code == Code::I1.name()));
                }
                // What a killed process wrote last has no end.
                _ if !line.ends_with(b"\n") => return Ok(prefix),
                head => {
                    let (line, expected) = (prefix.ends.len() + 1, head.err().unwrap_or_default());
                    return Err(checking::damaged(&path, line, &expected));
                }
            }
        }
    }
}

/// The common fields of both kinds of line.
#[derive(serde::Deserialize)]
struct Head {
    schema: Option<String>,
    scene: Option<String>,
    query_scene: Option<String>,
    query: String,
    method: String,
    setting: Option<Setting>,
    fusion: Option<Fusion>,
    reason: Option<HeadReason>,
}

impl Head {
    fn line(&self) -> Line<'_> {
        let Self { schema, scene, query_scene, query, method, setting, fusion, .. } = self;
        let schema = schema.as_deref();
        let scenes = scene.as_deref().map(|scene| [scene, query_scene.as_deref().unwrap_or(scene)]);
        // Times have neither scenes nor settings.
        let case = scenes.map(|_| (*setting, *fusion));
        Line { schema, scenes, query, method, case }
    }
}

#[derive(serde::Deserialize)]
struct HeadReason {
    /// A text: another version may have other codes.
    code: String,
}

/// The complete lines at the beginning of a file: their ends \[bytes\], and whether files could not be read.
#[derive(Default)]
struct Prefix {
    ends: Vec<u64>,
    unread: Vec<bool>,
}

fn push_line(bytes: &mut Vec<u8>, value: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer(&mut *bytes, value)?;
    bytes.push(b'\n');
    Ok(())
}

/// The text of `run.toml`.
fn toml_of(run: &RunFile) -> String {
    // Every field has a form in TOML; a test writes and reads one.
    toml::to_string(run).unwrap_or_else(|error| unreachable!("{error}"))
}

fn same_run(path: &Path, there: &RunFile, here: &RunFile) -> Result<(), FolderError> {
    let [there, here] = [there, here].map(|run| toml_of(&run.canonical()));
    if there == here {
        return Ok(());
    }
    let different = there.lines().zip(here.lines()).find(|(there, here)| there != here);
    let (there, here) = different.unwrap_or(("a shorter file", "a longer one"));
    let short = |line: &str| line.chars().take(120).collect();
    Err(FolderError::OtherRun { path: path.to_owned(), there: short(there), here: short(here) })
}

/// Whether the folder contains anything but what a process leaves that is killed before it describes its run:
/// temporary and empty files.
fn holds_anything(path: &Path) -> Result<bool, FolderError> {
    let entries = match fs::read_dir(path) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(FolderError::io(path)(error)),
    };
    for entry in entries {
        let entry = entry.map_err(FolderError::io(path))?;
        let is_temporary = is_temporary(&entry.file_name());
        let is_empty = [RESULTS, TIMINGS].iter().any(|name| entry.file_name() == *name)
            && entry.metadata().is_ok_and(|file| file.is_file() && file.len() == 0);
        if !is_temporary && !is_empty {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Removes temporary files of a killed process.
fn remove_temporary_files(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if is_temporary(&entry.file_name()) && entry.file_type()?.is_file() {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use tempfile::TempDir;

    use super::*;
    use crate::params::Params;
    use crate::run::{Protocol, QueryCamera, RUN_SCHEMA, ScenePair};

    /// A run over these queries.
    fn run(queries: &[&str]) -> RunFile {
        let camera = QueryCamera { width: 2, height: 1, fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.0 };
        let pair = ScenePair {
            scene_index: 0,
            query_index: None,
            scene: "map".to_owned(),
            query_scene: "map".to_owned(),
            camera,
            cameras: Vec::new(),
            drawn: Vec::new(),
            queries: queries.iter().map(|query| (*query).to_owned()).collect(),
            times_s: Vec::new(),
            references: Vec::new(),
        };
        RunFile {
            schema: RUN_SCHEMA.to_owned(),
            version: "1".to_owned(),
            scenes: vec!["map".to_owned()],
            shard: None,
            protocol: Protocol::default(),
            inputs: BTreeMap::new(),
            paths: BTreeMap::new(),
            pairs: vec![pair],
            params: Params::default().to_toml().parse().expect("a table"),
        }
    }

    #[test]
    fn names_that_files_cannot_tell_apart_get_numbers() {
        let queries = ["cam0/3", "cam0-3", "cam0:3", "cam1/3", "70", "a", "A"];
        let names = RecordingNames::of(&run(&queries));
        let files = queries.map(|query| names.file(["map", "map"], query, Method::FB));
        let files = files.map(|file| file.expect("is of the run"));
        let expected =
            ["cam0-3-2-fb", "cam0-3-fb", "cam0-3-3-fb", "cam1-3-fb", "70-fb", "a-fb", "A-2-fb"];
        assert_eq!(files, expected.map(|name| format!("{name}.rrd")));
        assert_eq!(names.file(["map", "map"], "71", Method::FB), None);
    }

    #[test]
    fn a_process_that_does_not_get_the_lock_changes_nothing() {
        let root = TempDir::new().expect("a folder");
        let (path, run) = (root.path(), run(&["70"]));
        let is_in_use = |opened: Result<RunFolder, FolderError>| {
            assert!(matches!(opened, Err(FolderError::InUse(_))), "{opened:?}");
        };
        // Another process has just taken the lock, and has described nothing yet.
        let other = RunFolder::open(path).expect("the lock");
        is_in_use(RunFolder::create(path, &run));
        assert!(!path.join(RUN).exists());
        drop(other);
        let other = RunFolder::create(path, &run).expect("nobody has the lock");
        let temporary = path.join("tmp-posescope-a.jsonl");
        fs::write(&temporary, "of the other process").expect("writable");
        is_in_use(RunFolder::resume(path, &run));
        assert!(temporary.exists());
        drop(other);
        RunFolder::resume(path, &run).expect("nobody has the lock");
        assert!(!temporary.exists());
    }

    #[test]
    fn files_of_others_stay_whatever_they_are_called() {
        let root = TempDir::new().expect("a folder");
        let (path, run) = (root.path(), run(&["70"]));
        drop(RunFolder::create(path, &run).expect("an empty folder"));
        let foreign = ["tmp-notes.txt", "tmp-a.json", "tmp-results.jsonl"];
        for name in foreign {
            fs::write(path.join(name), "").expect("writable");
        }
        RunFolder::resume(path, &run).expect("our own");
        assert!(foreign.iter().all(|name| path.join(name).exists()));
    }
}
