//! A session on disk: scene, query, settings, layout.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::setup::{ReferencePick, Setup};
use crate::fusion;
use crate::method::Method;
use crate::params::Params;
use crate::run::default_failure_radius_m;
use crate::scene::{self, Scene};
use crate::session::IndexFile;
use posescope_core::files;

/// The version of the file's form.
const SCHEMA: &str = "posescope.session/1";

/// What is kept of a session.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct SavedSession {
    schema: String,
    scene: String,
    queries: Option<String>,
    query: String,
    references: Vec<String>,
    /// As [`ReferencePick`] is written.
    pick: String,
    methods: Vec<String>,
    #[serde(default)]
    fusions: Vec<String>,
    radius_m: f64,
    #[serde(default)]
    prior_m: Option<f64>,
    /// The scene's own where a session says nothing of it.
    #[serde(default)]
    failure_radius_m: Option<f64>,
    seed: u64,
    breakpoints: Vec<String>,
    /// Every parameter, as in a configuration file.
    params: String,
    /// The position of the cursor.
    pub(super) cursor: usize,
    /// The tree of views.
    pub(super) layout: serde_json::Value,
}

impl SavedSession {
    pub(super) fn new(setup: &Setup, cursor: usize, layout: serde_json::Value) -> Self {
        let name = |scene: &Arc<dyn Scene>, frame: usize| scene.frames()[frame].clone();
        let references = setup.chosen.frames.iter();
        Self {
            schema: SCHEMA.to_owned(),
            scene: setup.scene_argument.clone(),
            queries: setup.queries_argument.clone(),
            query: name(&setup.queries, setup.query),
            references: references
                .map(|&frame| name(&setup.references, frame))
                .collect(),
            pick: setup.pick.to_string(),
            methods: setup
                .methods
                .iter()
                .map(|method| method.name().to_owned())
                .collect(),
            fusions: setup.fusions.iter().map(|f| f.name.to_owned()).collect(),
            radius_m: setup.uncertainty_radius_m,
            prior_m: setup.prior_m,
            failure_radius_m: Some(setup.failure_radius_m),
            seed: setup.seed,
            breakpoints: setup.breakpoints.clone(),
            params: setup.params.to_toml(),
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

    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let said = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = std::fs::read_to_string(path).map_err(|error| said(&error))?;
        let saved: Self = serde_json::from_str(&text).map_err(|error| said(&error))?;
        if saved.schema != SCHEMA {
            return Err(said(&format!("{SCHEMA} expected, {} found", saved.schema)));
        }
        Ok(saved)
    }

    /// The setup of the session. Scenes that are open already are not opened again.
    pub(super) fn setup(&self, present: &Setup) -> Result<Setup, String> {
        let words = |error: scene::SceneError| error.to_string();
        let open = |argument: &str| -> Result<Arc<dyn Scene>, String> {
            if argument == present.scene_argument {
                return Ok(Arc::clone(&present.references));
            }
            Ok(scene::open(argument, None).map_err(words)?.into())
        };
        let references = open(&self.scene)?;
        let queries = match &self.queries {
            Some(argument) => open(argument)?,
            None => Arc::clone(&references),
        };
        let query = queries.find(&self.query).map_err(words)?;
        let reference_frames: Vec<usize> = self
            .references
            .iter()
            .map(|name| references.find(name).map_err(words))
            .collect::<Result<_, _>>()?;
        let mut params = Params::default();
        params
            .merge_toml(&self.params)
            .map_err(|error| error.to_string())?;
        let is_same_scene =
            self.scene == present.scene_argument && self.queries == present.queries_argument;
        let failure_radius_m = self
            .failure_radius_m
            .unwrap_or_else(|| default_failure_radius_m(references.name()));
        Ok(Setup {
            scene_argument: self.scene.clone(),
            queries_argument: self.queries.clone(),
            offered: match is_same_scene {
                true => present.offered.clone(),
                false => (0..queries.frames().len()).collect(),
            },
            references,
            queries,
            query,
            chosen: reference_frames.into(),
            index: match is_same_scene {
                true => Arc::clone(&present.index),
                false => Arc::new(IndexFile::new(&self.scene, None)),
            },
            pick: self
                .pick
                .parse()
                .map_or(ReferencePick::ByHand, ReferencePick::By),
            methods: self
                .methods
                .iter()
                .filter_map(|name| name.parse::<Method>().ok())
                .collect(),
            fusions: self
                .fusions
                .iter()
                .filter_map(|name| fusion::find(name))
                .collect(),
            params,
            uncertainty_radius_m: self.radius_m,
            prior_m: self.prior_m,
            failure_radius_m,
            seed: self.seed,
            breakpoints: self.breakpoints.clone(),
            ..present.clone()
        })
    }
}
