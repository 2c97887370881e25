//! Errors of the command line and their exit codes.

use std::io;
use std::path::{Path, PathBuf};

use image::ImageError;
use posescope::lesson::{LessonError, SettingError};
use posescope::localize::{ChoiceError, Selection};
use posescope::run::{
    ConfigError, DrawError, FolderError, OutputError, PlanError, ProtocolError, Refusal, RunError,
    SurveyError,
};
use posescope::scene::{NoIndex, SceneError, is_decoding};
use posescope::session::JobError;
use posescope::sink::rerun::RecordError;
use posescope::survey::SurveyingError;
use posescope::trace::Cancelled;

use super::compute::ComputeError;
use super::stderr::tell;

pub const DONE: u8 = 0;
const NOT_GOOD_ENOUGH: u8 = 1;
pub const USAGE: u8 = 2;
const BAD_DATA: u8 = 3;
/// The requested graphics card is missing or failed.
const NO_GPU: u8 = 5;
/// The shells' exit code of a process that Ctrl-C ended.
const INTERRUPTED: u8 = 130;
/// The exit code of a panic.
pub const INTERNAL: u8 = 4;

/// What else may be meant by a frame that is not there: a way of choosing references, without its number.
fn about_choosing(error: &SceneError) -> String {
    match error {
        SceneError::UnknownFrame { frame, .. } if Selection::is_name(frame) => {
            format!("; `{frame}:1` chooses a reference in this way")
        }
        _ => String::new(),
    }
}

/// An error that ends a command. It prints as one line.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    #[error("{0}")]
    Usage(String),
    /// What clap says of arguments, or the help that they ask for; it is printed as it is.
    #[error(transparent)]
    Arguments(#[from] clap::Error),
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Refused(#[from] Refusal),
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    #[error("{0}{hint}", hint = about_choosing(.0))]
    Scene(#[from] SceneError),
    #[error("{}: {source}", .path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Index(#[from] NoIndex),
    #[error(transparent)]
    Survey(#[from] SurveyError),
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    #[error(transparent)]
    Folder(#[from] FolderError),
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
    #[error(transparent)]
    Gpu(#[from] ComputeError),
    /// A gate or a comparison failed.
    #[error("{0}")]
    NotGoodEnough(String),
    /// A scene is unusable or has no reference, or a picture cannot be drawn or saved.
    #[error("{0}")]
    Unusable(String),
    /// The user pressed Ctrl-C; finished work is kept.
    #[error("stopped by Ctrl-C; {0}")]
    Interrupted(String),
    /// A breakpoint ended the run, as requested.
    #[error("{0}")]
    Stopped(#[from] Cancelled),
    /// The reader of our stdout, such as `head`, closed it: not an error.
    #[error("the output was closed (broken pipe)")]
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

    pub fn exit_code(&self) -> u8 {
        match self {
            Self::ReaderGone | Self::Stopped(_) | Self::Choice(ChoiceError::Cancelled(_)) => DONE,
            Self::NotGoodEnough(_) => NOT_GOOD_ENOUGH,
            Self::Usage(_)
            | Self::Arguments(_)
            | Self::Config(ConfigError::Param(_))
            | Self::Output(_)
            | Self::Refused(_)
            | Self::Protocol(_)
            | Self::Index(NoIndex::NoFolder)
            | Self::Survey(SurveyError::Scenes(_))
            | Self::Choice(ChoiceError::UnknownPosition { .. } | ChoiceError::NoIndex)
            | Self::Draw(DrawError::NotDrawn { .. })
            | Self::Folder(
                FolderError::NotEmpty { .. } | FolderError::OtherRun { .. } | FolderError::InUse(_),
            )
            | Self::Lesson(LessonError::Unknown { .. })
            | Self::Scene(SceneError::UnknownFormat { .. }) => USAGE,
            Self::Gpu(_) => NO_GPU,
            Self::Interrupted(_) => INTERRUPTED,
            // What the arguments name is missing, unusable, or cannot be written.
            Self::Scene(_)
            | Self::Config(_)
            | Self::Io { .. }
            | Self::Index(_)
            | Self::Survey(_)
            | Self::Choice(_)
            | Self::Folder(_)
            | Self::Draw(_)
            | Self::Record(_)
            | Self::Job(_)
            | Self::Lesson(_)
            | Self::LessonSetting(_)
            | Self::Unusable(_) => BAD_DATA,
        }
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

impl From<PlanError> for CliError {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::Protocol(error) => error.into(),
            PlanError::Config(error) => error.into(),
            PlanError::Scene(error) => error.into(),
            PlanError::Draw(error) => error.into(),
            PlanError::Folder(error) => error.into(),
            PlanError::Index(error) => error.into(),
            PlanError::Survey(error) => error.into(),
            PlanError::Output(error) => error.into(),
            PlanError::Refused(error) => error.into(),
        }
    }
}

impl From<SurveyingError> for CliError {
    fn from(error: SurveyingError) -> Self {
        match error {
            SurveyingError::Plan(error) => error.into(),
            SurveyingError::Run(error) => error.into(),
            SurveyingError::Folder(error) => error.into(),
            SurveyingError::Survey(error) => error.into(),
            SurveyingError::Alone { .. } => Self::Unusable(error.to_string()),
        }
    }
}

/// Reports a panic, which is a bug, in one line with its location.
pub fn report_panics_in_one_line() {
    std::panic::set_hook(Box::new(|panic| {
        if is_decoding() {
            return;
        }
        let message = panic.payload_as_str().unwrap_or("no message").replace('\n', " ");
        let place = panic
            .location()
            .map(|location| format!("{}:{}", location.file(), location.line()))
            .unwrap_or_default();
        tell(&format!(
            "posescope: internal error at {place}: {message}; this is a bug, please report it"
        ));
    }));
}
