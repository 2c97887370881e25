use basin::{CostFunction as _, Gradient as _, Jacobian as _, Residual as _};
use image::Luma;
use nalgebra::{Point2, Point3, Vector3};
use std::convert::Infallible;

use super::information::Distance;
use super::photometric::Differences;
use super::view::sampled;
use super::*;
use crate::camera::Intrinsics;
use crate::image::FloatImage;

const CAMERA: Intrinsics =
    Intrinsics { fx: 90.0, fy: 90.0, cx: 59.5, cy: 39.5, width: 120, height: 80 };

/// Waves on a wall that is slanted to the left.
fn brightness(point: &Point3<f64>) -> f64 {
    let wave = |along: f64, length: f64| (along * std::f64::consts::TAU / length).sin();
    127.0
        + 45.0 * wave(point.x + 0.3 * point.y, 3.1)
        + 40.0 * wave(point.y - 0.2 * point.x, 2.3)
        + 20.0 * wave(point.x, 7.7)
}

/// Where a pixel's ray meets the wall.
fn met(camera_from_world: &Pose, pixel: Point2<f64>) -> Point3<f64> {
    let pose = camera_from_world.inverse();
    let (centre, ray) =
        (pose.translation.vector, pose.rotation * CAMERA.unproject(&pixel, 1.0).coords);
    // x + 4 z = 40.
    let along = (40.0 - centre.x - 4.0 * centre.z) / (ray.x + 4.0 * ray.z);
    Point3::from(centre + ray * along)
}

fn photo(camera_from_world: &Pose) -> FloatImage {
    FloatImage::from_fn(CAMERA.width, CAMERA.height, |x, y| {
        let pixel = Point2::new(f64::from(x), f64::from(y));
        Luma([brightness(&met(camera_from_world, pixel)) as f32])
    })
}

fn cloud() -> Vec<Point3<f32>> {
    let pixels = (4..76).step_by(3).flat_map(|y| (4..116).step_by(3).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| met(&Pose::identity(), Point2::new(f64::from(x), f64::from(y))).cast())
        .collect()
}

fn truth() -> Pose {
    Pose::new(Vector3::new(0.25, -0.1, -0.3), Vector3::new(0.01, -0.02, 0.008))
}

const AT: [f64; 6] = [0.05, -0.02, 0.1, 0.06, 0.04, -0.03];

fn stepped(i: usize, by: f64) -> Vec<f64> {
    let mut x = AT.to_vec();
    x[i] += by;
    x
}

#[test]
fn the_slope_of_an_image_is_that_of_its_differences() {
    let image = photo(&Pose::identity());
    let step = 1e-5;
    for (x, y) in [(10.3, 20.8), (55.55, 40.1), (100.9, 60.5)] {
        let value = |x, y| sampled(&image, x, y).expect("inside").0;
        let (_, [across, down]) = sampled(&image, x, y).expect("inside");
        let by_x = (value(x + step, y) - value(x - step, y)) / (2.0 * step);
        let by_y = (value(x, y + step) - value(x, y - step)) / (2.0 * step);
        assert!((across - by_x).abs() < 1e-4 && (down - by_y).abs() < 1e-4);
    }
    assert!(sampled(&image, 0.9, 20.0).is_none() && sampled(&image, 50.0, 78.0).is_none());
}

#[test]
fn the_derivatives_of_the_differences_are_those_of_finite_differences() {
    let (reference, query) = (photo(&Pose::identity()), photo(&truth()));
    let view = View::new((&query, &CAMERA), (&reference, &CAMERA), &cloud(), &Pose::identity());
    let (differences, _) = Differences::new(&view);
    let jacobian = differences.jacobian(&AT.to_vec()).expect("cannot fail");
    let step = 1e-5;
    let mut compared = 0;
    for i in 0..6 {
        let [more, less] =
            [step, -step].map(|by| differences.residual(&stepped(i, by)).expect("cannot fail"));
        for row in 0..more.len() {
            let slope = (more[row] - less[row]) / (2.0 * step);
            let said = jacobian.get(row, i);
            // Where a point leaves the image there is no derivative.
            if slope.abs() < 1e4 && said != 0.0 {
                compared += 1;
                assert!(
                    (slope - said).abs() < 1e-3 * (1.0 + said.abs()),
                    "{i} {row}: {slope} {said}"
                );
            }
        }
    }
    assert!(compared > 3000, "{compared}");
}

#[test]
fn the_gradient_of_the_distance_is_that_of_finite_differences() {
    let (reference, query) = (photo(&Pose::identity()), photo(&truth()));
    // The middle of the wall stays in view: what leaves it makes steps.
    let middle: Vec<_> =
        cloud().into_iter().filter(|p| p.x.abs() < 4.0 && p.y.abs() < 2.5).collect();
    let view = View::new((&query, &CAMERA), (&reference, &CAMERA), &middle, &Pose::identity());
    let distance = Distance::new(&view, 16);
    let gradient = distance.gradient(&AT.to_vec()).expect("cannot fail");
    let step = 1e-5;
    for (i, said) in gradient.iter().enumerate() {
        let [more, less] =
            [step, -step].map(|by| distance.cost(&stepped(i, by)).expect("cannot fail"));
        let slope = (more - less) / (2.0 * step);
        assert!((slope - said).abs() < 1e-5 + 1e-3 * slope.abs(), "{i}: {slope} {said}");
    }
    assert!(gradient.iter().any(|slope| slope.abs() > 0.01));
}

/// Where a descent from the reference ends, and its steps.
fn ended(descend: impl Fn(&View<'_>, &mut dyn FnMut(Step))) -> (Pose, Vec<f64>) {
    let (reference, query) = (photo(&Pose::identity()), photo(&truth()));
    let view = View::new((&query, &CAMERA), (&reference, &CAMERA), &cloud(), &Pose::identity());
    let (mut end, mut costs) = (Pose::identity(), Vec::new());
    descend(&view, &mut |step| {
        end = step.camera_from_reference;
        costs.push(step.cost);
    });
    (end, costs)
}

#[test]
fn both_go_down_to_the_truth_from_near_by() {
    let photometric = ended(|view, tell| {
        let Ok(()) = photometric::descend(view, 60, |step| {
            tell(step);
            Ok::<_, Infallible>(())
        });
    });
    let information = ended(|view, tell| {
        let Ok(()) = information::descend(view, 16, 60, |step| {
            tell(step);
            Ok::<_, Infallible>(())
        });
    });
    for ((end, costs), within_m) in [(photometric, 0.01), (information, 0.05)] {
        let off = (end * truth().inverse()).translation.vector.norm();
        assert!(off < within_m, "{off} m off after {} steps", costs.len());
        assert!(costs.len() > 2);
        assert!(costs.windows(2).all(|pair| pair[1] <= pair[0] + 1e-12), "{costs:?}");
    }
}

#[test]
fn nothing_in_view_is_no_reason_to_move() {
    let (reference, query) = (photo(&Pose::identity()), photo(&truth()));
    let behind = Pose::translation(0.0, 0.0, -100.0);
    let view = View::new((&query, &CAMERA), (&reference, &CAMERA), &cloud(), &behind);
    for descends in [true, false] {
        let mut end = behind;
        let tell = |step: Step| {
            end = step.camera_from_reference;
            Ok::<_, Infallible>(())
        };
        let Ok(()) = if descends {
            photometric::descend(&view, 20, tell)
        } else {
            information::descend(&view, 16, 20, tell)
        };
        assert_eq!(end, behind);
    }
}
