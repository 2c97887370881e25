//! How long the stages take, on one pair of frames.
//!
//! `cargo bench -p posescope-studies -- NAME …` builds what they need and runs those of the names. With
//! `POSESCOPE_THREADS=1` in the environment everything runs on one thread. The pair is one of the street, or the one
//! that `POSESCOPE_SCENE` and `POSESCOPE_PAIR` name.

use divan::Bencher;
use divan::counter::ItemsCount;
use posescope::cost;
use posescope::method::Method;
use posescope_studies::stages::with_stage;

fn main() {
    let threads = std::env::var("POSESCOPE_THREADS").ok();
    if let Some(threads) = threads.and_then(|threads| threads.parse().ok()) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build_global().expect("the threads, once");
    }
    divan::main();
}

fn bench(bencher: Bencher, stage: &str) {
    let measured = with_stage(stage, |items, work| {
        bencher.counter(ItemsCount::new(items)).bench_local(work);
    });
    measured.expect("the name of a stage");
}

#[divan::bench(args = ["surf", "surf_upright", "sift", "sift_upright", "match"])]
fn features(bencher: Bencher, stage: &str) {
    bench(bencher, stage);
}

#[divan::bench(args = ["p3p", "pose_30_200", "pose_90_200", "pose_90_1000"])]
fn solvers(bencher: Bencher, stage: &str) {
    bench(bencher, stage);
}

/// Rendering and judging the hypotheses of a coarse search, by each cost.
#[divan::bench(args = cost::ALL.iter().map(|entry| entry.name), consts = [1, 3])]
fn hypothesis<const SPLAT_PX: usize>(bencher: Bencher, cost: &str) {
    bench(bencher, &format!("{cost}_{SPLAT_PX}"));
}

/// Rendering each hypothesis once and judging it by PM's cost and MI's, on one thread.
#[divan::bench(consts = [1, 3])]
fn hypothesis_by_both_costs<const SPLAT_PX: usize>(bencher: Bencher) {
    bench(bencher, &format!("both_{SPLAT_PX}"));
}

#[divan::bench(args = Method::PAPER.map(Method::name), sample_count = 10)]
fn whole_estimator(bencher: Bencher, method: &str) {
    bench(bencher, method);
}
