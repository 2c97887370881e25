//! The file that a recording is saved to.
//!
//! Rerun's file sink writes on its own thread and only logs errors there, such as a full disk or a footer that
//! could not be written. This one keeps the first error.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{EncodeError, Encoder, EncodingOptions};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

use super::error::RecordError;

/// A recording file; clones write to the same file.
#[derive(Clone)]
pub(super) struct RecordingFile {
    path: PathBuf,
    writer: Arc<Mutex<Writer>>,
}

enum Writer {
    Open(Encoder<File>),
    Broken(String),
    Finished,
}

impl RecordingFile {
    /// Creates or replaces the file, and writes its header.
    pub(super) fn create(path: &Path) -> Result<Self, RecordError> {
        let refused = |source: io::Error| RecordError::Create { path: path.to_owned(), source };
        let file = File::create(path).map_err(refused)?;
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let encoder = Encoder::new_eager(CrateVersion::LOCAL, options, file)
            .map_err(|error| refused(into_io(error)))?;
        Ok(Self { path: path.to_owned(), writer: Arc::new(Mutex::new(Writer::Open(encoder))) })
    }

    /// The error, if any.
    pub(super) fn error(&self) -> Option<RecordError> {
        match &*self.writer() {
            Writer::Broken(message) => Some(self.incomplete(message.clone())),
            Writer::Open(_) | Writer::Finished => None,
        }
    }

    /// Writes the footer and syncs the file to disk.
    pub(super) fn finish(&self) -> Result<(), RecordError> {
        let mut writer = self.writer();
        match std::mem::replace(&mut *writer, Writer::Finished) {
            Writer::Open(encoder) => finish(encoder).map_err(|error| self.incomplete(error)),
            Writer::Broken(message) => Err(self.incomplete(message)),
            Writer::Finished => Ok(()),
        }
    }

    fn incomplete(&self, message: String) -> RecordError {
        RecordError::Incomplete { path: self.path.clone(), message }
    }

    fn writer(&self) -> MutexGuard<'_, Writer> {
        self.writer.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn finish(mut encoder: Encoder<File>) -> Result<(), String> {
    let written = encoder.finish().map_err(into_io);
    let mut file = encoder.into_inner().map_err(|error| error.to_string())?;
    written
        .and_then(|()| file.flush())
        // Some file systems report a full disk only here. A pipe or another special file cannot be synced.
        .and_then(|()| match file.sync_all() {
            Err(error) if error.kind() != io::ErrorKind::InvalidInput => Err(error),
            _ => Ok(()),
        })
        .map_err(|error| error.to_string())
}

/// The bare cause, so a message does not contain "failed to write" twice.
fn into_io(error: EncodeError) -> io::Error {
    match error {
        EncodeError::Write(error) => error,
        other => io::Error::other(other),
    }
}

impl LogSink for RecordingFile {
    fn send(&self, message: LogMsg) {
        let mut writer = self.writer();
        if let Writer::Open(encoder) = &mut *writer
            && let Err(error) = encoder.append(&message)
        {
            // A footer after a torn message is useless.
            encoder.do_not_emit_footer();
            *writer = Writer::Broken(into_io(error).to_string());
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        match self.error() {
            Some(error) => Err(SinkFlushError::failed(error.to_string())),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_broke_a_file_is_told_at_every_flush_and_at_the_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = RecordingFile::create(&folder.path().join("run.rrd")).expect("writable");
        assert!(file.flush_blocking(Duration::ZERO).is_ok());
        *file.writer() = Writer::Broken("no room".to_owned());
        assert!(file.flush_blocking(Duration::ZERO).is_err());
        let message = file.finish().expect_err("it is broken").to_string();
        assert!(message.ends_with("run.rrd is incomplete: no room"), "{message}");
    }
}
