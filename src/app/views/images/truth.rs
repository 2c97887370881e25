//! What the true pose says about a match.

use egui::{Color32, Painter};
use nalgebra::{Point2, Point3, Vector2, Vector3};

use crate::app::theme;
use crate::app::views::canvas::Placement;
use crate::app::views::legend::MarkShape;
use crate::camera::Intrinsics;
use crate::geometry::Pose;
use crate::problem::Problem;

/// A line in an image: `normal · (u, v, 1) = 0`, the normal's first two entries of unit length, so
/// that the product is a distance \[px\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ImageLine {
    normal: Vector3<f64>,
}

impl ImageLine {
    /// The query pixels at which the point behind a reference pixel may be seen, whatever its depth:
    /// `l = K_Q⁻ᵀ (t × R x)` with `query_from_reference = [R|t]` and the bearing `x` of the pixel
    /// (Hartley and Zisserman, *Multiple View Geometry*, section 9.2). `None` where the cameras share
    /// their centre, or the pixel looks along the line between them.
    pub(super) fn epipolar(
        query: &Intrinsics,
        reference: &Intrinsics,
        query_from_reference: &Pose,
        pixel: &Point2<f64>,
    ) -> Option<Self> {
        let bearing = query_from_reference.rotation * reference.bearing(pixel).into_inner();
        let plane = query_from_reference.translation.vector.cross(&bearing);
        let (a, b) = (plane.x / query.fx, plane.y / query.fy);
        let normal = Vector3::new(a, b, plane.z - a * query.cx - b * query.cy);
        let length = a.hypot(b);
        (length > 1e-12).then(|| Self { normal: normal / length })
    }

    /// How far a pixel is from the line \[px\].
    pub(super) fn distance_px(&self, pixel: &Point2<f64>) -> f64 {
        self.normal.dot(&pixel.to_homogeneous()).abs()
    }

    /// Two pixels of the line, with all between them that a camera's image may show.
    pub(super) fn across(&self, camera: &Intrinsics) -> [Point2<f64>; 2] {
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let middle = Point2::new(0.5 * width, 0.5 * height);
        let foot = middle - self.normal.dot(&middle.to_homogeneous()) * self.normal.xy();
        let along = Vector2::new(-self.normal.y, self.normal.x);
        [-1.0, 1.0].map(|side| foot + side * width.hypot(height) * along)
    }
}

/// A match as the true pose sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TrueMatch {
    /// Where the reference keypoint may be seen in the query.
    pub(super) line: Option<ImageLine>,
    /// How far the query keypoint is from that line \[px\].
    pub(super) line_px: Option<f64>,
    /// Where the lifted point is seen in the query.
    pub(super) place: Option<Point2<f64>>,
    /// How far the query keypoint is from there \[px\].
    pub(super) place_px: Option<f64>,
    /// The inlier threshold \[px\].
    within_px: f64,
}

impl TrueMatch {
    /// Looks at the match of a query and a reference pixel with the query's true pose
    /// (`world_from_camera`); `point` is its lifted point in the reference camera's frame.
    pub(super) fn of(
        problem: &Problem,
        truth: &Pose,
        query: &Point2<f64>,
        reference: &Point2<f64>,
        point: Option<&Point3<f64>>,
        within_px: f64,
    ) -> Self {
        let query_from_reference = problem.reference_from_query(truth).inverse();
        let camera = problem.query().intrinsics();
        let line = ImageLine::epipolar(
            camera,
            problem.reference().intrinsics(),
            &query_from_reference,
            reference,
        );
        let place = point.and_then(|point| camera.project(&(query_from_reference * point)));
        Self {
            line,
            line_px: line.map(|line| line.distance_px(query)),
            place,
            place_px: place.map(|place| (place - query).norm()),
            within_px,
        }
    }

    /// Whether the match is true, as far as is known. A match without a depth is false where its epipolar line
    /// is too far; on the line it may be either.
    pub(super) fn is_true(&self) -> Option<bool> {
        match (self.place_px, self.line_px) {
            (Some(distance), _) => Some(distance <= self.within_px),
            (None, Some(distance)) if distance > self.within_px => Some(false),
            _ => None,
        }
    }

    /// What the true pose says of the match, in words.
    pub(super) fn verdict(&self) -> &'static str {
        let is_on_line = self.line_px.is_some_and(|px| px <= self.within_px);
        match (self.is_true(), is_on_line) {
            (Some(true), _) => "true match",
            // It is where another depth would put it.
            (Some(false), true) => "false match or wrong depth",
            (Some(false), false) => "false match",
            (None, _) => "unknown without a depth",
        }
    }
}

