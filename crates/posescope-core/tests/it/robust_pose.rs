//! Long statistics of the minimal solver, the robust estimator and the acceptance rule.
//!
//! Every random scene comes from a seed that is part of the test. The figures are printed
//! (`cargo test -p posescope-core --test it robust_pose -- --nocapture`); the requirements are asserted.

use std::convert::Infallible;
use std::ops::Range;
use std::time::Instant;

use nalgebra::{Point2, Point3, Quaternion, Translation3, Unit, UnitQuaternion, Vector2, Vector3};
use posescope_core::camera::Intrinsics;
use posescope_core::geometry::{Pose, PoseError};
use posescope_core::robust::{
    Acceptance, AcceptanceRule, Consensus, MlesacError, MlesacParams, effective_area_px,
    inliers_beyond_chance, mlesac,
};
use posescope_core::solver::{Correspondence, p3p};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const KITTI: Intrinsics =
    Intrinsics { fx: 718.856, fy: 718.856, cx: 607.1928, cy: 185.2157, width: 1241, height: 376 };

/// A standard normal number (Box–Muller).
fn normal(rng: &mut Pcg64) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

/// A rotation uniform over all rotations and a normally distributed translation.
fn random_pose(rng: &mut Pcg64, translation_sigma: f64) -> Pose {
    let q = Quaternion::new(normal(rng), normal(rng), normal(rng), normal(rng));
    let t = Vector3::from_fn(|_, _| translation_sigma * normal(rng));
    Pose::from_parts(Translation3::from(t), UnitQuaternion::new_normalize(q))
}

#[test]
fn p3p_finds_the_true_pose_of_random_problems() {
    const PROBLEMS: usize = 100_000;
    let mut rng = Pcg64::seed_from_u64(20_240_501);
    let problems: Vec<_> = (0..PROBLEMS)
        .map(|_| {
            let pose = random_pose(&mut rng, 1.0);
            let bearings: [_; 3] = std::array::from_fn(|_| {
                let x = rng.random_range(-1.0..1.0) * 0.5 * 1241.0 / 718.856;
                let y = rng.random_range(-1.0..1.0) * 0.5 * 376.0 / 718.856;
                Unit::new_normalize(Vector3::new(x, y, 1.0))
            });
            let points = bearings.map(|bearing: Unit<Vector3<f64>>| {
                let distance = rng.random_range(2.0..50.0);
                pose.inverse_transform_point(&Point3::from(bearing.into_inner() * distance))
            });
            (pose, bearings, points)
        })
        .collect();

    let start = Instant::now();
    let solutions: Vec<_> = problems.iter().map(|(_, b, p)| p3p(b, p)).collect();
    let micros = start.elapsed().as_secs_f64() * 1e6 / PROBLEMS as f64;

    let (mut missed, mut worst_rotation, mut worst_angle) = (0, 0.0_f64, 0.0_f64);
    let mut count = 0;
    for ((truth, bearings, points), poses) in problems.iter().zip(&solutions) {
        count += poses.len();
        let rotation_error = |pose: &Pose| {
            (pose.rotation.to_rotation_matrix().into_inner()
                - truth.rotation.to_rotation_matrix().into_inner())
            .norm()
        };
        let nearest = poses.iter().map(rotation_error).fold(9.0, f64::min);
        if nearest < 1e-6 {
            worst_rotation = worst_rotation.max(nearest);
        } else {
            missed += 1;
            println!("missed: nearest {nearest:e} of {} solutions", poses.len());
        }
        for pose in poses {
            for (bearing, point) in bearings.iter().zip(points) {
                let seen = (pose * point).coords;
                worst_angle = worst_angle.max((seen.normalize() - bearing.into_inner()).norm());
            }
        }
    }
    println!(
        "p3p: {missed} of {PROBLEMS} missed, worst rotation error {worst_rotation:e}, worst \
         reprojection {worst_angle:e} rad, {micros:.2} µs, {:.2} solutions",
        count as f64 / PROBLEMS as f64
    );
    assert!(missed <= PROBLEMS / 10_000);
    assert!(worst_angle < 1e-6);
}

/// A random pose, and correspondences to points in view of which the first are true, with 1 px of
/// noise per axis, and the share `outliers` has pixels anywhere in the image.
fn scene(
    rng: &mut Pcg64,
    total: usize,
    outliers: f64,
    depth_m: Range<f64>,
) -> (Pose, Vec<Correspondence>) {
    let truth = random_pose(rng, 3.0);
    let inliers = (total as f64 * (1.0 - outliers)).round() as usize;
    let correspondences = (0..total)
        .map(|i| {
            let seen = anywhere(rng);
            let depth = rng.random_range(depth_m.clone());
            let point = truth.inverse_transform_point(&KITTI.unproject(&seen, depth));
            let pixel = if i < inliers {
                seen + Vector2::new(normal(rng), normal(rng))
            } else {
                anywhere(rng)
            };
            Correspondence { pixel, point }
        })
        .collect();
    (truth, correspondences)
}

fn anywhere(rng: &mut Pcg64) -> Point2<f64> {
    Point2::new(
        rng.random_range(0.0..f64::from(KITTI.width)),
        rng.random_range(0.0..f64::from(KITTI.height)),
    )
}

