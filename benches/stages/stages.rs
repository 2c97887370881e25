//! How long the stages take, on one pair of frames.
//!
//! `cargo bench -p posescope-stages -- NAME …` builds what they need and runs those of the names.
//!
//! With `POSESCOPE_THREADS=1` in the environment everything runs on one thread. The pair is one of the
//! street, or with `POSESCOPE_SCENE=PATH` and `POSESCOPE_PAIR=QUERY,REFERENCE`, the indices of two of its
//! frames, one of any scene.

use std::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};
use std::thread;
use std::time::Instant;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::{Point2, Point3, Unit, Vector3};
use posescope::camera::Intrinsics;
use posescope::cost::{self, Cost, Evaluator, Pair};
use posescope::estimator;
use posescope::event::KindSet;
use posescope::features::{Descriptor, Features, SurfParams, nearest_neighbours, surf};
use posescope::geometry::Pose;
use posescope::grid::{GridParams, Lattice, Offset, Phase};
use posescope::image::FloatImage;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::render::{Canvas, ColoredCloud, PointArrays, Scorer, Values, color_cloud_by};
use posescope::retrieval::{Index, RetrievalParams, Vocabulary};
use posescope::robust::{MlesacParams, mlesac};
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::scene::{self, IndexOptions, Retriever};
use posescope::solver::{Correspondence, p3p};
use posescope::trace::{Cancelled, Record, Sink, Trace};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn main() {
    if let Some(threads) = std::env::var("POSESCOPE_THREADS")
        .ok()
        .and_then(|threads| threads.parse().ok())
    {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .expect("set once");
    }
    divan::main();
}

/// Two frames of the street, 8 m apart, or those that the environment names.
static PAIR: LazyLock<Problem> = LazyLock::new(|| {
    let variable = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let scene = variable("POSESCOPE_SCENE", "street");
    let indices = variable("POSESCOPE_PAIR", "70,62");
    named_pair(&scene, &indices).unwrap_or_else(|error| {
        eprintln!("error: {error}");
        std::process::exit(2);
    })
});

fn named_pair(scene: &str, indices: &str) -> Result<Problem, Box<dyn Error>> {
    let expected = || {
        format!(
            "POSESCOPE_PAIR={indices}: the indices of a query and a reference expected, as 70,62"
        )
    };
    let (query, reference) = indices.split_once(',').ok_or_else(expected)?;
    let index = |text: &str| text.trim().parse::<usize>().map_err(|_| expected());
    let scene = scene::open(scene, None)?;
    let known = |index: usize| match scene.frames().len() {
        frames if index < frames => Ok(index),
        frames => Err(format!(
            "POSESCOPE_PAIR={indices}: {} has {frames} frames, 0 to {}",
            scene.name(),
            frames.saturating_sub(1)
        )),
    };
    Ok(Problem {
        query: scene.query(known(index(query)?)?)?,
        reference: scene.reference(known(index(reference)?)?)?,
        uncertainty_radius_m: 15.0,
        prior_m: None,
        seed: 0,
        matches: None,
    })
}

static FEATURES: LazyLock<(Features, Features)> = LazyLock::new(|| {
    let params = SurfParams::default();
    (
        surf(&PAIR.query.photo.gray, &params),
        surf(&PAIR.reference.photo.gray, &params),
    )
});

#[divan::bench(args = [true, false])]
fn surf_one_image(bencher: Bencher, upright: bool) {
    let params = SurfParams {
        upright,
        ..SurfParams::default()
    };
    let image = &PAIR.query.photo.gray;
    bencher.bench(|| surf(black_box(image), &params));
}

#[divan::bench]
fn match_one_way(bencher: Bencher) {
    let (query, reference) = &*FEATURES;
    let pairs = query.descriptors.len() * reference.descriptors.len();
    bencher
        .counter(ItemsCount::new(pairs))
        .bench(|| nearest_neighbours(black_box(&query.descriptors), &reference.descriptors));
}

type Bearings = [Unit<Vector3<f64>>; 3];
type Points = [Point3<f64>; 3];

