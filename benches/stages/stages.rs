//! How long the stages take, on one pair of frames.
//!
//! `cargo bench -p posescope-stages -- NAME …` builds what they need and runs those of the names.
//!
//! With `POSESCOPE_THREADS=1` in the environment everything runs on one thread. The pair is one of the
//! street, or with `POSESCOPE_SCENE=PATH` and `POSESCOPE_PAIR=QUERY,REFERENCE`, the indices of two of its
//! frames, one of any scene.

mod both_costs;
mod pair;
mod problems;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};
use std::thread;
use std::time::Instant;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use posescope::camera::Intrinsics;
use posescope::cost;
use posescope::estimator;
use posescope::event::KindSet;
use posescope::features::{Descriptor, Features, SurfParams, nearest_neighbours, surf};
use posescope::method::Method;
use posescope::params::Params;
use posescope::render::Scorer;
use posescope::retrieval::{Index, RetrievalParams, Vocabulary};
use posescope::robust::{MlesacParams, mlesac};
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::scene::{self, IndexOptions, Retriever};
use posescope::solver::p3p;
use posescope::trace::{Cancelled, Record, Sink, Trace};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use self::both_costs::with_both_costs;
use self::pair::{PAIR, poses_of_a_disc, registered_cost, seen_by};
use self::problems::{Outliers, p3p_problems};

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
    let case = Outliers {
        percent,
        correspondences: 600,
    };
    let (correspondences, _) = case.draw(2);
    let intrinsics: Intrinsics = PAIR.query.intrinsics;
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
    let poses = poses_of_a_disc();
    let bencher = bencher.counter(ItemsCount::new(poses.len()));
    with_both_costs(SPLAT_PX, |judge| {
        bencher.bench_local(|| judge(black_box(&poses)).sum);
    });
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
