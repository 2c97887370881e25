//! How far is a pose to be believed? Fits the probability of being within a metre, and judges it.
//!
//! `cargo run -p posescope-diagnosis --bin calibration -- --places 40` localises queries of every
//! condition of the street against references of every other, fits a logistic function of each method's
//! signals where both are overcast, sunny or snowy, and on queries that do not show their place (mirrored, of another
//! town, of another street of this one), and prints its coefficients, as
//! `diagnosis/confidence/coefficients.rs` holds them. Then it judges the probabilities that posescope has
//! now, and those of the coefficients, on the pairs that night or rain is part of: calibration error,
//! area under the ROC curve, reliability by tenths.
//!
//! Options: `--places N` (40), `--seed N` (0), `--methods fb2,mi6` (all that have a probability),
//! `--dump FILE` to keep the signals, `--from FILE` to use those of an earlier run, `--judge FILE` to judge those of another run than was fitted on,
//! `--diagrams FOLDER` for reliability and ROC as SVG, `--real yes` to judge the pairs of real photos
//! below `POSESCOPE_DATA` and nothing else.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector};
use posescope::diagnosis::{Evidence, confidence};
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::image::Photo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::trace::Trace;
use posescope_diagnosis::diagrams::{self, Scored, said_and_was, tenths};
use posescope_diagnosis::frames::Frame;
use posescope_diagnosis::places::frame_of;
use posescope_diagnosis::real_pairs;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// The conditions whose pairs the probabilities are fitted on.
const FITTED_ON: [Condition; 3] = [Condition::Overcast, Condition::Sun, Condition::Snow];

/// The methods whose poses have a probability of their own.
const JUDGED: [Method; 7] = [
    Method::FB,
    Method::PM,
    Method::MI,
    Method::named("nid"),
    Method::named("fb2"),
    Method::named("mi6"),
    Method::named("robust"),
];

/// Uncertainty of the reference's position \[m\].
const RADIUS_M: f64 = 10.0;

/// Queries that do not show their place are fitted on too.
const UNKNOWABLE: &str = "unknowable";

/// What one of them counts beside a query that does: there are more of them than anybody would ask.
const UNKNOWABLE_COUNTS: f64 = 0.25;

/// References of other streets at each place.
const OTHER_STREETS: usize = 3;

/// How far another street is at least \[m\], and how far turned against the query's its cameras are \[°\]:
/// cameras on one street look along it.
const OTHER_STREET_M: f64 = 60.0;
const OTHER_STREET_DEG: f64 = 60.0;

/// One pose with its signals.
#[derive(Clone, Debug)]
struct Sample {
    method: String,
    /// The condition of the reference, and that of the query.
    conditions: [String; 2],
    is_near: bool,
    /// What posescope says of such signals.
    probability: Option<f64>,
    names: Vec<String>,
    values: Vec<f64>,
}

impl Sample {
    fn is_for_fitting(&self) -> bool {
        let is_fitted = |name: &String| {
            name == UNKNOWABLE || FITTED_ON.iter().any(|condition| condition.name() == name)
        };
        self.conditions.iter().all(is_fitted)
    }
}