/// The epipolar line, and where the true pose sees the lifted point.
pub(super) fn draw_truth(
    painter: &Painter,
    at: &Placement,
    camera: &Intrinsics,
    truth: &TrueMatch,
) {
    let place = |pixel: &Point2<f64>| at.on_screen(pixel.cast::<f32>().into());
    let shade = Color32::from_black_alpha(140);
    if let Some([from, to]) = truth.line.map(|line| line.across(camera)) {
        painter.line_segment([place(&from), place(&to)], (3.5, shade));
        painter.line_segment([place(&from), place(&to)], (1.8, theme::TRUTH));
    }
    if let Some(pixel) = &truth.place {
        painter.circle_filled(place(pixel), 8.0, shade);
        MarkShape::Plus.paint(painter, place(pixel), 6.0, theme::TRUTH);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};
    use proptest::prelude::*;

    const CAMERA: Intrinsics =
        Intrinsics { fx: 700.0, fy: 710.0, cx: 600.0, cy: 180.0, width: 1241, height: 376 };

    #[test]
    fn a_sideways_camera_sees_the_row_and_one_that_turns_in_place_no_line() {
        let sideways = Pose::translation(-1.0, 0.0, 0.0);
        let pixel = Point2::new(300.0, 100.0);
        let line = ImageLine::epipolar(&CAMERA, &CAMERA, &sideways, &pixel).expect("a line");
        assert!(line.distance_px(&Point2::new(900.0, 100.0)) < 1e-9);
        assert!((line.distance_px(&Point2::new(900.0, 107.0)) - 7.0).abs() < 1e-9);
        let mut ends = line.across(&CAMERA).map(|end| end.x);
        ends.sort_by(f64::total_cmp);
        assert!(ends[0] < -0.5 && ends[1] > 1240.5);

        let turned = Pose::rotation(Vector3::new(0.0, 0.1, 0.0));
        assert_eq!(ImageLine::epipolar(&CAMERA, &CAMERA, &turned, &pixel), None);
    }

    #[test]
    fn a_match_is_judged_by_its_place_and_without_a_depth_by_its_line() {
        let judged = |place_px, line_px| {
            let seen = TrueMatch { line: None, line_px, place: None, place_px, within_px: 3.0 };
            (seen.is_true(), seen.verdict())
        };
        let place = judged(Some(2.9), Some(0.1));
        assert_eq!(place, (Some(true), "true match"));
        let along = judged(Some(20.0), Some(0.1));
        assert_eq!(along, (Some(false), "false match or wrong depth"));
        let off = judged(Some(20.0), Some(9.0));
        assert_eq!(off, (Some(false), "false match"));
        assert_eq!(judged(None, Some(9.0)), (Some(false), "false match"));
        assert_eq!(judged(None, Some(1.0)), (None, "unknown without a depth"));
    }

    proptest! {
        #[test]
        fn the_line_meets_the_true_match_at_any_depth(
            x in 0.0..1240.0, y in 0.0..375.0, depth in 3.0..80.0,
            right in -3.0..3.0, ahead in 0.5..2.5, yaw in -0.2..0.2,
        ) {
            let reference_from_query = Pose::from_parts(
                Translation3::new(right, 0.1, ahead),
                UnitQuaternion::from_euler_angles(0.01, yaw, -0.02),
            );
            let query_from_reference = reference_from_query.inverse();
            let pixel = Point2::new(x, y);
            let seen = query_from_reference * CAMERA.unproject(&pixel, depth);
            let (Some(seen), Some(line)) = (
                CAMERA.project(&seen),
                ImageLine::epipolar(&CAMERA, &CAMERA, &query_from_reference, &pixel),
            ) else {
                return Ok(());
            };
            prop_assume!(seen.coords.norm() < 1e5);
            prop_assert!(line.distance_px(&seen) < 1e-5);
            let [from, to] = line.across(&CAMERA);
            for end in [from, to] {
                prop_assert!(line.distance_px(&end) < 1e-6);
                prop_assert!(!CAMERA.contains(&end));
            }
            if CAMERA.contains(&seen) {
                let share = (seen - from).dot(&(to - from)) / (to - from).norm_squared();
                prop_assert!((0.0..=1.0).contains(&share));
            }
        }
    }
}
