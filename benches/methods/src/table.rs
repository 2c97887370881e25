//! How well methods do, each with settings of its own, on the street and on real pairs.
//!
//! `cargo run -p posescope-methods --bin table -- --street 30 --seed 3 --cells equal --method "hy" \
//! --method "mi6" --method "mi6 mi6.yaws=1"` prints a row for each method and cell: shares of the
//! queries within 0.25 m, 1 m, 2 m and 10 m, and the medians over all queries, those without a pose
//! counted as infinitely wrong.
//!
//! Options: `--street N` places of the street, or `--scene PATH` all pairs of its frames; `--seed N` (0),
//! `--radius M` (10), `--from M` (0) the least distance of a pair, `--unrelated M` references of the
//! street at least so far away, `--queries PATH` queries of another scene that shows another place, `--cells LIST`: `equal`, `other`,
//! `all` or `overcast-night,…` (reference-query); `--truth FILE` poses that are better than the scene's,
//! lines of a frame's name and a 3 × 4 matrix; `--seeds N` (1) asks every pair so often; `--details`
//! prints each query, `--from-truth` also what a pose refined from the truth costs.

mod cases;
mod truth;

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::time::Instant;

use posescope::diagnosis::{Evidence, Subject, confidence};
use posescope::estimator;
use posescope::event::{Event, Kind, KindSet};
use posescope::geometry::{Pose, PoseError};
use posescope::grid::least_covered;
use posescope::judge::{Freedoms, Judge, Shrinking, Start, shrink};
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene;
use posescope::scene::street::Street;
use posescope::trace::{Cancelled, Fanout, Record, Sink, Trace};
use rayon::prelude::*;

use crate::cases::{Case, Places, pairs, unrelated};
use crate::truth::poses;

/// A method with its settings, as it was asked for.
struct Asked {
    label: String,
    method: Method,
    params: Params,
}

#[derive(Default)]
struct Options {
    street: Option<usize>,
    scene: Option<String>,
    seed: u64,
    seeds: u64,
    radius_m: f64,
    from_m: f64,
    unrelated_m: Option<f64>,
    queries: Option<String>,
    cells: String,
    truth: Option<String>,
    details: bool,
    from_truth: bool,
    methods: Vec<Asked>,
}

/// What a method made of a case.
struct Measured {
    cell: String,
    label: usize,
    error: Option<PoseError>,
    took_s: f64,
}

fn main() -> Result<(), String> {
    let options = Options::parse(std::env::args().skip(1))?;
    let started = Instant::now();
    let measured: Vec<Measured> = match (&options.street, &options.scene) {
        (Some(count), None) => {
            let places = Places {
                count: *count,
                seed: options.seed,
                radius_m: options.radius_m,
                unrelated_m: options.unrelated_m,
                pairs: cells(&options.cells)?,
            };
            let of_places: Result<Vec<Vec<Measured>>, String> = (0..*count)
                .into_par_iter()
                .map(|place| {
                    let cases = places.cases(place).map_err(|error| error.to_string())?;
                    let done = measure(&cases, &options);
                    eprintln!(
                        "place {place}, {:.1} min",
                        started.elapsed().as_secs_f64() / 60.0
                    );
                    Ok(done)
                })
                .collect();
            of_places?.into_iter().flatten().collect()
        }
        (None, Some(path)) => {
            let scene = scene::open(path, None).map_err(|error| error.to_string())?;
            let better = options.truth.as_deref().map(poses).transpose()?;
            let truth = |frame: usize| match &better {
                Some(poses) => poses.get(&scene.frames()[frame]).copied(),
                None => scene.pose(frame),
            };
            let of_queries = match &options.queries {
                Some(path) => {
                    let queries = scene::open(path, None).map_err(|error| error.to_string())?;
                    unrelated(scene.as_ref(), queries.as_ref(), options.radius_m)
                }
                None => pairs(scene.as_ref(), &truth, options.from_m, options.radius_m),
            };
            let of_queries = of_queries.map_err(|error| error.to_string())?;
            let of_queries: Vec<Vec<Measured>> = of_queries
                .par_iter()
                .map(|cases| measure(cases, &options))
                .collect();
            of_queries.into_iter().flatten().collect()
        }
        _ => return Err("either --street N or --scene PATH".to_owned()),
    };
    print(&measured, &options);
    println!("\n{:.1} min", started.elapsed().as_secs_f64() / 60.0);
    Ok(())
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            radius_m: 10.0,
            seeds: 1,
            cells: "equal".to_owned(),
            ..Self::default()
        };
        fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
            text.parse().map_err(|_| format!("{text} is no number"))
        }
        while let Some(argument) = arguments.next() {
            if argument == "--details" || argument == "--from-truth" {
                options.details = true;
                options.from_truth |= argument == "--from-truth";
                continue;
            }
            let value = arguments
                .next()
                .ok_or(format!("{argument} needs a value"))?;
            match argument.as_str() {
                "--street" => options.street = Some(number(&value)?),
                "--scene" => options.scene = Some(value),
                "--seed" => options.seed = number(&value)?,
                "--seeds" => options.seeds = number(&value)?,
                "--radius" => options.radius_m = number(&value)?,
                "--unrelated" => options.unrelated_m = Some(number(&value)?),
                "--queries" => options.queries = Some(value),
                "--from" => options.from_m = number(&value)?,
                "--cells" => options.cells = value,
                "--truth" => options.truth = Some(value),
                "--method" => options.methods.push(Asked::read(&value)?),
                other => return Err(format!("unknown argument {other}")),
            }
        }
        Ok(options)
    }
}

