//! Writing every event of a run.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use posescope::method::Method;
use posescope::problem::Problem;
use posescope::sink::{SceneNames, write_event};
use posescope::trace::Record;

use super::failure::CliError;

/// A file of events, into which queries come whole: one that is interrupted in a run that goes on later is
/// told once.
pub struct EventExport {
    path: PathBuf,
    file: File,
    scenes: SceneNames,
    /// What was told of the query at work.
    lines: Vec<u8>,
    broken: Option<io::Error>,
}

impl EventExport {
    /// Opens the file before anything is computed; what it had is gone.
    pub fn to(path: &Path) -> Result<Self, CliError> {
        let export = Self::after(path)?;
        export.clear()?;
        Ok(export)
    }

    /// Goes on behind what the file has.
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

    /// What the file had is gone. A file that cannot be cut, a pipe say, has nothing before it is written.
    pub fn clear(&self) -> Result<(), CliError> {
        let is_file = |meta: fs::Metadata| meta.is_file();
        if self.file.metadata().is_ok_and(is_file) {
            self.file.set_len(0).map_err(CliError::io(&self.path))
        } else {
            Ok(())
        }
    }

    /// What comes is of frames of these scenes.
    pub fn name_scenes(&mut self, scenes: SceneNames) {
        self.scenes = scenes;
    }

    /// Takes an event. The first error is kept, and nothing is taken after it.
    pub fn accept(&mut self, record: &Record, problem: &Problem, method: Method) {
        if self.broken.is_none() {
            let written = write_event(&mut self.lines, &self.scenes, problem, method, record);
            self.broken = written.err();
        }
    }

    /// The query at work is done: what was told of it is written.
    pub fn end_query(&mut self) {
        let told = std::mem::take(&mut self.lines);
        if self.broken.is_none() {
            self.broken = self.file.write_all(&told).err();
        }
    }

    /// Says whether all of it has arrived. A query that is not done is left out.
    pub fn close(self) -> Result<(), CliError> {
        match self.broken {
            Some(error) => Err(CliError::io(self.path)(error)),
            None => Ok(()),
        }
    }
}
