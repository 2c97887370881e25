//! How well one pose of several references is, by each fusion.
//!
//! `cargo run -p posescope-methods --bin fusions -- --scene street --queries 24 --seed 3 --radius 20 \
//! --references 5 --method fb,pm,mi,hy --fusion r-wavg,joint` asks so many queries, one out of each of as
//! many equal stretches of the scene, against random references within the radius, and prints for each
//! method and fusion the share with a pose, the shares within 0.25 m, 1 m and 2 m of all queries, the
//! median over all, those without a pose counted as infinitely wrong, and the RMSE over those with one.
//!
//! `--scene` and `--query-scene` are anything that `posescope run` takes, with `--size half` a smaller
//! street; `--truth FILE` has poses that are better than the scene's, for queries and references, and only
//! their frames take part; `--set KEY=VALUE` sets parameters, `--details` prints each query.

mod truth;

use std::collections::HashMap;
use std::time::Instant;

use posescope::fusion::Fusion;
use posescope::geometry::Pose;
use posescope::localize::{
    LocalizeError, Localizer, NoObserver, QueryResult, Request, frames_within,
};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scene::street::{Size, Street};
use posescope::scene::{self, Scene};
use xxhash_rust::xxh3::xxh3_64;

struct Options {
    scene: String,
    query_scene: Option<String>,
    is_half: bool,
    queries: usize,
    seed: u64,
    radius_m: f64,
    references: usize,
    methods: Vec<Method>,
    fusions: Vec<Fusion>,
    params: Params,
    truth: Option<String>,
    details: bool,
}

fn main() -> Result<(), String> {
    let options = Options::parse(std::env::args().skip(1))?;
    let started = Instant::now();
    let references = open(&options.scene, &options)?;
    let queries = match &options.query_scene {
        Some(path) => open(path, &options)?,
        None => open(&options.scene, &options)?,
    };
    let localizer = Localizer::new(
        references.as_ref(),
        queries.as_ref(),
        &options.params,
        options.seed,
    );
    let mut results: Vec<QueryResult> = Vec::new();
    let frames = queries.frames().len();
    let count = options.queries.min(frames);
    for place in 0..count {
        let (begin, end) = (place * frames / count, (place + 1) * frames / count);
        let draw = xxh3_64(format!("{}/place/{place}", options.seed).as_bytes()) as usize;
        let query = begin + draw % (end - begin).max(1);
        let Some(truth) = queries.pose(query) else {
            continue;
        };
        let is_same = references.name() == queries.name();
        let place = truth.translation.vector.into();
        let mut within = frames_within(references.as_ref(), &place, options.radius_m, &|frame| {
            is_same && frame == query
        });
        within.sort_by_key(|frame| xxh3_64(format!("{}/{query}/{frame}", options.seed).as_bytes()));
        within.truncate(options.references);
        let request = Request {
            radius_m: options.radius_m,
            references: within.into(),
            fusions: options.fusions.clone(),
            setting: None,
        };
        let keep = |result: QueryResult, _| {
            if options.details {
                print_one(&result);
            }
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        let methods = &options.methods;
        localizer
            .localize(0, query, &[request], methods, &mut NoObserver, keep)
            .map_err(|error| error.to_string())?;
    }
    print(&results, &options);
    println!("\n{:.1} min", started.elapsed().as_secs_f64() / 60.0);
    Ok(())
}

/// A scene with other poses.
struct Corrected {
    scene: Box<dyn Scene>,
    poses: HashMap<String, Pose>,
}

impl Scene for Corrected {
    posescope::inner_scene!(scene: name, frames, intrinsics, time_s, has_cloud, photo, cloud);

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.poses.get(&self.frames()[frame]).copied()
    }
}

