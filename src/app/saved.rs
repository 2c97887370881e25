//! A session on disk: what is asked, query, layout.

use std::path::Path;
use std::sync::Arc;

use posescope_core::files;
use posescope_core::text::json_message;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::setup::{ReferencePick, Setup};
use crate::fusion::Fusion;
use crate::method::Method;
use crate::params::Params;
use crate::run::Protocol;
use crate::scene::{self, Scene};
use crate::session::{Breakpoint, IndexFile, Task, TaskScenes};

/// The version of the file's form.
const SCHEMA: &str = "posescope.session/2";
/// The version before, which is read too.
const SCHEMA_1: &str = "posescope.session/1";

/// What is kept of a session.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct SavedSession {
    schema: String,
    task: Task,
    query: String,
    references: Vec<String>,
    /// The position of the cursor.
    pub(super) cursor: usize,
    /// The tree of views.
    pub(super) layout: serde_json::Value,
}

/// A session as the first version was written. It had neither the format nor the index.
#[derive(Deserialize)]
struct SavedSession1 {
    scene: String,
    queries: Option<String>,
    query: String,
    references: Vec<String>,
    pick: ReferencePick,
    methods: Vec<Method>,
    #[serde(default)]
    fusions: Vec<Fusion>,
    radius_m: f64,
    #[serde(default)]
    prior_m: Option<f64>,
    seed: u64,
    breakpoints: Vec<Breakpoint>,
    #[serde(deserialize_with = "posescope_core::text::parsed")]
    params: Params,
    cursor: usize,
    layout: serde_json::Value,
}

impl From<SavedSession1> for SavedSession {
    fn from(saved: SavedSession1) -> Self {
        let default = Protocol::default();
        Self {
            schema: SCHEMA_1.to_owned(),
            task: Task {
                queries: saved.queries,
                by_hand: saved.pick == ReferencePick::ByHand,
                radius_m: saved.radius_m,
                protocol: Protocol {
                    references: match saved.pick {
                        ReferencePick::ByHand => default.references,
                        ReferencePick::By(selection) => selection,
                    },
                    prior_m: saved.prior_m,
                    methods: saved.methods,
                    fusions: saved.fusions,
                    seed: saved.seed,
                    ..default
                },
                params: saved.params,
                breakpoints: saved.breakpoints,
                ..Task::of(saved.scene)
            },
            query: saved.query,
            references: saved.references,
            cursor: saved.cursor,
            layout: saved.layout,
        }
    }
}

impl SavedSession {
    pub(super) fn new(setup: &Setup, cursor: usize, layout: serde_json::Value) -> Self {
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

    /// Reads a session of this version or the one before. What is wrong is told with file and line.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct Head {
            schema: String,
        }
        let said = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = std::fs::read_to_string(path).map_err(|error| said(&error))?;
        let Head { schema } = parsed(path, &text)?;
        match schema.as_str() {
            SCHEMA => parsed(path, &text),
            SCHEMA_1 => parsed::<SavedSession1>(path, &text).map(Self::from),
            other => Err(said(&format!("{SCHEMA} expected, {other} found"))),
        }
    }

    /// The setup of the session. Scenes that are open already are not opened again.
    pub(super) fn setup(&self, present: &Setup) -> Result<Setup, String> {
        let words = |error: scene::SceneError| error.to_string();
        let (task, now) = (&self.task, &present.task);
        let is_same_format = task.format.is_none() || task.format == now.format;
        let is_same_scene = task.scene == now.scene
            && task.queries == now.queries
            && task.photos == now.photos
            && task.protocol.gps == now.protocol.gps;
        let opened = |argument: &str| -> Option<Arc<dyn Scene>> {
            (is_same_format && *argument == now.scene).then(|| Arc::clone(&present.references))
        };
        let TaskScenes {
            references,
            queries,
        } = match is_same_format && is_same_scene {
            true => TaskScenes {
                references: Arc::clone(&present.references),
                queries: task.protocol.degraded(&present.queries),
            },
            false => task.open(&opened).map_err(words)?,
        };
        let query = queries.find(&self.query).map_err(words)?;
        let reference_frames: Vec<usize> = self
            .references
            .iter()
            .map(|name| references.find(name).map_err(words))
            .collect::<Result<_, _>>()?;
        let mut task = task.clone();
        if is_same_scene && self.schema == SCHEMA_1 {
            // What was not written down then.
            task.format = task.format.or_else(|| now.format.clone());
            task.index = task.index.or_else(|| now.index.clone());
        }
        Ok(Setup {
            offered: match is_same_scene {
                true => present.offered.clone(),
                false => (0..queries.frames().len()).collect(),
            },
            references,
            queries,
            query,
            chosen: reference_frames.into(),
            index: match is_same_scene && task.index == now.index {
                true => Arc::clone(&present.index),
                false => Arc::new(IndexFile::new(&task.scene, task.index.clone())),
            },
            task,
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
