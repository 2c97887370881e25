//! A hierarchy of bounding boxes over the solids.

use nalgebra::{Point3, Vector3};

use super::frame::Ray;

/// Solids per leaf.
const LEAF: usize = 2;
/// Sets of no more solids than this are parted at the cheapest place.
const SMALL: usize = 128;

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Least and greatest corner.
    corners: [Point3<f32>; 2],
    /// First item of a leaf, or index of the second child (the first follows its parent).
    next: u32,
    /// Number of items, 0 for an inner node.
    count: u16,
    /// Axis along which the children are separated.
    axis: u16,
}

/// The hierarchy; items are indices into the list that it was built from.
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

    fn split(&mut self, boxes: &[[Point3<f64>; 2]], begin: usize, end: usize) {
        let items = &mut self.items[begin..end];
        let empty = [
            Point3::from(Vector3::repeat(f64::MAX)),
            Point3::from(Vector3::repeat(f64::MIN)),
        ];
        let [low, high] = items.iter().fold(empty, |[low, high], &i| {
            let [a, b] = boxes[i as usize];
            [low.inf(&a), high.sup(&b)]
        });
        // Rounded outwards: a box must not lose what it holds.
        let slack = Vector3::repeat(1e-3);
        let index = self.nodes.len();
        self.nodes.push(Node {
            corners: [(low - slack).cast(), (high + slack).cast()],
            next: begin as u32,
            count: if end - begin <= LEAF {
                (end - begin) as u16
            } else {
                0
            },
            axis: 0,
        });
        if end - begin <= LEAF {
            return;
        }
        let (axis, middle) = cheapest_split(items, boxes, (high - low).imax());
        self.nodes[index].axis = axis as u16;
        self.split(boxes, begin, begin + middle);
        self.nodes[index].next = self.nodes.len() as u32;
        self.split(boxes, begin + middle, end);
    }

    /// Calls `visit` with every item whose box the ray enters before the distance that `visit`
    /// returned last (at first `limit`), roughly front to back.
    #[inline]
    pub(super) fn traverse(&self, ray: &Ray, limit: f64, mut visit: impl FnMut(u32) -> f64) {
        let origin: Point3<f32> = ray.origin.cast();
        let inverse: Vector3<f32> = ray.direction.map(|c| c.recip() as f32);
        let backwards = [inverse.x < 0.0, inverse.y < 0.0, inverse.z < 0.0];
        let mut limit = limit as f32;
        let mut stack = [0_u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            if !enters(node, &origin, &inverse, backwards, limit) {
                continue;
            }
            if node.count > 0 {
                let begin = node.next as usize;
                for &item in &self.items[begin..begin + usize::from(node.count)] {
                    limit = visit(item) as f32;
                }
                continue;
            }
            let (near, far) = if backwards[usize::from(node.axis)] {
                (node.next, index + 1)
            } else {
                (index + 1, node.next)
            };
            stack[depth] = far;
            stack[depth + 1] = near;
            depth += 2;
        }
    }
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

    #[test]
    fn every_box_on_the_ray_is_visited() {
        let boxes: Vec<_> = (0..500)
            .map(|i| {
                let corner = Point3::from(Vector3::from_fn(|r, _| {
                    100.0 * unit(derive(i, r as u32)) - 50.0
                }));
                [corner, corner + Vector3::repeat(5.0)]
            })
            .collect();
        let tree = BoxTree::new(&boxes);
        for i in 0..200 {
            let direction =
                Vector3::from_fn(|r, _| unit(derive(i, 50 + r as u32)) - 0.5).normalize();
            let ray = Ray {
                origin: Point3::origin(),
                direction,
            };
            let mut visited = vec![false; boxes.len()];
            tree.traverse(&ray, 1e3, |item| {
                visited[item as usize] = true;
                1e3
            });
            for (k, [low, high]) in boxes.iter().enumerate() {
                let centre = nalgebra::center(low, high);
                let along = centre.coords.dot(&direction);
                let inside = (centre - ray.at(along)).amax() < 2.4;
                assert!(!inside || along < 0.0 || visited[k]);
            }
        }
    }
}
