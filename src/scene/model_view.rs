//! What a camera sees of the points of a model without scale.

use nalgebra::Point3;

use super::view_crop;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;

/// The points in view, of points in the camera's frame in the unit of a model.
pub(super) fn in_view_of_any_scale(points: Vec<Point3<f64>>, camera: &Intrinsics) -> Cloud {
    /// The median depth for which the least depth of a point in view is made.
    const DEPTH_M: f64 = 10.0;
    let mut depths: Vec<f64> = points.iter().map(|p| p.z).filter(|&z| z > 0.0).collect();
    depths.sort_by(f64::total_cmp);
    let Some(median) = depths.get(depths.len() / 2) else {
        return Cloud::default();
    };
    let scale = DEPTH_M / median;
    let scaled = points.into_iter().map(|point| point * scale);
    let seen = view_crop::in_view(scaled, camera);
    let back = seen.points.iter().map(|point| (point.cast::<f64>() / scale).cast());
    Cloud { points: back.collect() }
}
