//! A connection to a viewer.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, LogSink, SinkFlushError};

/// A connection that is closed at its first failure.
///
/// Rerun's own sink keeps trying: every flush would wait a second, and delay the run and the recording file.
pub(super) struct Viewer {
    connection: GrpcSink,
    lost: Mutex<Option<String>>,
}

impl Viewer {
    pub(super) fn new(connection: GrpcSink) -> Self {
        Self { connection, lost: Mutex::default() }
    }

    fn lost(&self) -> MutexGuard<'_, Option<String>> {
        self.lost.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LogSink for Viewer {
    fn send(&self, message: LogMsg) {
        if self.lost().is_none() {
            self.connection.send(message);
        }
    }

    fn flush_blocking(&self, timeout: Duration) -> Result<(), SinkFlushError> {
        let mut lost = self.lost();
        if let Some(reason) = &*lost {
            return Err(SinkFlushError::failed(reason.clone()));
        }
        let flushed = self.connection.flush_blocking(timeout);
        *lost = flushed.as_ref().err().map(ToString::to_string);
        flushed
    }
}
