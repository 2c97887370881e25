//! How well each method localises a photo of one weather against a reference of another.
//!
//! `cargo run --release --no-default-features --example street_conditions -- --queries 60` prints
//! Markdown: for FB, PM, MI and HY tables of five reference conditions (rows) by five query
//! conditions (columns), and whether the findings of Fu, Pertuz, Matas and Kämäräinen (2019) show.
//!
//! The protocol is the paper's: query frames spread over the route, the same for all pairs; for
//! each, one reference drawn at random among the frames within 10 m; a pose counts if the method
//! itself does not call it failed and its centre is off by less than 10 m. As that is lax, the
//! shares within 1 m and 2 m and the median error are reported too.
//!
//! A last table asks why MI fails where it does: does it miss the truth's minimum, or does the truth
//! cost more than the pose found?
//!
//! Options: `--queries N` (60), `--seed N` (0), `--radius M` (10), `--half` for images of half
//! size, `--conditions A,B,…` for fewer than all.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use posescope::cloud::Cloud;
use posescope::estimator::{self, Outcome};
use posescope::image::Photo;
use posescope::memo::Memo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::trace::Trace;
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

/// A pose counts as a success within this distance of the truth \[m\], as in the paper.
const SUCCESS_M: f64 = 10.0;

/// What was asked for.
struct Options {
    queries: usize,
    seed: u64,
    radius_m: f64,
    size: Size,
    conditions: Vec<Condition>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            queries: 60,
            seed: 0,
            radius_m: 10.0,
            size: Size::Full,
            conditions: Condition::ALL.to_vec(),
        };
        while let Some(argument) = arguments.next() {
            let mut value = || {
                arguments
                    .next()
                    .ok_or_else(|| format!("{argument} needs a value"))
            };
            match argument.as_str() {
                "--queries" => options.queries = number(&value()?)?,
                "--seed" => options.seed = number(&value()?)?,
                "--radius" => options.radius_m = number(&value()?)?,
                "--half" => options.size = Size::Half,
                "--conditions" => {
                    options.conditions =
                        value()?.split(',').map(named).collect::<Result<_, _>>()?;
                }
                other => return Err(format!("unknown argument {other}")),
            }
        }
        Ok(options)
    }
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse()
        .map_err(|_| format!("{text} is not a number of the right kind"))
}

fn named(name: &str) -> Result<Condition, String> {
    Condition::ALL
        .into_iter()
        .find(|condition| condition.name() == name)
        .ok_or_else(|| format!("no condition is called {name}"))
}

/// A method, the reference's condition, the query's.
type Cell = (Method, Condition, Condition);

/// Errors of the translation \[m\]; infinite where a method found no pose.
type Errors = HashMap<Cell, Vec<f64>>;

/// The cost of MI at three poses, as normalised mutual information.
struct Information {
    /// The cost at the true pose.
    at_truth: f64,
    /// The cost at the pose found.
    at_found: f64,
    /// The cost of pixels that have nothing to do with each other.
    by_chance: f64,
    /// Whether the pose found is less than 2 m off.
    is_near: bool,
}

/// What was found at one place for a pair of conditions.
struct Finding {
    reference: Condition,
    query: Condition,
    errors: [(Method, f64); 4],
    information: Option<Information>,
}

fn main() -> Result<(), String> {
    let options = Options::parse(std::env::args().skip(1))?;
    let started = Instant::now();
    let drives: Vec<(Condition, Traversal)> = options
        .conditions
        .iter()
        .map(|&condition| {
            let drive = Traversal::new(WORLD_SEED, condition, options.size);
            (condition, drive)
        })
        .collect();
    let done = AtomicUsize::new(0);
    let collected: Vec<Vec<Finding>> = (0..options.queries)
        .into_par_iter()
        .map(|place| {
            let found = localize(&drives, &options, place);
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            let minutes = started.elapsed().as_secs_f64() / 60.0;
            eprintln!("{count} of {} places, {minutes:.1} min", options.queries);
            found
        })
        .collect();
    let mut errors = Errors::new();
    let findings: Vec<Finding> = collected.into_iter().flatten().collect();
    for finding in &findings {
        for (method, error) in finding.errors {
            let cell = (method, finding.reference, finding.query);
            errors.entry(cell).or_default().push(error);
        }
    }
    report(&options, &errors);
    why_mi_fails(&options, &findings);
    println!(
        "\n{} queries per pair, {:?} size, radius {} m, seed {}; {:.1} min.",
        options.queries,
        options.size,
        options.radius_m,
        options.seed,
        started.elapsed().as_secs_f64() / 60.0
    );
    Ok(())
}

