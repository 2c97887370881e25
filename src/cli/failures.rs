//! What a run leaves beside its results: recordings of the queries that failed,
//! `failures/QUERY-METHOD.rrd`, and events where they are asked for.

use std::fs;
use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use posescope::localize::{LocalizeError, LocalizeObserver, QueryResult};
use posescope::params::Params;
use posescope::run::{
    FAILURES, FailedQuery, FolderError, Protocol, RunError, RunFile, RunFolder, RunItem,
    RunObserver, ScenePair, read_results, recording_name,
};
use posescope::sink::SceneNames;
use posescope::sink::rerun::{Identity, RecordError, Recorder, Targets};

use super::event_export::EventExport;
use super::failure::CliError;
use super::interrupt::Interrupt;
use super::observer::CliObserver;

/// Observes a run: a progress bar, recordings of the first failures, and every event where they are asked for.
///
/// A failure is localised once more to be recorded: most queries succeed, and recording each of them
/// would cost more than repeating a few.
pub struct FailureRecordings<'a> {
    folder: PathBuf,
    /// Failures that are still to be recorded.
    left: usize,
    missed: usize,
    params: &'a Params,
    protocol: &'a Protocol,
    several_pairs: bool,
    bar: indicatif::ProgressBar,
    observer: CliObserver,
}

impl<'a> FailureRecordings<'a> {
    /// For a run that begins, or goes on after the queries that are done.
    pub fn new(
        kept: usize,
        folder: &RunFolder,
        run: &'a RunFile,
        params: &'a Params,
        bar: indicatif::ProgressBar,
        interrupt: Interrupt,
        events: Option<EventExport>,
    ) -> Result<Self, CliError> {
        let path = folder.path().join(FAILURES);
        fs::create_dir_all(&path).map_err(FolderError::io(&path))?;
        let failures = failures(folder.path(), run)?;
        let mut observer = CliObserver::new(indicatif::ProgressBar::hidden(), None, interrupt);
        observer.events = events;
        Ok(Self {
            folder: path,
            left: kept.saturating_sub(failures.len()),
            missed: failures.len().saturating_sub(kept),
            params,
            protocol: &run.protocol,
            several_pairs: run.pairs.len() > 1,
            bar,
            observer,
        })
    }

    /// Says what was not recorded, and whether the events have arrived.
    pub fn close(self) -> Result<(), CliError> {
        tell_missed(self.missed);
        self.observer.events.map_or(Ok(()), EventExport::close)
    }

    fn record(&self, query: &FailedQuery<'_>, path: &Path) -> Result<(), RecordError> {
        let (references, queries) = (query.localizer.references(), query.localizer.queries());
        let frames = query.request.references.frames.iter();
        let identity = Identity {
            queries: vec![query.item.query.to_owned()],
            references: frames
                .map(|&frame| references.frames()[frame].clone())
                .collect(),
            ..Identity::of(references, queries, self.params, self.protocol)
        };
        let mut recorder = Recorder::open(&Targets::file(path), &identity, &[query.method])?;
        // A panic was told as the query's result; here it only ends the recording.
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

/// Brings the recordings of the first failures of the whole run together from those of its parts.
pub fn merge(
    parts: &[PathBuf],
    target: &Path,
    kept: usize,
    run: &RunFile,
) -> Result<(), FolderError> {
    let folder = target.join(FAILURES);
    fs::create_dir_all(&folder).map_err(FolderError::io(&folder))?;
    let failures = failures(target, run)?;
    tell_missed(failures.len().saturating_sub(kept));
    for name in failures.iter().take(kept) {
        let file = format!("{name}.rrd");
        let sources = parts.iter().map(|part| part.join(FAILURES).join(&file));
        if let Some(source) = sources.into_iter().find(|path| path.exists()) {
            let copied = fs::copy(&source, folder.join(&file));
            copied.map_err(FolderError::io(source))?;
        }
    }
    Ok(())
}

/// The names of the recordings of all failures of a run folder, in the order of its results.
fn failures(folder: &Path, run: &RunFile) -> Result<Vec<String>, FolderError> {
    let mut names: Vec<String> = Vec::new();
    let several_pairs = run.pairs.len() > 1;
    for result in read_results::<QueryResult>(folder)? {
        let result = result?;
        if result.grade.is_failure()
            && let Some(pair) = run.pair_of(&result)
        {
            let name = recording_name(pair, &result.query, result.method, several_pairs);
            // The results of a method on a query stand behind each other.
            if names.last() != Some(&name) {
                names.push(name);
            }
        }
    }
    Ok(names)
}

impl RunObserver for FailureRecordings<'_> {
    fn query_observer(&mut self) -> &mut dyn LocalizeObserver {
        &mut self.observer
    }

    fn begin(&mut self, item: &RunItem<'_>) {
        if let Some(events) = &mut self.observer.events {
            let ScenePair {
                scene, query_scene, ..
            } = item.pair;
            events.name_scenes(SceneNames {
                references: scene.clone(),
                query: Some(query_scene.clone()).filter(|query| query != scene),
            });
        }
    }

    fn failed(&mut self, query: &FailedQuery<'_>) -> Result<(), RunError> {
        let name = recording_name(
            query.item.pair,
            query.item.query,
            query.method,
            self.several_pairs,
        );
        let path = self.folder.join(format!("{name}.rrd"));
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
        if let Some(events) = &mut self.observer.events {
            events.end_query();
        }
        self.bar.set_message(item.query.to_owned());
        self.bar.inc(1);
    }
}

fn tell_missed(missed: usize) {
    if missed > 0 {
        log::warn!("{missed} failures were not recorded; --keep-failures records more");
    }
}