fn main() -> Result<(), String> {
    let mut arguments = std::env::args().skip(1);
    let (mut places, mut seed, mut dump, mut from) = (40, 0, None, None);
    let (mut judged, mut diagrams, mut is_real) = (None, None, false);
    let mut methods = JUDGED.to_vec();
    while let Some(argument) = arguments.next() {
        let value = arguments
            .next()
            .ok_or(format!("{argument} needs a value"))?;
        let number = || {
            value
                .parse::<usize>()
                .map_err(|_| format!("{value} is no number"))
        };
        match argument.as_str() {
            "--places" => places = number()?,
            "--seed" => seed = number()? as u64,
            "--methods" => methods = named(&value)?,
            "--dump" => dump = Some(value),
            "--from" => from = Some(value),
            "--judge" => judged = Some(value),
            "--diagrams" => diagrams = Some(value),
            "--real" => is_real = value == "yes",
            other => return Err(format!("unknown argument {other}")),
        }
    }
    let samples = match from {
        Some(path) => read(&path)?,
        None if is_real => of_real_pairs(&methods)?,
        None => collect(places, seed, &methods),
    };
    if let Some(path) = dump {
        std::fs::write(&path, written(&samples)).map_err(|error| format!("{path}: {error}"))?;
    }
    if is_real {
        println!("{} poses in pairs of real photos", samples.len());
        judge("As posescope has them now", &samples, &methods_of(&samples));
        return Ok(());
    }
    let judged = match judged {
        Some(path) => read(&path)?,
        None => samples.clone(),
    };
    let methods = methods_of(&samples);
    println!("## Coefficients\n\n```rust");
    let mut refitted = judged.clone();
    for method in &methods {
        let own = |s: &&Sample| s.method == *method && s.is_for_fitting();
        let fitting: Vec<&Sample> = samples.iter().filter(own).collect();
        let Some(weights) = fitted(&fitting) else {
            continue;
        };
        let numbers: Vec<String> = weights.iter().map(|w| format!("{w:.4}")).collect();
        println!("    (\"{method}\", &[{}]),", numbers.join(", "));
        println!("    // constant, {}", fitting[0].names.join(", "));
        for sample in refitted.iter_mut().filter(|s| s.method == *method) {
            sample.probability = Some(logistic(&weights, &sample.values));
        }
    }
    println!("```");
    judge("As posescope has them now", &judged, &methods);
    judge("With these coefficients", &refitted, &methods);
    diagrams.map_or(Ok(()), |folder| draw(Path::new(&folder), &judged, &methods))
}

/// The methods of these names, behind commas.
fn named(names: &str) -> Result<Vec<Method>, String> {
    let find = |name: &str| JUDGED.into_iter().find(|method| method.name() == name);
    let found = names.split(',').map(|name| find(name).ok_or(name));
    let found: Result<_, _> = found.collect();
    found.map_err(|name| format!("{name} has no probability"))
}

/// The signals and the truth of poses of real photos. Nothing was fitted on these.
fn of_real_pairs(methods: &[Method]) -> Result<Vec<Sample>, String> {
    let pairs = real_pairs::all()?;
    let conditions = ["real".to_owned(), "real".to_owned()];
    Ok(pairs
        .par_iter()
        .flat_map_iter(|pair| {
            let (query, truth) = query_of(&pair.query);
            let reference = reference_of("reference", &pair.reference);
            let problem = Problem::new(query, reference, RADIUS_M).expect("a radius");
            of_problem(&problem, Some(&truth), &conditions, methods)
        })
        .collect())
}

/// The methods that gave poses, by name.
fn methods_of(samples: &[Sample]) -> Vec<String> {
    let methods: BTreeSet<String> = samples.iter().map(|s| s.method.clone()).collect();
    methods.into_iter().collect()
}

