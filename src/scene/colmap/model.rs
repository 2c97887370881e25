//! The content of a model, whether binary or text.

use std::collections::{BTreeMap, HashMap};

use super::super::SceneError;
use super::camera::ModelCamera;
use crate::geometry::Pose;

pub(super) struct Model {
    /// Cameras that cannot be used have an error.
    pub cameras: BTreeMap<u32, Result<ModelCamera, SceneError>>,
    pub images: Vec<ModelImage>,
    /// The points, in the world's frame.
    pub points: Vec<[f64; 3]>,
}

pub(in super::super) struct ModelImage {
    /// The file, relative to the folder of the photos.
    pub name: String,
    pub camera: u32,
    pub camera_from_world: Pose,
    /// The observed points, as positions in [`Model::points`].
    pub observed: Vec<u32>,
}

#[derive(Default)]
pub(super) struct Points {
    /// In the order of addition.
    pub positions: Vec<[f64; 3]>,
    by_id: HashMap<u64, u32>,
}

impl Points {
    /// Adds a point. 32 bits count more points than fit into memory.
    pub fn add(&mut self, id: u64, position: [f64; 3]) {
        let index = self.positions.len() as u32;
        self.positions.push(position);
        self.by_id.insert(id, index);
    }

    /// The position of a point in the list.
    pub fn find(&self, id: u64) -> Result<u32, String> {
        let found = self.by_id.get(&id).copied();
        found.ok_or_else(|| format!("the id of a point of points3D expected, {id} found"))
    }
}
