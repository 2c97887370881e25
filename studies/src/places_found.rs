use std::path::PathBuf;
use std::time::Instant;

use posescope::features::{Features, surf};
use posescope::geometry::PoseError;
use posescope::params::Params;
use posescope::retrieval::{Index, Ranked};
use posescope::scene::{self, IndexOptions, Retriever, Scene};
use rayon::prelude::*;

use crate::Failure;
use crate::numbers::{median, percent, print_table};

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

/// How a query was answered.
struct Answer {
    /// Whether its place is in the top 1 and the top 5, by the scores alone and after verification.
    is_found: [[bool; 2]; 2],
    /// Inliers of the first frame, if it is verified.
    inliers: Option<usize>,
    ms: f64,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let mut params = Params::default();
    options.set.iter().try_for_each(|assignment| params.assign(assignment))?;
    let index_options = IndexOptions { words: options.words, every: 1, seed: options.seed };
    let references = scene::open(&options.scenes[0], None)?;
    let total = references.frames().len();
    let held_out = evenly_spread(total, total.saturating_sub(options.frames));
    let temporary = tempfile::tempdir()?;
    let path = options.index.clone().unwrap_or_else(|| temporary.path().join("places"));
    if Index::open(&path, params.retrieval.checks).is_err() {
        let mut request =
            Retriever::request(references.as_ref(), &index_options, &Default::default(), &params);
        request.frames.retain(|frame| !held_out.contains(frame));
        Retriever::build(references.as_ref(), &path, &request, &params, |_| {})?;
    }
    let index = Index::open(&path, params.retrieval.checks)?;
    let mut rows = Vec::new();
    for (number, argument) in options.scenes.iter().enumerate() {
        let queries = scene::open(argument, None)?;
        let frames = match number {
            0 => held_out.clone(),
            _ => evenly_spread(queries.frames().len(), options.queries),
        };
        let answers = ask(&index, &params, references.as_ref(), queries.as_ref(), &frames)?;
        rows.push(row(queries.name(), &answers));
    }
    const HEAD: &str =
        "query,queries,top 1,top 5,verified: top 1,top 5,first is verified,its inliers,time (ms)";
    print_table(HEAD, &rows);
    let counts = index.description().counts;
    println!("{} frames of {}, {} words", counts.documents, references.name(), counts.words);
    Ok(())
}

fn ask(
    index: &Index,
    params: &Params,
    references: &dyn Scene,
    queries: &dyn Scene,
    frames: &[usize],
) -> Result<Vec<Answer>, Failure> {
    let detector = params.retrieval.surf(&params.surf);
    let mut unverified = params.retrieval;
    unverified.verify = 0;
    let features = frames.par_iter().map(|&frame| Ok(surf(&queries.photo(frame)?.gray, &detector)));
    let features: Result<Vec<Features>, scene::SceneError> = features.collect();
    let known = frames
        .iter()
        .zip(features?)
        .filter_map(|(&frame, features)| Some((queries.pose(frame)?, features)));
    let answers = known.map(|(truth, features)| {
        let is_there = |ranked: &Ranked| {
            let pose = references.pose(ranked.frame);
            pose.is_some_and(|pose| PoseError::between(&truth, &pose).translation_m <= PLACE_M)
        };
        let by_scores = index.query(&features, &unverified, |_| true).ranked;
        let started = Instant::now();
        let verified = index.query(&features, &params.retrieval, |_| true).ranked;
        let first = verified.first().and_then(|first| first.verification());
        Answer {
            ms: 1e3 * started.elapsed().as_secs_f64(),
            inliers: first.map(|found| found.inliers),
            is_found: [by_scores, verified]
                .map(|ranked| [1, 5].map(|top| ranked.iter().take(top).any(is_there))),
        }
    });
    Ok(answers.collect())
}

fn row(name: &str, answers: &[Answer]) -> Vec<String> {
    let share = |is_so: &dyn Fn(&&Answer) -> bool| {
        let count = answers.iter().filter(is_so).count();
        format!("{:.1} %", percent(count, answers.len()))
    };
    let found = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let found = found.map(|(ranking, top)| share(&|answer| answer.is_found[ranking][top]));
    let inliers = answers.iter().filter_map(|answer| Some(answer.inliers? as f64));
    let last = [
        share(&|answer| answer.inliers.is_some()),
        format!("{:.0}", median(inliers)),
        format!("{:.1}", median(answers.iter().map(|answer| answer.ms))),
    ];
    [&[name.to_owned(), answers.len().to_string()], &found[..], &last].concat()
}

/// So many of the frames, at equal distances.
fn evenly_spread(frames: usize, count: usize) -> Vec<usize> {
    let count = count.min(frames);
    (0..count).map(|i| (2 * i + 1) * frames / (2 * count)).collect()
}
