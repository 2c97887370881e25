//! The part of a tree that the rays of a beam can meet, laid out for them.

use nalgebra::{Point3, Vector3};

use super::{BoxTree, inverse};
use crate::beam::Beam;
use crate::frame::Ray;

/// A node of a [`Thicket`].
#[derive(Clone, Copy, Debug)]
struct Twig {
    /// The corners of its box where a ray enters and leaves, relative to the rays' origin.
    enter: [f32; 3],
    leave: [f32; 3],
    /// Number of nodes up to the end of its subtree, itself included.
    size: u32,
    /// First item of a leaf, and number of items; 0 for an inner node.
    first: u32,
    count: u32,
    /// This and all later boxes are farther from the origin \[m\].
    beyond: f32,
}

/// The part of a tree that the rays of a beam can meet, if they all point to the same octant: its
/// nodes in the order in which the tree is traversed.
#[derive(Debug, Default)]
pub(crate) struct Thicket {
    twigs: Vec<Twig>,
    items: Vec<u32>,
}

impl BoxTree {
    /// The nodes that a beam reaches; `backwards` says along which axes its rays point so.
    pub(crate) fn within(&self, beam: &Beam, backwards: [bool; 3]) -> Thicket {
        let mut thicket = Thicket::default();
        if let Some(root) = self.root() {
            self.gather(root, beam, backwards, &mut thicket);
        }
        let mut beyond = f32::INFINITY;
        for twig in thicket.twigs.iter_mut().rev() {
            beyond = beyond.min(twig.beyond);
            twig.beyond = beyond;
        }
        thicket
    }

    /// Adds the part of a subtree that a beam reaches; returns the number of its leaves.
    fn gather(
        &self,
        index: u32,
        beam: &Beam,
        backwards: [bool; 3],
        thicket: &mut Thicket,
    ) -> usize {
        /// It is cheaper to test so few leaves than first the box around them.
        const FEW: usize = 2;
        let node = &self.nodes[index as usize];
        if !beam.reaches(&node.corners) {
            return 0;
        }
        let origin: Point3<f32> = beam.origin.cast();
        let corner = |axis: usize, far: bool| {
            node.corners[usize::from(backwards[axis] != far)][axis] - origin[axis]
        };
        let here = thicket.twigs.len();
        thicket.twigs.push(Twig {
            enter: [0, 1, 2].map(|axis| corner(axis, false)),
            leave: [0, 1, 2].map(|axis| corner(axis, true)),
            size: 1,
            first: thicket.items.len() as u32,
            count: u32::from(node.count),
            beyond: beam.distance(&node.corners),
        });
        if node.count > 0 {
            thicket.items.extend(self.items_of(node));
            return 1;
        }
        let mut leaves = 0;
        for child in node.children(backwards) {
            leaves += self.gather(child, beam, backwards, thicket);
        }
        if leaves <= FEW {
            thicket.twigs.remove(here);
        } else {
            thicket.twigs[here].size = (thicket.twigs.len() - here) as u32;
        }
        leaves
    }
}

impl Thicket {
    /// As [`BoxTree::traverse`], which visits the same items in the same order, for a ray of the beam.
    #[inline]
    pub(crate) fn traverse(&self, ray: &Ray, limit: f64, mut visit: impl FnMut(u32) -> f64) {
        let inverse = inverse(&ray.direction);
        let mut limit = limit as f32;
        let mut next = 0;
        while let Some(twig) = self.twigs.get(next)
            && twig.beyond <= limit
        {
            if !twig.is_entered(&inverse, limit) {
                next += twig.size as usize;
                continue;
            }
            next += 1;
            if twig.count > 0 {
                for &item in &self.items[twig.first as usize..][..twig.count as usize] {
                    limit = visit(item) as f32;
                }
            }
        }
    }
}

impl Twig {
    #[inline]
    fn is_entered(&self, inverse: &Vector3<f32>, limit: f32) -> bool {
        let (mut near, mut far) = (0.0_f32, limit);
        for axis in 0..3 {
            let enter = self.enter[axis] * inverse[axis];
            let leave = self.leave[axis] * inverse[axis];
            if enter > near {
                near = enter;
            }
            if leave < far {
                far = leave;
            }
        }
        near <= far
    }
}
