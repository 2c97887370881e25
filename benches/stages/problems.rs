//! Random problems for the solvers, seen by the camera of the pair.

use nalgebra::{Point2, Point3, Unit, Vector3};
use posescope::geometry::Pose;
use posescope::solver::Correspondence;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::pair::PAIR;

/// Directions of three points in the camera, and the points.
pub type P3pProblem = ([Unit<Vector3<f64>>; 3], [Point3<f64>; 3]);

/// Random problems that have a solution.
pub fn p3p_problems(count: usize) -> Vec<P3pProblem> {
    let mut rng = Pcg64::seed_from_u64(1);
    let camera_from_world = random_pose(&mut rng);
    (0..count)
        .map(|_| {
            let in_camera: [Point3<f64>; 3] = std::array::from_fn(|_| random_point(&mut rng));
            (
                in_camera.map(|point| Unit::new_normalize(point.coords)),
                in_camera.map(|point| camera_from_world.inverse() * point),
            )
        })
        .collect()
}

/// Correspondences of which a share is false; the others have 1 px of noise.
#[derive(Clone, Copy)]
pub struct Outliers {
    pub percent: usize,
    pub correspondences: usize,
}

impl Outliers {
    /// Some correspondences, and the pose `camera_from_world` that made them.
    pub fn draw(self, seed: u64) -> (Vec<Correspondence>, Pose) {
        let intrinsics = &PAIR.query.intrinsics;
        let mut rng = Pcg64::seed_from_u64(seed);
        let camera_from_world = random_pose(&mut rng);
        let correspondences = (0..self.correspondences).map(|i| {
            let point = random_point(&mut rng);
            let shown = if i % 100 < self.percent {
                random_point(&mut rng)
            } else {
                point
            };
            let pixel = intrinsics.project(&shown).expect("in front");
            let mut noise = || rng.random_range(-1.7..1.7);
            Correspondence {
                pixel: Point2::new(pixel.x + noise(), pixel.y + noise()),
                point: camera_from_world.inverse() * point,
            }
        });
        (correspondences.collect(), camera_from_world)
    }
}

fn random_point(rng: &mut Pcg64) -> Point3<f64> {
    let pixel = Point2::new(rng.random_range(0.0..1240.0), rng.random_range(0.0..375.0));
    PAIR.query
        .intrinsics
        .unproject(&pixel, rng.random_range(5.0..50.0))
}

fn random_pose(rng: &mut Pcg64) -> Pose {
    let mut angle = || rng.random_range(-1.0..1.0);
    Pose::new(
        Vector3::new(angle(), angle(), angle()) * 3.0,
        Vector3::new(angle(), angle(), angle()),
    )
}
