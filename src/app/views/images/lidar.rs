//! The LiDAR points that are seen around a reference keypoint.

use nalgebra::Point2;

use crate::problem::ReferenceTuple;

/// One point of the scan, seen by the reference camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SeenPoint {
    /// Where the point is seen \[px\].
    pub(super) pixel: Point2<f64>,
    /// How deep the point is \[m\].
    pub(super) depth_m: f64,
}

/// The points within a radius \[px\] of a pixel, the nearest to it first.
pub(super) fn around(
    tuple: &ReferenceTuple,
    pixel: &Point2<f64>,
    radius_px: f64,
) -> Vec<SeenPoint> {
    let mut seen: Vec<SeenPoint> = tuple
        .cloud
        .points
        .iter()
        .filter_map(|point| {
            let seen = SeenPoint {
                pixel: tuple.intrinsics.project(&point.cast())?,
                depth_m: f64::from(point.z),
            };
            ((seen.pixel - pixel).norm_squared() <= radius_px * radius_px).then_some(seen)
        })
        .collect();
    let distance = |seen: &SeenPoint| (seen.pixel - pixel).norm_squared();
    seen.sort_by(|a, b| {
        let by_distance = distance(a).total_cmp(&distance(b));
        by_distance.then(a.depth_m.total_cmp(&b.depth_m))
    });
    seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;
    use crate::cloud::Cloud;
    use crate::geometry::Pose;
    use crate::image::{GrayImage, Photo};
    use crate::memo::Memo;

    #[test]
    fn only_points_near_the_pixel_and_in_front_are_seen_the_nearest_first() {
        let intrinsics = Intrinsics {
            fx: 100.0,
            fy: 100.0,
            cx: 50.0,
            cy: 40.0,
            width: 101,
            height: 81,
        };
        let at = |x: f64, y: f64, z: f64| intrinsics.unproject(&Point2::new(x, y), z).cast();
        let mut points = vec![
            at(20.0, 20.0, 10.0),
            at(22.0, 20.0, 30.0),
            at(60.0, 60.0, 5.0),
        ];
        points.push(-points[0]);
        let tuple = ReferenceTuple {
            name: "reference".to_owned(),
            photo: Photo::from_gray(GrayImage::new(101, 81)).into(),
            intrinsics,
            world_from_camera: Pose::identity(),
            cloud: Cloud { points },
            memo: Memo::off(),
        };
        let seen = around(&tuple, &Point2::new(22.5, 20.0), 15.0);
        let depths: Vec<f64> = seen.iter().map(|seen| seen.depth_m.round()).collect();
        assert_eq!(depths, [30.0, 10.0]);
    }
}
