//! The folder of a run, written query by query.
//!
//! A query's results are appended together once all are computed, so a killed run loses at most the current
//! query. Resuming cuts off incomplete lines and ends with the same bytes.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufRead as _, BufReader, Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::run_file::{RunFile, RunFileError};
use super::scene_pair::ScenePair;
use crate::diagnosis::Code;
use crate::localize::{QueryResult, StageTimes};
use crate::method::Method;
use crate::params::Params;
use crate::scene::Scene;
use posescope_core::files::write_whole;
use posescope_core::text::json_message;

const RUN: &str = "run.toml";
const RESULTS: &str = "results.jsonl";
const TIMINGS: &str = "timings.jsonl";

/// The folder of the failures' recordings, inside the run folder.
pub const FAILURES: &str = "failures";

/// The names of the recordings of a run's failures: `QUERY-METHOD`, preceded by the scenes if the run has several pairs.
/// Each query has a name of its own, also beside another that differs from it only by characters that file names do not
/// have.
pub struct RecordingNames(HashMap<[String; 3], String>);

impl RecordingNames {
    /// Those of all queries of a run.
    pub fn of(run: &RunFile) -> Self {
        let is_plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
        let several_pairs = run.pairs.len() > 1;
        let queries = run.plan().map(|item| {
            let ScenePair { scene, query_scene, .. } = item.pair;
            let scenes = several_pairs.then(|| format!("{scene}-{query_scene}-"));
            let name = scenes.unwrap_or_default() + item.query;
            ([scene, query_scene, item.query].map(str::to_owned), name)
        });
        let (exact, changed): (Vec<_>, Vec<_>) =
            queries.partition(|(_, name)| name.chars().all(is_plain));
        let mut used: HashSet<String> = exact.iter().map(|(_, name)| name.clone()).collect();
        let changed = changed.into_iter().map(|(key, name)| {
            let plain: String = name.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
            let numbered = (2..).map(|number| format!("{plain}-{number}"));
            let mut free = [plain.clone()].into_iter().chain(numbered);
            let name = free.find(|name| used.insert(name.clone()));
            (key, name.unwrap_or(plain))
        });
        let changed: Vec<_> = changed.collect();
        Self(exact.into_iter().chain(changed).collect())
    }

    /// The file of a failure in the folder [`FAILURES`]; `None` for a query that is not of the run.
    pub fn file(&self, scenes: [&str; 2], query: &str, method: Method) -> Option<String> {
        let [scene, query_scene] = scenes;
        let name = self.0.get(&[scene, query_scene, query].map(str::to_owned))?;
        Some(format!("{name}-{method}.rrd"))
    }

    /// The file of a failed result.
    pub fn of_result(&self, result: &QueryResult) -> Option<String> {
        let query_scene = result.query_scene.as_ref().unwrap_or(&result.scene);
        self.file([&result.scene, query_scene], &result.query, result.method)
    }
}

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
        fs::create_dir_all(path).map_err(FolderError::io(path))?;
        let folder = Self::open(path)?;
        let file = path.join(RUN);
        // Another process may have run in the meantime.
        if file.exists() {
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
        let results: Prefix = folder.prefix(RESULTS)?;
        let timings: Prefix = folder.prefix(TIMINGS)?;
        folder.check_order(run, &results, results_per_item)?;
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
        })
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
            let old = fs::read(&path)?;
            let old: Vec<&[u8]> = old.split_inclusive(|byte| *byte == b'\n').collect();
            let whole = [&old[..lines.start].concat(), new, &old[lines.end..].concat()].concat();
            let temporary = self.path.join(format!("tmp-{name}"));
            fs::write(&temporary, whole)?;
            let file = OpenOptions::new().read(true).append(true).open(&temporary)?;
            // The lock of the old file ends with it.
            file.try_lock().ok();
            fs::rename(temporary, &path)?;
            Ok(file)
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

    /// Complete lines of a file.
    fn prefix(&self, name: &str) -> Result<Prefix, FolderError> {
        let path = self.path.join(name);
        let file = File::open(&path).map_err(FolderError::io(&path))?;
        let mut reader = BufReader::new(file);
        let mut prefix = Prefix::default();
        let (mut line, mut end) = (Vec::new(), 0);
        loop {
            line.clear();
            let length = reader.read_until(b'\n', &mut line).map_err(FolderError::io(&path))?;
            let head = serde_json::from_slice::<Head>(&line);
            match head {
                Ok(head) if line.ends_with(b"\n") => {
                    end += length as u64;
                    prefix.ends.push(end);
                    prefix.queries.push(head.query);
                    prefix
                        .unread
                        .push(head.reason.is_some_and(|reason| reason.code == Code::I1.name()));
                }
                // What a killed process wrote last has no end.
                _ if !line.ends_with(b"\n") => return Ok(prefix),
                head => {
                    let expected =
                        head.err().map_or_else(String::new, |error| json_message(&error));
                    return Err(FolderError::Damaged {
                        path,
                        line: prefix.ends.len() + 1,
                        message: format!(
                            "{expected}; remove this line and all below, and --resume localises their queries again"
                        ),
                    });
                }
            }
        }
    }

    fn check_order(
        &self,
        run: &RunFile,
        results: &Prefix,
        per_item: usize,
    ) -> Result<(), FolderError> {
        let expected = run.items().flat_map(|item| vec![item.query; per_item]);
        let found = results.queries.iter().enumerate();
        for ((line, found), expected) in found.zip(expected) {
            if found != expected {
                return Err(FolderError::Damaged {
                    path: self.path.join(RESULTS),
                    line: line + 1,
                    message: format!("query {expected} expected, {found} found"),
                });
            }
        }
        Ok(())
    }
}

/// The common fields of both kinds of line.
#[derive(serde::Deserialize)]
struct Head {
    query: String,
    reason: Option<HeadReason>,
}

#[derive(serde::Deserialize)]
struct HeadReason {
    /// A text: another version may have other codes.
    code: String,
}

/// The complete lines at the beginning of a file: their ends \[bytes\], queries, and whether files could not be read.
#[derive(Default)]
struct Prefix {
    ends: Vec<u64>,
    queries: Vec<String>,
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
        let is_temporary = entry.file_name().to_string_lossy().starts_with("tmp-");
        let is_empty = [RESULTS, TIMINGS].iter().any(|name| entry.file_name() == *name)
            && entry.metadata().is_ok_and(|file| file.len() == 0);
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
        if entry.file_name().to_string_lossy().starts_with("tmp-") {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

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

fn lines_of(
    folder: &Path,
    name: &str,
) -> Result<impl Iterator<Item = io::Result<String>>, FolderError> {
    let path = folder.join(name);
    let file = File::open(&path).map_err(FolderError::io(path))?;
    Ok(BufReader::new(file).lines())
}

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

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;
    use crate::run::{Protocol, QueryCamera, RUN_SCHEMA};

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
        let queries = ["cam0/3", "cam0-3", "cam0:3", "cam1/3", "70"];
        let names = RecordingNames::of(&run(&queries));
        let files = queries.map(|query| names.file(["map", "map"], query, Method::FB));
        let files = files.map(|file| file.expect("is of the run"));
        let expected = ["cam0-3-2-fb", "cam0-3-fb", "cam0-3-3-fb", "cam1-3-fb", "70-fb"];
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
        let temporary = path.join("tmp-results.jsonl");
        fs::write(&temporary, "of the other process").expect("writable");
        is_in_use(RunFolder::resume(path, &run));
        assert!(temporary.exists());
        drop(other);
        RunFolder::resume(path, &run).expect("nobody has the lock");
        assert!(!temporary.exists());
    }
}
