//! Events as data: one JSON object per line.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::method::Method;
use crate::problem::Problem;
use crate::run::FolderError;
use crate::trace::Record;

/// The names of the frames' scenes.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SceneNames {
    /// The scene of the references.
    #[serde(rename = "scene")]
    pub references: String,
    /// The scene of the query, if it is another one.
    #[serde(rename = "query_scene", skip_serializing_if = "Option::is_none")]
    pub query: Option<String>,
}

/// An event of a method on a problem.
#[derive(Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    scenes: &'a SceneNames,
    query: &'a str,
    reference: &'a str,
    radius_m: f64,
    method: Method,
    #[serde(flatten)]
    record: &'a Record,
}

/// Writes an event of a method on a problem as one line.
///
/// # Errors
/// The errors of the writer.
pub fn write_event(
    mut to: impl Write,
    scenes: &SceneNames,
    problem: &Problem,
    method: Method,
    record: &Record,
) -> io::Result<()> {
    let line = Line {
        scenes,
        query: problem.query().name(),
        reference: problem.reference().name(),
        radius_m: problem.uncertainty_radius_m(),
        method,
        record,
    };
    serde_json::to_writer(&mut to, &line)?;
    to.write_all(b"\n")
}

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
    ///
    /// # Errors
    /// A file that cannot be opened or emptied.
    pub fn to(path: &Path) -> Result<Self, FolderError> {
        let export = Self::after(path)?;
        export.clear()?;
        Ok(export)
    }

    /// Appends to the file.
    ///
    /// # Errors
    /// A file that cannot be opened.
    pub fn after(path: &Path) -> Result<Self, FolderError> {
        let file = OpenOptions::new().create(true).append(true).open(path);
        Ok(Self {
            path: path.to_owned(),
            file: file.map_err(FolderError::io(path))?,
            scenes: SceneNames::default(),
            lines: Vec::new(),
            broken: None,
        })
    }

    /// Empties the file. A file that cannot be truncated, such as a pipe, is empty already.
    ///
    /// # Errors
    /// A file that cannot be emptied.
    pub fn clear(&self) -> Result<(), FolderError> {
        let is_file = |meta: fs::Metadata| meta.is_file();
        if self.file.metadata().is_ok_and(is_file) {
            self.file.set_len(0).map_err(FolderError::io(&self.path))
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

    /// Ends the file. A query that is not done is left out.
    ///
    /// # Errors
    /// The first error of writing.
    pub fn close(self) -> Result<(), FolderError> {
        match self.broken {
            Some(error) => Err(FolderError::io(self.path)(error)),
            None => Ok(()),
        }
    }
}
