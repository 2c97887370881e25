//! What a run writes besides its results: recordings of the failed queries,
//! `failures/QUERY-METHOD.rrd`, and events if requested.

use std::fs;
use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use posescope::diagnosis::Code;
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

/// Observes a run: shows progress, records the first failures and writes events if requested.
///
/// A failed query is localised again to be recorded. Most queries succeed, so this costs less than recording
/// every query.
pub struct FailureRecordings<'a> {
    folder: PathBuf,
    /// How many more failures to record.
    left: usize,
    missed: usize,
    params: &'a Params,
    protocol: &'a Protocol,
    several_pairs: bool,
    bar: indicatif::ProgressBar,
    observer: CliObserver,
}

impl<'a> FailureRecordings<'a> {
    /// For a new or a resumed run.
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
        let mut observer = CliObserver::new(indicatif::ProgressBar::hidden(), interrupt);
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

    /// Reports unrecorded failures, and an error of the events file.
    pub fn close(self) -> Result<(), CliError> {
        warn_of_missed(self.missed);
        self.observer.events.map_or(Ok(()), EventExport::close)
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
            ..Identity::of(references, queries, self.params, self.protocol)
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
pub fn merge(
    parts: &[PathBuf],
    target: &Path,
    kept: usize,
    run: &RunFile,
) -> Result<(), FolderError> {
    let folder = target.join(FAILURES);
    fs::create_dir_all(&folder).map_err(FolderError::io(&folder))?;
    let failures = failures(target, run)?;
    warn_of_missed(failures.len().saturating_sub(kept));
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
        // Queries whose files cannot be read have no recording.
        if result.grade.is_failure()
            && result.reason.as_ref().is_none_or(|reason| reason.code != Code::I1)
            && let Some(pair) = run.pair_of(&result)
        {
            let name = recording_name(pair, &result.query, result.method, several_pairs);
            // The results of one method and query are consecutive.
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
            let ScenePair { scene, query_scene, .. } = item.pair;
            events.name_scenes(SceneNames {
                references: scene.clone(),
                query: Some(query_scene.clone()).filter(|query| query != scene),
            });
        }
    }

    fn failed(&mut self, query: &FailedQuery<'_>) -> Result<(), RunError> {
        let name =
            recording_name(query.item.pair, query.item.query, query.method, self.several_pairs);
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

fn warn_of_missed(missed: usize) {
    if missed > 0 {
        log::warn!("{missed} failures were not recorded; raise --keep-failures to record more");
    }
}
