//! What a run writes besides its results: recordings of the failed queries,
//! `failures/QUERY-METHOD.rrd`, and events if requested.

use std::fs;
use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::events::{EventExport, SceneNames};
use super::rerun::{Identity, RecordError, Recorder, Targets};
use crate::diagnosis::Code;
use crate::event::KindSet;
use crate::geometry::Pose;
use crate::localize::{LocalizeError, LocalizeObserver};
use crate::method::Method;
use crate::problem::Problem;
use crate::run::{
    FAILURES, FailedQuery, FolderError, Plan, RecordingNames, RunError, RunFile, RunFolder,
    RunItem, RunObserver, ScenePair, read_results,
};
use crate::trace::{Cancelled, Record, Sink};

/// Recorded failures by default.
pub const KEPT_FAILURES: usize = 20;

/// Who waits for a run: sees its progress, and can stop it.
pub trait Follower: Send {
    /// A query is done.
    fn done(&mut self, query: &str);

    /// Cancels the run once it shall stop.
    ///
    /// # Errors
    /// [`Cancelled`].
    fn check(&self) -> Result<(), Cancelled>;

    /// A flag that asks for a call of [`Self::check`] even without an event.
    fn attention(&self) -> Arc<AtomicBool>;
}

/// Observes a run: tells its follower, records the first failures and writes events if requested.
///
/// A failed query is localised again to be recorded. Most queries succeed, so this costs less than recording
/// every query.
pub struct RunRecords<'a> {
    folder: PathBuf,
    plan: &'a Plan,
    names: RecordingNames,
    /// How many more failures to record.
    left: usize,
    missed: usize,
    events: Option<EventExport>,
    follower: &'a mut dyn Follower,
}

impl<'a> RunRecords<'a> {
    /// For a new or a resumed run.
    ///
    /// # Errors
    /// A folder that cannot be written, or results that cannot be read.
    pub fn new(
        kept: usize,
        folder: &RunFolder,
        plan: &'a Plan,
        events: Option<EventExport>,
        follower: &'a mut dyn Follower,
    ) -> Result<Self, FolderError> {
        let path = own_folder(folder.path())?;
        let failures = failures(folder.path(), &plan.run)?;
        Ok(Self {
            folder: path,
            names: RecordingNames::of(&plan.run),
            plan,
            left: kept.saturating_sub(failures.len()),
            missed: failures.len().saturating_sub(kept),
            events,
            follower,
        })
    }

    /// Reports unrecorded failures.
    ///
    /// # Errors
    /// The first error of the events' file.
    pub fn close(self) -> Result<(), FolderError> {
        warn_of_missed(self.missed);
        self.events.map_or(Ok(()), EventExport::close)
    }

    fn record(&self, query: &FailedQuery<'_>, path: &Path) -> Result<(), RecordError> {
        let (references, queries) = (query.localizer.references(), query.localizer.queries());
        let frames = query.request.references.frames.iter();
        let ScenePair { scene, query_scene, .. } = query.item.pair;
        let identity = Identity {
            scene: scene.clone(),
            query_scene: Some(query_scene.clone()).filter(|queries| queries != scene),
            queries: vec![query.item.query.to_owned()],
            references: frames.map(|&frame| references.frames()[frame].clone()).collect(),
            ..Identity::of(references, queries, &self.plan.params, &self.plan.run.protocol)
        };
        let mut recorder = Recorder::open(&Targets::file(path), &identity, &[query.method])?;
        // The query's result reports the panic already; here it only ends the recording.
        let localized = catch_unwind(AssertUnwindSafe(|| {
            query.localizer.localize(
                query.item.index,
                query.frame,
                std::slice::from_ref(query.request),
                &[query.method],
                &mut recorder,
                |_, _| Ok::<(), LocalizeError>(()),
            )
        }));
        if let Ok(Err(error)) = localized {
            log::warn!("{}: {error}", path.display());
        }
        recorder.close()
    }
}

