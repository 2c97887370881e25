use std::convert::Infallible;

use posescope::estimator;
use posescope::features::{MatchVerdict, SurfParams, best_matches, surf};
use posescope::geometry::PoseError;
use posescope::image::GrayImage;
use posescope::localize::localize;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene::{self, Scene};

use crate::Failure;
use crate::numbers::{mean, percent, percentile, print_table};

/// Frames that stand for a scene.
const FRAMES: usize = 10;
/// Distances of two frames \[m\]; a pair counts for one that it meets within a sixth.
const DISTANCES_M: [f64; 3] = [6.0, 10.0, 18.0];
/// The ratio of the match statistics, stricter than FB's own.
const MAX_RATIO: f32 = 0.8;

/// What are photos and scans of a scene like, in figures?
///
/// Prints a column per scene: grey values, gradients, the slope of the power spectrum, SURF keypoints, matches and
/// errors of FB against the distance of two frames, mutual information at the true pose. Scenes without scans have no
/// figures for what needs them.
#[derive(clap::Args)]
pub struct Options {
    #[arg(required = true)]
    scenes: Vec<String>,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let mut head = String::new();
    let mut rows: Vec<Vec<String>> = Vec::new();
    for argument in &options.scenes {
        let scene = scene::open(argument, None)?;
        head += &format!(",{}", scene.name());
        for (at, (name, figure)) in statistics(scene.as_ref())?.into_iter().enumerate() {
            if rows.len() == at {
                rows.push(vec![name]);
            }
            rows[at].push(figure);
        }
    }
    print_table(&head, &rows);
    Ok(())
}

type Rows = Vec<(String, String)>;

fn statistics(scene: &dyn Scene) -> Result<Rows, Failure> {
    let count = scene.frames().len();
    let step = count.div_ceil(FRAMES);
    let frames: Vec<usize> = (0..count).step_by(step).collect();
    let photos = frames
        .iter()
        .map(|&frame| Ok(scene.photo(frame)?.gray))
        .collect::<Result<Vec<_>, Failure>>()?;

    let mut grey: Vec<f64> =
        photos.iter().flat_map(|photo| photo.iter().copied().map(f64::from)).collect();
    let average = mean(grey.iter().copied());
    let deviation = mean(grey.iter().map(|value| (value - average).powi(2))).sqrt();
    let shares =
        [0.05, 0.25, 0.5, 0.75, 0.95].map(|share| format!("{:.0}", percentile(&mut grey, share)));
    let mut gradients: Vec<f64> = photos.iter().flat_map(gradients).collect();
    let [steep, half, most] = [
        mean(gradients.iter().copied()),
        percentile(&mut gradients, 0.5),
        percentile(&mut gradients, 0.9),
    ];
    let keypoints = |photo| surf(photo, &SurfParams::default()).keypoints.len() as f64;
    let covered = lidar_share(scene, &frames)?;
    let mut rows: Rows = [
        ("grey value, mean ± deviation", format!("{average:.0} ± {deviation:.0}")),
        ("… at 5, 25, 50, 75, 95 %", shares.join(", ")),
        ("gradient, mean / median / 90 %", format!("{steep:.1} / {half:.1} / {most:.1}")),
        ("power spectrum, slope", format!("{:.2}", mean(photos.iter().map(spectrum_slope)))),
        ("SURF keypoints", format!("{:.0}", mean(photos.iter().map(keypoints)))),
        ("image within 4 px of a LiDAR point, %", figure(mean(covered), 0)),
    ]
    .map(|(name, figure)| (name.to_owned(), figure))
    .into();
    for distance_m in DISTANCES_M {
        pairs(scene, &frames, distance_m, &mut rows)?;
    }
    Ok(rows)
}

/// A number with so many digits; a dash where nothing is known.
fn figure(value: f64, digits: usize) -> String {
    if value.is_nan() { "–".to_owned() } else { format!("{value:.digits$}") }
}

/// Magnitudes of central differences.
fn gradients(photo: &GrayImage) -> Vec<f64> {
    let at = |x: u32, y: u32| f64::from(photo.get_pixel(x, y).0[0]);
    let magnitude = |x, y| (at(x + 1, y) - at(x - 1, y)).hypot(at(x, y + 1) - at(x, y - 1)) / 2.0;
    let rows = 1..photo.height() - 1;
    rows.flat_map(|y| (1..photo.width() - 1).map(move |x| magnitude(x, y))).collect()
}

