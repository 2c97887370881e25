//! A beam with the few solids that its rays can meet.

use std::sync::{Arc, OnceLock};

use super::{BoxTree, Thicket, backwards};
use crate::beam::Beam;
use crate::frame::Ray;

/// A beam and what its rays can meet, for every octant that any of them points to.
#[derive(Debug)]
pub(crate) struct Sector {
    beam: Beam,
    tree: Arc<BoxTree>,
    octants: [OnceLock<Thicket>; 8],
}

impl Sector {
    /// The part of a tree in a beam.
    pub(crate) fn new(tree: &Arc<BoxTree>, beam: Beam) -> Self {
        Self { beam, tree: Arc::clone(tree), octants: Default::default() }
    }

    /// What a ray of the beam can meet.
    #[inline]
    pub(crate) fn thicket(&self, ray: &Ray) -> &Thicket {
        let backwards = backwards(&ray.direction);
        let octant = (0..3).map(|axis| usize::from(backwards[axis]) << axis);
        self.octants[octant.sum::<usize>()].get_or_init(|| self.tree.within(&self.beam, backwards))
    }
}
