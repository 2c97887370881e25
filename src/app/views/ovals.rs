//! Where the points of the cloud may be in the query photo, by a pose that may be off.

use egui::{Color32, Painter, Pos2, Stroke};
use nalgebra::{Point2, Point3};

use super::canvas::Placement;
use crate::app::ViewContext;
use crate::camera::Intrinsics;
use crate::covariance::PoseCovariance;
use crate::method::Method;
use crate::problem::Problem;

/// Cells of the photo; each has at most one oval.
const CELLS: [usize; 2] = [6, 3];

/// Points of the cloud that are looked at, at most.
const LOOKED_AT: usize = 6000;

/// Where some points of the cloud are seen in the query photo in 95 % of cases, if the pose is right.
#[derive(Default)]
pub(super) struct Ovals(Vec<Vec<[f64; 2]>>);

impl Ovals {
    /// Those of a method's result; none before it, and where nothing is known of how far it is off.
    pub(super) fn of(context: &ViewContext<'_>, problem: &Problem, method: Method) -> Self {
        let covariance = context.confidence(method).and_then(|known| known.covariance);
        let Some((pose, covariance)) = context.estimate(method).zip(covariance) else {
            return Self::default();
        };
        let query_from_reference = problem.reference_from_query(&pose).inverse();
        let visible = problem.reference().visible_cloud(&context.run.params.render);
        let step = visible.positions().len().div_ceil(LOOKED_AT).max(1);
        let points = visible.positions().step_by(step);
        let seen = points.map(|point| query_from_reference * point.cast::<f64>());
        Self(outlines(problem.query().intrinsics(), seen, &covariance))
    }

    /// What they are, after the name of the picture; nothing where there are none.
    pub(super) fn words(&self) -> &'static str {
        if self.0.is_empty() { "" } else { " · ovals: 95 % interval of the pose" }
    }

    pub(super) fn draw(&self, painter: &Painter, at: &Placement) {
        for outline in &self.0 {
            let points = outline.iter().map(|&[x, y]| at.on_screen([x as f32, y as f32]));
            let points: Vec<Pos2> = points.collect();
            for (width, color) in [(3.4, Color32::from_black_alpha(160)), (1.4, Color32::WHITE)] {
                painter.add(egui::Shape::closed_line(points.clone(), Stroke::new(width, color)));
            }
        }
    }
}

/// The oval of the point nearest to the middle of each cell of the photo; `points` are in the query camera's frame.
fn outlines(
    camera: &Intrinsics,
    points: impl Iterator<Item = Point3<f64>>,
    covariance: &PoseCovariance,
) -> Vec<Vec<[f64; 2]>> {
    let size = [camera.width, camera.height].map(f64::from);
    let mut nearest = vec![None; CELLS[0] * CELLS[1]];
    for point in points {
        let Some(pixel) = camera.project(&point).filter(|pixel| camera.contains(pixel)) else {
            continue;
        };
        let place = |axis: usize| (pixel[axis] + 0.5) / size[axis] * CELLS[axis] as f64;
        let cell = [0, 1].map(|axis| (place(axis) as usize).min(CELLS[axis] - 1));
        let middle =
            |axis: usize| (cell[axis] as f64 + 0.5) / CELLS[axis] as f64 * size[axis] - 0.5;
        let off = (pixel - Point2::new(middle(0), middle(1))).norm();
        let best = &mut nearest[cell[1] * CELLS[0] + cell[0]];
        if best.is_none_or(|(least, _)| off < least) {
            *best = Some((off, point));
        }
    }
    let of_point = |(_, point): (f64, Point3<f64>)| covariance.outline_of_point(camera, &point);
    nearest.into_iter().flatten().map(of_point).filter(|outline| !outline.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};

    #[test]
    fn each_part_of_the_photo_with_points_has_one_oval_around_where_its_point_is_seen() {
        let camera =
            Intrinsics { fx: 300.0, fy: 300.0, cx: 300.0, cy: 150.0, width: 601, height: 301 };
        // The left half of the photo, and points behind the camera.
        let pixels =
            (0..30).flat_map(|y| (0..30).map(move |x| [10.0 * f64::from(x), 10.0 * f64::from(y)]));
        let points = pixels.flat_map(|[x, y]| {
            let point = camera.unproject(&Point2::new(x, y), 12.0);
            [point, Point3::from(-point.coords)]
        });
        let deviations = Vector6::from([0.002, 0.002, 0.002, 0.05, 0.05, 0.05]);
        let spread = PoseCovariance::new(Matrix6::from_diagonal(&deviations.map(|d| d * d)));
        let spread = spread.expect("a covariance");
        let ovals = |of: &PoseCovariance| outlines(&camera, points.clone(), of);
        let narrow = ovals(&spread);
        assert_eq!(narrow.len(), CELLS[0] / 2 * CELLS[1]);
        let width = |outline: &Vec<[f64; 2]>| {
            let across = outline.iter().map(|[x, _]| *x);
            across.clone().fold(f64::MIN, f64::max) - across.fold(f64::MAX, f64::min)
        };
        for (narrow, wide) in narrow.iter().zip(ovals(&spread.scaled(3.0))) {
            let centre =
                |axis: usize| narrow.iter().map(|at| at[axis]).sum::<f64>() / narrow.len() as f64;
            assert!(camera.contains(&Point2::new(centre(0), centre(1))) && centre(0) < 300.0);
            // 5 cm at 12 m, and two thousandths of a radian, are 1.4 px; the axis of 95 % is 2.4 times as long.
            assert!((5.0..11.0).contains(&width(narrow)), "{}", width(narrow));
            assert!((width(&wide) / width(narrow) - 3.0).abs() < 1e-6);
        }
    }
}
