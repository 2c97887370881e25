use std::path::PathBuf;

use posescope::fusion::Fusion;
use posescope::localize::{
    LocalizeError, Localizer, NoObserver, QueryResult, Request, frames_within,
};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scene::Scene;
use posescope::scene::street::{Size, Street};

use crate::Failure;
use crate::cases::{draw, frame_of_stretch};
use crate::numbers::{SUMMARY, print_table, summary};
use crate::truth;

/// How good is one pose of several references, by each fusion?
///
/// Asks so many queries, one out of each of as many equal stretches of the scene, against random references within the
/// radius.
#[derive(clap::Args)]
pub struct Options {
    /// Anything that `posescope run` takes.
    #[arg(long, default_value = "street")]
    scene: String,
    /// The scene of the queries, if it is another.
    #[arg(long)]
    query_scene: Option<String>,
    /// Poses that are better than the scene's, for queries and references: lines of a frame's name and a 3 × 4
    /// matrix. Only their frames take part.
    #[arg(long)]
    truth: Option<PathBuf>,
    /// Take photos of the street in half size.
    #[arg(long)]
    half: bool,
    #[arg(long, default_value_t = 20)]
    queries: usize,
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The uncertainty radius, and how far a reference is from its query at most [m].
    #[arg(long, default_value_t = 20.0)]
    radius: f64,
    /// References of each query, at most.
    #[arg(long, default_value_t = 5)]
    references: usize,
    #[arg(long, value_delimiter = ',', default_values = ["fb", "pm", "mi", "hy"])]
    method: Vec<Method>,
    /// The fusions; all unless some are named.
    #[arg(long, value_delimiter = ',')]
    fusion: Vec<Fusion>,
    /// A parameter, as KEY=VALUE; repeatable.
    #[arg(long)]
    set: Vec<String>,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let mut params = Params::default();
    options.set.iter().try_for_each(|assignment| params.assign(assignment))?;
    let references = open(&options.scene, options)?;
    let queries = open(options.query_scene.as_ref().unwrap_or(&options.scene), options)?;
    let fusions = match options.fusion.as_slice() {
        [] => Fusion::all().collect(),
        named => named.to_vec(),
    };
    let localizer = Localizer::new(references.as_ref(), queries.as_ref(), &params, options.seed);
    let mut results: Vec<QueryResult> = Vec::new();
    let count = options.queries.min(queries.frames().len());
    for place in 0..count {
        let query = frame_of_stretch(queries.as_ref(), place, count, options.seed);
        let Some(truth) = queries.pose(query) else {
            continue;
        };
        let is_same = references.name() == queries.name();
        let is_query = |frame| is_same && frame == query;
        let place = truth.translation.vector.into();
        let mut within = frames_within(references.as_ref(), &place, options.radius, &is_query);
        within.sort_by_key(|frame| draw(options.seed, &[&query, frame]) as u64);
        within.truncate(options.references);
        let request = Request {
            radius_m: options.radius,
            references: within.into(),
            fusions: fusions.clone(),
            setting: None,
        };
        let keep = |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        localizer.localize(0, query, &[request], &options.method, &mut NoObserver, keep)?;
    }
    let mut rows = Vec::new();
    for method in &options.method {
        for fusion in &fusions {
            let own = results.iter().filter(|r| r.method == *method && r.fusion == Some(*fusion));
            let errors: Vec<_> = own.map(|result| result.error).collect();
            let names = vec![method.name().to_uppercase(), fusion.to_string()];
            rows.push([names, summary(&errors)].concat());
        }
    }
    print_table(&format!("method,fusion,{SUMMARY}"), &rows);
    Ok(())
}

fn open(path: &str, options: &Options) -> Result<Box<dyn Scene>, Failure> {
    match path.split_once(':').unwrap_or((path, "overcast")) {
        ("street", condition) if options.half => Ok(Box::new(Street::new(condition, Size::Half)?)),
        _ => truth::open(path, options.truth.as_deref()),
    }
}