/// Slope of log power over log frequency along the rows, between 1/64 and 1/4 cycles per pixel;
/// natural images have about −2.
fn spectrum_slope(photo: &GrayImage) -> f64 {
    let length = photo.width() as usize;
    // A few frequencies, evenly spaced in their logarithm.
    let cycles: Vec<f64> =
        (0..=16).map(|i| (length as f64 / 64.0 * 2f64.powf(f64::from(i) / 4.0)).round()).collect();
    let mut power = vec![0.0; cycles.len()];
    for row in photo.rows().step_by(4) {
        let values: Vec<f64> = row.map(|pixel| f64::from(pixel.0[0])).collect();
        let average = mean(values.iter().copied());
        for (sum, cycles) in power.iter_mut().zip(&cycles) {
            let (mut cosine, mut sine) = (0.0, 0.0);
            for (x, value) in values.iter().enumerate() {
                let phase = std::f64::consts::TAU * x as f64 / length as f64;
                // A Hann window, because the row's ends do not meet.
                let windowed = (value - average) * (0.5 - 0.5 * phase.cos());
                cosine += windowed * (cycles * phase).cos();
                sine += windowed * (cycles * phase).sin();
            }
            *sum += cosine * cosine + sine * sine;
        }
    }
    let points = cycles.iter().zip(&power);
    let points: Vec<(f64, f64)> = points.map(|(cycles, power)| (cycles.ln(), power.ln())).collect();
    let (x, y) = (mean(points.iter().map(|p| p.0)), mean(points.iter().map(|p| p.1)));
    let covariance: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    covariance / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

/// Share of the pixels that have a projected scan point within 4 px \[%\].
fn lidar_share(scene: &dyn Scene, frames: &[usize]) -> Result<Vec<f64>, Failure> {
    const REACH: i64 = 4;
    let mut shares = Vec::new();
    for &frame in frames.iter().filter(|&&frame| scene.has_cloud(frame)) {
        let intrinsics = scene.intrinsics(frame);
        let (width, height) = (i64::from(intrinsics.width), i64::from(intrinsics.height));
        let mut covered = vec![false; (width * height) as usize];
        for point in &scene.cloud(frame)?.points {
            let Some(pixel) = intrinsics.project(&point.cast()) else {
                continue;
            };
            let (u, v) = (pixel.x.round() as i64, pixel.y.round() as i64);
            if u < 0 || v < 0 || u >= width || v >= height {
                continue;
            }
            for y in (v - REACH).max(0)..(v + REACH + 1).min(height) {
                for x in (u - REACH).max(0)..(u + REACH + 1).min(width) {
                    covered[(y * width + x) as usize] |=
                        (x - u).pow(2) + (y - v).pow(2) <= REACH * REACH;
                }
            }
        }
        let count = covered.iter().filter(|pixel| **pixel).count();
        shares.push(percent(count, covered.len()));
    }
    Ok(shares)
}

/// Matches, FB and mutual information between frames a distance apart.
fn pairs(
    scene: &dyn Scene,
    frames: &[usize],
    distance_m: f64,
    rows: &mut Rows,
) -> Result<(), Failure> {
    let [mut survivors, mut inliers, mut errors, mut information] = [const { Vec::new() }; 4];
    for &reference in frames {
        let Some(query) = ahead(scene, reference, distance_m) else {
            continue;
        };
        let query_frame = scene.query(query)?;
        let photo = scene.photo(reference)?;
        let [q, r] = [&query_frame.photo().gray, &photo.gray]
            .map(|gray| surf(gray, &SurfParams::default()).descriptors);
        let Ok(matches) = best_matches(&q, &r, MAX_RATIO, || Ok::<_, Infallible>(()));
        let kept = matches.iter().flatten();
        let kept = kept.filter(|found| found.verdict == MatchVerdict::Candidate);
        survivors.push(kept.count() as f64);
        let (true, Some(truth)) = (scene.has_cloud(reference), scene.pose(query)) else {
            continue;
        };
        let problem = Problem::new(query_frame, scene.reference(reference)?, 2.0 * distance_m)?;
        let params = Params::default();
        let outcome = localize(&problem, Method::FB, &params);
        let off_m = |pose| PoseError::between(&truth, &pose).translation_m;
        errors.push(outcome.pose.map_or(f64::INFINITY, off_m));
        inliers.extend(outcome.counts.map(|counts| counts.inliers as f64));
        let direct = estimator::entry(Method::MI).make(&params);
        let at_truth = direct.compare_at(&problem, &truth);
        information.extend(at_truth.and_then(|seen| seen.score.cost).map(|cost| 1.0 - cost));
    }
    let found = [
        ("unique matches, ratio 0.8", survivors, 0),
        ("FB, inliers", inliers, 0),
        ("FB, error [m]", errors, 2),
        ("NMI at the true pose", information, 3),
    ];
    for (what, mut values, digits) in found {
        let name = format!("{distance_m:.0} m apart: {what}");
        rows.push((name, figure(percentile(&mut values, 0.5), digits)));
    }
    Ok(())
}

/// The frame nearest to `distance_m` ahead of another, if one is within a sixth.
fn ahead(scene: &dyn Scene, frame: usize, distance_m: f64) -> Option<usize> {
    let here = scene.pose(frame)?;
    let deviation = |other: usize| {
        let there = scene.pose(other)?;
        let seen = here.inverse() * nalgebra::Point3::from(there.translation.vector);
        (seen.z > 0.0).then(|| (seen.coords.norm() - distance_m).abs())
    };
    (0..scene.frames().len())
        .filter_map(|other| Some((deviation(other)?, other)))
        .filter(|(deviation, _)| *deviation <= distance_m / 6.0)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, other)| other)
}
