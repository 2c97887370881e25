//! What both forms of a model say, as far as it matters here.

use std::collections::{BTreeMap, HashMap};

use super::camera::ModelCamera;
use crate::geometry::Pose;

pub(super) struct Model {
    pub cameras: BTreeMap<u32, ModelCamera>,
    pub images: Vec<ModelImage>,
    /// The points, in the world's frame.
    pub points: Vec<[f64; 3]>,
}

pub(in super::super) struct ModelImage {
    /// The file, below the folder of the photos.
    pub name: String,
    pub camera: u32,
    pub camera_from_world: Pose,
    /// The points that it observes, as positions in [`Model::points`].
    pub observed: Vec<u32>,
}

#[derive(Default)]
pub(super) struct Points {
    /// In the order in which they are added.
    pub positions: Vec<[f64; 3]>,
    by_id: HashMap<u64, u32>,
}

impl Points {
    /// Adds a point. Positions are counted in 32 bits, which is more points than fit any memory.
    pub fn add(&mut self, id: u64, position: [f64; 3]) {
        let index = self.positions.len() as u32;
        self.positions.push(position);
        self.by_id.insert(id, index);
    }

    /// The position of a point in the list.
    pub fn find(&self, id: u64) -> Result<u32, String> {
        let found = self.by_id.get(&id).copied();
        found.ok_or_else(|| format!("points of points3D expected, {id} found"))
    }
}