/// All pairs of conditions at one place of the route. Every frame is rendered once, and forgotten
/// after the place is done.
fn localize(drives: &[(Condition, Traversal)], options: &Options, place: usize) -> Vec<Finding> {
    let params = Params::default();
    let mut references: HashMap<(Condition, usize), Arc<ReferenceTuple>> = HashMap::new();
    let mut found = Vec::new();
    for (query_condition, drive) in drives {
        let frame = query_frame(drive.frame_count(), options, place);
        let query = Arc::new(Query {
            name: format!("{frame:06}"),
            photo: Arc::new(Photo::from_color(drive.image(frame))),
            intrinsics: drive.intrinsics(),
            memo: Memo::off(),
        });
        let truth = drive.world_from_camera(frame);
        for (reference_condition, other) in drives {
            let same = reference_condition == query_condition;
            let Some(chosen) = (0..other.frame_count())
                .filter(|&candidate| !(same && candidate == frame))
                .filter(|&candidate| {
                    let offset = other.world_from_camera(candidate).translation.vector
                        - truth.translation.vector;
                    offset.norm() <= options.radius_m
                })
                // The draw: the same candidate wins for all conditions.
                .min_by_key(|candidate| {
                    xxh3_64(format!("{}/{frame}/{candidate}", options.seed).as_bytes())
                })
            else {
                continue;
            };
            let reference = references
                .entry((*reference_condition, chosen))
                .or_insert_with(|| tuple(other, chosen));
            let problem = Problem {
                query: Arc::clone(&query),
                reference: Arc::clone(reference),
                uncertainty_radius_m: options.radius_m,
                prior_m: None,
                seed: options.seed,
                matches: None,
            };
            let run = |method| {
                estimator::entry(method)
                    .make(&params)
                    .estimate(&problem, &mut Trace::off())
                    .expect("nobody cancels")
            };
            let error = |outcome: &Outcome| {
                outcome.pose.as_ref().map_or(f64::INFINITY, |pose| {
                    (pose.translation.vector - truth.translation.vector).norm()
                })
            };
            let direct = run(Method::MI);
            let [indirect, photometric] = [Method::FB, Method::PM].map(run);
            // HY is FB's pose, or MI's where FB has none; equal problems have equal answers, so
            // that it need not be run again.
            let hybrid = if indirect.pose.is_ok() {
                &indirect
            } else {
                &direct
            };
            let at_truth = estimator::entry(Method::MI)
                .make(&params)
                .score_at(&problem, &truth)
                .and_then(|score| score.cost);
            let information = at_truth
                .zip(direct.cost)
                .map(|(at_truth, found)| Information {
                    at_truth: 1.0 - at_truth,
                    at_found: 1.0 - found.best,
                    by_chance: 1.0 - found.shuffled.unwrap_or(1.0),
                    is_near: error(&direct) < 2.0,
                });
            found.push(Finding {
                reference: *reference_condition,
                query: *query_condition,
                errors: [
                    (Method::FB, error(&indirect)),
                    (Method::PM, error(&photometric)),
                    (Method::MI, error(&direct)),
                    (Method::HY, error(hybrid)),
                ],
                information,
            });
        }
    }
    found
}

/// One frame out of each of as many equal stretches of the route as there are places.
fn query_frame(frames: usize, options: &Options, place: usize) -> usize {
    let begin = place * frames / options.queries;
    let end = ((place + 1) * frames / options.queries).max(begin + 1);
    let draw = xxh3_64(format!("{}/place/{place}", options.seed).as_bytes()) as usize;
    begin + draw % (end - begin)
}

fn tuple(drive: &Traversal, frame: usize) -> Arc<ReferenceTuple> {
    let points = drive.cloud(frame);
    Arc::new(ReferenceTuple {
        name: format!("{frame:06}"),
        photo: Arc::new(Photo::from_color(drive.image(frame))),
        intrinsics: drive.intrinsics(),
        world_from_camera: drive.world_from_camera(frame),
        cloud: Cloud {
            points: points.into_iter().map(|point| point.position).collect(),
        },
        memo: Memo::off(),
    })
}

/// Per cent of the queries with an error below a limit.
fn share(errors: &[f64], limit_m: f64) -> f64 {
    let within = errors.iter().filter(|&&error| error < limit_m).count();
    100.0 * within as f64 / errors.len().max(1) as f64
}

/// Median error of the poses found; no number where none was.
fn median(errors: &[f64]) -> f64 {
    let mut found: Vec<f64> = errors.iter().copied().filter(|e| e.is_finite()).collect();
    found.sort_unstable_by(f64::total_cmp);
    found.get(found.len() / 2).copied().unwrap_or(f64::NAN)
}

