//! How long do verdicts take beside what they are about?
//!
//! `cargo run -p posescope-diagnosis --bin verdict_cost -- --cases 40` localises queries in all conditions
//! of the street, and says for each method which share of that time the verdicts take, without the truth
//! and with it, of all results and of the wrong ones, and so for a query
//! that asks all four. Both times are taken one after the other on the same pair, so that what else the
//! machine does stands in both; nothing is remembered from one pair to the next.
//!
//! Options: `--cases N` (40), `--seed N` (0), `--same yes` for queries and references of one condition,
//! `--together yes` for methods that share what is remembered of the photos, as those of one run do: without
//! it each is asked alone.

use std::sync::Arc;
use std::time::{Duration, Instant};

use posescope::diagnosis::{Diagnosis, Evidence, Subject, Tolerance, diagnose};
use posescope::estimator::Outcome;
use posescope::geometry::{Pose, PoseError};
use posescope::localize::localize_traced;
use posescope::memo::Memo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::trace::Trace;
use posescope_diagnosis::places::{Pairing, problem_of};

/// Uncertainty of the reference's position \[m\].
const RADIUS_M: f64 = 10.0;

/// What is remembered of a photo, at most, as of a frame of a scene that is read once.
const REMEMBERED: usize = 64;

/// Times of one result.
struct Timed {
    method: Method,
    is_right: bool,
    /// Primary verdict, or `none`.
    verdict: String,
    localized: Duration,
    withheld: Duration,
    known: Duration,
}

fn main() -> Result<(), String> {
    let (mut cases, mut seed, mut is_same_condition, mut is_together) = (40, 0, false, false);
    let mut arguments = std::env::args().skip(1);
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
            "--cases" => cases = number()?,
            "--seed" => seed = number()? as u64,
            "--same" => is_same_condition = value == "yes",
            "--together" => is_together = value == "yes",
            other => return Err(format!("unknown argument {other}")),
        }
    }
    let drives = Condition::ALL.map(|c| Traversal::new(WORLD_SEED, c, Size::Full));
    let mut timed = Vec::new();
    for number in 0..cases {
        let pairing = Pairing::numbered(&drives, number, seed, is_same_condition);
        let (query, reference) = pairing.frames(&drives);
        let (mut problem, truth) = problem_of(query, reference, RADIUS_M);
        // Twice, so that neither finds what the other left behind.
        let [withheld, known] = [None, Some(&truth)].map(|truth| {
            let mut judged = Vec::new();
            for (number, method) in Method::PAPER.into_iter().enumerate() {
                if number == 0 || !is_together {
                    Arc::make_mut(&mut problem.query).memo = Memo::of(REMEMBERED);
                    Arc::make_mut(&mut problem.reference).memo = Memo::of(REMEMBERED);
                }
                judged.push(judged_by(&problem, truth, method));
            }
            judged
        });
        let both = withheld.into_iter().zip(known);
        timed.extend(both.zip(Method::PAPER).map(|((withheld, known), method)| {
            let pose = known.outcome.pose.as_ref();
            let error = |pose| PoseError::between(&truth, pose);
            let primary = known.found.first();
            Timed {
                method,
                is_right: pose.is_ok_and(|pose| Tolerance::default().contains(&error(pose))),
                verdict: primary.map_or("none".to_owned(), |primary| primary.code.to_string()),
                localized: (withheld.localized + known.localized) / 2,
                withheld: withheld.judging,
                known: known.judging,
            }
        }));
        eprintln!("{} of {cases}", number + 1);
    }
    println!(
        "| method | results | without the truth | with it | wrong | … with the truth, of the wrong |\n\
         |---|---|---|---|---|---|"
    );
    let methods = Method::PAPER.map(Some).into_iter();
    for method in methods.chain([None]) {
        let is_of = |t: &&Timed| method.is_none_or(|method| t.method == method);
        let of_method: Vec<&Timed> = timed.iter().filter(is_of).collect();
        let name = method.map_or("all four", |method| method.name());
        let wrong: Vec<&Timed> = of_method.iter().copied().filter(|t| !t.is_right).collect();
        println!(
            "| {name} | {} | {:.1} % | {:.1} % | {} | {:.1} % |",
            of_method.len(),
            share(&of_method, |t| t.withheld),
            share(&of_method, |t| t.known),
            wrong.len(),
            share(&wrong, |t| t.known),
        );
    }
    let mut verdicts: Vec<String> = timed.iter().map(|t| t.verdict.clone()).collect();
    verdicts.sort();
    verdicts.dedup();
    println!("\n| primary verdict | results | with the truth |\n|---|---|---|");
    for verdict in verdicts {
        let of_verdict: Vec<&Timed> = timed.iter().filter(|t| t.verdict == verdict).collect();
        let part = share(&of_verdict, |t| t.known);
        println!("| {verdict} | {} | {part:.1} % |", of_verdict.len());
    }
    Ok(())
}

/// What part takes of the time of localising, of all together \[%\].
fn share(timed: &[&Timed], part: impl Fn(&Timed) -> Duration) -> f64 {
    let sum = |of: &dyn Fn(&Timed) -> Duration| -> f64 {
        timed.iter().map(|t| of(t).as_secs_f64()).sum()
    };
    100.0 * sum(&part) / sum(&|t| t.localized).max(f64::MIN_POSITIVE)
}

/// A result, its verdicts, and the times of both.
struct Judged {
    outcome: Outcome,
    found: Vec<Diagnosis>,
    localized: Duration,
    judging: Duration,
}

fn judged_by(problem: &Problem, truth: Option<&Pose>, method: Method) -> Judged {
    let params = Params::default();
    let mut evidence = Evidence::default();
    let started = Instant::now();
    let outcome = localize_traced(problem, method, &params, &mut Trace::to(&mut evidence))
        .expect("nobody cancels");
    let localized = started.elapsed();
    let started = Instant::now();
    let subject = Subject::new(problem, method, &params, &outcome, &evidence);
    let found = diagnose(&subject.against(truth, Tolerance::default()));
    let judging = started.elapsed();
    Judged {
        outcome,
        found,
        localized,
        judging,
    }
}