/// Random problems that have a solution.
fn p3p_problems(count: usize) -> Vec<(Bearings, Points)> {
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

#[divan::bench]
fn p3p_thousand_problems(bencher: Bencher) {
    let problems = p3p_problems(1000);
    bencher.counter(ItemsCount::new(problems.len())).bench(|| {
        problems
            .iter()
            .map(|(bearings, points)| p3p(black_box(bearings), points).len())
            .sum::<usize>()
    });
}

/// 600 correspondences with 1 px of noise, of which a share is false.
#[divan::bench(args = [50, 90])]
fn mlesac_percent_outliers(bencher: Bencher, percent: usize) {
    let intrinsics: Intrinsics = PAIR.query.intrinsics;
    let mut rng = Pcg64::seed_from_u64(2);
    let camera_from_world = random_pose(&mut rng);
    let correspondences: Vec<Correspondence> = (0..600)
        .map(|i| {
            let point = random_point(&mut rng);
            let shown = if i % 100 < percent {
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
        })
        .collect();
    let params = MlesacParams::default();
    bencher.bench(|| {
        mlesac(black_box(&correspondences), &intrinsics, &params, 0, |_| {
            Ok::<_, ()>(())
        })
    });
}

/// Rendering and judging the hypotheses of a coarse search.
#[divan::bench(args = cost::ALL.iter().map(|entry| entry.name), consts = [1, 3])]
fn hypothesis<const SPLAT_PX: usize>(bencher: Bencher, name: &str) {
    let cost = registered_cost(name);
    let (query, cloud) = seen_by(cost.as_ref());
    let intrinsics = &PAIR.query.intrinsics;
    let scorer = Scorer::new(&cloud.points, query, intrinsics, SPLAT_PX, cost.as_ref());
    let poses = poses_of_a_disc();
    bencher
        .counter(ItemsCount::new(poses.len()))
        .bench(|| scorer.score(black_box(&poses)));
}

/// Rendering a hypothesis once and judging it by PM's cost and MI's, on one thread.
#[divan::bench(consts = [1, 3])]
fn hypothesis_by_both_costs<const SPLAT_PX: usize>(bencher: Bencher) {
    let [photometric, information] = ["pm", "mi"].map(registered_cost);
    let (query, cloud) = seen_by(information.as_ref());
    let (Evaluator::Pairs(mut error), Evaluator::Counts { bins, mut cost }) =
        (photometric.evaluator(), information.evaluator())
    else {
        unreachable!("PM looks at pairs, MI at their histogram");
    };
    let of_points: Vec<f32> = cloud.points.iter().map(|point| point.intensity).collect();
    let values = Values {
        query: &query,
        points: &of_points,
    };
    let points = PointArrays::new(&cloud.points);
    let mut canvas = Canvas::new(&PAIR.query.intrinsics, SPLAT_PX).expect("a photo of usual size");
    let (mut bin_pairs, mut counts) = (Vec::new(), Vec::new());
    let bin = |value: f32| cost::bin(value, bins) as u8;
    let poses = poses_of_a_disc();
    bencher
        .counter(ItemsCount::new(poses.len()))
        .bench_local(|| {
            let mut sum = 0.0;
            for pose in black_box(&poses) {
                let pairs = canvas.draw(&points, values, &pose.inverse());
                bin_pairs.clear();
                bin_pairs.extend(pairs.iter().map(|pair| Pair {
                    query: bin(pair.query),
                    synthetic: bin(pair.synthetic),
                }));
                cost::count_pairs(&bin_pairs, bins, &mut counts);
                sum += error(pairs).unwrap_or_default() + cost(&counts).unwrap_or_default();
            }
            sum
        });
}

fn registered_cost(name: &str) -> Box<dyn Cost> {
    let entry = cost::ALL.iter().find(|entry| entry.name == name);
    (entry.expect("is listed").params)().cost()
}

/// The query of the pair and the cloud of its reference, as a cost looks at them.
fn seen_by(cost: &dyn Cost) -> (Arc<FloatImage>, ColoredCloud) {
    let (query, reference) = (&PAIR.query, &PAIR.reference);
    let cloud = color_cloud_by(
        &reference.cloud,
        &reference.intrinsics,
        &Params::default().render,
        cost.reference_channel(&reference.photo.gray),
    );
    (Arc::new(cost.query_channel(&query.photo.gray)), cloud)
}

/// The cameras of the coarse search in a disc of 10 m.
fn poses_of_a_disc() -> Vec<Pose> {
    let centre = Offset::default();
    let lattice = Lattice::new(Phase::PositionCoarse, centre, 10.0, &GridParams::default());
    let hypotheses = lattice.expect("a small lattice");
    let hypotheses = hypotheses.hypotheses();
    hypotheses
        .map(|(_, offset)| offset.reference_from_camera())
        .collect()
}

#[divan::bench(args = Method::PAPER.map(Method::name), sample_count = 10)]
fn whole_estimator(bencher: Bencher, name: &str) {
    let method: Method = name.parse().expect("is listed");
    let estimator = estimator::entry(method).make(&Params::default());
    bencher.bench(|| estimator.estimate(black_box(&PAIR), &mut Trace::off()));
}

/// How long a run goes on after it was asked to stop. The moments at which it is asked are spread over
/// the run, so that the slowest is what somebody at the window waits at worst.
#[divan::bench(args = Method::PAPER.map(Method::name), sample_count = 60, sample_size = 1)]
fn stopped(bencher: Bencher, name: &str) {
    const MOMENTS: u32 = 60;
    let method: Method = name.parse().expect("is listed");
    let run = move |flag: &AtomicBool| {
        let estimator = estimator::entry(method).make(&Params::default());
        estimator.estimate(&PAIR, &mut Trace::watched(&mut UntilStopped, flag))
    };
    LazyLock::force(&PAIR);
    let begun = Instant::now();
    run(&AtomicBool::new(false)).expect("nobody stops it");
    let whole = begun.elapsed();
    let mut moment = 0;
    bencher
        .with_inputs(|| {
            let flag = Arc::new(AtomicBool::new(false));
            let worker = {
                let flag = Arc::clone(&flag);
                thread::spawn(move || run(&flag).is_err())
            };
            thread::sleep(whole * (moment % MOMENTS) / MOMENTS);
            moment += 1;
            (flag, worker)
        })
        .bench_local_values(|(flag, worker)| {
            flag.store(true, Ordering::Release);
            worker.join()
        });
}

/// Wants to hear nothing, and stops the run when its flag is up.
struct UntilStopped;

impl Sink for UntilStopped {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }
    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }
    fn attend(&mut self) -> Result<(), Cancelled> {
        Err(Cancelled)
    }
}

