//! Frames that an earlier job has read, in place of the files.

use std::sync::Arc;

use super::loaded::Loaded;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;
use crate::memo::Memo;
use crate::problem::{Query, ReferenceTuple};
use crate::scene::{Scene, SceneError};

/// Values that one photo's memo keeps: some settings of each stage, so that going back to the last
/// one costs nothing either.
const REMEMBERED: usize = 64;

/// A scene whose frames are taken, with all that was worked out about them, from the job before
/// where that has them, and remember from now on what is worked out about them.
pub(super) struct AtHand<'a> {
    pub(super) scene: &'a dyn Scene,
    pub(super) before: Option<&'a Loaded>,
}

impl Scene for AtHand<'_> {
    fn query(&self, frame: usize) -> Result<Arc<Query>, SceneError> {
        let name = &self.frames()[frame];
        let known = self.before.map_or(&[][..], |loaded| &loaded.problems);
        match known.iter().find(|problem| problem.query.name == *name) {
            Some(problem) => Ok(Arc::clone(&problem.query)),
            None => Ok(Arc::new(Query {
                memo: Memo::of(REMEMBERED),
                ..Arc::unwrap_or_clone(self.scene.query(frame)?)
            })),
        }
    }

    fn reference(&self, frame: usize) -> Result<Arc<ReferenceTuple>, SceneError> {
        let name = &self.frames()[frame];
        let known = self.before.map_or(&[][..], |loaded| &loaded.problems);
        match known.iter().find(|problem| problem.reference.name == *name) {
            Some(problem) => Ok(Arc::clone(&problem.reference)),
            None => Ok(Arc::new(ReferenceTuple {
                memo: Memo::of(REMEMBERED),
                ..Arc::unwrap_or_clone(self.scene.reference(frame)?)
            })),
        }
    }

    fn name(&self) -> &str {
        self.scene.name()
    }

    fn frames(&self) -> &[String] {
        self.scene.frames()
    }

    fn intrinsics(&self) -> Intrinsics {
        self.scene.intrinsics()
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.scene.pose(frame)
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        self.scene.time_s(frame)
    }

    fn has_cloud(&self, frame: usize) -> bool {
        self.scene.has_cloud(frame)
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        self.scene.photo(frame)
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        self.scene.cloud(frame)
    }
}