impl Asked {
    /// `mi6 mi6.yaws=1 judge.channels=intensity`
    fn read(text: &str) -> Result<Self, String> {
        let mut words = text.split_whitespace();
        let name = words.next().ok_or("--method needs a name")?;
        let mut params = Params::default();
        for assignment in words {
            params
                .assign(assignment)
                .map_err(|error| error.to_string())?;
        }
        Ok(Self {
            label: text.to_owned(),
            method: name.parse().map_err(|error| format!("{error}"))?,
            params,
        })
    }
}

/// Pairs of conditions, the reference's and the query's.
fn cells(text: &str) -> Result<Vec<(String, String)>, String> {
    let all = Street::conditions()
        .flat_map(|a| Street::conditions().map(move |b| (a.to_owned(), b.to_owned())));
    match text {
        "all" => Ok(all.collect()),
        "equal" => Ok(all.filter(|(a, b)| a == b).collect()),
        "other" => Ok(all.filter(|(a, b)| a != b).collect()),
        list => list
            .split(',')
            .map(|pair| {
                let pair = pair.split_once('-').ok_or(format!("{pair} is no pair"))?;
                Ok((pair.0.to_owned(), pair.1.to_owned()))
            })
            .collect(),
    }
}

fn measure(cases: &[Case], options: &Options) -> Vec<Measured> {
    let mut measured = Vec::new();
    for case in cases {
        for (label, asked) in options.methods.iter().enumerate() {
            for seed in 0..options.seeds {
                let problem = Problem {
                    seed: case.problem.seed + seed,
                    ..case.problem.clone()
                };
                let started = Instant::now();
                let mut judged = Judged::default();
                let mut evidence = Evidence::default();
                let outcome = {
                    let mut sinks = Fanout::new(vec![&mut evidence, &mut judged]);
                    estimator::entry(asked.method)
                        .make(&asked.params)
                        .estimate(&problem, &mut Trace::to(&mut sinks))
                        .expect("nobody cancels")
                };
                let subject =
                    Subject::new(&problem, asked.method, &asked.params, &outcome, &evidence);
                let outcome = confidence::accepted(&subject, None);
                let took_s = started.elapsed().as_secs_f64();
                let error = outcome.pose.as_ref().ok();
                let error = error.map(|pose| PoseError::between(&case.truth, pose));
                if options.details {
                    let at = &problem.reference.name;
                    let said = match (&outcome.pose, &error) {
                        (Ok(_), Some(error)) => error.to_string(),
                        (Err(failure), _) => failure.to_string(),
                        _ => String::new(),
                    };
                    let probability = subject.confidence.as_ref().map(|one| one.probability);
                    let cost = outcome.cost.map_or(f64::NAN, |cost| cost.best);
                    let from_truth = match options.from_truth {
                        true => {
                            format!(", {} from the truth", refined_truth(case, asked, &problem))
                        }
                        false => String::new(),
                    };
                    println!(
                        "{} {} at {at}: {}: {said}; probability {:.3}; cost {cost:.4}{from_truth}{}",
                        case.cell,
                        problem.query.name,
                        asked.label,
                        probability.unwrap_or(f64::NAN),
                        judged.0
                    );
                }
                measured.push(Measured {
                    cell: case.cell.clone(),
                    label,
                    error,
                    took_s,
                });
            }
        }
    }
    measured
}

