//! The stream of a recording: its times, its flushes, its first error.

use std::time::Duration;

use rerun::log::ChunkBatcherConfig;
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, TimeColumn};

use super::encode::Encoded;
use super::entities::{
    APPLICATION_ID, EVAL_TIMELINE, LOCKSTEP_TIMELINE, QUERY_TIMELINE, STEP_TIMELINE,
};
use super::file::RecordingFile;
use super::layout::{self, BlueprintNode};
use super::targets::OpenTargets;
use super::{Identity, RecordError, Targets};

/// Nothing is flushed by time or size. Chunks then end where the run says so, which makes two
/// recordings of one run equal chunk by chunk.
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
    /// A viewer went away while the file is well: what is left goes to the file.
    viewer_lost: bool,
    /// Whether somebody looks on while it grows.
    is_live: bool,
    now: Now,
    /// Layouts that were sent.
    layouts: i64,
}

/// Where a row stands on each timeline.
struct Now {
    query: i64,
    step: i64,
    eval: Option<i64>,
    lockstep: Option<i64>,
}

impl Stream {
    pub(super) fn open(targets: &Targets, identity: &Identity) -> Result<Self, RecordError> {
        let OpenTargets { sinks, file } = targets.open()?;
        let id = identity.recording_id();
        let recording = RecordingStreamBuilder::new(APPLICATION_ID)
            .recording_id(id.as_str())
            .recording_name(identity.recording_name())
            .send_properties(true)
            // Somebody asked for this recording, whatever the environment says.
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
            now: Now {
                query: 0,
                step: -1,
                eval: None,
                lockstep: None,
            },
            layouts: 0,
        })
    }

    /// Sends a layout, which takes the place of the one before.
    pub(super) fn send_layout(&mut self, root: &BlueprintNode) {
        let sent = layout::send(root, &self.id, self.layouts, &self.recording);
        self.layouts += 1;
        self.keep(sent.map_err(|error| unrecordable("the layout", &error)));
    }

    /// Whether somebody looks on while it grows.
    pub(super) fn is_live(&self) -> bool {
        self.is_live
    }

    /// Whether recording on makes sense.
    pub(super) fn is_broken(&self) -> bool {
        self.error.is_some() && !self.viewer_lost
    }

    /// From here on the rows belong to this query.
    pub(super) fn set_query(&mut self, index: usize) {
        self.now.query = index as i64;
    }

    /// From here on the rows belong to this hypothesis, or to none.
    pub(super) fn set_eval(&mut self, eval: Option<i64>) {
        self.now.eval = eval;
    }

    /// From here on the rows belong to this event of its estimator, or to none.
    pub(super) fn set_lockstep(&mut self, event: Option<u64>) {
        self.now.lockstep = event.map(|event| event as i64);
    }

    /// Goes on to the next decision of the timeline.
    pub(super) fn advance(&mut self) {
        self.now.step += 1;
    }

    /// Records something as of now.
    pub(super) fn log(&mut self, path: &str, what: &dyn AsComponents) {
        if self.is_broken() {
            return;
        }
        // Rerun keeps the time per thread, and a run may move to another one.
        self.recording
            .set_time_sequence(QUERY_TIMELINE, self.now.query);
        self.recording
            .set_time_sequence(STEP_TIMELINE, self.now.step);
        for (timeline, time) in [
            (EVAL_TIMELINE, self.now.eval),
            (LOCKSTEP_TIMELINE, self.now.lockstep),
        ] {
            match time {
                Some(time) => self.recording.set_time_sequence(timeline, time),
                None => self.recording.disable_timeline(timeline),
            }
        }
        let told = self.recording.log(path, what);
        self.keep(told.map_err(|error| unrecordable(path, &error)));
    }

    /// Records an image as of now.
    pub(super) fn log_image(&mut self, path: &str, image: Encoded) {
        match image {
            Ok(image) => self.log(path, &image),
            Err(error) => self.keep(Err(unrecordable(path, &error))),
        }
    }

    /// Records something that holds at all times.
    pub(super) fn log_static(&mut self, path: &str, what: &dyn AsComponents) {
        let told = self.recording.log_static(path, what);
        self.keep(told.map_err(|error| unrecordable(path, &error)));
    }

    /// Records one number per hypothesis, at once. They have no step: thousands of them would stand
    /// at the same one.
    pub(super) fn log_scalars(&mut self, path: &str, rows: &[(i64, f64)]) {
        if rows.is_empty() || self.is_broken() {
            return;
        }
        let times = [
            TimeColumn::new_sequence(QUERY_TIMELINE, rows.iter().map(|_| self.now.query)),
            TimeColumn::new_sequence(EVAL_TIMELINE, rows.iter().map(|row| row.0)),
        ];
        let told = rerun::Scalars::new(rows.iter().map(|row| row.1))
            .columns_of_unit_batches()
            .map_err(Into::into)
            .and_then(|columns| self.recording.send_columns(path, times, columns));
        self.keep(told.map_err(|error| unrecordable(path, &error)));
    }

    /// Hands what was recorded so far to the targets, so that a killed run leaves it behind.
    pub(super) fn flush(&mut self) {
        let flushed = self.recording.flush_async();
        self.keep(flushed.map_err(|error| RecordError::Viewer(error.to_string())));
        self.ask_file();
    }

    /// Hands out what was recorded as [`Self::flush`] does, and waits until the targets have it.
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

    /// The end of the recording, with the first error of its life.
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

    fn keep(&mut self, told: Result<(), RecordError>) {
        if let Err(error) = told {
            self.error.get_or_insert(error);
        }
    }
}

fn unrecordable(what: &str, error: &dyn std::error::Error) -> RecordError {
    RecordError::Encode {
        what: what.to_owned(),
        message: error.to_string(),
    }
}
