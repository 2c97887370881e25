use std::sync::Arc;

use cpu_time::ProcessTime;
use posescope::camera::Intrinsics;
use posescope::cost::{Cost, MutualInformation};
use posescope::features::{SurfParams, nearest_neighbours, surf};
use posescope::image::{FloatImage, GrayImage};
use posescope::render::{ColoredCloud, ColoredPoint, Scorer};
use posescope_studies::{PAIR, poses_of_a_disc, registered_cost, seen_by};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::Failure;
use crate::numbers::{median, print_table};

const POINTS: [usize; 8] = [2_000, 5_000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000];
/// Sides of the photo, as multiples of what they are.
const SCALES: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 3.0];
const BINS: [usize; 7] = [4, 8, 16, 32, 64, 128, 256];
const KEYPOINTS: [usize; 6] = [500, 1_000, 2_000, 5_000, 10_000, 20_000];
/// Every so many poses of the disc are scored.
const EVERY: usize = 4;

/// How does the time of the stages grow with points, pixels, bins and keypoints?
///
/// Everything runs on one thread, and times are the processor's. The pair is one of the street, or the one that
/// POSESCOPE_SCENE and POSESCOPE_PAIR name.
#[derive(clap::Args)]
pub struct Options {
    /// Rounds, of which the median counts.
    #[arg(long, default_value_t = 5)]
    rounds: usize,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let rounds = options.rounds;
    let (query, cloud) = seen_by(registered_cost("pm").as_ref());
    let camera = PAIR.query().intrinsics();
    // A hypothesis of PM and one of MI [µs].
    let of_both = |points: &[ColoredPoint], query: &Arc<FloatImage>, camera: &Intrinsics| {
        let costs = ["pm", "mi"].map(registered_cost);
        costs.map(|cost| hypothesis(points, query, camera, cost.as_ref(), rounds))
    };
    let rows =
        POINTS.map(|count| row(count, of_both(&dense(&cloud.points, count), &query, camera)));
    print_table("points,PM (µs),MI (µs)", &rows);
    let rows = SCALES.map(|scale| {
        let camera = scaled(camera, scale);
        let back = |at: u32, size: u32| ((f64::from(at) / scale) as u32).min(size - 1);
        let pixel = |x, y| *query.get_pixel(back(x, query.width()), back(y, query.height()));
        let query = Arc::new(FloatImage::from_fn(camera.width, camera.height, pixel));
        row(camera.area(), of_both(&cloud.points, &query, &camera))
    });
    print_table("pixels,PM (µs),MI (µs)", &rows);
    let rows = BINS.map(|bins| {
        let mut cost = MutualInformation::default();
        cost.bins = bins;
        let (query, cloud) = seen_by(&cost);
        row(bins, [hypothesis(&cloud.points, &query, camera, &cost, rounds)])
    });
    print_table("bins,MI (µs)", &rows);
    by_keypoints(rounds);
    Ok(())
}

fn row(of: impl ToString, times: impl IntoIterator<Item = f64>) -> Vec<String> {
    let times = times.into_iter().map(|time| format!("{time:.3}"));
    [of.to_string()].into_iter().chain(times).collect()
}

/// So many points. More than there are come from copies that stand a few centimetres aside.
fn dense(points: &[ColoredPoint], count: usize) -> Vec<ColoredPoint> {
    const ASIDE_M: f32 = 0.05;
    let mut rng = Pcg64::seed_from_u64(4);
    let mut point = |i: usize| {
        let mut point = points[i * points.len() / count];
        if count > points.len() {
            for coordinate in point.position.coords.iter_mut() {
                *coordinate += rng.random_range(-ASIDE_M..ASIDE_M);
            }
        }
        point
    };
    (0..count).map(&mut point).collect()
}

fn scaled(intrinsics: &Intrinsics, scale: f64) -> Intrinsics {
    let side = |side: u32| (f64::from(side) * scale) as u32;
    Intrinsics {
        fx: intrinsics.fx * scale,
        fy: intrinsics.fy * scale,
        cx: (intrinsics.cx + 0.5) * scale - 0.5,
        cy: (intrinsics.cy + 0.5) * scale - 0.5,
        width: side(intrinsics.width),
        height: side(intrinsics.height),
    }
}

/// Finding, describing and matching features over their number.
///
/// The photos are enlarged twice and made grainy, and nearly everything counts as a feature, so that there are
/// enough.
fn by_keypoints(rounds: usize) {
    let photos = [&PAIR.query().photo().gray, &PAIR.reference().photo().gray].map(enlarged);
    let params = |max_keypoints| {
        let mut params = SurfParams::default();
        params.threshold = 1.0;
        params.max_keypoints = max_keypoints;
        params
    };
    let most = params(KEYPOINTS[KEYPOINTS.len() - 1]);
    let [query, reference] = photos.each_ref().map(|photo| surf(photo, &most).descriptors);
    let known = query.len().min(reference.len());
    let rows = KEYPOINTS.into_iter().filter(|&count| count <= known).map(|count| {
        let found = processor_s(rounds, || surf(&photos[0], &params(count)));
        let matched =
            processor_s(rounds, || nearest_neighbours(&query[..count], &reference[..count]));
        row(count, [1e3 * found, 1e3 * matched])
    });
    let rows: Vec<_> = rows.collect();
    print_table("keypoints,SURF of a photo (ms),matching one way (ms)", &rows);
}

/// Processor time of one hypothesis \[µs\].
fn hypothesis(
    points: &[ColoredPoint],
    query: &Arc<FloatImage>,
    intrinsics: &Intrinsics,
    cost: &dyn Cost,
    rounds: usize,
) -> f64 {
    let poses: Vec<_> = poses_of_a_disc().into_iter().step_by(EVERY).collect();
    let cloud = ColoredCloud { points: points.to_vec(), ..ColoredCloud::default() };
    let scorer = Scorer::new(cloud, Arc::clone(query), intrinsics, 1, cost);
    scorer.score(&poses[..1]);
    1e6 * processor_s(rounds, || scorer.score(&poses)) / poses.len() as f64
}

/// The median of some rounds \[s\].
fn processor_s<T>(rounds: usize, mut work: impl FnMut() -> T) -> f64 {
    median((0..rounds).map(|_| {
        let begun = ProcessTime::now();
        std::hint::black_box(work());
        begun.elapsed().as_secs_f64()
    }))
}

/// Twice as wide and high, a pixel between two their mean, with grain: enlarging alone adds no blobs.
fn enlarged(photo: &GrayImage) -> GrayImage {
    const GRAIN: i32 = 24;
    let mut rng = Pcg64::seed_from_u64(5);
    let (width, height) = photo.dimensions();
    let at = |x: u32, y: u32| i32::from(photo.get_pixel(x.min(width - 1), y.min(height - 1)).0[0]);
    GrayImage::from_fn(2 * width, 2 * height, |x, y| {
        let ([left, right], [top, bottom]) = ([x / 2, x.div_ceil(2)], [y / 2, y.div_ceil(2)]);
        let mean = (at(left, top) + at(right, top) + at(left, bottom) + at(right, bottom)) / 4;
        [(mean + rng.random_range(-GRAIN..=GRAIN)).clamp(0, 255) as u8].into()
    })
}