/// What `robust` said about its decision.
#[derive(Default)]
struct Judged(String);

impl Sink for Judged {
    fn wanted(&self) -> KindSet {
        KindSet::of(&[Kind::CandidatesJudged])
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if let Event::CandidatesJudged(judged) = &record.event {
            self.0 = format!("; {:.2} deviations; {}", judged.deviations, judged.why);
        }
        Ok(())
    }
}

/// What a pose costs that is refined from the truth, by the judge, and how far it went.
fn refined_truth(case: &Case, asked: &Asked, problem: &Problem) -> String {
    let judge = Judge::new(problem, &asked.params.render, &asked.params.judge, 1);
    let truth = problem.reference_from_query(&case.truth);
    let scores = judge.score(&[Pose::identity(), truth]);
    let least = least_covered(asked.params.grid.coverage_floor, scores[0].covered);
    let Some(cost) = scores[1].eligible_cost(least) else {
        return "nothing is seen".to_owned();
    };
    let plan = Shrinking {
        freedoms: Freedoms::Six,
        first_m: asked.params.mi6.six_step_m,
        last_m: asked.params.mi6.last_step_m,
        rad_per_m: asked.params.mi6.deg_per_m.to_radians(),
    };
    let start = [Start { pose: truth, cost }];
    let refined = shrink(&start, &plan, |poses| {
        Ok::<_, Infallible>(judge.costs(poses, least))
    });
    let refined = refined.expect("nobody cancels")[0];
    let moved = PoseError::between(&truth, &refined.pose);
    format!("{:.4} {}", refined.cost, moved)
}

fn print(measured: &[Measured], options: &Options) {
    let mut groups: BTreeMap<(usize, String), Vec<&Measured>> = BTreeMap::new();
    for one in measured {
        let (reference, query) = one.cell.split_once(" → ").unwrap_or((&one.cell, &one.cell));
        let kind = match reference == query {
            true => "all equal",
            false => "all other",
        };
        groups
            .entry((one.label, one.cell.clone()))
            .or_default()
            .push(one);
        groups
            .entry((one.label, kind.to_owned()))
            .or_default()
            .push(one);
    }
    let cells: std::collections::BTreeSet<&String> = groups.keys().map(|(_, cell)| cell).collect();
    println!(
        "\n| cell | method | queries | answered | < 0.25 m | < 1 m | < 2 m | < 10 m | median | rotation | s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for cell in cells {
        for (label, asked) in options.methods.iter().enumerate() {
            let Some(own) = groups.get(&(label, cell.clone())) else {
                continue;
            };
            let count = own.len();
            let off = |one: &&Measured| one.error.map_or(f64::INFINITY, |e| e.translation_m);
            let turned = |one: &&Measured| one.error.map_or(f64::INFINITY, |e| e.rotation_deg);
            let within = |limit: f64| {
                let near = own.iter().filter(|one| off(one) < limit).count();
                format!("{:.1} %", 100.0 * near as f64 / count as f64)
            };
            let took: f64 = own.iter().map(|one| one.took_s).sum();
            println!(
                "| {cell} | {} | {count} | {} | {} | {} | {} | {} | {:.3} m | {:.2}° | {:.2} |",
                asked.label,
                within(f64::INFINITY),
                within(0.25),
                within(1.0),
                within(2.0),
                within(10.0),
                median(own.iter().map(off)),
                median(own.iter().map(turned)),
                took / count as f64,
            );
        }
    }
}

/// The middle one, of an even number the upper one.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
