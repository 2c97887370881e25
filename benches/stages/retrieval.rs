//! What a large index costs: time to build, size of the file, time of a query, memory.
//!
//! `cargo bench -p posescope-stages --bench retrieval -- build FILE` and then `… -- query FILE`, in a process
//! of its own so that its memory is that of queries alone. `… -- growth FOLDER` does both for more and more
//! frames and writes a table and plots.
//!
//! The descriptors are synthetic: 4,500 frames along a road of landmarks, of which each shows 1,000,
//! the next frame 900 of the same, moved; every view of a landmark has its own noise. They say what
//! an index costs, and nothing about how well it finds places.
//!
//! Options: `--frames N` (4500), `--features N` per frame (1000; `growth` 250), `--words N` (10000),
//! `--iterations N` of the vocabulary (10).

mod table;

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use posescope::features::{Descriptor, Features, Keypoint};
use posescope::retrieval::{BuildRequest, BuildStep, Index, RetrievalParams, build};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde_json::{Value, json};

use self::table::Table;

/// Frames of `growth`.
const FRAMES: [usize; 5] = [1_000, 3_000, 10_000, 30_000, 100_000];
/// Landmarks look like one of so many things.
const LOOKS: u64 = 100_000;
/// The share of a frame's landmarks that the next frame does not show is one in so many.
const STEPS: usize = 10;
/// Greatest deviation of a number of a descriptor: about a third of what SURF's numbers are.
const NOISE: f32 = 0.04;
const QUERIES: usize = 200;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut road = Road {
        frames: 4500,
        features: None,
        words: 10_000,
        iterations: RetrievalParams::default().iterations,
    };
    let mut plain = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut number = || -> Result<usize, Failure> {
            let number = arguments.next().ok_or("a number is missing")?;
            Ok(number.parse()?)
        };
        match argument.as_str() {
            "--bench" => (),
            "--frames" => road.frames = number()?,
            "--features" => road.features = Some(number()?),
            "--words" => road.words = number()?,
            "--iterations" => road.iterations = number()?,
            _ => plain.push(argument),
        }
    }
    let plain: Vec<&str> = plain.iter().map(String::as_str).collect();
    match plain.as_slice() {
        ["build", file] => println!("{}", build_index(Path::new(file), &road)?),
        ["query", file] => println!("{}", query(Path::new(file), &road)?),
        ["growth", folder] => growth(Path::new(folder), &road)?,
        _ => return Err("build FILE, query FILE or growth FOLDER expected".into()),
    }
    Ok(())
}

/// What is indexed, and with how many words.
struct Road {
    frames: usize,
    features: Option<usize>,
    words: usize,
    iterations: usize,
}

impl Road {
    fn features(&self) -> usize {
        self.features.unwrap_or(1000)
    }
}

/// Builds an index; what it took.
fn build_index(path: &Path, road: &Road) -> Result<Value, Failure> {
    let params = RetrievalParams::default();
    let request = BuildRequest {
        scene: "synthetic".to_owned(),
        fingerprint: 0,
        frames: (0..road.frames).collect(),
        words: road.words,
        seed: 0,
        sample: params.sample,
        iterations: road.iterations,
        trees: params.trees,
        checks: params.checks,
        recipe: BTreeMap::new(),
    };
    let (started, worked) = (Instant::now(), ProcessTime::now());
    let mut ended = [[Duration::ZERO; 2]; 3];
    let features = road.features();
    let view = |frame| Ok::<_, Infallible>(view(frame, features, 0));
    let summary = build(path, &request, view, |progress| {
        ended[progress.step as usize] = [started.elapsed(), worked.elapsed()];
        if progress.step == BuildStep::Vocabulary {
            eprintln!("round {}, {:.1?}", progress.done, started.elapsed());
        }
    })?;
    let whole = [started.elapsed(), worked.elapsed()];
    let [made, learnt, quantized] = ended;
    let of = |end: [Duration; 2], begin: [Duration; 2]| {
        let [clock, processor] = [0, 1].map(|i| (end[i] - begin[i]).as_secs_f64());
        json!({ "clock_s": clock, "processor_s": processor })
    };
    Ok(json!({
        "frames": summary.frames,
        "features": summary.features,
        "file_mb": summary.bytes as f64 / 1e6,
        "making_descriptors": of(made, [Duration::ZERO; 2]),
        "vocabulary": of(learnt, made),
        "words": of(quantized, learnt),
        "writing_lists": of(whole, quantized),
        "threads": rayon::current_num_threads(),
        "peak_mb": memory_mb("VmHWM"),
    }))
}