fn run(correspondences: &[Correspondence]) -> Option<Consensus> {
    let params = MlesacParams::default();
    match mlesac(correspondences, &KITTI, &params, 1, |_| Ok::<_, Infallible>(())) {
        Ok(consensus) => Some(consensus),
        Err(MlesacError::NoModel { .. }) => None,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn mlesac_recovers_the_pose_among_false_matches() {
    // Outliers, correspondences, depths [m], runs, and how many of these may fail.
    let table = [
        (0.5, 600, 5.0..50.0, 100, 0),
        (0.9, 600, 5.0..50.0, 100, 0),
        (0.3, 200, 4.0..60.0, 40, 0),
        (0.3, 1000, 4.0..60.0, 40, 0),
        (0.6, 200, 4.0..60.0, 40, 0),
        (0.6, 1000, 4.0..60.0, 40, 0),
        (0.8, 200, 4.0..60.0, 40, 0),
        (0.8, 1000, 4.0..60.0, 40, 0),
        // Twenty true matches do not always pin the centre down to 0.1 m.
        (0.9, 200, 4.0..60.0, 40, 2),
        (0.9, 1000, 4.0..60.0, 40, 0),
    ];
    for (outliers, total, depth_m, runs, may_fail) in table {
        let mut rng = Pcg64::seed_from_u64(7);
        let (mut times, mut errors, mut failed) = (Vec::new(), Vec::new(), 0);
        for _ in 0..runs {
            let (truth, correspondences) = scene(&mut rng, total, outliers, depth_m.clone());
            let start = Instant::now();
            let consensus = run(&correspondences);
            times.push(start.elapsed().as_secs_f64() * 1e3);
            let error =
                consensus.map(|found| PoseError::between(&truth.inverse(), &found.pose.inverse()));
            let good = error.is_some_and(|e| e.translation_m < 0.1 && e.rotation_deg < 0.5);
            failed += usize::from(!good);
            errors.push(error.map_or(f64::INFINITY, |error| error.translation_m));
        }
        println!(
            "mlesac: {:2.0} % of {total:4} false: {failed} of {runs} failed, centre {:.4} m, {:.2} ms",
            100.0 * outliers,
            median(errors),
            median(times)
        );
        assert!(failed <= may_fail);
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Where false matches come from: patches of texture in an image, or anywhere in it.
struct Texture(Vec<(Point2<f64>, f64)>);

impl Texture {
    fn new(rng: &mut Pcg64, patches: usize) -> Self {
        Self((0..patches).map(|_| (anywhere(rng), rng.random_range(5.0..50.0))).collect())
    }

    /// A pixel with its depth \[m\].
    fn draw(&self, rng: &mut Pcg64) -> (Point2<f64>, f64) {
        if self.0.is_empty() {
            return (anywhere(rng), rng.random_range(5.0..50.0));
        }
        let (centre, depth) = self.0[rng.random_range(0..self.0.len())];
        let offset = Vector2::new(25.0 * normal(rng), 25.0 * normal(rng));
        (centre + offset, depth * (1.0 + 0.05 * normal(rng)))
    }
}

#[test]
fn matches_that_are_all_false_are_not_accepted() {
    for patches in [0, 8, 3] {
        for (total, runs) in [(8, 100), (15, 100), (30, 50), (60, 25), (128, 15), (300, 3)] {
            let mut rng = Pcg64::seed_from_u64(11);
            let (mut accepted, mut accepted_by_paper, mut most, mut needed) = (0, 0, 0, Vec::new());
            for _ in 0..runs {
                let query = Texture::new(&mut rng, patches);
                let reference = Texture::new(&mut rng, patches);
                let correspondences: Vec<_> = (0..total)
                    .map(|_| {
                        let (pixel, _) = query.draw(&mut rng);
                        let (other, depth) = reference.draw(&mut rng);
                        Correspondence { pixel, point: KITTI.unproject(&other, depth) }
                    })
                    .collect();
                let inliers = run(&correspondences).map_or(0, |found| found.inliers.len());
                let verdict = judge(&correspondences, inliers);
                accepted += usize::from(AcceptanceRule::Consensus.accepts(&verdict));
                accepted_by_paper += usize::from(AcceptanceRule::Paper.accepts(&verdict));
                most = most.max(inliers);
                needed.push(verdict.needed.map_or(f64::INFINITY, |needed| needed as f64));
            }
            println!(
                "acceptance: {total:4} false matches in {patches} patches: {accepted} of {runs} \
                 accepted (paper's rule {accepted_by_paper}), at most {most} inliers, {} needed",
                median(needed)
            );
            assert!(100 * accepted <= runs);
        }
    }
}

fn judge(correspondences: &[Correspondence], inliers: usize) -> Acceptance {
    let pixels: Vec<_> = correspondences.iter().map(|c| c.pixel).collect();
    let area = effective_area_px(&pixels, KITTI.area());
    inliers_beyond_chance(inliers, correspondences.len(), 3.0, area)
}

#[test]
fn a_few_true_matches_more_than_needed_are_accepted() {
    for (total, runs) in [(8, 50), (15, 50), (30, 50), (60, 20)] {
        let mut rng = Pcg64::seed_from_u64(13);
        for true_matches in 4..=10.min(total) {
            let outliers = 1.0 - true_matches as f64 / total as f64;
            let (mut accepted, mut good) = (0, 0);
            for _ in 0..runs {
                let (truth, correspondences) = scene(&mut rng, total, outliers, 5.0..50.0);
                let Some(found) = run(&correspondences) else {
                    continue;
                };
                let error = PoseError::between(&truth.inverse(), &found.pose.inverse());
                good += usize::from(error.translation_m < 1.0 && error.rotation_deg < 2.0);
                let verdict = judge(&correspondences, found.inliers.len());
                accepted += usize::from(AcceptanceRule::Consensus.accepts(&verdict));
            }
            println!(
                "acceptance: {true_matches:2} of {total:3} true: {accepted} of {runs} accepted, {good} good"
            );
            assert!(true_matches < 9 || 100 * accepted >= 90 * runs);
        }
    }
}
