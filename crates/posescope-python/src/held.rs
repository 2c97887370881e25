//! Frames that Python holds, as a scene.

use std::sync::Arc;

use posescope::scene::{Scene, SceneError};
use posescope_core::{Cloud, Intrinsics, Photo, Pose, Query, ReferenceTuple};

/// A frame: a query, and where its pose or its cloud is known, these.
#[derive(Clone)]
pub struct HeldFrame {
    /// The photo with its camera.
    pub query: Arc<Query>,
    /// The pose, `world_from_camera`.
    pub pose: Option<Pose>,
    /// The reference that the cloud is of.
    pub reference: Option<Arc<ReferenceTuple>>,
}

impl HeldFrame {
    /// A frame with everything but a query's truth.
    ///
    /// # Errors
    /// Those of [`Query::new`].
    pub fn of_reference(
        reference: &Arc<ReferenceTuple>,
    ) -> Result<Self, posescope_core::InputError> {
        let photo = Arc::clone(reference.photo());
        Ok(Self {
            query: Arc::new(Query::new(reference.name(), photo, *reference.intrinsics())?),
            pose: Some(*reference.world_from_camera()),
            reference: Some(Arc::clone(reference)),
        })
    }
}

/// A scene of frames that are in memory. Its scale is that of a street: without a whole scene, nothing can be measured.
pub struct Held {
    name: String,
    names: Vec<String>,
    frames: Vec<HeldFrame>,
}

impl Held {
    /// The name of a scene of references that come from no scene.
    pub const ARRAYS: &str = "arrays";

    /// A scene of these frames.
    pub fn new(name: &str, frames: Vec<HeldFrame>) -> Self {
        let names = frames.iter().map(|frame| frame.query.name().to_owned()).collect();
        Self { name: name.to_owned(), names, frames }
    }
}

impl Scene for Held {
    fn name(&self) -> &str {
        &self.name
    }

    fn frames(&self) -> &[String] {
        &self.names
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        *self.frames[frame].query.intrinsics()
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.frames[frame].pose
    }

    fn time_s(&self, _frame: usize) -> Option<f64> {
        None
    }

    fn has_cloud(&self, frame: usize) -> bool {
        self.frames[frame].reference.is_some()
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        Ok(Photo::clone(self.frames[frame].query.photo()))
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        match &self.frames[frame].reference {
            Some(reference) => Ok(reference.cloud().clone()),
            None => Err(SceneError::expected(&self.name, "a cloud expected")),
        }
    }

    fn query(&self, frame: usize) -> Result<Arc<Query>, SceneError> {
        Ok(Arc::clone(&self.frames[frame].query))
    }
}
