//! How well a photo's edges fix a pose.

use nalgebra::{Matrix6, Vector2, Vector6};

use crate::camera::Intrinsics;
use crate::covariance::PoseCovariance;
use crate::geometry::Pose;
use crate::image::GrayImage;
use crate::params::Params;
use crate::problem::Problem;

/// Points of the cloud that are looked at, at most.
const POINTS: usize = 4000;

/// Grey values are compared this far to both sides of a point, as a share of the photo's width.
const APART: f64 = 1.0 / 400.0;

/// Differences of grey values below this are mostly noise.
const NOISE: f64 = 8.0;

/// What is known of each freedom without any edge, as standard deviations: of rotation \[rad\] and, of position, at the
/// scale of the paper \[m\].
const KNOWN_RAD: f64 = 0.2;
const KNOWN_M: f64 = 5.0;

/// The covariance that the pose of a query would have if the points of the reference's cloud that lie on its edges
/// were each seen to within a pixel across their edge; rotation first. It says which freedoms the photo fixes well and
/// which it hardly fixes, not how large errors are.
pub(super) fn covariance(
    problem: &Problem,
    params: &Params,
    reference_from_query: &Pose,
) -> Option<PoseCovariance> {
    let (query, reference) = (&problem.query, &problem.reference);
    let visible = reference.visible_cloud(&params.render);
    let query_from_reference = reference_from_query.inverse();
    let step = visible.positions().len().div_ceil(POINTS).max(1);
    let known_m = params.scale.length(KNOWN_M);
    let deviations = Vector6::from_iterator([KNOWN_RAD, known_m].into_iter().flat_map(|d| [d; 3]));
    let mut information = Matrix6::from_diagonal(&deviations.map(|deviation| deviation.powi(-2)));
    for position in visible.positions().step_by(step) {
        let seen = query_from_reference * position.cast::<f64>();
        if let Some(moves) = across_edge(&query.photo.gray, &query.intrinsics, seen.coords.into()) {
            information += moves * moves.transpose();
        }
    }
    PoseCovariance::new(information.try_inverse()?)
}

/// How far a point of the camera's frame moves across the edge that it lies on, by a twist of the camera \[px/rad,
/// px/m\], weighted by how clear the edge is.
fn across_edge(
    photo: &GrayImage,
    camera: &Intrinsics,
    [x, y, z]: [f64; 3],
) -> Option<Vector6<f64>> {
    let pixel = camera.project(&[x, y, z].into())?;
    let apart = (APART * f64::from(camera.width)).max(1.0);
    let grey = |along: f64, down: f64| {
        let (u, v) = ((pixel.x + along).round(), (pixel.y + down).round());
        let is_inside = u >= 0.0 && v >= 0.0;
        let found = is_inside.then(|| photo.get_pixel_checked(u as u32, v as u32))?;
        found.map(|pixel| f64::from(pixel.0[0]))
    };
    let gradient = Vector2::new(
        grey(apart, 0.0)? - grey(-apart, 0.0)?,
        grey(0.0, apart)? - grey(0.0, -apart)?,
    );
    let across = gradient / (gradient.norm() + NOISE);
    let (fx, fy) = (camera.fx * across.x, camera.fy * across.y);
    let (x, y, near) = (x / z, y / z, 1.0 / z);
    Some(Vector6::new(
        -fx * x * y - fy * (1.0 + y * y),
        fx * (1.0 + x * x) + fy * x * y,
        -fx * y + fy * x,
        fx * near,
        fy * near,
        -(fx * x + fy * y) * near,
    ))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use image::Luma;
    use nalgebra::Point3;

    use super::*;
    use crate::cloud::Cloud;
    use crate::image::Photo;
    use crate::problem::{Query, ReferenceTuple};

    const CAMERA: Intrinsics =
        Intrinsics { fx: 200.0, fy: 200.0, cx: 99.5, cy: 59.5, width: 200, height: 120 };

    /// A wall 10 m away that is painted in stripes.
    fn problem(is_light: fn(u32, u32) -> bool) -> Problem {
        let gray =
            GrayImage::from_fn(200, 120, |x, y| Luma([if is_light(x, y) { 200 } else { 20 }]));
        let photo = || Photo::from_gray(gray.clone());
        let across =
            (0..100_u8).flat_map(|x| (0..60_u8).map(move |y| (f32::from(x), f32::from(y))));
        let cloud: Cloud =
            across.map(|(x, y)| [0.1 * (x - 50.0), 0.1 * (y - 30.0), 10.0]).collect();
        let query = Query::new("q", photo(), CAMERA).expect("a query");
        let reference = ReferenceTuple::new("r", photo(), CAMERA, Pose::identity(), cloud);
        Problem::new(Arc::new(query), reference.expect("a reference"), 10.0).expect("a problem")
    }

    fn deviations(is_light: fn(u32, u32) -> bool) -> Vector6<f64> {
        let found = covariance(&problem(is_light), &Params::default(), &Pose::identity());
        found.expect("a covariance").deviations()
    }

    #[test]
    fn stripes_fix_what_moves_them_and_nothing_else() {
        let upright = deviations(|x, _| x / 20 % 2 == 0);
        let lying = deviations(|_, y| y / 20 % 2 == 0);
        let chequered = deviations(|x, y| (x / 20 + y / 20) % 2 == 0);
        // A step up does not move upright stripes, one to the right moves them like a turn.
        assert!(upright[4] > 4.0, "{upright}");
        assert!(upright[3] < 0.5 * upright[4], "{upright}");
        assert!(lying[3] > 4.0 && lying[4] < 0.5 * lying[3], "{lying}");
        // All are better known with both.
        for freedom in 0..6 {
            let both = upright[freedom].min(lying[freedom]);
            assert!(chequered[freedom] <= 1.05 * both, "{freedom}: {chequered} {upright} {lying}");
        }
    }

    #[test]
    fn a_point_moves_across_its_edge_as_central_differences_say() {
        let photo = GrayImage::from_fn(200, 120, |x, y| Luma([(x + y) as u8]));
        let point = Point3::new(1.0, -0.7, 6.0);
        let moves = across_edge(&photo, &CAMERA, point.coords.into()).expect("inside");
        let gradient = Vector2::new(2.0, 2.0);
        let across = gradient / (gradient.norm() + NOISE);
        for freedom in 0..6 {
            let pixel = |size: f64| {
                let twist = Vector6::ith(freedom, size);
                let [turn, shift] = [0, 3].map(|first| twist.fixed_rows::<3>(first).into_owned());
                CAMERA.project(&(Pose::new(shift, turn) * point)).expect("in front")
            };
            let along = (pixel(1e-6) - pixel(-1e-6)).dot(&across) / 2e-6;
            assert!((moves[freedom] - along).abs() < 1e-4 * along.abs().max(1.0), "{freedom}");
        }
    }
}
