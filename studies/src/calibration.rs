use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use posescope::diagnosis::{Evidence, Subject, confidence};
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::image::Photo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::Scene as _;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::trace::Trace;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::Failure;
use crate::frames::Frame;
use crate::numbers::{at_places, mean, percent, print_table};
use crate::places::{all_conditions, nearest};
use crate::real_pairs;

/// The conditions whose pairs the probabilities are fitted on.
const FITTED_ON: [Condition; 3] = [Condition::Overcast, Condition::Sun, Condition::Snow];

/// The methods whose poses have a probability of their own.
const JUDGED: &str = "fb,pm,mi,fb2,mi6,robust";

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

/// What is added to the squares of the slopes, so that separable samples have a fit.
const RIDGE: f64 = 1.0;

/// How far can a pose be believed?
///
/// Localises queries of every condition of the street against references of every other. Fits a logistic function of
/// each method's signals where both are overcast, sunny or snowy, and on queries that do not show their place, and
/// prints the coefficients as diagnosis/confidence/coefficients.rs holds them. Then judges the probabilities that
/// posescope has now, and those of the coefficients, on the pairs that night or rain is part of.
#[derive(clap::Args)]
pub struct Options {
    #[arg(long, default_value_t = 40)]
    places: usize,
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The methods, of all that have a probability.
    #[arg(long, value_delimiter = ',', default_value = JUDGED)]
    methods: Vec<Method>,
    /// Keep the signals in this file.
    #[arg(long)]
    dump: Option<PathBuf>,
    /// Use the signals of an earlier run.
    #[arg(long)]
    from: Option<PathBuf>,
    /// Judge the signals of another run than was fitted on.
    #[arg(long)]
    judge: Option<PathBuf>,
    /// Judge the pairs of real photos below POSESCOPE_DATA and nothing else.
    #[arg(long)]
    real: bool,
}

