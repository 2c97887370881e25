//! Events as data: one JSON object per line.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::event::KindSet;
use crate::geometry::Pose;
use crate::localize::LocalizeObserver;
use crate::method::Method;
use crate::problem::Problem;
use crate::run::FolderError;
use crate::trace::{Cancelled, Record, Sink};

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

/// Collects every event of a run as a line of JSON.
#[derive(Default)]
pub struct EventLines {
    scenes: SceneNames,
    problems: Vec<Problem>,
    /// The current problem and method.
    current: Option<(usize, Method)>,
    lines: Vec<u8>,
}

impl EventLines {
    /// For a run between these scenes.
    pub fn new(scenes: SceneNames) -> Self {
        Self { scenes, ..Self::default() }
    }

    /// All lines.
    pub fn into_text(self) -> String {
        String::from_utf8_lossy(&self.lines).into_owned()
    }
}

impl Sink for EventLines {
    fn wanted(&self) -> KindSet {
        KindSet::ALL
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if let Some((problem, method)) = self.current
            && let Some(problem) = self.problems.get(problem)
        {
            let line = Line {
                scenes: &self.scenes,
                query: problem.query().name(),
                reference: problem.reference().name(),
                radius_m: problem.uncertainty_radius_m(),
                method,
                record,
            };
            // A vector takes all bytes.
            serde_json::to_writer(&mut self.lines, &line).ok();
            self.lines.push(b'\n');
        }
        Ok(())
    }
}

impl LocalizeObserver for EventLines {
    fn begin_query(&mut self, _index: usize, problems: &[Problem], _truth: Option<&Pose>) {
        self.problems = problems.to_vec();
    }

    fn begin_method(&mut self, problem: usize, method: Method) {
        self.current = Some((problem, method));
    }

    fn begin_fusion(&mut self, method: Method) {
        self.begin_method(0, method);
    }
}

/// A file of events that gets whole queries only: a query that is interrupted and repeated on resuming is
/// written once.
pub struct EventExport {
    path: PathBuf,
    file: File,
    /// The events of the current query.
    pub lines: EventLines,
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
            lines: EventLines::default(),
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
        self.lines.scenes = scenes;
    }

    /// Writes the events of the current query, which is done. After the first error, which is kept, none are written.
    pub fn end_query(&mut self) {
        let lines = std::mem::take(&mut self.lines.lines);
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
