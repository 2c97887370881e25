//! What a run leaves beside its results: recordings of the queries that failed,
//! `failures/QUERY-METHOD.rrd`, and events where they are asked for.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use posescope::image::Degradation;
use posescope::localize::{LocalizeError, LocalizeObserver};
use posescope::params::Params;
use posescope::run::{
    FAILURES, FailedQuery, FolderError, RunError, RunFile, RunFolder, RunItem, RunObserver,
    ScenePair, recording_name,
};
use posescope::sink::SceneNames;
use posescope::sink::rerun::{Identity, RecordError, Recorder, Targets};

use super::args::EvalArgs;
use super::event_export::EventExport;
use super::failure::CliError;
use super::interrupt::Interrupt;
use super::observer::CliObserver;

/// Names of failed queries without a recording, one per line.
const DROPPED: &str = "dropped.txt";

/// Observes a run: a progress bar, a recording of each failure while the budget lasts, and every event where
/// they are asked for.
///
/// A failure is localised once more to be recorded: most queries succeed, and recording each of them
/// would cost more than repeating a few.
pub struct FailureRecordings<'a> {
    folder: PathBuf,
    budget: RecordingBudget,
    params: &'a Params,
    degraded: Degradation,
    seed: u64,
    several_pairs: bool,
    bar: indicatif::ProgressBar,
    observer: CliObserver,
    dropped: usize,
}

/// What recordings may still take. Once one does not fit, none does: the first failures are kept,
/// whatever their sizes.
struct RecordingBudget {
    recordings: usize,
    bytes: u64,
    is_full: bool,
}

impl RecordingBudget {
    fn new(args: &EvalArgs) -> Self {
        Self {
            recordings: args.recordings(),
            bytes: args.max_recording_mb.saturating_mul(1 << 20),
            is_full: false,
        }
    }

    /// Whether a recording of as many bytes is kept.
    fn take(&mut self, bytes: u64) -> bool {
        if self.is_full || self.recordings == 0 || bytes > self.bytes {
            self.is_full = true;
            return false;
        }
        self.recordings -= 1;
        self.bytes -= bytes;
        true
    }
}

impl<'a> FailureRecordings<'a> {
    /// For a run that begins, or goes on after the queries that are done.
    pub fn new(
        args: &EvalArgs,
        folder: &RunFolder,
        run: &RunFile,
        params: &'a Params,
        bar: indicatif::ProgressBar,
        interrupt: Interrupt,
        events: Option<EventExport>,
    ) -> Result<Self, CliError> {
        let path = folder.path().join(FAILURES);
        fs::create_dir_all(&path).map_err(FolderError::io(&path))?;
        let several_pairs = run.pairs.len() > 1;
        let mut budget = RecordingBudget::new(args);
        let dropped = read_dropped(&path)?;
        let mut still_dropped = String::new();
        for item in run.items().take(folder.done()) {
            for method in &run.protocol.methods {
                let name = recording_name(item.pair, item.query, *method, several_pairs);
                if dropped.contains(&name) {
                    budget.is_full = true;
                    still_dropped += &format!("{name}\n");
                } else if let Ok(file) = fs::metadata(path.join(format!("{name}.rrd"))) {
                    budget.take(file.len());
                }
            }
        }
        let list = path.join(DROPPED);
        if still_dropped.is_empty() {
            remove_if_there(&list)?;
        } else {
            fs::write(&list, &still_dropped).map_err(FolderError::io(&list))?;
        }
        let mut observer = CliObserver::new(indicatif::ProgressBar::hidden(), None, interrupt);
        observer.events = events;
        Ok(Self {
            folder: path,
            budget,
            params,
            degraded: run.protocol.degrade,
            seed: run.protocol.seed,
            several_pairs,
            bar,
            observer,
            dropped: still_dropped.lines().count(),
        })
    }

    /// Says what was not kept, and whether the events have arrived.
    pub fn close(self) -> Result<(), CliError> {
        tell_dropped(self.dropped, &self.folder);
        self.observer.events.map_or(Ok(()), EventExport::close)
    }

