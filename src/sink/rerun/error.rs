//! Errors of recordings.

use std::io;
use std::path::PathBuf;

/// Why a recording cannot be made or is incomplete.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be created.
    #[error("cannot create the recording {}: {source}", path.display())]
    Create {
        /// The file of the recording.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file was created but could not be written to its end.
    #[error("the recording {} is incomplete: {message}", path.display())]
    Incomplete {
        /// The file of the recording.
        path: PathBuf,
        /// What went wrong.
        message: String,
    },
    /// The URL is not one of a viewer.
    #[error("cannot connect to `{url}`: {message}")]
    Address {
        /// The URL.
        url: String,
        /// The error.
        message: String,
    },
    /// No viewer could be started.
    #[error("cannot start a Rerun viewer: {0}")]
    Spawn(String),
    /// The thread of the recorder could not be started.
    #[error("cannot start the recorder's thread: {0}")]
    Thread(#[source] io::Error),
    /// A viewer did not take the recording.
    #[error("the viewer did not receive the whole recording: {0}")]
    Viewer(String),
    /// Something could not be encoded.
    #[error("cannot record {what}: {message}")]
    Encode {
        /// The thing to record.
        what: String,
        /// What went wrong.
        message: String,
    },
}