/// Copies the recordings of the first failures of the whole run from the folders of its parts.
///
/// # Errors
/// A file that cannot be read or written.
pub fn merge_failures(
    parts: &[PathBuf],
    target: &Path,
    kept: usize,
    run: &RunFile,
) -> Result<(), FolderError> {
    let folder = own_folder(target)?;
    let failures = failures(target, run)?;
    warn_of_missed(failures.len().saturating_sub(kept));
    for file in failures.iter().take(kept) {
        let mut sources = parts.iter().map(|part| part.join(FAILURES).join(file));
        let is_own = |path: &PathBuf| path.symlink_metadata().is_ok_and(|file| file.is_file());
        if let Some(source) = sources.find(is_own) {
            let copied = fs::copy(&source, folder.join(file));
            copied.map_err(FolderError::io(source))?;
        }
    }
    Ok(())
}

/// The folder of the failures' recordings, which is made if it is not there. A link would lead out of the run folder.
fn own_folder(run: &Path) -> Result<PathBuf, FolderError> {
    let path = run.join(FAILURES);
    if path.is_symlink() {
        let error = std::io::Error::other("a folder expected, a link found");
        return Err(FolderError::io(&path)(error));
    }
    fs::create_dir_all(&path).map_err(FolderError::io(&path))?;
    Ok(path)
}

/// The recordings of all failures of a run folder, in the order of its results.
fn failures(folder: &Path, run: &RunFile) -> Result<Vec<String>, FolderError> {
    let (mut files, names): (Vec<String>, _) = (Vec::new(), RecordingNames::of(run));
    for result in read_results(folder, run)? {
        // Queries whose files cannot be read have no recording.
        let is_unread = result.reason.as_ref().is_some_and(|reason| reason.code == Code::I1);
        let file = names.of_result(&result).filter(|_| result.is_suspect() && !is_unread);
        // The results of one method and query are consecutive.
        files.extend(file.filter(|file| files.last() != Some(file)));
    }
    Ok(files)
}

impl Sink for RunRecords<'_> {
    fn wanted(&self) -> KindSet {
        if self.events.is_some() { KindSet::ALL } else { KindSet::NONE }
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if let Some(events) = &mut self.events {
            events.lines.accept(record)?;
        }
        self.follower.check()
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.follower.check()
    }
}

impl LocalizeObserver for RunRecords<'_> {
    fn begin_query(&mut self, index: usize, problems: &[Problem], truth: Option<&Pose>) {
        if let Some(events) = &mut self.events {
            events.lines.begin_query(index, problems, truth);
        }
    }

    fn begin_method(&mut self, problem: usize, method: Method) {
        if let Some(events) = &mut self.events {
            events.lines.begin_method(problem, method);
        }
    }

    fn begin_fusion(&mut self, method: Method) {
        self.begin_method(0, method);
    }

    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(self.follower.attention())
    }
}

impl RunObserver for RunRecords<'_> {
    fn query_observer(&mut self) -> &mut dyn LocalizeObserver {
        self
    }

    fn begin(&mut self, item: &RunItem<'_>) {
        if let Some(events) = &mut self.events {
            let ScenePair { scene, query_scene, .. } = item.pair;
            events.name_scenes(SceneNames {
                references: scene.clone(),
                query: Some(query_scene.clone()).filter(|query| query != scene),
            });
        }
    }

    fn failed(&mut self, query: &FailedQuery<'_>) -> Result<(), RunError> {
        let ScenePair { scene, query_scene, .. } = query.item.pair;
        let file = self.names.file([scene, query_scene], query.item.query, query.method);
        let path = self.folder.join(file.unwrap_or_default());
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(FolderError::io(&path)(error).into());
            }
            _ => {}
        }
        if self.left == 0 {
            self.missed += 1;
            return Ok(());
        }
        self.left -= 1;
        if !query.request.references.frames.is_empty()
            && let Err(error) = self.record(query, &path)
        {
            log::warn!("{error}");
        }
        Ok(())
    }

    fn done(&mut self, item: &RunItem<'_>) {
        if let Some(events) = &mut self.events {
            events.end_query();
        }
        self.follower.done(item.query);
    }
}

fn warn_of_missed(missed: usize) {
    if missed > 0 {
        log::warn!("{missed} failures were not recorded; raise --keep-failures to record more");
    }
}
