//! What a large index costs: time to build, size of the file, time of a query, memory.
//!
//! `cargo run --release --no-default-features --example retrieval_size -- build FILE` and then
//! `… -- query FILE`, in a process of its own so that its memory is that of queries alone.
//!
//! The descriptors are synthetic: 4,500 frames along a road of landmarks, of which each shows 1,000,
//! the next frame 900 of the same, moved; every view of a landmark has its own noise. They say what
//! an index costs, and nothing about how well it finds places.
//!
//! Options: `--frames N` (4500), `--features N` per frame (1000), `--words N` (10000).

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::Path;
use std::time::{Duration, Instant};

use posescope::features::{Descriptor, Features, Keypoint};
use posescope::retrieval::{BuildRequest, BuildStep, Index, RetrievalParams, build};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// Landmarks look like one of so many things.
const LOOKS: u64 = 100_000;
/// The share of a frame's landmarks that the next frame does not show is one in so many.
const STEPS: usize = 10;
/// Greatest deviation of a number of a descriptor: about a third of what SURF's numbers are.
const NOISE: f32 = 0.04;
const QUERIES: usize = 200;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let (mut frames, mut features, mut words) = (4500, 1000, 10_000);
    let mut plain = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let number = match argument.as_str() {
            "--frames" => &mut frames,
            "--features" => &mut features,
            "--words" => &mut words,
            _ => {
                plain.push(argument);
                continue;
            }
        };
        let value = arguments.next();
        *number = value.ok_or("a number is missing")?.parse()?;
    }
    match plain.as_slice() {
        [command, file] if command == "build" => {
            build_index(Path::new(file), frames, features, words)
        }
        [command, file] if command == "query" => query(Path::new(file), frames, features),
        _ => Err("build FILE or query FILE expected".into()),
    }
}

fn build_index(path: &Path, frames: usize, features: usize, words: usize) -> Result<(), Failure> {
    let params = RetrievalParams::default();
    let request = BuildRequest {
        scene: "synthetic".to_owned(),
        fingerprint: 0,
        frames: (0..frames).collect(),
        words,
        seed: 0,
        sample: params.sample,
        iterations: params.iterations,
        trees: params.trees,
        checks: params.checks,
        recipe: BTreeMap::new(),
    };
    let started = Instant::now();
    let mut ended = [Duration::ZERO; 3];
    let view = |frame| Ok::<_, Infallible>(view(frame, features, 0));
    let summary = build(path, &request, view, |progress| {
        ended[progress.step as usize] = started.elapsed();
        if progress.step == BuildStep::Vocabulary {
            eprintln!("round {}, {:.1?}", progress.done, started.elapsed());
        }
    })?;
    let [made, learnt, quantized] = ended;
    println!(
        "{summary:?}\ndescriptors {made:.1?}, vocabulary {:.1?}, words {:.1?}, in all {:.1?} on {} threads",
        learnt - made,
        quantized - learnt,
        started.elapsed(),
        rayon::current_num_threads(),
    );
    print_memory("peak", "VmHWM");
    Ok(())
}

fn query(path: &Path, frames: usize, features: usize) -> Result<(), Failure> {
    print_memory("before", "VmRSS");
    let params = RetrievalParams::default();
    let started = Instant::now();
    let index = Index::open(path, params.checks)?;
    println!("opened in {:.1?}", started.elapsed());
    print_memory("open", "VmRSS");
    for (what, verify) in [("by scores", 0), ("verified", params.verify)] {
        let params = RetrievalParams { verify, ..params };
        let mut times = Vec::new();
        let mut near = 0;
        let mut work = Duration::ZERO;
        for query in 0..QUERIES {
            let place = query * frames / QUERIES;
            let features = view(place, features, 1);
            let started = Instant::now();
            let worked = cpu_time();
            let ranked = index.query(&features, &params, |_| true).ranked;
            times.push(started.elapsed());
            work += cpu_time() - worked;
            let first = ranked.first().map(|first| first.frame);
            near += usize::from(first.is_some_and(|frame| frame.abs_diff(place) <= 2));
        }
        times.sort_unstable();
        println!(
            "{what}: median {:.1?}, 95 % {:.1?}, most {:.1?}, of processors {:.1?} on average; first \
             frame near in {near} of {QUERIES}",
            times[QUERIES / 2],
            times[QUERIES * 95 / 100],
            times[QUERIES - 1],
            work / QUERIES as u32,
        );
    }
    print_memory("after the queries", "VmRSS");
    print_memory("of it, pages of files", "RssFile");
    Ok(())
}

/// What is seen of the road from a frame; `visit` changes the noise.
fn view(frame: usize, features: usize, visit: u64) -> Features {
    let first = frame * features / STEPS;
    let landmarks = first..first + features;
    let mut noise = Pcg64::seed_from_u64(frame as u64 + (visit << 40));
    let keypoints = landmarks.clone().map(|landmark| Keypoint {
        x: 1241.0 * (landmark - first) as f32 / features as f32,
        y: (landmark * 7919 % 376) as f32,
        scale: 2.0,
        angle: 0.0,
        response: 1.0,
        laplacian_positive: true,
    });
    let descriptors = landmarks.map(|landmark| {
        let look = Pcg64::seed_from_u64(landmark as u64).random_range(0..LOOKS);
        let mut look = Pcg64::seed_from_u64(look);
        let descriptor: Descriptor = std::array::from_fn(|_| {
            // Most numbers of a descriptor are small.
            let value: f32 = look.random_range(-1.0..1.0);
            0.35 * value * value * value + noise.random_range(-NOISE..NOISE)
        });
        descriptor
    });
    Features {
        keypoints: keypoints.collect(),
        descriptors: descriptors.collect(),
    }
}

/// What all threads of this process have worked, where the system tells: other programs make queries
/// wait, but do not add to it.
fn cpu_time() -> Duration {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let of_thread = |thread: std::fs::DirEntry| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<u64>().ok()
    };
    Duration::from_nanos(threads.flatten().filter_map(of_thread).sum())
}

/// Prints the memory of this process, where the system tells.
fn print_memory(when: &str, field: &str) {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    if let Some(line) = status.lines().find(|line| line.starts_with(field)) {
        println!(
            "memory, {when}: {}",
            line.split_whitespace().collect::<Vec<_>>().join(" ")
        );
    }
}
