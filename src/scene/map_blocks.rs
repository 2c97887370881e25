//! A map in blocks: points are stored by cubes of the world, so a camera only visits cubes that may be in view.

use std::cmp::Ordering;
use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::slice::ParallelSliceMut as _;

use super::MapFacts;
use super::cloud_file::MapCloud;
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// The side of a block \[m\]; a dense map has some thousand points in it. Smaller maps, such as that of an object or
/// one without scale, have smaller blocks.
const SIDE_M: f32 = 8.0;
/// The least number of blocks along the longest axis.
const MIN_BLOCKS: f32 = 32.0;

/// A map with its points sorted by block. It needs only a few bytes per block more than the points.
pub(super) struct MapBlocks {
    origin: Vector3<f64>,
    points: Vec<Point3<f32>>,
    blocks: Vec<Block>,
    /// The least and the greatest coordinates of the map \[m\].
    extent: [(f64, f64); 3],
}

struct Block {
    points: Range<usize>,
    /// The centre of the points' bounding box, and its distance to the corners.
    middle: Point3<f32>,
    radius: f32,
}

impl MapBlocks {
    pub fn new(map: MapCloud) -> Self {
        let MapCloud { origin, mut points, extent, .. } = map;
        let lengths = (0..3).map(|axis| {
            let along = || points.iter().map(|point| point[axis]);
            along().fold(f32::MIN, f32::max) - along().fold(f32::MAX, f32::min)
        });
        let longest = lengths.fold(0.0, f32::max);
        let side = SIDE_M.min(longest / MIN_BLOCKS).max(f32::MIN_POSITIVE);
        let cube = |point: &Point3<f32>, axis: usize| floor(point[axis] / side);
        let key = |point: &Point3<f32>| [0, 1, 2].map(|axis| cube(point, axis));
        // By all coordinates: the order must not depend on the number of threads.
        points.par_sort_unstable_by(|a, b| {
            let cubes = (0..3).map(|axis| cube(a, axis).cmp(&cube(b, axis)));
            let coordinates = (0..3).map(|axis| a[axis].total_cmp(&b[axis]));
            cubes.chain(coordinates).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
        });
        let mut blocks = Vec::new();
        let mut start = 0;
        for chunk in points.chunk_by(|a, b| key(a) == key(b)) {
            let corner = |pick: fn(f32, f32) -> f32| {
                let first = chunk[0];
                chunk.iter().fold(first, |corner, point| {
                    Point3::from([0, 1, 2].map(|axis| pick(corner[axis], point[axis])))
                })
            };
            let (least, most) = (corner(f32::min), corner(f32::max));
            blocks.push(Block {
                points: start..start + chunk.len(),
                middle: nalgebra::center(&least, &most),
                radius: (most - least).norm() / 2.0,
            });
            start += chunk.len();
        }
        Self { origin, points, blocks, extent }
    }

    pub fn facts(&self) -> MapFacts {
        MapFacts { points: self.points.len(), extent: self.extent }
    }

    /// The points of all blocks that may be in a camera's view, in its frame \[m\].
    pub fn around_view<'a>(
        &'a self,
        world_from_camera: &Pose,
        camera: &Intrinsics,
    ) -> impl Iterator<Item = Point3<f64>> + use<'a> {
        let camera_from_origin = world_from_camera.inverse()
            * Pose::translation(self.origin.x, self.origin.y, self.origin.z);
        let sides = sides(camera);
        let is_near = move |block: &&Block| {
            let middle = camera_from_origin * block.middle.cast::<f64>();
            // The margin covers rounding to f32.
            let radius = 1.001 * f64::from(block.radius) + 0.001;
            sides.iter().all(|side| side.dot(&middle.coords) >= -radius)
        };
        let seen = self.blocks.iter().filter(is_near);
        seen.flat_map(|block| &self.points[block.points.clone()])
            .map(move |point| camera_from_origin * point.cast::<f64>())
    }
}

/// `number.floor() as i32`, without a call where the processor's baseline has no instruction for it.
fn floor(number: f32) -> i32 {
    let whole = number as i32;
    if whole as f32 > number { whole.saturating_sub(1) } else { whole }
}

/// The inward normals of the planes that bound a camera's view, and the viewing direction.
fn sides(camera: &Intrinsics) -> [Vector3<f64>; 5] {
    let (left, right) = (-0.5 - camera.cx, f64::from(camera.width) - 0.5 - camera.cx);
    let (top, bottom) = (-0.5 - camera.cy, f64::from(camera.height) - 0.5 - camera.cy);
    [
        Vector3::new(camera.fx, 0.0, -left),
        Vector3::new(-camera.fx, 0.0, right),
        Vector3::new(0.0, camera.fy, -top),
        Vector3::new(0.0, -camera.fy, bottom),
        Vector3::z(),
    ]
    .map(|side| side.normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn numbers_are_rounded_down() {
        for number in [0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 1e-30, -1e-30, 7.99, -7.99, 3e9, -3e9] {
            assert_eq!(floor(number), number.floor() as i32, "{number}");
        }
    }

    #[test]
    fn nothing_in_view_is_missed_and_what_is_behind_is_hardly_looked_at() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let origin = Vector3::new(500_000.0, 5_400_000.0, 100.0);
        let mut point = || {
            let mut along = |most: f32| random.random_range(-most..most);
            Point3::new(along(200.0), along(200.0), along(20.0))
        };
        let points: Vec<_> = (0..50_000).map(|_| point()).collect();
        let map = MapCloud { origin, points: points.clone(), ..MapCloud::default() };
        let blocks = MapBlocks::new(map);
        let camera =
            Intrinsics { fx: 300.0, fy: 320.0, cx: 300.0, cy: 250.0, width: 640, height: 480 };
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, -1.1, 0.2);
        let at = nalgebra::Translation3::from(origin + Vector3::new(20.0, -30.0, 1.0));
        let world_from_camera = Pose::from_parts(at, turn);
        let in_view = |point: &Point3<f64>| {
            let pixel = camera.project(point);
            pixel.is_some_and(|pixel| camera.contains(&pixel))
        };
        let camera_from_world = world_from_camera.inverse();
        let all = points
            .iter()
            .map(|point| camera_from_world * (point.cast::<f64>() + origin))
            .filter(in_view);
        let (mut looked_at, mut seen) = (0, 0);
        for point in blocks.around_view(&world_from_camera, &camera) {
            looked_at += 1;
            seen += usize::from(in_view(&point));
        }
        assert_eq!(seen, all.count());
        assert!(seen > 1_000 && looked_at < points.len() / 3, "{looked_at}");
    }
}
