//! What a camera has in view of a cloud that is not its own.

use nalgebra::Point3;

use super::cloud_file::MapCloud;
use super::depth_image;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// Nothing nearer than this is looked at \[m\]: the camera itself, or whoever carried it.
const NEAREST_M: f64 = 0.1;

/// The points that a camera has in view, in its frame: of those that fall into the same small square of
/// the image the nearest, which hides the others where the map is dense. The squares are such that a
/// map of any density gives about as many points as a scan.
pub(super) fn in_view(map: &MapCloud, world_from_camera: &Pose, camera: &Intrinsics) -> Cloud {
    let camera_from_world = world_from_camera.inverse();
    let side = depth_image::step((camera.width, camera.height));
    let columns = camera.width.div_ceil(side) as usize;
    let rows = camera.height.div_ceil(side) as usize;
    let mut nearest: Vec<Option<Point3<f32>>> = vec![None; columns * rows];
    for point in map.positions() {
        let point = camera_from_world * point;
        let Some(pixel) = camera
            .project(&point)
            .filter(|pixel| camera.contains(pixel))
        else {
            continue;
        };
        if point.z < NEAREST_M {
            continue;
        }
        let cell = |at: f64| ((at + 0.5) / f64::from(side)) as usize;
        let place = &mut nearest[cell(pixel.y) * columns + cell(pixel.x)];
        let point: Point3<f32> = point.cast();
        if place.is_none_or(|other| point.z < other.z) {
            *place = Some(point);
        }
    }
    Cloud {
        points: nearest.into_iter().flatten().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const CAMERA: Intrinsics = Intrinsics {
        fx: 300.0,
        fy: 300.0,
        cx: 319.5,
        cy: 239.5,
        width: 640,
        height: 480,
    };

    #[test]
    fn a_near_wall_hides_a_far_one_and_what_is_behind_is_left_out() {
        let origin = Vector3::new(500_000.0, 5_400_000.0, 100.0);
        let mut map = MapCloud {
            origin,
            points: Vec::new(),
        };
        for depth in [-5.0, 0.05, 4.0, 9.0] {
            for row in -330..330 {
                for column in -440..440 {
                    let (x, y) = (column as f32 * 0.01, row as f32 * 0.01);
                    map.points.push(Point3::new(x, y, depth));
                }
            }
        }
        let world_from_camera = Pose::translation(origin.x, origin.y, origin.z);
        let cloud = in_view(&map, &world_from_camera, &CAMERA);
        assert_eq!(cloud.len(), 160 * 120);
        assert!(cloud.points.iter().all(|point| point.z == 4.0));
    }
}
