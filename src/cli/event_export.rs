//! Writing every event of a run.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use posescope::method::Method;
use posescope::problem::Problem;
use posescope::sink::EventLines;
use posescope::trace::Record;

use super::failure::CliError;

/// A file of events.
pub struct EventExport {
    path: PathBuf,
    lines: EventLines<BufWriter<File>>,
    broken: Option<io::Error>,
}

impl EventExport {
    /// Opens the file before anything is computed.
    pub fn to(path: &Path) -> Result<Self, CliError> {
        let file = File::create(path).map_err(CliError::io(path))?;
        Ok(Self {
            path: path.to_owned(),
            lines: EventLines::to(BufWriter::new(file)),
            broken: None,
        })
    }

    /// Writes an event. The first error is kept, and nothing is written after it.
    pub fn accept(&mut self, record: &Record, problem: &Problem, method: Method) {
        if self.broken.is_none() {
            self.broken = self.lines.write(problem, method, record).err();
        }
    }

    /// Says whether all of it has arrived.
    pub fn close(self) -> Result<(), CliError> {
        let outcome = match self.broken {
            Some(error) => Err(error),
            None => self.lines.close(),
        };
        outcome.map_err(CliError::io(self.path))
    }
}
