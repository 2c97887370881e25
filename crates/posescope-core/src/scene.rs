//! Scenes: anything that yields frames (photo, intrinsics, perhaps a pose, perhaps a cloud).

mod error;

use std::sync::Arc;

use xxhash_rust::xxh3::Xxh3;

pub use error::SceneError;

use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;
use crate::memo::Memo;
use crate::problem::{Query, ReferenceTuple};

/// A sequence of frames in one world frame. Frames are addressed by position, `0..frames().len()`.
pub trait Scene: Send + Sync {
    /// What the scene is called in results and recordings: no path, so that results do not depend on
    /// where the data lie.
    fn name(&self) -> &str;

    /// The frames' names, as their files are called, in their order.
    fn frames(&self) -> &[String];

    /// The camera of all frames.
    fn intrinsics(&self) -> Intrinsics;

    /// `world_from_camera`, where it is known.
    fn pose(&self, frame: usize) -> Option<Pose>;

    /// When the frame was taken \[s\], where it is known.
    fn time_s(&self, frame: usize) -> Option<f64>;

    /// Whether a cloud was scanned with this frame.
    fn has_cloud(&self, frame: usize) -> bool;

    /// The photo.
    ///
    /// # Errors
    /// When it cannot be read or is not of the size that the scene has.
    fn photo(&self, frame: usize) -> Result<Photo, SceneError>;

    /// The cloud, in the camera's frame.
    ///
    /// # Errors
    /// When there is none, or it cannot be used.
    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError>;

    /// The frame as a query.
    ///
    /// # Errors
    /// As [`Scene::photo`].
    fn query(&self, frame: usize) -> Result<Arc<Query>, SceneError> {
        Ok(Arc::new(Query {
            name: self.frames()[frame].clone(),
            photo: self.photo(frame)?,
            intrinsics: self.intrinsics(),
            memo: Memo::off(),
        }))
    }

    /// The frame as a reference tuple.
    ///
    /// # Errors
    /// As [`Scene::photo`] and [`Scene::cloud`], and [`SceneError::NoPose`].
    fn reference(&self, frame: usize) -> Result<Arc<ReferenceTuple>, SceneError> {
        let name = &self.frames()[frame];
        let Some(world_from_camera) = self.pose(frame) else {
            return Err(SceneError::NoPose {
                scene: self.name().to_owned(),
                frame: name.clone(),
            });
        };
        Ok(Arc::new(ReferenceTuple {
            name: name.clone(),
            photo: self.photo(frame)?,
            intrinsics: self.intrinsics(),
            world_from_camera,
            cloud: self.cloud(frame)?,
            memo: Memo::off(),
        }))
    }

    /// A number that changes with the photos, as far as can be told without reading them: what was
    /// made from them before is stale then.
    fn fingerprint(&self) -> u64 {
        fingerprint(self, &[])
    }
}

/// A number for what a scene is and holds, and whatever else its format knows.
pub fn fingerprint(scene: &(impl Scene + ?Sized), more: &[u8]) -> u64 {
    let mut sum = Xxh3::new();
    let parts = [scene.name(), &format!("{:?}", scene.intrinsics())];
    for part in parts
        .into_iter()
        .chain(scene.frames().iter().map(String::as_str))
    {
        sum.update(part.as_bytes());
        sum.update(b"\n");
    }
    sum.update(more);
    sum.digest()
}

impl dyn Scene + '_ {
    /// The frame of a name; numbers match whatever their leading zeros (`3823` finds `003823`).
    ///
    /// # Errors
    /// [`SceneError::UnknownFrame`] says which frames there are.
    pub fn find(&self, name: &str) -> Result<usize, SceneError> {
        let frames = self.frames();
        let number = name.parse::<u64>().ok();
        frames
            .iter()
            .position(|frame| frame == name)
            .or_else(|| {
                frames
                    .iter()
                    .position(|frame| number.is_some() && frame.parse().ok() == number)
            })
            .ok_or_else(|| SceneError::UnknownFrame {
                scene: self.name().to_owned(),
                frame: name.to_owned(),
                known: match frames {
                    [] => "none".to_owned(),
                    [only] => only.clone(),
                    [first, .., last] => format!("{first} … {last}, {} in all", frames.len()),
                },
            })
    }
}

/// A format's place in the registry.
pub struct Entry {
    /// The name that `--format` takes.
    pub name: &'static str,
    /// What a scene argument of this format looks like.
    pub about: &'static str,
    /// Whether a scene argument is of this format, judged by its content.
    pub recognizes: fn(&str) -> bool,
    /// Opens the scene.
    pub open: fn(&str) -> Result<Box<dyn Scene>, SceneError>,
}
