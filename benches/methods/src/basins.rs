//! How far from the truth a start may be: the paper's grid beside the descents that its costs come from.
//!
//! `cargo run -p posescope-methods --bin basins -- --starts 200 --radius 15 --size half` draws so many pairs
//! of the street, whose distances are spread evenly up to the radius: the reference pose is the start, the
//! query pose the truth. It prints which share of them each method brings to within 0.5 m and 1 m, by the
//! distance of the start; `--bins N` (6) rows, `--seed N`, `--cell overcast-night` other conditions
//! (reference-query), `--method "pm pm.search=descent"` other methods and settings, repeatable.

use std::time::Instant;

use posescope::geometry::PoseError;
use posescope::localize::{frames_within, localize};
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene::Scene;
use posescope::scene::street::{Size, Street};
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

struct Options {
    starts: usize,
    bins: usize,
    radius_m: f64,
    seed: u64,
    size: Size,
    cell: (String, String),
    methods: Vec<String>,
}

/// How far a start was, and how far off each method ended; infinite without a pose.
struct Ended {
    start_m: f64,
    off_m: Vec<f64>,
}

fn main() -> Result<(), String> {
    let options = Options::parse(std::env::args().skip(1))?;
    let methods: Vec<(Method, Params)> = options
        .methods
        .iter()
        .map(|text| method(text))
        .collect::<Result<_, _>>()?;
    let started = Instant::now();
    let open =
        |condition: &str| Street::new(condition, options.size).map_err(|error| error.to_string());
    let (references, queries) = (open(&options.cell.0)?, open(&options.cell.1)?);
    let run = |number| ended(number, &references, &queries, &methods, &options);
    let found: Result<Vec<_>, String> = (0..options.starts).into_par_iter().map(run).collect();
    let found: Vec<Ended> = found?.into_iter().flatten().collect();
    print(&found, &options);
    println!("\n{:.1} min", started.elapsed().as_secs_f64() / 60.0);
    Ok(())
}

/// One start: a query of the route and the reference that is nearest to the wanted distance from it.
fn ended(
    number: usize,
    references: &Street,
    queries: &Street,
    methods: &[(Method, Params)],
    options: &Options,
) -> Result<Option<Ended>, String> {
    let frames = queries.frames().len();
    let draw = xxh3_64(format!("{}/start/{number}", options.seed).as_bytes()) as usize;
    let query = draw % frames;
    let truth = queries.pose(query).ok_or("the street knows its poses")?;
    let wanted_m = options.radius_m * (number as f64 + 0.5) / options.starts as f64;
    let place = truth.translation.vector.into();
    let is_same = references.name() == queries.name();
    let within = frames_within(references, &place, options.radius_m, &|frame| {
        is_same && frame == query
    });
    let apart = |frame: usize| {
        let pose = references.pose(frame);
        pose.map_or(f64::INFINITY, |pose| {
            PoseError::between(&truth, &pose).translation_m
        })
    };
    let off = |frame: &usize| (apart(*frame) - wanted_m).abs();
    let chosen = within.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    let Some(chosen) = chosen else {
        return Ok(None);
    };
    let query = queries.query(query).map_err(|error| error.to_string())?;
    let reference = references
        .reference(chosen)
        .map_err(|error| error.to_string())?;
    let problem = Problem::new(query, reference, options.radius_m);
    let problem = problem.map_err(|error| error.to_string())?;
    let off_m = methods.iter().map(|(method, params)| {
        let pose = localize(&problem, *method, params).pose;
        pose.map_or(f64::INFINITY, |pose| {
            PoseError::between(&truth, &pose).translation_m
        })
    });
    Ok(Some(Ended {
        start_m: apart(chosen),
        off_m: off_m.collect(),
    }))
}

/// `pm pm.search=descent`
fn method(text: &str) -> Result<(Method, Params), String> {
    let mut words = text.split_whitespace();
    let name = words.next().ok_or("--method needs a name")?;
    let mut params = Params::default();
    for assignment in words {
        params
            .assign(assignment)
            .map_err(|error| error.to_string())?;
    }
    let method = name.parse().map_err(|error| format!("{error}"))?;
    Ok((method, params))
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            starts: 200,
            bins: 6,
            radius_m: 15.0,
            seed: 0,
            size: Size::Full,
            cell: ("overcast".to_owned(), "overcast".to_owned()),
            methods: Vec::new(),
        };
        while let Some(argument) = arguments.next() {
            let value = arguments
                .next()
                .ok_or(format!("{argument} needs a value"))?;
            let wrong = |_| format!("{value} is no number");
            match argument.as_str() {
                "--starts" => options.starts = value.parse().map_err(wrong)?,
                "--bins" => options.bins = value.parse().map_err(wrong)?,
                "--seed" => options.seed = value.parse().map_err(wrong)?,
                "--radius" => {
                    options.radius_m =
                        value.parse().map_err(|_| format!("{value} is no number"))?;
                }
                "--size" if value == "half" => options.size = Size::Half,
                "--size" => options.size = Size::Full,
                "--cell" => {
                    let pair = value.split_once('-').ok_or(format!("{value} is no pair"))?;
                    options.cell = (pair.0.to_owned(), pair.1.to_owned());
                }
                "--method" => options.methods.push(value),
                other => return Err(format!("unknown argument {other}")),
            }
        }
        if options.methods.is_empty() {
            let default = ["pm", "pm pm.search=descent", "mi", "mi mi.search=descent"];
            options.methods = default.map(str::to_owned).into();
        }
        Ok(options)
    }
}

fn print(found: &[Ended], options: &Options) {
    println!("| start | starts | {} |", options.methods.join(" | "));
    println!("|:--|--:|{}", "--:|".repeat(options.methods.len()));
    let width = options.radius_m / options.bins as f64;
    let rows = (0..options.bins).map(|bin| {
        let (from, to) = (width * bin as f64, width * (bin + 1) as f64);
        (format!("{from:.1} to {to:.1} m"), from, to)
    });
    for (name, from, to) in rows.chain([("all".to_owned(), 0.0, f64::INFINITY)]) {
        let own = found
            .iter()
            .filter(|one| one.start_m >= from && one.start_m < to);
        let own: Vec<&Ended> = own.collect();
        let shares = (0..options.methods.len()).map(|method| {
            let within = |limit: f64| {
                let near = own.iter().filter(|one| one.off_m[method] < limit).count();
                100.0 * near as f64 / own.len() as f64
            };
            format!("{:.0} / {:.0} %", within(0.5), within(1.0))
        });
        let shares: Vec<String> = shares.collect();
        println!("| {name} | {} | {} |", own.len(), shares.join(" | "));
    }
}
