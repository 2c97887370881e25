use std::path::PathBuf;
use std::time::{Duration, Instant};

use posescope::features::{Features, surf};
use posescope::params::Params;
use posescope::retrieval::{Index, Ranked, RetrievalParams};
use posescope::scene::{self, IndexOptions, Retriever, Scene};
use rayon::prelude::*;

use crate::Failure;
use crate::numbers::{percent, print_table};

/// A retrieved frame shows the place of the query within this distance \[m\].
const PLACE_M: f64 = 5.0;

/// How often does retrieval find the place of a photo, from photos of the same or of other weather?
///
/// The first scene is indexed but for some frames, evenly spread, which are its queries; of the other scenes, evenly
/// spread frames are asked for. A query counts as found in the top K if one of the first K frames was taken within 5 m
/// of it. Nothing restricts the search to a part of the scene.
#[derive(clap::Args)]
pub struct Options {
    #[arg(required = true)]
    scenes: Vec<String>,
    /// Frames that are indexed.
    #[arg(long, default_value_t = 600)]
    frames: usize,
    /// Queries of each other scene.
    #[arg(long, default_value_t = 100)]
    queries: usize,
    #[arg(long, default_value_t = 10_000)]
    words: usize,
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// A parameter, as KEY=VALUE; repeatable.
    #[arg(long)]
    set: Vec<String>,
    /// Keep the index in this file, and use it again.
    #[arg(long)]
    index: Option<PathBuf>,
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

pub fn run(options: &Options) -> Result<(), Failure> {
    let mut params = Params::default();
    options
        .set
        .iter()
        .try_for_each(|assignment| params.assign(assignment))?;
    let index_options = IndexOptions {
        words: options.words,
        every: 1,
        seed: options.seed,
    };
    let references = scene::open(&options.scenes[0], None)?;
    let total = references.frames().len();
    let held_out = evenly_spread(total, total.saturating_sub(options.frames));
    let temporary = tempfile::tempdir()?;
    let path = options
        .index
        .clone()
        .unwrap_or_else(|| temporary.path().join("places"));
    if Index::open(&path, params.retrieval.checks).is_err() {
        let mut request = Retriever::request(references.as_ref(), &index_options, &params);
        request.frames.retain(|frame| !held_out.contains(frame));
        let started = Instant::now();
        Retriever::build(references.as_ref(), &path, &request, &params, |p| {
            if p.done == p.total || p.done % 50 < 16 {
                let seconds = started.elapsed().as_secs();
                eprintln!("{} {} of {}, {seconds} s", p.step.name(), p.done, p.total);
            }
        })?;
    }
    let index = Index::open(&path, params.retrieval.checks)?;
    let mut rows = Vec::new();
    for (number, argument) in options.scenes.iter().enumerate() {
        let queries = scene::open(argument, None)?;
        let frames = match number {
            0 => held_out.clone(),
            _ => evenly_spread(queries.frames().len(), options.queries),
        };
        let tally = ask(
            &index,
            &params,
            references.as_ref(),
            queries.as_ref(),
            &frames,
        )?;
        rows.push(tally.row(queries.name()));
    }
    let head = [
        "query",
        "queries",
        "top 1",
        "top 5",
        "verified: top 1",
        "top 5",
        "first is verified",
    ];
    print_table(&[&head[..], &["its inliers", "time"]].concat(), &rows);
    let counts = index.description().counts;
    println!(
        "{} frames of {}, {} words",
        counts.documents,
        references.name(),
        counts.words
    );
    Ok(())
}

fn ask(
    index: &Index,
    params: &Params,
    references: &dyn Scene,
    queries: &dyn Scene,
    frames: &[usize],
) -> Result<Tally, Failure> {
    let detector = params.retrieval.surf(&params.surf);
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
            ..params.retrieval
        };
        for (row, retrieval) in [unverified, params.retrieval].iter().enumerate() {
            let started = Instant::now();
            let ranked = index.query(features, retrieval, |_| true).ranked;
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

impl Tally {
    fn row(mut self, name: &str) -> Vec<String> {
        let share = |count: usize| format!("{:.1} %", percent(count, self.queries));
        let mut row = vec![name.to_owned(), self.queries.to_string()];
        row.extend(self.found.as_flattened().iter().map(|&count| share(count)));
        row.push(share(self.verified));
        self.times.sort_unstable();
        self.inliers.sort_unstable();
        let inliers = self.inliers.get(self.inliers.len() / 2);
        let time = self.times.get(self.times.len() / 2);
        row.push(inliers.map_or("–".to_owned(), usize::to_string));
        row.push(time.map_or("–".to_owned(), |time| {
            format!("{:.1} ms", 1e3 * time.as_secs_f64())
        }));
        row
    }
}