/// Both diagrams of the poses that were not fitted on.
fn draw(folder: &Path, samples: &[Sample], methods: &[String]) -> Result<(), String> {
    let scored: Vec<(String, Vec<Scored>)> = with_pooled(methods)
        .map(|method| (method.to_uppercase(), scored(samples, method, false)))
        .collect();
    let diagrams = [
        ("reliability.svg", diagrams::reliability(&scored)?),
        ("roc.svg", diagrams::roc(&scored)?),
    ];
    for (name, svg) in diagrams {
        let path = folder.join(name);
        std::fs::write(&path, svg).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

/// The methods, and all of them together.
fn with_pooled(methods: &[String]) -> impl Iterator<Item = &str> {
    methods
        .iter()
        .map(String::as_str)
        .chain(std::iter::once("all"))
}

/// Probabilities and whether they were right, of one method or of `all`.
fn scored(samples: &[Sample], method: &str, is_for_fitting: bool) -> Vec<Scored> {
    samples
        .iter()
        .filter(|s| s.is_for_fitting() == is_for_fitting)
        .filter(|s| method == "all" || s.method == method)
        .filter_map(|s| Some((s.probability?, s.is_near)))
        .collect()
}

fn collect(places: usize, seed: u64, methods: &[Method]) -> Vec<Sample> {
    let drives = Condition::ALL
        .map(|condition| (condition, Traversal::new(WORLD_SEED, condition, Size::Full)));
    let done = AtomicUsize::new(0);
    (0..places)
        .into_par_iter()
        .flat_map_iter(|place| {
            let samples = at(&drives, place, seed, methods);
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            eprintln!("{count} of {places} places");
            samples
        })
        .collect()
}

/// All pairs of conditions at one place.
fn at(
    drives: &[(Condition, Traversal)],
    place: usize,
    seed: u64,
    methods: &[Method],
) -> Vec<Sample> {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(7919).wrapping_add(place as u64));
    let share: f64 = rng.random();
    let apart: f64 = rng.random_range(-9.0..9.0);
    let nearest = |drive: &Traversal, target: &nalgebra::Vector3<f64>| {
        let distance =
            |frame: &usize| (drive.world_from_camera(*frame).translation.vector - target).norm();
        let frames = 0..drive.frame_count();
        frames
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or(0)
    };
    let day = &drives[0].1;
    let middle = (share * day.frame_count() as f64) as usize % day.frame_count();
    let beside =
        (middle as f64 + apart).rem_euclid(day.frame_count() as f64) as usize % day.frame_count();
    let at_query = day.world_from_camera(middle).translation.vector;
    let at_reference = day.world_from_camera(beside).translation.vector;
    let problems: Vec<_> = drives
        .iter()
        .map(|(condition, drive)| {
            let query = nearest(drive, &at_query);
            // The query itself is no reference.
            let mut reference = nearest(drive, &at_reference);
            if reference == query {
                reference = (query + 1) % drive.frame_count();
            }
            let truth = drive.world_from_camera(query);
            let (query, truth) = query_of(&frame_of(drive, query, &truth));
            let pose = drive.world_from_camera(reference);
            let name = format!("{reference:06}");
            let reference = reference_of(&name, &frame_of(drive, reference, &pose));
            (*condition, query, truth, reference)
        })
        .collect();
    let mut samples = Vec::new();
    for (query_condition, query, truth, _) in &problems {
        for (reference_condition, _, _, reference) in &problems {
            let problem =
                Problem::new(query.clone(), reference.clone(), RADIUS_M).expect("a radius");
            let conditions = [reference_condition, query_condition].map(|c| c.name().to_owned());
            samples.extend(of_problem(&problem, Some(truth), &conditions, methods));
        }
    }
    let (_, query, truth, reference) = &problems[0];
    samples.extend(unknowable(query, reference, place, methods));
    let use_of = use_of(place);
    for reference in other_streets(day, truth, &mut rng) {
        let problem = Problem::new(query.clone(), reference, RADIUS_M).expect("a radius");
        samples.extend(of_problem(&problem, None, &use_of, methods));
    }
    samples
}

/// References of the same town and condition that show nothing of what a query shows.
fn other_streets(drive: &Traversal, truth: &Pose, rng: &mut Pcg64) -> Vec<Arc<ReferenceTuple>> {
    let is_other = |frame: &usize| {
        let between = PoseError::between(truth, &drive.world_from_camera(*frame));
        between.translation_m >= OTHER_STREET_M && between.rotation_deg >= OTHER_STREET_DEG
    };
    let others: Vec<usize> = (0..drive.frame_count()).filter(is_other).collect();
    (0..OTHER_STREETS)
        .filter_map(|_| {
            let frame = *others.get(rng.random_range(0..others.len().max(1)))?;
            let pose = drive.world_from_camera(frame);
            Some(reference_of(
                &format!("{frame:06}"),
                &frame_of(drive, frame, &pose),
            ))
        })
        .collect()
}

/// Every other place of queries that do not show it is for fitting.
fn use_of(place: usize) -> [String; 2] {
    let name = if place.is_multiple_of(2) {
        UNKNOWABLE
    } else {
        "unknowable, set aside"
    };
    [name.to_owned(), name.to_owned()]
}

fn query_of(frame: &Frame) -> (Arc<Query>, Pose) {
    let photo = Photo::from_color(frame.photo.clone());
    let query = Query::new("query", photo, frame.intrinsics).expect("a whole frame");
    (Arc::new(query), frame.pose.expect("a frame with its pose"))
}

fn reference_of(name: &str, frame: &Frame) -> Arc<ReferenceTuple> {
    let photo = Photo::from_color(frame.photo.clone());
    let pose = frame.pose.expect("a frame with its pose");
    let tuple = ReferenceTuple::new(name, photo, frame.intrinsics, pose, frame.cloud.clone());
    Arc::new(tuple.expect("a whole frame"))
}

/// The place of a query that does not show it: mirrored, or of another town.
fn unknowable(
    query: &Arc<Query>,
    reference: &Arc<ReferenceTuple>,
    place: usize,
    methods: &[Method],
) -> Vec<Sample> {
    let Some(color) = &query.photo.color else {
        return Vec::new();
    };
    let drive = Traversal::new(WORLD_SEED + 1, Condition::Overcast, Size::Full);
    let photos = [
        image::imageops::flip_horizontal(color),
        drive.image(7 * place % drive.frame_count()),
    ];
    photos
        .into_iter()
        .flat_map(|photo| {
            let query = Query::new("unknowable", Photo::from_color(photo), query.intrinsics);
            let query = query.expect("a photo of the same size");
            let problem = Problem::new(query, reference.clone(), RADIUS_M).expect("a radius");
            of_problem(&problem, None, &use_of(place), methods)
        })
        .collect()
}

/// A sample of every method that gives a pose. Without a truth no pose is near.
fn of_problem(
    problem: &Problem,
    truth: Option<&Pose>,
    conditions: &[String; 2],
    methods: &[Method],
) -> Vec<Sample> {
    let params = Params::default();
    let mut samples = Vec::new();
    for &method in methods {
        let mut evidence = Evidence::default();
        let estimator = estimator::entry(method).make(&params);
        let outcome = estimator
            .estimate(problem, &mut Trace::to(&mut evidence))
            .expect("nobody cancels");
        let signals = confidence::signals(problem, method, &params, &outcome, &evidence);
        let (Ok(pose), Some(signals)) = (&outcome.pose, signals) else {
            continue;
        };
        let is_near = truth.is_some_and(|truth| {
            PoseError::between(truth, pose).translation_m < confidence::WITHIN_M
        });
        samples.push(Sample {
            method: method.name().to_owned(),
            conditions: conditions.clone(),
            is_near,
            probability: confidence::probability(method, &signals.values),
            names: signals
                .names
                .iter()
                .map(|name| (*name).to_owned())
                .collect(),
            values: signals.values,
        });
    }
    samples
}

fn written(samples: &[Sample]) -> String {
    samples.iter().fold(String::new(), |mut text, s| {
        let line = serde_json::json!([s.method, s.conditions, s.is_near, s.names, s.values]);
        let _ = writeln!(text, "{line}");
        text
    })
}

fn read(path: &str) -> Result<Vec<Sample>, String> {
    type Line = (String, [String; 2], bool, Vec<String>, Vec<f64>);
    let text = std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
    text.lines()
        .map(|line| {
            let read: Line = serde_json::from_str(line).map_err(|error| error.to_string())?;
            let (method, conditions, is_near, names, values) = read;
            let known = JUDGED.iter().find(|known| known.name() == method);
            Ok(Sample {
                probability: known.and_then(|known| confidence::probability(*known, &values)),
                method,
                conditions,
                is_near,
                names,
                values,
            })
        })
        .collect()
}

fn logistic(weights: &[f64], values: &[f64]) -> f64 {
    let sum: f64 = weights[1..].iter().zip(values).map(|(w, v)| w * v).sum();
    1.0 / (1.0 + (-(weights[0] + sum)).exp())
}

/// Logistic regression by iteratively reweighted least squares, on standardised signals and with a
/// ridge, so that signals that tell little keep small weights. The constant first.
fn fitted(samples: &[&Sample]) -> Option<Vec<f64>> {
    const RIDGE: f64 = 1.0;
    let columns = samples.first()?.values.len();
    let count = samples.len() as f64;
    let column = |k: usize| samples.iter().map(move |s| s.values[k]);
    let means: Vec<f64> = (0..columns)
        .map(|k| column(k).sum::<f64>() / count)
        .collect();
    let deviations: Vec<f64> = (0..columns)
        .map(|k| {
            let squared: f64 = column(k).map(|v| (v - means[k]).powi(2)).sum();
            (squared / count).sqrt().max(1e-9)
        })
        .collect();
    let design = DMatrix::from_fn(samples.len(), columns + 1, |row, k| match k {
        0 => 1.0,
        _ => (samples[row].values[k - 1] - means[k - 1]) / deviations[k - 1],
    });
    let labels = DVector::from_fn(samples.len(), |row, _| {
        f64::from(u8::from(samples[row].is_near))
    });
    let counts = DVector::from_fn(samples.len(), |row, _| {
        match samples[row].conditions[0] == UNKNOWABLE {
            true => UNKNOWABLE_COUNTS,
            false => 1.0,
        }
    });
    let mut weights = DVector::zeros(columns + 1);
    for _ in 0..50 {
        let predicted = (&design * &weights).map(|x: f64| 1.0 / (1.0 + (-x).exp()));
        let spread = predicted
            .map(|p| (p * (1.0 - p)).max(1e-6))
            .component_mul(&counts);
        let mut hessian = design.transpose() * DMatrix::from_diagonal(&spread) * &design;
        let mut gradient = design.transpose() * (&labels - &predicted).component_mul(&counts);
        for k in 1..=columns {
            hessian[(k, k)] += RIDGE;
            gradient[k] -= RIDGE * weights[k];
        }
        let step = hessian.cholesky()?.solve(&gradient);
        weights += &step;
        if step.amax() < 1e-9 {
            break;
        }
    }
    let slopes: Vec<f64> = (0..columns)
        .map(|k| weights[k + 1] / deviations[k])
        .collect();
    let constant = weights[0] - slopes.iter().zip(&means).map(|(s, m)| s * m).sum::<f64>();
    Some(std::iter::once(constant).chain(slopes).collect())
}

fn judge(title: &str, samples: &[Sample], methods: &[String]) {
    println!("\n## {title}\n");
    println!(
        "| judged on | method | poses | within 1 m | calibration error | AUC |\n|---|---|---|---|---|---|"
    );
    for is_for_fitting in [true, false] {
        let set = if is_for_fitting {
            "fitted pairs"
        } else {
            "other pairs"
        };
        for method in with_pooled(methods) {
            let scored = scored(samples, method, is_for_fitting);
            if scored.is_empty() {
                continue;
            }
            let near = scored.iter().filter(|s| s.1).count();
            println!(
                "| {set} | {method} | {} | {:.1} % | {:.3} | {} |",
                scored.len(),
                100.0 * near as f64 / scored.len() as f64,
                calibration_error(&scored),
                area_under_curve(&scored).map_or("–".to_owned(), |area| format!("{area:.3}"))
            );
        }
    }
    let mut all = scored(samples, "all", false);
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    println!("\nOther pairs, all methods, by tenths: probability said / share within 1 m\n");
    for bin in tenths(&all) {
        let (said, was) = said_and_was(bin);
        println!("- {said:.3} / {was:.3}");
    }
}

/// Expected calibration error over ten bins of equal count.
fn calibration_error(scored: &[Scored]) -> f64 {
    let mut sorted = scored.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    tenths(&sorted)
        .map(|bin| {
            let (said, was) = said_and_was(bin);
            (said - was).abs() * bin.len() as f64 / sorted.len() as f64
        })
        .sum()
}

/// The share of pairs of a near and a far pose in which the near one is believed more; ties are half.
/// `None` where there is no such pair.
fn area_under_curve(scored: &[Scored]) -> Option<f64> {
    let (near, far): (Vec<Scored>, Vec<Scored>) = scored.iter().copied().partition(|s| s.1);
    let wins: f64 = near
        .iter()
        .map(|a| {
            far.iter()
                .map(|b| match a.0.total_cmp(&b.0) {
                    std::cmp::Ordering::Greater => 1.0,
                    std::cmp::Ordering::Equal => 0.5,
                    std::cmp::Ordering::Less => 0.0,
                })
                .sum::<f64>()
        })
        .sum();
    let pairs = near.len() * far.len();
    (pairs > 0).then(|| wins / pairs as f64)
}