/// Asks an index; what it took.
fn query(path: &Path, road: &Road) -> Result<Value, Failure> {
    let params = RetrievalParams::default();
    let started = Instant::now();
    let index = Index::open(path, params.checks)?;
    let opened = started.elapsed();
    let memory_open = memory_mb("RssAnon");
    let mut asked = serde_json::Map::new();
    for (what, verify) in [("by_scores", 0), ("verified", params.verify)] {
        let params = RetrievalParams { verify, ..params };
        let mut times = Vec::new();
        let mut near = 0;
        let mut work = Duration::ZERO;
        for query in 0..QUERIES {
            let place = query * road.frames / QUERIES;
            let features = view(place, road.features(), 1);
            let (started, worked) = (Instant::now(), ProcessTime::now());
            let ranked = index.query(&features, &params, |_| true).ranked;
            work += worked.elapsed();
            times.push(started.elapsed());
            let first = ranked.first().map(|first| first.frame);
            near += usize::from(first.is_some_and(|frame| frame.abs_diff(place) <= 2));
        }
        times.sort_unstable();
        let ms = |time: Duration| 1e3 * time.as_secs_f64();
        let outcome = json!({
            "median_ms": ms(times[QUERIES / 2]),
            "of_95_in_100_ms": ms(times[QUERIES * 95 / 100]),
            "processor_ms": ms(work) / QUERIES as f64,
            "first_frame_near": near,
            "queries": QUERIES,
        });
        asked.insert(what.to_owned(), outcome);
    }
    Ok(json!({
        "opened_s": opened.as_secs_f64(),
        "own_mb_open": memory_open,
        "asked": asked,
        "own_mb": memory_mb("RssAnon"),
        "pages_of_the_file_mb": memory_mb("RssFile"),
    }))
}

/// Builds and asks indices of more and more frames, each in a process of its own.
fn growth(folder: &Path, road: &Road) -> Result<(), Failure> {
    fs::create_dir_all(folder)?;
    let file = folder.join("growing.posescope-index");
    let program = std::env::current_exe()?;
    let measure = |command: &str, frames: usize| -> Result<Value, Failure> {
        let numbers = [
            ("--frames", frames),
            ("--features", road.features.unwrap_or(250)),
            ("--words", road.words),
            ("--iterations", road.iterations),
        ];
        let options = numbers.map(|(option, number)| [option.to_owned(), number.to_string()]);
        let done = Command::new(&program)
            .arg(command)
            .arg(&file)
            .args(options.as_flattened())
            .stderr(Stdio::inherit())
            .output()?;
        if !done.status.success() {
            return Err(format!("{command} of {frames} frames ended with {}", done.status).into());
        }
        let measured: Value = serde_json::from_slice(&done.stdout)?;
        eprintln!("{command} {frames}: {measured}");
        Ok(measured)
    };
    let mut text =
        "| frames | vocabulary (s) | words (s) | lists (s) | peak (MB) | file (MB) | open (s) | \
         query (ms) | verified (ms) | own memory (MB) | pages (MB) | near, of 200 |\n|--:|"
            .to_owned();
    text += &"--:|".repeat(11);
    text.push('\n');
    let mut rows = [const { Vec::new() }; 2];
    for frames in FRAMES {
        let (built, asked) = (measure("build", frames)?, measure("query", frames)?);
        let number = |value: &Value, path: &str| value.pointer(path).and_then(Value::as_f64);
        let of_build = |path: &str| number(&built, path).unwrap_or(f64::NAN);
        let of_query = |path: &str| number(&asked, path).unwrap_or(f64::NAN);
        let [vocabulary, words, lists] = ["vocabulary", "words", "writing_lists"]
            .map(|step| of_build(&format!("/{step}/processor_s")));
        let [query, verified] =
            ["by_scores", "verified"].map(|kind| of_query(&format!("/asked/{kind}/processor_ms")));
        let cells = [
            frames as f64,
            vocabulary,
            words,
            lists,
            of_build("/peak_mb"),
            of_build("/file_mb"),
            of_query("/opened_s"),
            query,
            verified,
            of_query("/own_mb"),
            of_query("/pages_of_the_file_mb"),
            of_query("/asked/verified/first_frame_near"),
        ];
        for cell in cells {
            let places = if cell < 100.0 && cell.fract() != 0.0 {
                2
            } else {
                0
            };
            text += &format!("| {cell:.places$} ");
        }
        text += "|\n";
        rows[0].push((frames as f64, vec![vocabulary, words, lists.max(1e-3)]));
        rows[1].push((frames as f64, vec![query, verified]));
    }
    fs::remove_file(&file)?;
    print!("{text}");
    fs::write(folder.join("retrieval.md"), text)?;
    let [building, asking] = rows;
    let tables = [
        Table {
            name: "retrieval-index",
            quantity: "frames",
            unit: "s",
            columns: vec!["vocabulary", "words of all frames", "lists"],
            rows: building,
        },
        Table {
            name: "retrieval-query",
            quantity: "frames",
            unit: "ms",
            columns: vec!["query, by scores", "… verified"],
            rows: asking,
        },
    ];
    for table in tables {
        table.draw(&folder.join(table.name).with_extension("svg"))?;
    }
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

/// A number of kilobytes that the system tells of this process \[MB\]; `None` where it tells nothing.
fn memory_mb(field: &str) -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with(field))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1024.0 / 1e6)
}
