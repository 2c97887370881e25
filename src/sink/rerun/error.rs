//! Why there is no recording, or not a whole one.

use std::io;
use std::path::PathBuf;

/// Why there is no recording, or not a whole one.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be created.
    #[error("cannot create the recording {}: {source}", path.display())]
    Create {
        /// The file of the recording.
        path: PathBuf,
        /// What the system said.
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
    /// The URL is not that of a viewer.
    #[error("cannot connect to `{url}`: {message}")]
    Address {
        /// The URL.
        url: String,
        /// What is wrong with it.
        message: String,
    },
    /// No viewer could be started.
    #[error("cannot start a Rerun viewer: {0}")]
    Spawn(String),
    /// Nothing can be recorded beside the run.
    #[error("cannot start the thread that records: {0}")]
    Thread(#[source] io::Error),
    /// A viewer did not take the recording.
    #[error("the viewer did not receive the whole recording: {0}")]
    Viewer(String),
    /// Something could not be put into the form of a recording.
    #[error("cannot record {what}: {message}")]
    Encode {
        /// The thing that was to be recorded.
        what: String,
        /// What went wrong.
        message: String,
    },
}
