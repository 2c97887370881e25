//! A hierarchy of bounding boxes over the solids.

mod sector;
mod thicket;

use std::cell::Cell;

use arrayvec::ArrayVec;
use nalgebra::{Point3, Vector3};

use super::beam::Beam;
use super::frame::Ray;
pub(super) use sector::Sector;
use thicket::Thicket;

/// Solids per leaf.
const LEAF: usize = 2;
/// Sets of no more solids than this are parted at the cheapest place.
const SMALL: usize = 128;

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Least and greatest corner.
    corners: [Point3<f32>; 2],
    /// Indices of the children; those of a leaf both are that of its first item.
    links: [u32; 2],
    /// Number of items, 0 for an inner node.
    count: u16,
    /// Axis along which the children are separated.
    axis: u16,
}

impl Node {
    /// The children of an inner node, the nearer one first.
    #[inline]
    fn children(&self, backwards: [bool; 3]) -> [u32; 2] {
        let [first, second] = self.links;
        if backwards[usize::from(self.axis)] { [second, first] } else { [first, second] }
    }
}

/// The hierarchy; items are indices into the list that it was built from. The root is the last node.
#[derive(Debug)]
pub(super) struct BoxTree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

impl BoxTree {
    /// The tree over boxes given by their least and greatest corners.
    pub(super) fn new(boxes: &[[Point3<f64>; 2]]) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * boxes.len()),
            items: (0..boxes.len() as u32).collect(),
        };
        if !boxes.is_empty() {
            tree.split(boxes, 0, boxes.len());
        }
        tree
    }

    /// Adds the tree over some of the items; returns the index of its root.
    fn split(&mut self, boxes: &[[Point3<f64>; 2]], begin: usize, end: usize) -> u32 {
        let items = &mut self.items[begin..end];
        let empty =
            [Point3::from(Vector3::repeat(f64::MAX)), Point3::from(Vector3::repeat(f64::MIN))];
        let [low, high] = items.iter().fold(empty, |[low, high], &i| {
            let [a, b] = boxes[i as usize];
            [low.inf(&a), high.sup(&b)]
        });
        // Rounded outwards: a box must not lose what it holds.
        let slack = Vector3::repeat(1e-3);
        let corners = [(low - slack).cast(), (high + slack).cast()];
        if end - begin <= LEAF {
            return self.push(Node {
                corners,
                links: [begin as u32; 2],
                count: (end - begin) as u16,
                axis: 0,
            });
        }
        let (axis, middle) = cheapest_split(items, boxes, (high - low).imax());
        let first = self.split(boxes, begin, begin + middle);
        let second = self.split(boxes, begin + middle, end);
        self.push(Node { corners, links: [first, second], count: 0, axis: axis as u16 })
    }

    fn push(&mut self, node: Node) -> u32 {
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    fn root(&self) -> Option<u32> {
        self.nodes.len().checked_sub(1).map(|last| last as u32)
    }

    #[inline]
    fn items_of(&self, leaf: &Node) -> &[u32] {
        &self.items[leaf.links[0] as usize..][..usize::from(leaf.count)]
    }

    /// The tree of what a beam reaches, in the same order.
    pub(super) fn part(&self, beam: &Beam) -> Self {
        let mut part = Self { nodes: Vec::new(), items: Vec::new() };
        if let Some(root) = self.root() {
            part.copy(self, root, beam);
        }
        part
    }

    /// Adds the part of a subtree of `whole` that a beam reaches; returns the index of its root.
    fn copy(&mut self, whole: &Self, index: u32, beam: &Beam) -> Option<u32> {
        let node = whole.nodes[index as usize];
        if !beam.reaches(&node.corners) {
            return None;
        }
        if node.count > 0 {
            let first = self.items.len() as u32;
            self.items.extend(whole.items_of(&node));
            return Some(self.push(Node { links: [first; 2], ..node }));
        }
        match node.links.map(|child| self.copy(whole, child, beam)) {
            [Some(first), Some(second)] => Some(self.push(Node { links: [first, second], ..node })),
            [first, second] => first.or(second),
        }
    }

    /// Calls `visit` with every item whose box the ray enters before the distance that `visit`
    /// returned last (at first `limit`), roughly front to back.
    #[inline]
    pub(super) fn traverse(&self, ray: &Ray, limit: f64, mut visit: impl FnMut(u32) -> f64) {
        let origin: Point3<f32> = ray.origin.cast();
        let inverse = inverse(&ray.direction);
        let backwards = backwards(&ray.direction);
        let mut limit = limit as f32;
        let mut stack: ArrayVec<u32, 64> = self.root().into_iter().collect();
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if !enters(node, &origin, &inverse, backwards, limit) {
                continue;
            }
            if node.count > 0 {
                for &item in self.items_of(node) {
                    limit = visit(item) as f32;
                }
                continue;
            }
            let [near, far] = node.children(backwards);
            stack.extend([far, near]);
        }
    }

    /// Whether `is_met` holds for any item whose box the ray enters before `limit`.
    ///
    /// `leaf` is the one where the last such item was: rays side by side mostly meet the same.
    #[inline]
    pub(super) fn any(
        &self,
        ray: &Ray,
        limit: f32,
        leaf: &Cell<Option<u32>>,
        is_met: impl Fn(u32) -> bool,
    ) -> bool {
        let origin: Point3<f32> = ray.origin.cast();
        let inverse = inverse(&ray.direction);
        let backwards = backwards(&ray.direction);
        let is_entered = |index: u32| {
            let node = &self.nodes[index as usize];
            enters(node, &origin, &inverse, backwards, limit)
        };
        let holds_met = |index: u32| {
            let leaf = &self.nodes[index as usize];
            self.items_of(leaf).iter().any(|&item| is_met(item))
        };
        if leaf.get().is_some_and(|leaf| is_entered(leaf) && holds_met(leaf)) {
            return true;
        }
        let mut stack: ArrayVec<u32, 64> = self.root().into_iter().collect();
        while let Some(index) = stack.pop() {
            if !is_entered(index) {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count == 0 {
                let [near, far] = node.children(backwards);
                stack.extend([far, near]);
            } else if leaf.get() != Some(index) && holds_met(index) {
                leaf.set(Some(index));
                return true;
            }
        }
        false
    }
}

