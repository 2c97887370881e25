//! Commands within another program.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Parser as _;
use posescope::scene::SceneError;

use super::args::{Arguments, Command};
use super::failure::CliError;
use super::host::Host;
use super::terminal::Terminal;
use super::{compute, eval};

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct CommandError {
    /// The exit code of the program.
    pub exit_code: u8,
    /// The message, on one line.
    pub message: String,
    /// The file or scene that cannot be used.
    pub scene: Option<SceneError>,
}

impl From<CliError> for CommandError {
    fn from(error: CliError) -> Self {
        Self {
            exit_code: error.exit_code(),
            message: error.to_string().trim().replace('\n', " "),
            scene: match error {
                CliError::Scene(error) => Some(error),
                _ => None,
            },
        }
    }
}

/// Runs `posescope eval` with these arguments and returns the run folder.
///
/// # Errors
/// What the program would print, with its exit code. After exit code 1, the folder is complete.
pub fn evaluate(arguments: Vec<OsString>, host: &Host) -> Result<PathBuf, CommandError> {
    let program = ["posescope", "eval"].map(OsString::from);
    let parsed = Arguments::try_parse_from(program.into_iter().chain(arguments));
    let parsed = parsed.map_err(CliError::from)?;
    let Some(Command::Eval(args)) = parsed.command else {
        return Err(CliError::Usage("options of `posescope eval` expected".to_owned()).into());
    };
    let terminal = Terminal::hosted(host.clone());
    compute::with(parsed.everywhere.compute, || eval::eval(&args, &terminal))?;
    Ok(eval::folder(&args)?)
}
