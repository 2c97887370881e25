//! What can be wrong with an index: one clear line each.

use std::io;
use std::path::PathBuf;

/// An index that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IndexError {
    /// There is no file.
    #[error("{}: the retrieval index does not exist", .path.display())]
    NotFound {
        /// Where the index should be.
        path: PathBuf,
    },
    /// A file that cannot be opened or read.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file of another kind.
    #[error("{}: not a retrieval index", .path.display())]
    NotAnIndex {
        /// The file.
        path: PathBuf,
    },
    /// A layout that this version does not read.
    #[error("{}: the retrieval index has layout {found} instead of {expected}", .path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The layout of the file.
        found: u8,
        /// The layout that is read.
        expected: u8,
    },
    /// Bytes that were not written so.
    #[error("{}: the retrieval index is damaged ({what})", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// How the damage shows.
        what: &'static str,
    },
    /// An index of something else.
    #[error("{}: the retrieval index is stale: {why}", .path.display())]
    Stale {
        /// The file.
        path: PathBuf,
        /// What differs from what is asked for.
        why: String,
    },
}

/// Why no index could be built; `E` is what went wrong with a frame.
#[derive(Debug, thiserror::Error)]
pub enum BuildError<E: std::error::Error + 'static> {
    /// A frame without features to be had.
    #[error(transparent)]
    Frame(E),
    /// A vocabulary larger than what it would be learnt from.
    #[error(
        "{found} descriptors are too few for a vocabulary of {words} words; at most {} words are possible",
        (.found / 10).max(1)
    )]
    TooFewDescriptors {
        /// Descriptors of all frames.
        found: u64,
        /// Words asked for.
        words: usize,
    },
    /// A file that cannot be written.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}
