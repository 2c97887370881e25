//! What can be wrong with a scene: one clear line each, with file, place and what was expected.

use std::io;
use std::path::{Path, PathBuf};

/// A scene that cannot be used as asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Neither a folder nor a built-in scene.
    #[error("{argument}: no such file or folder; a path expected, or the built-in scene street")]
    NotFound {
        /// The scene argument.
        argument: String,
    },
    /// A folder of no known layout.
    #[error("{argument}: not recognised as any of the formats {known}; {hint}")]
    NotRecognized {
        /// The scene argument.
        argument: String,
        /// Names of all formats.
        known: String,
        /// What to try instead.
        hint: String,
    },
    /// `--format` with an unknown name.
    #[error("--format {format}: one of {known} expected")]
    UnknownFormat {
        /// The format as it was given.
        format: String,
        /// Names of all formats.
        known: String,
    },
    /// The street in a condition that it does not have.
    #[error("{argument}: one of the conditions {known} expected after street:")]
    UnknownCondition {
        /// The scene argument.
        argument: String,
        /// Names of all conditions.
        known: String,
    },
    /// A file that cannot be opened, read or written.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// An image that cannot be decoded.
    #[error("{}: {source}", .path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// What the decoder says.
        source: image::ImageError,
    },
    /// A file whose content is not what its format asks for.
    #[error("{}: {expected}", .path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What was expected and what was found.
        expected: String,
    },
    /// A line of a text file that is not what its format asks for.
    #[error("{}:{line}: {expected}", .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What was expected and what was found.
        expected: String,
    },
    /// No frame of this name.
    #[error("{scene}: no frame `{frame}`; frames: {known}")]
    UnknownFrame {
        /// The scene's name.
        scene: String,
        /// The frame as it was given.
        frame: String,
        /// Which frames there are.
        known: String,
    },
    /// Several frames fit a name.
    #[error("{scene}: frame `{frame}` may be {known}; name one of them")]
    SeveralFrames {
        /// The scene's name.
        scene: String,
        /// The frame as it was given.
        frame: String,
        /// Which frames fit.
        known: String,
    },
    /// A frame without a pose cannot be a reference.
    #[error("{scene}: frame {frame} has no pose, so it cannot be a reference")]
    NoPose {
        /// The scene's name.
        scene: String,
        /// The frame.
        frame: String,
    },
    /// A frame without a cloud cannot be a reference.
    #[error(
        "{}: frame {frame} has no cloud, so it cannot be a reference; {hint}",
        .path.display()
    )]
    NoCloud {
        /// Where the scan should be.
        path: PathBuf,
        /// The frame.
        frame: String,
        /// Which frames have one.
        hint: String,
    },
}

impl SceneError {
    /// The error of a file that cannot be opened, read or written, for `map_err`.
    pub fn io(path: &Path) -> impl Fn(io::Error) -> Self + Copy + '_ {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    /// The error of an image that cannot be decoded or encoded, for `map_err`.
    pub fn image(path: &Path) -> impl Fn(image::ImageError) -> Self + Copy + '_ {
        move |source| Self::Image { path: path.to_owned(), source }
    }

    /// The error of a file with other content than `expected` says.
    pub fn expected(path: impl Into<PathBuf>, expected: impl Into<String>) -> Self {
        Self::Content { path: path.into(), expected: expected.into() }
    }

    /// The error of a line, counted from 1, that is not as `expected`.
    pub fn line(path: impl Into<PathBuf>, line: usize, expected: impl Into<String>) -> Self {
        Self::Line { path: path.into(), line, expected: expected.into() }
    }
}
