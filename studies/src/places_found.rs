use std::path::PathBuf;
use std::time::Instant;

use posescope::features::{Features, surf};
use posescope::geometry::{Pose, PoseError};
use posescope::image::Photo;
use posescope::params::Params;
use posescope::retrieval::{Index, Ranked};
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::scene::{self, IndexOptions, Retriever, Scene};
use rayon::prelude::*;

use crate::Failure;
use crate::numbers::{median, percent, print_table};

/// A retrieved frame shows the place of the query within this distance \[m\].
const PLACE_M: f64 = 5.0;

/// Numbers of inliers that could be asked for.
const INLIERS: [usize; 9] = [6, 8, 10, 12, 14, 16, 20, 25, 30];

/// How often does retrieval find the place of a photo, from photos of the same or of other weather?
///
/// The first scene is indexed but for some frames, evenly spread, which are its queries; of the other scenes, evenly
/// spread frames are asked for. A query counts as found in the top K if one of the first K frames was taken within 5 m
/// of it. Nothing restricts the search to a part of the scene.
///
/// A second table says, for a number of inliers, how many first frames have as many, and how many of these are right.
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
    /// Queries of another town of the street, which no frame shows.
    #[arg(long, default_value_t = 0)]
    elsewhere: usize,
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
    let mut of_all: Vec<(String, Vec<Answer>)> = Vec::new();
    for (number, argument) in options.scenes.iter().enumerate() {
        let queries = scene::open(argument, None)?;
        let frames = match number {
            0 => held_out.clone(),
            _ => evenly_spread(queries.frames().len(), options.queries),
        };
        let asked = frames.into_par_iter().map(|frame| {
            let photo = queries.photo(frame)?.gray;
            Ok((queries.pose(frame), surf(&photo, &params.retrieval.surf(&params.surf))))
        });
        let asked: Result<Vec<_>, scene::SceneError> = asked.collect();
        let answers = ask(&index, &params, references.as_ref(), asked?);
        of_all.push((queries.name().to_owned(), answers));
    }
    if options.elsewhere > 0 {
        let town = Traversal::new(WORLD_SEED + 1, Condition::Overcast, Size::Full);
        let frames = evenly_spread(town.frame_count(), options.elsewhere).into_par_iter();
        let asked = frames.map(|frame| {
            let photo = Photo::from_color(town.image(frame)).gray;
            (None, surf(&photo, &params.retrieval.surf(&params.surf)))
        });
        let answers = ask(&index, &params, references.as_ref(), asked.collect());
        of_all.push(("another town".to_owned(), answers));
    }
    const HEAD: &str =
        "query,queries,top 1,top 5,verified: top 1,top 5,first is verified,its inliers,time (ms)";
    let rows: Vec<_> = of_all.iter().map(|(name, answers)| row(name, answers)).collect();
    print_table(HEAD, &rows);
    let names: Vec<&str> = of_all.iter().map(|(name, _)| name.as_str()).collect();
    let rows: Vec<_> = INLIERS.iter().map(|&inliers| accepted(inliers, &of_all)).collect();
    print_table(&format!("inliers,{},all", names.join(",")), &rows);
    let counts = index.description().counts;
    println!("{} frames of {}, {} words", counts.documents, references.name(), counts.words);
    Ok(())
}

/// Asks for the places of features. A query without a pose shows none of them.
fn ask(
    index: &Index,
    params: &Params,
    references: &dyn Scene,
    queries: Vec<(Option<Pose>, Features)>,
) -> Vec<Answer> {
    let mut unverified = params.retrieval;
    unverified.verify = 0;
    let answers = queries.into_iter().map(|(truth, features)| {
        let is_there = |ranked: &Ranked| {
            let poses = truth.zip(references.pose(ranked.frame));
            poses.is_some_and(|(truth, pose)| {
                PoseError::between(&truth, &pose).translation_m <= PLACE_M
            })
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
    answers.collect()
}

/// How many first frames have so many inliers, and how many of these are right.
fn accepted(inliers: usize, of_all: &[(String, Vec<Answer>)]) -> Vec<String> {
    let cell = |answers: &mut dyn Iterator<Item = &Answer>| {
        let [mut all, mut accepted, mut right] = [0; 3];
        for answer in answers {
            all += 1;
            let is_accepted = answer.inliers.is_some_and(|found| found >= inliers);
            accepted += usize::from(is_accepted);
            right += usize::from(is_accepted && answer.is_found[1][0]);
        }
        format!("{accepted} of {all}: {right} right")
    };
    let cells = of_all.iter().map(|(_, answers)| cell(&mut answers.iter()));
    let all = cell(&mut of_all.iter().flat_map(|(_, answers)| answers));
    [inliers.to_string()].into_iter().chain(cells).chain([all]).collect()
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