/// The reciprocals of a direction's coordinates.
#[inline]
fn inverse(direction: &Vector3<f64>) -> Vector3<f32> {
    direction.map(|c| c.recip() as f32)
}

/// Along which axes a direction points backwards.
#[inline]
fn backwards(direction: &Vector3<f64>) -> [bool; 3] {
    // The sign of a zero counts: its reciprocal has it too.
    [0, 1, 2].map(|axis| direction[axis].is_sign_negative())
}

/// Sorts items along the axis, and returns it and the position, where the surface area heuristic
/// parts them.
///
/// The heuristic is dear: large sets are halved along `longest`.
fn cheapest_split(items: &mut [u32], boxes: &[[Point3<f64>; 2]], longest: usize) -> (usize, usize) {
    let mut best = (f64::INFINITY, longest, items.len() / 2);
    let axes = if items.len() > SMALL { 0..0 } else { 0..3 };
    for axis in axes {
        sort_along(items, boxes, axis);
        let left = areas(items.iter(), boxes);
        let right = areas(items.iter().rev(), boxes);
        let count = items.len();
        for k in 1..count {
            let cost = k as f64 * left[k - 1] + (count - k) as f64 * right[count - k - 1];
            if cost < best.0 {
                best = (cost, axis, k);
            }
        }
    }
    let (_, axis, middle) = best;
    sort_along(items, boxes, axis);
    (axis, middle)
}

fn sort_along(items: &mut [u32], boxes: &[[Point3<f64>; 2]], axis: usize) {
    let middle = |i: &u32| {
        let [a, b] = boxes[*i as usize];
        a[axis] + b[axis]
    };
    items.sort_unstable_by(|a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
}

/// Half the surface areas of the boxes around the first item, the first two, and so on.
fn areas<'a>(order: impl Iterator<Item = &'a u32>, boxes: &[[Point3<f64>; 2]]) -> Vec<f64> {
    let mut around: Option<[Point3<f64>; 2]> = None;
    order
        .map(|&i| {
            let [a, b] = boxes[i as usize];
            let [low, high] = around.map_or([a, b], |[l, h]| [l.inf(&a), h.sup(&b)]);
            around = Some([low, high]);
            let extent = high - low;
            extent.x * extent.y + extent.y * extent.z + extent.z * extent.x
        })
        .collect()
}