/// Making a frame of the street, past the cache.
mod frame {
    use super::*;

    const FRAME: usize = 70;

    fn drives() -> Vec<(Size, Condition)> {
        let sizes = [Size::Full, Size::Half].into_iter();
        sizes
            .flat_map(|size| Condition::ALL.map(|condition| (size, condition)))
            .collect()
    }

    fn traversal((size, condition): (Size, Condition)) -> Traversal {
        Traversal::new(WORLD_SEED, condition, size)
    }

    #[divan::bench(args = drives(), sample_count = 10)]
    fn photo(bencher: Bencher, drive: (Size, Condition)) {
        let drive = traversal(drive);
        bencher.bench(|| drive.image(black_box(FRAME)));
    }

    #[divan::bench(args = drives(), sample_count = 10)]
    fn photo_and_scan(bencher: Bencher, drive: (Size, Condition)) {
        let drive = traversal(drive);
        bencher.bench(|| (drive.image(black_box(FRAME)), drive.cloud(black_box(FRAME))));
    }

    /// The same for both sizes.
    #[divan::bench(args = Condition::ALL, sample_count = 10)]
    fn scan(bencher: Bencher, condition: Condition) {
        let drive = traversal((Size::Full, condition));
        bencher.bench(|| drive.cloud(black_box(FRAME)));
    }
}

/// Random words of unit length, and as many descriptors near them.
fn words_and_descriptors(count: usize) -> (Vec<Descriptor>, Vec<Descriptor>) {
    let mut rng = Pcg64::seed_from_u64(3);
    let words: Vec<Descriptor> = (0..count)
        .map(|_| std::array::from_fn(|_| rng.random_range(-0.2..0.2)))
        .collect();
    let descriptors = words
        .iter()
        .map(|word| word.map(|value| value + rng.random_range(-0.05..0.05)))
        .collect();
    (words, descriptors)
}

/// The nearest of 10,000 visual words, for 1,000 descriptors.
#[divan::bench(args = [32, 128, 512])]
fn nearest_words_by_checks(bencher: Bencher, checks: usize) {
    let (words, descriptors) = words_and_descriptors(10_000);
    let vocabulary = Vocabulary::new(words, RetrievalParams::default().trees, checks, 0);
    bencher
        .counter(ItemsCount::new(1000_usize))
        .bench(|| vocabulary.quantize(black_box(&descriptors[..1000])));
}

/// A query after its features were made: an index of 20 frames of the street, 2,000 words.
#[divan::bench(args = [0, 20])]
fn retrieval_query_verifying(bencher: Bencher, verify: usize) {
    let street = scene::open("street", None).expect("is built in");
    let params = Params::default();
    let options = IndexOptions {
        words: 2000,
        every: 40,
        seed: 0,
    };
    let mut request = Retriever::request(street.as_ref(), &options, &params);
    request.frames.truncate(20);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("street");
    Retriever::build(street.as_ref(), &path, &request, &params, |_| ()).expect("is built");
    let index = Index::open(&path, params.retrieval.checks).expect("just built");
    let features = surf(&PAIR.query.photo.gray, &params.retrieval.surf(&params.surf));
    let params = RetrievalParams {
        verify,
        ..params.retrieval
    };
    bencher.bench(|| index.query(black_box(&features), &params, |_| true));
}
