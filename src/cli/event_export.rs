//! The file of `--events`.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use posescope::method::Method;
use posescope::problem::Problem;
use posescope::sink::{SceneNames, write_event};
use posescope::trace::Record;

use super::failure::CliError;

/// A file of events that gets whole queries only: a query that is interrupted and repeated on resuming is
/// written once.
pub struct EventExport {
    path: PathBuf,
    file: File,
    scenes: SceneNames,
    /// The events of the current query.
    lines: Vec<u8>,
    broken: Option<io::Error>,
}

impl EventExport {
    /// Opens an empty file, before anything is computed.
    pub fn to(path: &Path) -> Result<Self, CliError> {
        let export = Self::after(path)?;
        export.clear()?;
        Ok(export)
    }

    /// Appends to the file.
    pub fn after(path: &Path) -> Result<Self, CliError> {
        let file = OpenOptions::new().create(true).append(true).open(path);
        Ok(Self {
            path: path.to_owned(),
            file: file.map_err(CliError::io(path))?,
            scenes: SceneNames::default(),
            lines: Vec::new(),
            broken: None,
        })
    }

    /// Empties the file. A file that cannot be truncated, such as a pipe, is empty already.
    pub fn clear(&self) -> Result<(), CliError> {
        let is_file = |meta: fs::Metadata| meta.is_file();
        if self.file.metadata().is_ok_and(is_file) {
            self.file.set_len(0).map_err(CliError::io(&self.path))
        } else {
            Ok(())
        }
    }

    /// Sets the scenes of the following events.
    pub fn name_scenes(&mut self, scenes: SceneNames) {
        self.scenes = scenes;
    }

    /// Adds an event. After the first error, which is kept, events are ignored.
    pub fn accept(&mut self, record: &Record, problem: &Problem, method: Method) {
        if self.broken.is_none() {
            let written = write_event(&mut self.lines, &self.scenes, problem, method, record);
            self.broken = written.err();
        }
    }

    /// Writes the events of the current query, which is done.
    pub fn end_query(&mut self) {
        let lines = std::mem::take(&mut self.lines);
        if self.broken.is_none() {
            self.broken = self.file.write_all(&lines).err();
        }
    }

    /// The first error, if any. A query that is not done is left out.
    pub fn close(self) -> Result<(), CliError> {
        match self.broken {
            Some(error) => Err(CliError::io(self.path)(error)),
            None => Ok(()),
        }
    }
}
