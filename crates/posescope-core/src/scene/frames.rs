//! The frames used last, with what was computed of them.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::{Scene, SceneError, pose_of, reference_of};
use crate::memo::Id;
use crate::problem::{Query, ReferenceTuple};
use crate::recent::{Limit, Recent};

/// Frames that are kept, but for those held elsewhere: a query, its references, and the candidates that
/// were looked at to choose them.
const FRAMES: usize = 64;
/// Memory of the frames, but for those held elsewhere \[bytes\]: that of 38 candidates within 15 m of a
/// query on the street, each with its features. A frame with its cloud and all that the four estimators
/// keep takes three times as much.
const BYTES: usize = 96 << 20;

/// Frames with all that was computed of them, within a limit. The least recently used frame makes room; one
/// held elsewhere stays, as dropping it would free nothing.
///
/// No lock is held while a frame is read. Two threads that ask for the same one may both read it, and get
/// the same.
pub struct FrameStore {
    frames: Recent<(Id, usize), Arc<Frame>>,
    /// Held, so that none is taken for another at the same address.
    scenes: Mutex<Vec<(Arc<dyn Scene>, Id)>>,
}

/// Query and reference tuple have the same photo and memo.
struct Frame {
    query: Arc<Query>,
    reference: OnceLock<Arc<ReferenceTuple>>,
}

impl Frame {
    fn bytes(&self) -> usize {
        let cloud = self
            .reference
            .get()
            .map_or(0, |reference| size_of_val(reference.cloud.points.as_slice()));
        self.query.photo.bytes() + self.query.memo.bytes() + cloud
    }

    fn is_held(&self) -> bool {
        let reference = self.reference.get();
        Arc::strong_count(&self.query) > 1 || reference.is_some_and(|r| Arc::strong_count(r) > 1)
    }
}

impl Default for FrameStore {
    fn default() -> Self {
        Self::new(FRAMES, BYTES)
    }
}

impl FrameStore {
    /// A store of at most `count` frames and `bytes` in all.
    pub fn new(count: usize, bytes: usize) -> Self {
        Self {
            frames: Recent::within(
                Limit { count, bytes },
                |frame: &Arc<Frame>| frame.bytes(),
                |frame| frame.is_held(),
            ),
            scenes: Mutex::default(),
        }
    }

    /// How many scenes it knows.
    #[cfg(test)]
    pub(super) fn scene_count(&self) -> usize {
        let scenes = self.scenes.lock();
        scenes.unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Memory of all frames with what was computed of them \[bytes\], roughly.
    pub fn bytes(&self) -> usize {
        self.frames.bytes()
    }

    /// The scene with its frames cached here, those from before too.
    pub fn of<'a>(self: &Arc<Self>, scene: &'a Arc<dyn Scene>) -> CachedScene<'a> {
        let mut scenes = self.scenes.lock().unwrap_or_else(PoisonError::into_inner);
        // A scene held nowhere else does not come back: each degradation tried is a scene of its own.
        scenes.retain(|(known, _)| Arc::strong_count(known) > 1);
        let known = scenes.iter().find(|(known, _)| Arc::ptr_eq(known, scene));
        let id = known.map(|(_, id)| *id).unwrap_or_else(|| {
            let id = Id::new();
            scenes.push((Arc::clone(scene), id));
            id
        });
        CachedScene { scene: scene.as_ref(), id, store: Arc::clone(self) }
    }
}

/// A scene whose frames are kept in a [`FrameStore`], with all that is computed of them.
#[derive(Clone)]
pub struct CachedScene<'a> {
    scene: &'a dyn Scene,
    id: Id,
    store: Arc<FrameStore>,
}

impl<'a> CachedScene<'a> {
    /// The scenes of references and of queries, which may be the same, with a store of their own.
    pub fn pair(references: &'a dyn Scene, queries: &'a dyn Scene) -> (Self, Self) {
        let references = Self { scene: references, id: Id::new(), store: Arc::default() };
        let is_same = std::ptr::eq(references.scene, queries);
        let queries = Self {
            scene: queries,
            id: if is_same { references.id } else { Id::new() },
            store: Arc::clone(&references.store),
        };
        (references, queries)
    }

    /// Where its frames are kept.
    pub fn store(&self) -> &Arc<FrameStore> {
        &self.store
    }

    fn frame(&self, frame: usize) -> Result<Arc<Frame>, SceneError> {
        let key = (self.id, frame);
        let frames = &self.store.frames;
        if let Some(known) = frames.get(&key) {
            // It has grown since, by what was computed of it.
            frames.trim();
            return Ok(known);
        }
        let query = Arc::unwrap_or_clone(self.scene.query(frame)?).remembering();
        let made = Frame { query: Arc::new(query), reference: OnceLock::new() };
        Ok(frames.insert(key, Arc::new(made)))
    }
}

impl Scene for CachedScene<'_> {
    crate::inner_scene!(scene: name, frames, other_name, pixel_map, intrinsics, pose, position, time_s, has_cloud, photo, cloud, cloud_at, as_degraded, lengths, cloud_facts, fingerprint);

    fn query(&self, frame: usize) -> Result<Arc<Query>, SceneError> {
        Ok(Arc::clone(&self.frame(frame)?.query))
    }

    fn reference(&self, frame: usize) -> Result<Arc<ReferenceTuple>, SceneError> {
        let world_from_camera = pose_of(self, frame)?;
        let known = self.frame(frame)?;
        if let Some(reference) = known.reference.get() {
            return Ok(Arc::clone(reference));
        }
        let made = reference_of(self, frame, world_from_camera, &known.query)?;
        Ok(Arc::clone(known.reference.get_or_init(|| made)))
    }
}
