//! A session on disk: what is asked, query, layout.

use std::path::Path;
use std::sync::Arc;

use posescope_core::files;
use posescope_core::text::json_message;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::setup::Setup;
use super::view_options::Arrangement;
use crate::scene::{self, Scene};
use crate::session::{IndexFile, Job, Task, TaskScenes};

/// The version of the file's form.
const SCHEMA: &str = "posescope.session/4";

/// What is kept of a session.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct SavedSession {
    schema: String,
    task: Task,
    query: String,
    references: Vec<String>,
    /// The position of the cursor.
    pub(super) cursor: usize,
    /// What the window is arranged for.
    pub(super) layout: Arrangement,
}

impl SavedSession {
    pub(super) fn new(setup: &Setup, cursor: usize, layout: Arrangement) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            task: setup.task.clone(),
            query: setup.query_name().to_owned(),
            references: setup.reference_names(),
            cursor,
            layout,
        }
    }

    pub(super) fn write(&self, path: &Path) -> Result<(), String> {
        let said = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = serde_json::to_string_pretty(self).map_err(|error| said(&error))?;
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|error| said(&error))?;
        }
        files::write_whole(path, text.as_bytes()).map_err(|error| said(&error))
    }

    /// Reads a session. An error names the file and the line.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct Head {
            schema: String,
        }
        let said = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = files::read_text(path, files::DESCRIPTION).map_err(|error| said(&error))?;
        let Head { schema } = parsed(path, &text)?;
        if schema != SCHEMA {
            return Err(said(&format!("{SCHEMA} expected, {schema} found")));
        }
        parsed(path, &text)
    }

    /// The setup of the session. Scenes that are open already are not opened again.
    pub(super) fn setup(&self, present: &Setup) -> Result<Setup, String> {
        let words = |error: scene::SceneError| error.to_string();
        let (task, now) = (&self.task, &present.task);
        let (asked, present_protocol) = (&task.protocol, &now.protocol);
        let is_same_format = asked.format.is_none() || asked.format == present_protocol.format;
        let is_same_scene = task.scene == now.scene
            && asked.query_scene == present_protocol.query_scene
            && task.photos == now.photos
            && asked.gps == present_protocol.gps;
        let opened = |argument: &str| -> Option<Arc<dyn Scene>> {
            (is_same_format && *argument == now.scene).then(|| Arc::clone(&present.references))
        };
        let TaskScenes { references, queries } = if is_same_format && is_same_scene {
            TaskScenes {
                references: Arc::clone(&present.references),
                queries: task.protocol.degraded(&present.queries),
            }
        } else {
            task.open(&opened).map_err(words)?
        };
        let query = queries.find(&self.query).map_err(words)?;
        let reference_frames: Vec<usize> = self
            .references
            .iter()
            .map(|name| references.find(name).map_err(words))
            .collect::<Result<_, _>>()?;
        let job = Job {
            // The scenes are others, even where they have the same names.
            frames: Arc::default(),
            references,
            queries,
            query,
            chosen: reference_frames.into(),
            index: if is_same_scene && asked.index == present_protocol.index {
                Arc::clone(&present.index)
            } else {
                Arc::new(IndexFile::of(task))
            },
            task: task.clone(),
        };
        Ok(Setup {
            offered: if is_same_scene {
                present.offered.clone()
            } else {
                (0..job.queries.frames().len()).collect()
            },
            job,
            ..present.clone()
        })
    }
}

fn parsed<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, String> {
    serde_json::from_str(text).map_err(|error| {
        let message = json_message(&error).replace('\n', " ");
        format!("{}:{}: {message}", path.display(), error.line())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_file_is_no_session() {
        let folder = tempfile::tempdir().expect("a folder");
        let refused = SavedSession::read(folder.path()).map(drop);
        let expected = format!("{}: a file expected, a folder found", folder.path().display());
        assert_eq!(refused, Err(expected));
    }
}
