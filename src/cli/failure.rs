//! Errors of the command line and their exit codes.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use image::ImageError;
use posescope::describe::ParamError;
use posescope::lesson::{LessonError, SettingError};
use posescope::localize::ChoiceError;
use posescope::measure::KnownError;
use posescope::run::{DrawError, FolderError, ProtocolError, RunError};
use posescope::scene::{NoIndex, SceneError};
use posescope::session::JobError;
use posescope::sink::rerun::RecordError;
use posescope::trace::Cancelled;

const DONE: u8 = 0;
const NOT_GOOD_ENOUGH: u8 = 1;
const USAGE: u8 = 2;
const BAD_DATA: u8 = 3;
/// There is no graphics card that was asked for, or it failed.
const NO_GPU: u8 = 5;
/// What shells say of a process that Ctrl-C ended.
const INTERRUPTED: u8 = 130;
/// The exit code of a panic.
pub const INTERNAL: u8 = 4;

/// Anything that ends a command early, as one line.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    #[error("{0}")]
    Usage(String),
    #[error(transparent)]
    Param(#[from] ParamError),
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{}: {source}", .path.display())]
    Config { path: PathBuf, source: ParamError },
    #[error("{}: {source}", .path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("{0}")]
    NoReference(String),
    #[error(transparent)]
    Index(#[from] NoIndex),
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    #[error(transparent)]
    Folder(#[from] FolderError),
    #[error(transparent)]
    Known(#[from] KnownError),
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Job(#[from] JobError),
    #[error(transparent)]
    Lesson(#[from] LessonError),
    #[error(transparent)]
    LessonSetting(#[from] SettingError),
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] posescope_gpu::GpuError),
    #[cfg(not(feature = "gpu"))]
    #[error("this program was built without the feature `gpu`, which --compute gpu needs")]
    NoGpu,
    /// There is nothing to draw with, or no room for the picture.
    #[cfg(feature = "app")]
    #[error("{0}")]
    Picture(String),
    /// A gate or a comparison says no.
    #[error("{0}")]
    NotGoodEnough(String),
    /// A scene that cannot work, or has a mistake in it.
    #[error("{0}")]
    Unhealthy(String),
    /// Somebody pressed Ctrl-C; what was done until then is kept.
    #[error("stopped by Ctrl-C; {0}")]
    Interrupted(String),
    /// A breakpoint ended the run: what was asked for.
    #[error("{0}")]
    Stopped(#[from] Cancelled),
    /// Whoever read our stdout, such as `head`, has seen enough: not an error.
    #[error("nobody reads the output any more")]
    ReaderGone,
}

impl CliError {
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        |source| Self::Io { path, source }
    }

    /// The error of a picture that cannot be written.
    pub fn image(path: &Path) -> impl FnOnce(ImageError) -> Self {
        move |error| {
            Self::io(path)(match error {
                ImageError::IoError(error) => error,
                other => io::Error::other(other),
            })
        }
    }

    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::ReaderGone | Self::Stopped(_) | Self::Choice(ChoiceError::Cancelled(_)) => DONE,
            Self::NotGoodEnough(_) => NOT_GOOD_ENOUGH,
            Self::Usage(_)
            | Self::Param(_)
            | Self::Protocol(_)
            | Self::Index(NoIndex::NoFolder)
            | Self::Choice(ChoiceError::UnknownPosition { .. } | ChoiceError::NoIndex)
            | Self::Draw(DrawError::NotDrawn { .. })
            | Self::Folder(
                FolderError::NotEmpty { .. }
                | FolderError::OtherRun { .. }
                | FolderError::InUse { .. },
            )
            | Self::Lesson(LessonError::Unknown { .. })
            | Self::Scene(SceneError::UnknownFormat { .. }) => USAGE,
            #[cfg(feature = "gpu")]
            Self::Gpu(_) => NO_GPU,
            #[cfg(not(feature = "gpu"))]
            Self::NoGpu => NO_GPU,
            Self::Interrupted(_) => INTERRUPTED,
            // What is left cannot be read or written.
            _ => BAD_DATA,
        })
    }
}

impl From<RunError> for CliError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Scene(error) => error.into(),
            RunError::Choice(error) => error.into(),
            RunError::Cancelled(cancelled) => Self::Stopped(cancelled),
            RunError::Folder(error) => error.into(),
        }
    }
}

/// A panic is a bug of ours: it is told in one line that says where, and ends with its own code.
pub fn report_panics_in_one_line() {
    std::panic::set_hook(Box::new(|panic| {
        let message = panic
            .payload_as_str()
            .unwrap_or("no message")
            .replace('\n', " ");
        let place = panic
            .location()
            .map(|location| format!("{}:{}", location.file(), location.line()))
            .unwrap_or_default();
        eprintln!(
            "posescope: internal error at {place}: {message}; this is a bug, please report it"
        );
    }));
}
