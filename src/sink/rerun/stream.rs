//! The stream of a recording: timelines, flushes and the first error.

use std::time::Duration;

use rerun::log::ChunkBatcherConfig;
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, TimeColumn};

use super::encode::Encoded;
use super::entities::{
    APPLICATION_ID, EVAL_TIMELINE, LOCKSTEP_TIMELINE, QUERY_TIMELINE, STEP_TIMELINE,
};
use super::file::RecordingFile;
use super::layout::{self, BlueprintNode};
use super::{Identity, RecordError, Targets};

/// Nothing is flushed by time or size. The run determines the chunks, so two recordings of one run are equal chunk by
/// chunk.
const BATCHER: ChunkBatcherConfig = ChunkBatcherConfig {
    flush_tick: Duration::MAX,
    flush_num_bytes: u64::MAX,
    flush_num_rows: u64::MAX,
    ..ChunkBatcherConfig::DEFAULT
};

/// A Rerun stream that never fails: it keeps its first error for the end.
pub(super) struct Stream {
    id: String,
    recording: RecordingStream,
    file: Option<RecordingFile>,
    error: Option<RecordError>,
    /// The viewer is lost but the file is intact: recording continues to the file.
    viewer_lost: bool,
    /// Whether a viewer shows the recording while it grows.
    is_live: bool,
    now: Now,
    /// The number of layouts sent.
    layouts: i64,
}

/// The time of a row on each timeline.
#[derive(Clone, Copy)]
pub(super) struct Now {
    query: i64,
    step: i64,
    eval: Option<i64>,
    lockstep: Option<i64>,
}

impl Stream {
    pub(super) fn open(targets: &Targets, identity: &Identity) -> Result<Self, RecordError> {
        let (sinks, file) = targets.open()?;
        let id = identity.recording_id();
        let recording = RecordingStreamBuilder::new(APPLICATION_ID)
            .recording_id(id.as_str())
            .recording_name(identity.recording_name())
            .send_properties(true)
            // The recording was requested, whatever the environment says.
            .enabled(true)
            .batcher_config(BATCHER)
            .set_sinks(sinks)
            .map_err(|error| unrecordable("anything", &error))?;
        Ok(Self {
            id,
            recording,
            file,
            error: None,
            viewer_lost: false,
            is_live: targets.connect.is_some() || targets.spawn,
            now: Now { query: 0, step: -1, eval: None, lockstep: None },
            layouts: 0,
        })
    }

    /// Sends a layout, which replaces the previous one.
    pub(super) fn send_layout(&mut self, root: &BlueprintNode) {
        let sent = layout::send(root, &self.id, self.layouts, &self.recording);
        self.layouts += 1;
        self.keep(sent.map_err(|error| unrecordable("the layout", &error)));
    }

    /// Whether a viewer shows the recording while it grows.
    pub(super) fn is_live(&self) -> bool {
        self.is_live
    }

    /// Whether the recording has failed.
    pub(super) fn is_broken(&self) -> bool {
        self.error.is_some() && !self.viewer_lost
    }

    /// Following rows belong to this query.
    pub(super) fn set_query(&mut self, index: usize) {
        self.now.query = index as i64;
    }

    /// Following rows belong to this hypothesis, or to none.
    pub(super) fn set_eval(&mut self, eval: Option<i64>) {
        self.now.eval = eval;
    }

    /// Following rows belong to this event of its estimator, or to none.
    pub(super) fn set_lockstep(&mut self, event: Option<u64>) {
        self.now.lockstep = event.map(|event| event as i64);
    }

    /// Advances to the next decision.
    pub(super) fn advance(&mut self) {
        self.now.step += 1;
    }

    /// The current time.
    pub(super) fn now(&self) -> Now {
        self.now
    }

    /// Records something at an earlier time.
    pub(super) fn log_at(&mut self, time: Now, path: &str, what: &dyn AsComponents) {
        let now = std::mem::replace(&mut self.now, time);
        self.log(path, what);
        self.now = now;
    }

    /// Records something at the current time.
    pub(super) fn log(&mut self, path: &str, what: &dyn AsComponents) {
        if self.is_broken() {
            return;
        }
        // Rerun keeps the time per thread, and a run may move to another one.
        self.recording.set_time_sequence(QUERY_TIMELINE, self.now.query);
        self.recording.set_time_sequence(STEP_TIMELINE, self.now.step);
        for (timeline, time) in
            [(EVAL_TIMELINE, self.now.eval), (LOCKSTEP_TIMELINE, self.now.lockstep)]
        {
            match time {
                Some(time) => self.recording.set_time_sequence(timeline, time),
                None => self.recording.disable_timeline(timeline),
            }
        }
        let logged = self.recording.log(path, what);
        self.keep(logged.map_err(|error| unrecordable(path, &error)));
    }

    /// Records an image at the current time.
    pub(super) fn log_image(&mut self, path: &str, image: Encoded) {
        match image {
            Ok(image) => self.log(path, &image),
            Err(error) => self.keep(Err(unrecordable(path, &error))),
        }
    }

    /// Records something for all times.
    pub(super) fn log_static(&mut self, path: &str, what: &dyn AsComponents) {
        let logged = self.recording.log_static(path, what);
        self.keep(logged.map_err(|error| unrecordable(path, &error)));
    }

    /// Records one number per hypothesis in one batch, which is empty then. They have no step: thousands would share
    /// the same one.
    pub(super) fn log_scalars(&mut self, path: &str, rows: &mut Vec<(i64, f64)>) {
        let rows = std::mem::take(rows);
        if rows.is_empty() || self.is_broken() {
            return;
        }
        let times = [
            TimeColumn::new_sequence(QUERY_TIMELINE, rows.iter().map(|_| self.now.query)),
            TimeColumn::new_sequence(EVAL_TIMELINE, rows.iter().map(|row| row.0)),
        ];
        let logged = rerun::Scalars::new(rows.iter().map(|row| row.1))
            .columns_of_unit_batches()
            .map_err(Into::into)
            .and_then(|columns| self.recording.send_columns(path, times, columns));
        self.keep(logged.map_err(|error| unrecordable(path, &error)));
    }

    /// Sends everything recorded so far to the targets, where it survives a killed run.
    pub(super) fn flush(&mut self) {
        let flushed = self.recording.flush_async();
        self.keep(flushed.map_err(|error| RecordError::Viewer(error.to_string())));
        self.ask_file();
    }

    /// Like [`Self::flush`], and waits until the targets have received it.
    pub(super) fn flush_blocking(&mut self) {
        let flushed = self.recording.flush_blocking();
        self.ask_file();
        if let Err(error) = flushed
            && self.error.is_none()
        {
            self.viewer_lost = self.file.is_some();
            self.error = Some(RecordError::Viewer(error.to_string()));
        }
    }

    /// Closes the recording, and returns its first error.
    pub(super) fn close(mut self) -> Result<(), RecordError> {
        self.flush_blocking();
        let finished = self.file.as_ref().map_or(Ok(()), RecordingFile::finish);
        self.error.map_or(finished, Err)
    }

    fn ask_file(&mut self) {
        let broken = self.file.as_ref().and_then(RecordingFile::error);
        if let Some(error) = broken {
            self.viewer_lost = false;
            self.keep(Err(error));
        }
    }

    fn keep(&mut self, logged: Result<(), RecordError>) {
        if let Err(error) = logged {
            self.error.get_or_insert(error);
        }
    }
}

fn unrecordable(what: &str, error: &dyn std::error::Error) -> RecordError {
    RecordError::Encode { what: what.to_owned(), message: error.to_string() }
}