    fn record(&self, query: &FailedQuery<'_>, path: &Path) -> Result<(), RecordError> {
        let targets = Targets {
            save: Some(path.to_owned()),
            ..Targets::default()
        };
        let frames = query.localizer.references().frames();
        let references = query.localizer.references().name();
        let queries = query.localizer.queries().name();
        let identity = Identity {
            scene: references.to_owned(),
            query_scene: (queries != references).then(|| queries.to_owned()),
            queries: vec![query.item.query.to_owned()],
            references: (query.request.references.frames.iter())
                .map(|&frame| frames[frame].clone())
                .collect(),
            configuration: self.params.to_toml(),
            degraded: self.degraded,
            seed: self.seed,
        };
        let mut recorder = Recorder::open(&targets, &identity, &[query.method])?;
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

    fn drop(&mut self, name: &str) -> Result<(), FolderError> {
        self.dropped += 1;
        append_dropped(&self.folder, name)
    }

    /// Brings the recordings of the parts of a run together, in the order of the whole.
    pub fn merge(
        parts: &[PathBuf],
        target: &Path,
        args: &EvalArgs,
        run: &RunFile,
    ) -> Result<(), FolderError> {
        let folder = target.join(FAILURES);
        fs::create_dir_all(&folder).map_err(FolderError::io(&folder))?;
        let mut budget = RecordingBudget::new(args);
        let mut dropped_in_parts = BTreeSet::new();
        for part in parts {
            dropped_in_parts.extend(read_dropped(&part.join(FAILURES))?);
        }
        let mut dropped = 0;
        for item in run.plan() {
            for method in &run.protocol.methods {
                let name = recording_name(item.pair, item.query, *method, run.pairs.len() > 1);
                let file = format!("{name}.rrd");
                let sources = parts.iter().map(|part| part.join(FAILURES).join(&file));
                let source = sources.into_iter().find(|path| path.exists());
                let size = match &source {
                    Some(source) => fs::metadata(source).map_err(FolderError::io(source))?.len(),
                    None if dropped_in_parts.contains(&name) => u64::MAX,
                    None => continue,
                };
                match source {
                    Some(source) if budget.take(size) => {
                        let copied = fs::copy(&source, folder.join(&file));
                        copied.map_err(FolderError::io(source))?;
                    }
                    _ => {
                        budget.is_full = true;
                        dropped += 1;
                        append_dropped(&folder, &name)?;
                    }
                }
            }
        }
        tell_dropped(dropped, &folder);
        Ok(())
    }
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
        remove_if_there(&path)?;
        if query.request.references.frames.is_empty() {
            return Ok(());
        }
        if self.budget.is_full || self.budget.recordings == 0 {
            self.budget.is_full = true;
            return Ok(self.drop(&name)?);
        }
        if let Err(error) = self.record(query, &path) {
            log::warn!("{error}");
            return Ok(());
        }
        let size = fs::metadata(&path).map_err(FolderError::io(&path))?.len();
        if !self.budget.take(size) {
            remove_if_there(&path)?;
            self.drop(&name)?;
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

fn read_dropped(folder: &Path) -> Result<BTreeSet<String>, FolderError> {
    let path = folder.join(DROPPED);
    match fs::read_to_string(&path) {
        Ok(text) => Ok(text.lines().map(str::to_owned).collect()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(BTreeSet::new()),
        Err(error) => Err(FolderError::io(path)(error)),
    }
}

fn append_dropped(folder: &Path, name: &str) -> Result<(), FolderError> {
    let path = folder.join(DROPPED);
    let file = fs::OpenOptions::new().create(true).append(true).open(&path);
    file.and_then(|mut file| writeln!(file, "{name}"))
        .map_err(FolderError::io(path))
}

fn remove_if_there(path: &Path) -> Result<(), FolderError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(FolderError::io(path)(error))
        }
        _ => Ok(()),
    }
}

fn tell_dropped(dropped: usize, folder: &Path) {
    if dropped > 0 {
        log::warn!(
            "{dropped} failed queries have no recording, for want of room (--max-recordings, \
             --max-recording-mb); {} names them",
            folder.join(DROPPED).display()
        );
    }
}