fn report(options: &Options, errors: &Errors) {
    let columns: Vec<&str> = options.conditions.iter().map(|c| c.name()).collect();
    for method in Method::PAPER {
        println!("\n## {}\n", method.name());
        println!(
            "Rows: reference; columns: query. Share of poses within 10 m / 2 m / 1 m, and the \
             median error of the poses found.\n"
        );
        println!("| | {} |", columns.join(" | "));
        println!("|---|{}", "---|".repeat(columns.len()));
        for &reference in &options.conditions {
            let cells = options.conditions.iter().map(|&query| {
                let errors = &errors[&(method, reference, query)];
                format!(
                    "{:.0} / {:.0} / {:.0} %, {:.2} m",
                    share(errors, SUCCESS_M),
                    share(errors, 2.0),
                    share(errors, 1.0),
                    median(errors)
                )
            });
            let cells: Vec<String> = cells.collect();
            println!("| **{}** | {} |", reference.name(), cells.join(" | "));
        }
    }
    findings(options, errors);
}

/// Whether MI's failures are those of its search, which did not come to the truth, or those of the
/// images, where the truth costs more than the pose found.
fn why_mi_fails(options: &Options, findings: &[Finding]) {
    println!("\n## Normalised mutual information\n");
    println!(
        "Median at the true pose / at the pose found / of shuffled pixels; of the poses more than \
         2 m off: those that cost more than the truth + those that cost less.\n"
    );
    let columns: Vec<&str> = options.conditions.iter().map(|c| c.name()).collect();
    println!("| | {} |", columns.join(" | "));
    println!("|---|{}", "---|".repeat(columns.len()));
    for &reference in &options.conditions {
        let cells = options.conditions.iter().map(|&query| {
            let here: Vec<&Information> = findings
                .iter()
                .filter(|finding| finding.reference == reference && finding.query == query)
                .filter_map(|finding| finding.information.as_ref())
                .collect();
            let middle = |value: fn(&Information) -> f64| {
                median(&here.iter().map(|i| value(i)).collect::<Vec<_>>())
            };
            let far: Vec<_> = here.iter().filter(|i| !i.is_near).collect();
            let missed = far.iter().filter(|i| i.at_truth > i.at_found).count();
            format!(
                "{:.2} / {:.2} / {:.2}; {} + {}",
                middle(|i| i.at_truth),
                middle(|i| i.at_found),
                middle(|i| i.by_chance),
                missed,
                far.len() - missed
            )
        });
        let cells: Vec<String> = cells.collect();
        println!("| **{}** | {} |", reference.name(), cells.join(" | "));
    }
}

/// Says of every finding in how many cells it holds, and names the cells where it does not.
fn findings(options: &Options, errors: &Errors) {
    println!("\n## Findings\n");
    let pairs: Vec<(Condition, Condition)> = options
        .conditions
        .iter()
        .flat_map(|&r| options.conditions.iter().map(move |&q| (r, q)))
        .collect();
    let at = |method, (r, q): (Condition, Condition), limit| share(&errors[&(method, r, q)], limit);
    let middle = |method, (r, q): (Condition, Condition)| median(&errors[&(method, r, q)]);
    let involves = |(r, q): (Condition, Condition), c| (r == c) != (q == c);
    let check = |text: &str,
                 where_: &dyn Fn((Condition, Condition)) -> bool,
                 holds: &dyn Fn((Condition, Condition)) -> bool| {
        let cells: Vec<_> = pairs.iter().copied().filter(|&pair| where_(pair)).collect();
        let not: Vec<String> = cells
            .iter()
            .filter(|&&pair| !holds(pair))
            .map(|(r, q)| format!("{} → {}", r.name(), q.name()))
            .collect();
        let except = if not.is_empty() {
            String::new()
        } else {
            format!("; not {}", not.join(", "))
        };
        println!(
            "- {text}: {} of {}{except}",
            cells.len() - not.len(),
            cells.len()
        );
    };
    let (fb, pm, mi, hy) = (Method::FB, Method::PM, Method::MI, Method::HY);
    let same = |(r, q): (Condition, Condition)| r == q;
    check("same condition: FB succeeds at 95 % or more", &same, &|p| {
        at(fb, p, SUCCESS_M) >= 95.0
    });
    check(
        "same condition: FB has the least median error",
        &same,
        &|p| middle(fb, p) < middle(mi, p).min(middle(pm, p)),
    );
    for condition in [Condition::Night, Condition::Snow] {
        for limit in [SUCCESS_M, 2.0] {
            check(
                &format!(
                    "{} against another: FB below MI within {limit} m",
                    condition.name()
                ),
                &|p| involves(p, condition),
                &|p| at(fb, p, limit) < at(mi, p, limit),
            );
        }
    }
    for limit in [2.0, 1.0] {
        check(
            &format!("different conditions: PM below MI within {limit} m"),
            &|p| !same(p),
            &|p| at(pm, p, limit) < at(mi, p, limit),
        );
    }
    check(
        "HY not below the better of FB and MI, less 2 points",
        &|_| true,
        &|p| at(hy, p, SUCCESS_M) >= at(fb, p, SUCCESS_M).max(at(mi, p, SUCCESS_M)) - 2.0,
    );
}