/// A query and a reference, and what is known of them.
struct Trial {
    query: Arc<Query>,
    reference: Arc<ReferenceTuple>,
    /// Without a truth no pose is near.
    truth: Option<Pose>,
    /// The condition of the reference, and that of the query.
    conditions: [&'static str; 2],
}

/// One pose with its signals.
#[derive(Clone, Serialize, Deserialize)]
struct Sample {
    method: String,
    is_for_fitting: bool,
    shows_place: bool,
    is_near: bool,
    names: Vec<String>,
    values: Vec<f64>,
    /// What is said of such signals.
    #[serde(skip)]
    probability: Option<f64>,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let samples = match &options.from {
        Some(path) => read(path)?,
        None => collect(options)?,
    };
    if let Some(path) = &options.dump {
        let lines: Result<Vec<_>, _> = samples.iter().map(serde_json::to_string).collect();
        std::fs::write(path, lines?.join("\n"))?;
    }
    if options.real {
        judge("As posescope has them now", &samples);
        return Ok(());
    }
    let judged = options.judge.as_deref().map_or(Ok(samples.clone()), read)?;
    println!("## Coefficients\n\n```rust");
    let mut refitted = judged.clone();
    for method in methods_of(&samples) {
        let own = |s: &&Sample| s.method == method && s.is_for_fitting;
        let fitting: Vec<&Sample> = samples.iter().filter(own).collect();
        let Some(weights) = fitted(&fitting) else {
            continue;
        };
        let numbers: Vec<String> = weights.iter().map(|w| format!("{w:.4}")).collect();
        println!("    (\"{method}\", &[{}]),", numbers.join(", "));
        println!("    // constant, {}", fitting[0].names.join(", "));
        for sample in refitted.iter_mut().filter(|s| s.method == method) {
            sample.probability = Some(logistic(&weights, &sample.values));
        }
    }
    println!("```");
    judge("As posescope has them now", &judged);
    judge("With these coefficients", &refitted);
    Ok(())
}

/// The methods that gave poses, by name.
fn methods_of(samples: &[Sample]) -> BTreeSet<&str> {
    samples.iter().map(|s| s.method.as_str()).collect()
}

fn read(path: &Path) -> Result<Vec<Sample>, Failure> {
    let text =
        std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let sample = |line: &str| {
        let mut sample: Sample = serde_json::from_str(line)?;
        sample.probability = confidence::probability(sample.method.parse()?, &sample.values);
        Ok(sample)
    };
    text.lines().map(sample).collect()
}

fn collect(options: &Options) -> Result<Vec<Sample>, Failure> {
    let samples = if options.real {
        let pairs = real_pairs::all()?;
        at_places(pairs.len(), |number| {
            let pair = &pairs[number];
            let trial = Trial {
                query: pair.query.clone().named("query").query(0)?,
                reference: pair.reference.clone().named("reference").reference(0)?,
                truth: pair.query.pose,
                conditions: ["real"; 2],
            };
            trial.samples(&options.methods)
        })?
    } else {
        let drives = all_conditions();
        at_places(options.places, |place| {
            let mut samples = Vec::new();
            for trial in at(&drives, place, options.seed)? {
                samples.extend(trial.samples(&options.methods)?);
            }
            Ok(samples)
        })?
    };
    Ok(samples.concat())
}

/// All pairs of conditions at one place, and queries that do not show it.
fn at(drives: &[Traversal; 5], place: usize, seed: u64) -> Result<Vec<Trial>, Failure> {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(7919).wrapping_add(place as u64));
    let share: f64 = rng.random();
    let apart: f64 = rng.random_range(-9.0..9.0);
    let day = &drives[0];
    let frames = day.frame_count();
    let middle = (share * frames as f64) as usize % frames;
    let beside = (middle as f64 + apart).rem_euclid(frames as f64) as usize % frames;
    let [at_query, at_reference] = [middle, beside].map(|frame| day.world_from_camera(frame));
    let mut sides = Vec::new();
    for drive in drives {
        let query = nearest(drive, &at_query);
        // The query itself is no reference.
        let mut reference = nearest(drive, &at_reference);
        if reference == query {
            reference = (query + 1) % drive.frame_count();
        }
        let truth = drive.world_from_camera(query);
        // What is drawn at random depends on the name.
        let name = format!("{reference:06}");
        let (query, reference) = (Frame::of(drive, query), Frame::of(drive, reference));
        sides.push((query.named("query").query(0)?, truth, reference.named(&name).reference(0)?));
    }
    let trial = |query: &Arc<Query>, reference: &Arc<ReferenceTuple>, truth, conditions| {
        let (query, reference) = (Arc::clone(query), Arc::clone(reference));
        Trial { query, reference, truth, conditions }
    };
    let mut trials = Vec::new();
    for (of_query, (query, truth, _)) in Condition::ALL.iter().zip(&sides) {
        for (of_reference, (_, _, reference)) in Condition::ALL.iter().zip(&sides) {
            let conditions = [of_reference.name(), of_query.name()];
            trials.push(trial(query, reference, Some(*truth), conditions));
        }
    }
    let (query, truth, reference) = &sides[0];
    // Every other place of queries that do not show it is for fitting.
    let kind = if place.is_multiple_of(2) { UNKNOWABLE } else { "unknowable, set aside" };
    let color = query.photo().color.as_ref().ok_or("a photo in colour expected")?;
    let elsewhere = Traversal::new(WORLD_SEED + 1, Condition::Overcast, Size::Full);
    let of_another_town = elsewhere.image(7 * place % elsewhere.frame_count());
    for photo in [image::imageops::flip_horizontal(color), of_another_town] {
        let query = Query::new("unknowable", Photo::from_color(photo), *query.intrinsics())?;
        trials.push(trial(&Arc::new(query), reference, None, [kind; 2]));
    }
    let is_other_street = |frame: &usize| {
        let between = PoseError::between(truth, &day.world_from_camera(*frame));
        between.translation_m >= OTHER_STREET_M && between.rotation_deg >= OTHER_STREET_DEG
    };
    let others: Vec<usize> = (0..frames).filter(is_other_street).collect();
    for _ in 0..OTHER_STREETS {
        if let Some(&frame) = others.get(rng.random_range(0..others.len().max(1))) {
            let reference = Frame::of(day, frame).named(&format!("{frame:06}")).reference(0)?;
            trials.push(trial(query, &reference, None, [kind; 2]));
        }
    }
    Ok(trials)
}

impl Trial {
    /// A sample of every method that gives a pose.
    fn samples(&self, methods: &[Method]) -> Result<Vec<Sample>, Failure> {
        let params = Params::default();
        let problem = Problem::new(Arc::clone(&self.query), Arc::clone(&self.reference), RADIUS_M)?;
        let is_fitted = |name: &&str| {
            *name == UNKNOWABLE || FITTED_ON.iter().any(|condition| condition.name() == *name)
        };
        let mut samples = Vec::new();
        for &method in methods {
            let mut evidence = Evidence::default();
            let estimator = estimator::entry(method).make(&params);
            let outcome = estimator.estimate(&problem, &mut Trace::to(&mut evidence))?;
            let subject = Subject::new(&problem, method, &params, &outcome, &evidence);
            let signals = confidence::signals(&subject);
            let (Ok(pose), Some(signals)) = (&outcome.pose, signals) else {
                continue;
            };
            let error = self.truth.map(|truth| PoseError::between(&truth, pose));
            let (names, values): (Vec<_>, Vec<_>) = signals.into_iter().unzip();
            samples.push(Sample {
                method: method.name().to_owned(),
                is_for_fitting: self.conditions.iter().all(is_fitted),
                shows_place: self.conditions[0] != UNKNOWABLE,
                is_near: error.is_some_and(|error| error.translation_m < confidence::WITHIN_M),
                probability: confidence::probability(method, &values),
                names: names.iter().map(ToString::to_string).collect(),
                values,
            });
        }
        Ok(samples)
    }
}

fn logistic(weights: &[f64], values: &[f64]) -> f64 {
    let sum: f64 = weights[1..].iter().zip(values).map(|(w, v)| w * v).sum();
    1.0 / (1.0 + (-(weights[0] + sum)).exp())
}

