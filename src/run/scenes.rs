//! The scenes of a run.

use std::sync::Arc;

use super::protocol::Protocol;
use super::scene_pair::ScenePair;
use crate::scene::{self, Scene, SceneError};

/// The scenes of a run, opened.
pub struct Scenes {
    /// The scenes of the references, in the order of [`RunFile::scenes`](super::RunFile::scenes).
    pub references: Vec<Arc<dyn Scene>>,
    /// The scenes of the queries, in the order of [`Protocol::query_scene`]. Empty if queries and references come
    /// from the same scene and no photo is degraded.
    pub queries: Vec<Arc<dyn Scene>>,
}

impl Scenes {
    /// Opens the scenes of references and of queries.
    ///
    /// # Errors
    /// A scene that cannot be read.
    pub fn open(
        references: &[String],
        queries: &[String],
        format: Option<&str>,
    ) -> Result<Self, SceneError> {
        let open_all = |arguments: &[String]| -> Result<Vec<Arc<dyn Scene>>, SceneError> {
            let scenes = arguments.iter();
            scenes.map(|argument| scene::open(argument, format).map(Arc::from)).collect()
        };
        Ok(Self { references: open_all(references)?, queries: open_all(queries)? })
    }

    /// The same scenes with the protocol's rough positions and degradations of the queries. Latitudes and
    /// longitudes are tied to the first scene of references.
    ///
    /// # Errors
    /// The errors of [`Protocol::prepared_queries`].
    pub fn with_protocol(self, protocol: &Protocol) -> Result<Self, SceneError> {
        let Self { mut references, mut queries } = self;
        let Some(first) = references.first().map(Arc::clone) else {
            return Ok(Self { references, queries });
        };
        if queries.is_empty() && !protocol.degrade.is_none() {
            // The photos of references are never degraded.
            queries.clone_from(&references);
        }
        let of_queries = if queries.is_empty() { &mut references } else { &mut queries };
        for scene in of_queries {
            *scene = protocol.prepared_queries(Arc::clone(scene), first.as_ref())?;
        }
        Ok(Self { references, queries })
    }

    /// The scene of a pair's queries.
    pub fn of_queries(&self, pair: &ScenePair) -> &dyn Scene {
        // Degraded photos of the references' own scenes are query scenes too.
        let queries = self.queries.get(pair.query_index.unwrap_or(pair.scene_index));
        queries.unwrap_or(&self.references[pair.scene_index]).as_ref()
    }
}