fn open(path: &str, options: &Options) -> Result<Box<dyn Scene>, String> {
    let scene = match path.split_once(':').unwrap_or((path, "overcast")) {
        ("street", condition) if options.is_half => Street::new(condition, Size::Half)
            .map(|street| Box::new(street) as Box<dyn Scene>)
            .map_err(|error| error.to_string()),
        _ => scene::open(path, None).map_err(|error| error.to_string()),
    }?;
    Ok(match &options.truth {
        Some(path) => Box::new(Corrected {
            scene,
            poses: truth::poses(path)?,
        }),
        None => scene,
    })
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            scene: "street".to_owned(),
            query_scene: None,
            is_half: false,
            queries: 20,
            seed: 0,
            radius_m: 20.0,
            references: 5,
            methods: Method::PAPER.to_vec(),
            fusions: Fusion::all().collect(),
            params: Params::default(),
            truth: None,
            details: false,
        };
        fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
            text.parse().map_err(|_| format!("{text} is no number"))
        }
        fn list<T: std::str::FromStr<Err: ToString>>(text: &str) -> Result<Vec<T>, String> {
            let words = text.split(',');
            words
                .map(|word| word.parse().map_err(|error: T::Err| error.to_string()))
                .collect()
        }
        while let Some(argument) = arguments.next() {
            if argument == "--details" {
                options.details = true;
                continue;
            }
            let value = arguments
                .next()
                .ok_or(format!("{argument} needs a value"))?;
            match argument.as_str() {
                "--scene" => options.scene = value,
                "--query-scene" => options.query_scene = Some(value),
                "--size" => options.is_half = value == "half",
                "--queries" => options.queries = number(&value)?,
                "--seed" => options.seed = number(&value)?,
                "--radius" => options.radius_m = number(&value)?,
                "--references" => options.references = number(&value)?,
                "--method" => options.methods = list(&value)?,
                "--fusion" => options.fusions = list(&value)?,
                "--truth" => options.truth = Some(value),
                "--set" => {
                    let assigned = options.params.assign(&value);
                    assigned.map_err(|error| error.to_string())?;
                }
                other => return Err(format!("unknown argument {other}")),
            }
        }
        Ok(options)
    }
}

fn print_one(result: &QueryResult) {
    let fusion = result.fusion.map_or("alone", |fusion| fusion.name);
    let said = match (&result.error, &result.reason) {
        (Some(error), _) => error.to_string(),
        (None, Some(reason)) => reason.text.clone(),
        (None, None) => String::new(),
    };
    println!("{} {} {fusion}: {said}", result.query, result.method);
}

fn print(results: &[QueryResult], options: &Options) {
    println!(
        "| method | fusion | queries | a pose | < 0.25 m | < 1 m | < 2 m | median | | RMSE | |"
    );
    println!("|:--|:--|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for &method in &options.methods {
        for &fusion in &options.fusions {
            let own = results.iter().filter(|r| r.method == method);
            let own: Vec<_> = own.filter(|r| r.fusion == Some(fusion)).collect();
            let solved: Vec<_> = own.iter().filter_map(|result| result.error).collect();
            let share = |limit: f64| {
                let near = solved.iter().filter(|error| error.translation_m < limit);
                format!("{:.0} %", 100.0 * near.count() as f64 / own.len() as f64)
            };
            let failed = own.len() - solved.len();
            let infinite = std::iter::repeat_n(f64::INFINITY, failed);
            let metres = solved.iter().map(|error| error.translation_m);
            let degrees = solved.iter().map(|error| error.rotation_deg);
            println!(
                "| {} | {fusion} | {} | {} | {} | {} | {} | {:.3} m | {:.2}° | {:.3} m | {:.2}° |",
                method.name().to_uppercase(),
                own.len(),
                share(f64::INFINITY),
                share(0.25),
                share(1.0),
                share(2.0),
                median(metres.clone().chain(infinite.clone())),
                median(degrees.clone().chain(infinite)),
                rms(metres),
                rms(degrees),
            );
        }
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, n), value| (sum + value * value, n + 1));
    (sum / f64::from(count)).sqrt()
}