/// Logistic regression by iteratively reweighted least squares, on standardised signals and with a
/// ridge, so that signals that tell little keep small weights. The constant first.
fn fitted(samples: &[&Sample]) -> Option<Vec<f64>> {
    let columns = samples.first()?.values.len();
    let column = |k: usize| samples.iter().map(move |s| s.values[k]);
    let means: Vec<f64> = (0..columns).map(|k| mean(column(k))).collect();
    let variance = |k: usize| mean(column(k).map(|v| (v - means[k]).powi(2)));
    let deviations: Vec<f64> = (0..columns).map(|k| variance(k).sqrt().max(1e-9)).collect();
    let design = DMatrix::from_fn(samples.len(), columns + 1, |row, k| match k {
        0 => 1.0,
        _ => (samples[row].values[k - 1] - means[k - 1]) / deviations[k - 1],
    });
    let labels =
        DVector::from_fn(samples.len(), |row, _| f64::from(u8::from(samples[row].is_near)));
    let counts = DVector::from_fn(samples.len(), |row, _| {
        if samples[row].shows_place { 1.0 } else { UNKNOWABLE_COUNTS }
    });
    let mut weights = DVector::zeros(columns + 1);
    for _ in 0..50 {
        let predicted = (&design * &weights).map(|x: f64| 1.0 / (1.0 + (-x).exp()));
        let spread = predicted.map(|p| (p * (1.0 - p)).max(1e-6)).component_mul(&counts);
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
    let slopes: Vec<f64> = (0..columns).map(|k| weights[k + 1] / deviations[k]).collect();
    let constant = weights[0] - slopes.iter().zip(&means).map(|(s, m)| s * m).sum::<f64>();
    Some(std::iter::once(constant).chain(slopes).collect())
}

/// A probability, and whether the pose is near.
type Scored = (f64, bool);

/// Probabilities and whether they were right, of one method or of `all`, the least first.
fn scored(samples: &[Sample], method: &str, is_for_fitting: bool) -> Vec<Scored> {
    let own = samples
        .iter()
        .filter(|s| s.is_for_fitting == is_for_fitting)
        .filter(|s| method == "all" || s.method == method);
    let mut scored: Vec<Scored> = own.filter_map(|s| Some((s.probability?, s.is_near))).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    scored
}

fn judge(title: &str, samples: &[Sample]) {
    println!("\n## {title}\n");
    let mut rows = Vec::new();
    for (set, is_for_fitting) in [("fitted pairs", true), ("other pairs", false)] {
        for method in methods_of(samples).into_iter().chain(["all"]) {
            let scored = scored(samples, method, is_for_fitting);
            if scored.is_empty() {
                continue;
            }
            let near = scored.iter().filter(|s| s.1).count();
            rows.push(vec![
                format!("{set}, {method}"),
                scored.len().to_string(),
                format!("{:.1} %", percent(near, scored.len())),
                format!("{:.3}", calibration_error(&scored)),
                area_under_curve(&scored).map_or("–".to_owned(), |area| format!("{area:.3}")),
            ]);
        }
    }
    print_table("judged on,poses,within 1 m,calibration error,AUC", &rows);
    println!("Other pairs, all methods, by tenths: probability said / share within 1 m\n");
    for (predicted, actual, _) in tenths(&scored(samples, "all", false)) {
        println!("- {predicted:.3} / {actual:.3}");
    }
}

/// Ten bins of equal count of sorted samples: the mean probability, the share of poses that are near, and the count.
fn tenths(sorted: &[Scored]) -> impl Iterator<Item = (f64, f64, usize)> {
    let bins = (0..10).map(|k| &sorted[k * sorted.len() / 10..(k + 1) * sorted.len() / 10]);
    bins.filter(|bin| !bin.is_empty()).map(|bin| {
        let share = mean(bin.iter().map(|s| f64::from(u8::from(s.1))));
        (mean(bin.iter().map(|s| s.0)), share, bin.len())
    })
}

/// Expected calibration error over ten bins of equal count.
fn calibration_error(scored: &[Scored]) -> f64 {
    let all = scored.len() as f64;
    let error = |(predicted, actual, count): (f64, f64, usize)| {
        (predicted - actual).abs() * count as f64 / all
    };
    tenths(scored).map(error).sum()
}

/// The share of pairs of a near and a far pose in which the near one is believed more; ties are half.
/// `None` where there is no such pair.
fn area_under_curve(scored: &[Scored]) -> Option<f64> {
    let (near, far): (Vec<Scored>, Vec<Scored>) = scored.iter().copied().partition(|s| s.1);
    let wins = near.iter().flat_map(|a| far.iter().map(move |b| a.0.total_cmp(&b.0)));
    let wins: f64 = wins
        .map(|order| match order {
            Ordering::Greater => 1.0,
            Ordering::Equal => 0.5,
            Ordering::Less => 0.0,
        })
        .sum();
    let pairs = near.len() * far.len();
    (pairs > 0).then(|| wins / pairs as f64)
}
