use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use posescope::features::{Descriptor, Features, Keypoint};
use posescope::retrieval::{BuildRequest, Clustering, Index, RetrievalParams, build};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::Failure;
use crate::numbers::{memory_mb, percentile, print_table};

/// Landmarks look like one of so many things.
const LOOKS: u64 = 100_000;
/// The share of a frame's landmarks that the next frame does not show is one in so many.
const STEPS: usize = 10;
/// Greatest deviation of a number of a descriptor: about a third of what SURF's numbers are.
const NOISE: f32 = 0.04;
const QUERIES: usize = 200;

/// What does an index cost: time to build, size of the file, time of a query, memory?
///
/// The descriptors are synthetic: frames along a road of landmarks, of which the next frame shows nine in ten again,
/// moved; every view of a landmark has its own noise. They say what an index costs, and nothing about how well it finds
/// places. Each index is built in a process of its own and queried in another, so that memory is that of one of them.
#[derive(clap::Args)]
pub struct Options {
    /// How many frames are indexed; several numbers show how the cost grows.
    #[arg(long, value_delimiter = ',', default_values_t = [1_000, 3_000, 10_000, 30_000, 100_000])]
    frames: Vec<usize>,
    /// Features of a frame.
    #[arg(long, default_value_t = 250)]
    features: usize,
    #[arg(long, default_value_t = 10_000)]
    words: usize,
    /// Build this index and say in a line what that takes.
    #[arg(long, hide = true)]
    build: Option<PathBuf>,
    /// Ask this index and say in a line what that takes.
    #[arg(long, hide = true)]
    ask: Option<PathBuf>,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let frames = *options.frames.first().ok_or("a number of frames expected")?;
    match (&options.build, &options.ask) {
        (Some(path), _) => println!("{}", cells(built(path, frames, options)?)),
        (_, Some(path)) => println!("{}", cells(queried(path, frames, options)?)),
        _ => {
            let folder = tempfile::tempdir()?;
            let path = folder.path().join("road");
            let row = |frames: &usize| {
                let [built, queried] =
                    ["--build", "--ask"].map(|what| alone(what, &path, *frames, options));
                let cells = format!("{frames} {} {}", built?, queried?);
                Ok(cells.split_whitespace().map(str::to_owned).collect())
            };
            let rows: Result<Vec<Vec<String>>, Failure> = options.frames.iter().map(row).collect();
            const HEAD: &str = "frames,vocabulary (s),words (s),lists (s),building by the clock (s),most \
                memory (MB),file (MB),opening (s),index open (MB),query (ms),… by the clock,… 95 % of them,verified (ms),\
                … by the clock,… 95 % of them,own memory (MB),pages (MB),found";
            print_table(HEAD, &rows?);
        }
    }
    Ok(())
}

/// What a part says in a process of its own.
fn alone(what: &str, path: &Path, frames: usize, options: &Options) -> Result<String, Failure> {
    let numbers =
        [("--frames", frames), ("--features", options.features), ("--words", options.words)];
    let numbers = numbers.map(|(option, number)| format!("{option}={number}"));
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("index").arg(what).arg(path).args(numbers);
    let done = command.stderr(Stdio::inherit()).output()?;
    if done.status.success() {
        Ok(String::from_utf8(done.stdout)?)
    } else {
        Err(format!("{what} of {frames} frames ended with {}", done.status).into())
    }
}

fn cells<const N: usize>(numbers: [f64; N]) -> String {
    let cells = numbers.map(|number| match number {
        small if small < 100.0 && small.fract() != 0.0 => format!("{small:.2}"),
        large => format!("{large:.0}"),
    });
    cells.join(" ")
}

fn built(path: &Path, frames: usize, options: &Options) -> Result<[f64; 6], Failure> {
    let RetrievalParams { sample, iterations, trees, checks, .. } = RetrievalParams::default();
    let words = options.words;
    let request = BuildRequest {
        scene: "synthetic".to_owned(),
        fingerprint: 0,
        frames: (0..frames).collect(),
        clustering: Clustering { words, iterations, trees, checks, seed: 0 },
        sample,
        recipe: BTreeMap::new(),
    };
    let (started, worked) = (Instant::now(), ProcessTime::now());
    let mut ended = [Duration::ZERO; 3];
    let view = |frame| Ok::<_, Infallible>(view(frame, options.features, 0));
    let summary = build(path, &request, view, |progress| {
        ended[progress.step as usize] = worked.elapsed();
    })?;
    let [made, learnt, quantized] = ended.map(|end| end.as_secs_f64());
    let whole = worked.elapsed().as_secs_f64();
    let clock = started.elapsed().as_secs_f64();
    let megabytes = summary.bytes as f64 / 1e6;
    Ok([learnt - made, quantized - learnt, whole - quantized, clock, memory_mb("VmHWM"), megabytes])
}

fn queried(path: &Path, frames: usize, options: &Options) -> Result<[f64; 11], Failure> {
    let mut params = RetrievalParams::default();
    let started = Instant::now();
    let index = Index::open(path, params.checks)?;
    let opened = started.elapsed().as_secs_f64();
    let memory_open = memory_mb("RssAnon");
    let mut found = 0;
    let [by_scores, verified] = [0, params.verify].map(|verify| {
        params.verify = verify;
        let (mut times, mut work) = (Vec::new(), Duration::ZERO);
        found = 0;
        for query in 0..QUERIES {
            let place = query * frames / QUERIES;
            let features = view(place, options.features, 1);
            let (started, worked) = (Instant::now(), ProcessTime::now());
            let ranked = index.query(&features, &params, |_| true).ranked;
            work += worked.elapsed();
            times.push(1e3 * started.elapsed().as_secs_f64());
            let first = ranked.first().map(|first| first.frame);
            found += usize::from(first.is_some_and(|frame| frame.abs_diff(place) <= 2));
        }
        let processor = 1e3 * work.as_secs_f64() / QUERIES as f64;
        [processor, percentile(&mut times, 0.5), percentile(&mut times, 0.95)]
    });
    let ([a, b, c], [d, e, f]) = (by_scores, verified);
    let [own, pages] = ["RssAnon", "RssFile"].map(memory_mb);
    Ok([opened, memory_open, a, b, c, d, e, f, own, pages, found as f64])
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
    let descriptors = landmarks.map(|landmark| -> Descriptor {
        let look = Pcg64::seed_from_u64(landmark as u64).random_range(0..LOOKS);
        let mut look = Pcg64::seed_from_u64(look);
        std::array::from_fn(|_| {
            // Most numbers of a descriptor are small.
            let value: f32 = look.random_range(-1.0..1.0);
            0.35 * value * value * value + noise.random_range(-NOISE..NOISE)
        })
    });
    Features { keypoints: keypoints.collect(), descriptors: descriptors.collect() }
}
