//! What a second thread is worth: searches and SURF by the clock, on one thread and on several.
//!
//! `cargo bench -p posescope-stages --bench threads -- [THREADS]` (2) takes the numbers of threads in turn and
//! prints the least time of each. Whatever else runs takes a processor away, so the load is printed too. The pair is
//! that of the stages, named in the environment.

mod pair;

use std::error::Error;
use std::fs;
use std::time::Instant;

use posescope::estimator;
use posescope::features::{SurfParams, surf};
use posescope::method::Method;
use posescope::params::Params;
use posescope::render::Scorer;
use posescope::trace::Trace;
use rayon::ThreadPool;

use self::pair::{PAIR, poses_of_a_disc, registered_cost, seen_by};

const ROUNDS: usize = 25;

type Work<'a> = Box<dyn Fn() + Sync + 'a>;

fn main() -> Result<(), Box<dyn Error>> {
    let threads = std::env::args()
        .skip(1)
        .find(|argument| argument != "--bench");
    let threads = threads.map_or(Ok(2), |threads| threads.parse())?;
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pools = [pool(1)?, pool(threads)?];
    let search = |name: &str| -> Result<Work<'static>, Box<dyn Error>> {
        let method: Method = name.parse()?;
        let estimator = estimator::entry(method).make(&Params::default());
        Ok(Box::new(move || {
            let found = estimator.estimate(&PAIR, &mut Trace::off());
            std::hint::black_box(found).ok();
        }))
    };
    let poses = poses_of_a_disc();
    let cost = registered_cost("mi");
    let (query, cloud) = seen_by(cost.as_ref());
    let scorer = Scorer::new(
        &cloud.points,
        query,
        &PAIR.query.intrinsics,
        1,
        cost.as_ref(),
    );
    let turning = SurfParams {
        upright: false,
        ..SurfParams::default()
    };
    let photo = &PAIR.query.photo.gray;
    let stages: [(&str, Work<'_>); 5] = [
        (
            "its hypotheses in a disc, of MI",
            Box::new(|| drop(std::hint::black_box(scorer.score(&poses)))),
        ),
        ("search of PM", search("pm")?),
        ("search of MI", search("mi")?),
        (
            "SURF of a photo, turning",
            Box::new(move || drop(std::hint::black_box(surf(photo, &turning)))),
        ),
        (
            "SURF of a photo, upright",
            Box::new(|| drop(std::hint::black_box(surf(photo, &SurfParams::default())))),
        ),
    ];
    println!("load before: {}", load());
    println!("\n| stage | 1 thread (ms) | {threads} threads (ms) | ratio |\n|---|--:|--:|--:|");
    for (stage, work) in stages {
        let [one, several] = least(&pools, &*work);
        println!(
            "| {stage} | {one:.2} | {several:.2} | {:.2} |",
            one / several
        );
    }
    println!("\nload after: {}", load());
    Ok(())
}

/// The least time of each pool, which work in turns \[ms\].
fn least(pools: &[ThreadPool; 2], work: &(dyn Fn() + Sync)) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        for (pool, least) in pools.iter().zip(&mut least) {
            let begun = Instant::now();
            pool.install(work);
            *least = least.min(1e3 * begun.elapsed().as_secs_f64());
        }
    }
    least
}

/// Processes that want to run, where the system tells: over the last 1, 5 and 15 minutes.
fn load() -> String {
    let told = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let told: Vec<&str> = told.split_whitespace().take(3).collect();
    match told.as_slice() {
        [] => "unknown".to_owned(),
        told => told.join(", "),
    }
}
