//! How often retrieval finds the place of a photo, from photos of the same or of other weather.
//!
//! `cargo run --release --no-default-features --example retrieval_places -- street street:sun
//! street:night street:rain street:snow` prints a Markdown table.
//!
//! The first scene is indexed but for some frames, evenly spread, which are its queries; of the other
//! scenes, evenly spread frames are asked for. A query counts as found in the top K if one of the
//! first K frames was taken within 5 m of it. Nothing restricts the search to a part of the scene.
//!
//! Options: `--frames N` indexed (600), `--queries N` of each other scene (100), `--words N` (10000),
//! `--seed N` (0), `--set KEY=VALUE` for any parameter, `--index FILE` to keep the index and to use
//! it again.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use posescope::features::{Features, surf};
use posescope::params::Params;
use posescope::retrieval::{Index, Ranked, RetrievalParams};
use posescope::scene::{self, IndexOptions, Retriever, Scene};
use rayon::prelude::*;

/// A retrieved frame shows the place of the query within this distance \[m\].
const PLACE_M: f64 = 5.0;

type Failure = Box<dyn std::error::Error>;

struct Options {
    scenes: Vec<String>,
    frames: usize,
    queries: usize,
    index: IndexOptions,
    params: Params,
    file: Option<PathBuf>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, Failure> {
        let mut options = Self {
            scenes: Vec::new(),
            frames: 600,
            queries: 100,
            index: IndexOptions {
                words: 10_000,
                every: 1,
                seed: 0,
            },
            params: Params::default(),
            file: None,
        };
        while let Some(argument) = arguments.next() {
            let mut value = || {
                let value = arguments.next();
                value.ok_or_else(|| format!("{argument} needs a value"))
            };
            match argument.as_str() {
                "--frames" => options.frames = value()?.parse()?,
                "--queries" => options.queries = value()?.parse()?,
                "--words" => options.index.words = value()?.parse()?,
                "--seed" => options.index.seed = value()?.parse()?,
                "--set" => options.params.assign(&value()?)?,
                "--index" => options.file = Some(value()?.into()),
                other if other.starts_with('-') => return Err(format!("{other}?").into()),
                scene => options.scenes.push(scene.to_owned()),
            }
        }
        Ok(options)
    }
}

/// How the queries of a scene were answered.
#[derive(Default)]
struct Tally {
    queries: usize,
    /// In the top 1 and the top 5, by the scores alone and after verification.
    found: [[usize; 2]; 2],
    /// Whose first frame is verified.
    verified: usize,
    inliers: Vec<usize>,
    times: Vec<Duration>,
}

fn main() -> Result<(), Failure> {
    let options = Options::parse(std::env::args().skip(1))?;
    let Some(first) = options.scenes.first() else {
        return Err("name a scene to index, and perhaps scenes to ask it for".into());
    };
    let references = scene::open(first, None)?;
    let total = references.frames().len();
    let held_out = evenly_spread(total, total.saturating_sub(options.frames));
    let temporary = tempfile::tempdir()?;
    let path = (options.file.clone()).unwrap_or_else(|| temporary.path().join("places"));
    let mut request = Retriever::request(references.as_ref(), &options.index, &options.params);
    request.frames.retain(|frame| !held_out.contains(frame));
    let retrieval = &options.params.retrieval;
    if Index::open(&path, retrieval.checks).is_err() {
        let started = Instant::now();
        let params = &options.params;
        let summary = Retriever::build(references.as_ref(), &path, &request, params, |p| {
            if p.done == p.total || p.done % 50 < 16 {
                let seconds = started.elapsed().as_secs();
                eprintln!("{} {} of {}, {seconds} s", p.step.name(), p.done, p.total);
            }
        })?;
        eprintln!("{summary:?}, {:.1} s", started.elapsed().as_secs_f64());
    }
    let index = Index::open(&path, retrieval.checks)?;

    println!(
        "| query | queries | top 1 | top 5 | verified: top 1 | top 5 | first verified | its inliers | time |\n\
         |:--|--:|--:|--:|--:|--:|--:|--:|--:|"
    );
    for (number, argument) in options.scenes.iter().enumerate() {
        let queries = scene::open(argument, None)?;
        let frames = match number {
            0 => held_out.clone(),
            _ => evenly_spread(queries.frames().len(), options.queries),
        };
        let tally = ask(
            &index,
            &options,
            references.as_ref(),
            queries.as_ref(),
            &frames,
        )?;
        print(queries.name(), tally);
    }
    println!(
        "\n{} frames of {}, {} words, verified {} px, {} inliers, the first {}; seed {}.",
        index.description().counts.documents,
        references.name(),
        index.description().counts.words,
        retrieval.inlier_px,
        retrieval.min_inliers,
        retrieval.verify,
        options.index.seed,
    );
    Ok(())
}

fn ask(
    index: &Index,
    options: &Options,
    references: &dyn Scene,
    queries: &dyn Scene,
    frames: &[usize],
) -> Result<Tally, Failure> {
    let detector = options.params.retrieval.surf(&options.params.surf);
    let features: Vec<Features> = frames
        .par_iter()
        .map(|&frame| Ok(surf(&queries.photo(frame)?.gray, &detector)))
        .collect::<Result<_, scene::SceneError>>()?;
    let mut tally = Tally::default();
    for (&frame, features) in frames.iter().zip(&features) {
        let Some(truth) = queries.pose(frame) else {
            continue;
        };
        let is_there = |ranked: &Ranked| {
            references.pose(ranked.frame).is_some_and(|pose| {
                (pose.translation.vector - truth.translation.vector).norm() <= PLACE_M
            })
        };
        tally.queries += 1;
        let unverified = RetrievalParams {
            verify: 0,
            ..options.params.retrieval
        };
        for (row, params) in [unverified, options.params.retrieval].iter().enumerate() {
            let started = Instant::now();
            let ranked = index.query(features, params, |_| true).ranked;
            if row == 1 {
                tally.times.push(started.elapsed());
                if let Some(found) = ranked.first().and_then(|first| first.verification()) {
                    tally.verified += 1;
                    tally.inliers.push(found.inliers);
                }
            }
            for (column, top) in [1, 5].into_iter().enumerate() {
                let found = ranked.iter().take(top).any(is_there);
                tally.found[row][column] += usize::from(found);
            }
        }
    }
    Ok(tally)
}

/// So many of the frames, at equal distances.
fn evenly_spread(frames: usize, count: usize) -> Vec<usize> {
    let count = count.min(frames);
    (0..count)
        .map(|i| (2 * i + 1) * frames / (2 * count))
        .collect()
}

fn print(name: &str, mut tally: Tally) {
    let per_cent = |count: usize| 100.0 * count as f64 / tally.queries.max(1) as f64;
    let [plain, verified] = tally.found.map(|row| row.map(per_cent));
    tally.times.sort_unstable();
    tally.inliers.sort_unstable();
    let time = tally.times.get(tally.times.len() / 2);
    let inliers = tally.inliers.get(tally.inliers.len() / 2);
    println!(
        "| {name} | {} | {:.1} % | {:.1} % | {:.1} % | {:.1} % | {:.1} % | {} | {:.1} ms |",
        tally.queries,
        plain[0],
        plain[1],
        verified[0],
        verified[1],
        per_cent(tally.verified),
        inliers.map_or("–".to_owned(), usize::to_string),
        time.map_or(0.0, |time| 1e3 * time.as_secs_f64()),
    );
}