#[inline]
fn enters(
    node: &Node,
    origin: &Point3<f32>,
    inverse: &Vector3<f32>,
    backwards: [bool; 3],
    limit: f32,
) -> bool {
    let (mut near, mut far) = (0.0_f32, limit);
    for axis in 0..3 {
        let first = usize::from(backwards[axis]);
        let enter = (node.corners[first][axis] - origin[axis]) * inverse[axis];
        let leave = (node.corners[1 - first][axis] - origin[axis]) * inverse[axis];
        // Comparisons rather than `f32::max`, which would also have to look for NaN.
        if enter > near {
            near = enter;
        }
        if leave < far {
            far = leave;
        }
    }
    near <= far
}

#[cfg(test)]
mod tests {
    use super::super::noise::{derive, unit};
    use super::*;

    fn random_boxes(count: u32) -> Vec<[Point3<f64>; 2]> {
        let random = |i, row: usize| 100.0 * unit(derive(i, row as u32)) - 50.0;
        let corner = |i| Point3::from(Vector3::from_fn(|row, _| random(i, row)));
        (0..count).map(|i| [corner(i), corner(i) + Vector3::repeat(5.0)]).collect()
    }

    fn random_ray(i: u32) -> Ray {
        let direction = Vector3::from_fn(|r, _| unit(derive(i, 50 + r as u32)) - 0.5);
        Ray { origin: Point3::origin(), direction: direction.normalize() }
    }

    #[test]
    fn every_box_on_the_ray_is_visited() {
        let boxes = random_boxes(500);
        let tree = BoxTree::new(&boxes);
        for ray in (0..200).map(random_ray) {
            let mut visited = vec![false; boxes.len()];
            tree.traverse(&ray, 1e3, |item| {
                visited[item as usize] = true;
                1e3
            });
            for (k, [low, high]) in boxes.iter().enumerate() {
                let centre = nalgebra::center(low, high);
                let along = centre.coords.dot(&ray.direction);
                let inside = (centre - ray.at(along)).amax() < 2.4;
                assert!(!inside || along < 0.0 || visited[k]);
            }
        }
    }

    #[test]
    fn any_finds_what_traversing_finds_whatever_it_found_before() {
        let tree = BoxTree::new(&random_boxes(500));
        let leaf = Cell::new(None);
        let is_met = |item: u32| item.is_multiple_of(3);
        let mut found = 0;
        for ray in (0..300).map(random_ray) {
            let mut expected = false;
            tree.traverse(&ray, 30.0, |item| {
                expected |= is_met(item);
                30.0
            });
            assert_eq!(tree.any(&ray, 30.0, &leaf, is_met), expected);
            found += u32::from(expected);
        }
        assert!((50..250).contains(&found), "{found}");
    }

    #[test]
    fn a_thicket_shows_the_rays_of_its_beam_what_the_tree_shows_them_in_the_same_order() {
        let tree = BoxTree::new(&random_boxes(3000));
        let mut seen = 0;
        for ahead in (0..100).map(random_ray) {
            let aside = |k: u32| random_ray(1000 + k).direction * 0.3;
            let directions: Vec<_> = (0..8).map(|k| ahead.direction + aside(k)).collect();
            let wide = Beam::around(ahead.origin, &directions);
            let narrow = Beam::around(ahead.origin, &directions[..4]);
            let part = tree.part(&wide);
            for outer in &directions[..4] {
                let ray = Ray {
                    origin: ahead.origin,
                    direction: (outer * 3.0 + directions[0] + directions[1]).normalize(),
                };
                // The search ends at the fifth item.
                let limit = |found: &[u32]| if found.len() < 5 { 60.0 } else { 20.0 };
                let (mut expected, mut found) = (Vec::new(), Vec::new());
                tree.traverse(&ray, 60.0, |item| {
                    expected.push(item);
                    limit(&expected)
                });
                let thicket = part.within(&narrow, backwards(&ray.direction));
                thicket.traverse(&ray, 60.0, |item| {
                    found.push(item);
                    limit(&found)
                });
                assert_eq!(found, expected);
                seen += found.len();
            }
        }
        assert!(seen > 500, "{seen}");
    }
}
