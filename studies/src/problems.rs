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
    let world_from_camera = random_pose(&mut rng).inverse();
    let mut problem = |_| {
        let in_camera: [Point3<f64>; 3] = std::array::from_fn(|_| random_point(&mut rng));
        let bearings = in_camera.map(|point| Unit::new_normalize(point.coords));
        (bearings, in_camera.map(|point| world_from_camera * point))
    };
    (0..count).map(&mut problem).collect()
}

/// Correspondences of which a share is false; the others have 1 px of noise.
#[derive(Clone, Copy)]
pub struct Outliers {
    /// How many of a hundred are false.
    pub percent: usize,
    /// How many there are.
    pub correspondences: usize,
}

impl Outliers {
    /// The cases of the comparison with others, by the names of their stages.
    pub fn cases() -> impl Iterator<Item = (String, Self)> {
        [30, 60, 80, 90].into_iter().flat_map(|percent| {
            [200, 1000].map(|correspondences| {
                (format!("pose_{percent}_{correspondences}"), Self { percent, correspondences })
            })
        })
    }

    /// Some correspondences, and the pose `camera_from_world` that made them.
    pub fn draw(self, seed: u64) -> (Vec<Correspondence>, Pose) {
        let intrinsics = PAIR.query().intrinsics();
        let mut rng = Pcg64::seed_from_u64(seed);
        let camera_from_world = random_pose(&mut rng);
        let correspondences = (0..self.correspondences).map(|i| {
            let point = random_point(&mut rng);
            let shown = if i % 100 < self.percent { random_point(&mut rng) } else { point };
            let pixel = intrinsics.project(&shown).expect("a point in front of the camera");
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
    PAIR.query().intrinsics().unproject(&pixel, rng.random_range(5.0..50.0))
}

fn random_pose(rng: &mut Pcg64) -> Pose {
    let mut angle = || rng.random_range(-1.0..1.0);
    let translation = Vector3::new(angle(), angle(), angle()) * 3.0;
    Pose::new(translation, Vector3::new(angle(), angle(), angle()))
}
