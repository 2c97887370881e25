//! A program that runs a command within itself, without a terminal.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Parser as _;
use indicatif::ProgressBar;
use posescope::scene::SceneError;

use super::args::{Arguments, Command};
use super::failure::CliError;
use super::interrupt::Interrupt;
use super::terminal::Terminal;
use super::{compute, eval};

/// How another program follows a command, and stops it. The command prints nothing and handles no signal.
#[derive(Clone, Debug)]
pub struct Host {
    pub(super) interrupt: Interrupt,
    pub(super) bar: ProgressBar,
}

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

impl Default for Host {
    fn default() -> Self {
        Self { interrupt: Interrupt::silent(), bar: ProgressBar::hidden() }
    }
}

impl Host {
    /// Stops the command as Ctrl-C does.
    pub fn stop(&self) {
        self.interrupt.raise();
    }

    /// How many queries are done, and of how many; 0 before their number is known.
    pub fn progress(&self) -> (u64, u64) {
        (self.bar.position(), self.bar.length().unwrap_or(0))
    }

    /// Runs `posescope eval` with these arguments and returns the run folder.
    ///
    /// # Errors
    /// What the program would print, with its exit code. After exit code 1, the folder is complete.
    pub fn eval(&self, arguments: Vec<OsString>) -> Result<PathBuf, CommandError> {
        self.try_eval(arguments).map_err(|error| CommandError {
            exit_code: error.exit_code(),
            message: error.to_string().trim().replace('\n', " "),
            scene: match error {
                CliError::Scene(error) => Some(error),
                _ => None,
            },
        })
    }

    fn try_eval(&self, arguments: Vec<OsString>) -> Result<PathBuf, CliError> {
        let program = ["posescope", "eval"].map(OsString::from);
        let parsed = Arguments::try_parse_from(program.into_iter().chain(arguments))?;
        let Some(Command::Eval(args)) = parsed.command else {
            return Err(CliError::Usage("options of `posescope eval` expected".to_owned()));
        };
        let terminal = Terminal::hosted(self.clone());
        compute::with(parsed.everywhere.compute, || eval::eval(&args, &terminal))?;
        eval::folder(&args)
    }
}
