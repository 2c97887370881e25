//! Did the search fail, or the cost? The verdict beside a dense search.
//!
//! `cargo run -p posescope-diagnosis --bin search_or_cost -- --cases 60` takes poses of PM and MI that are
//! wrong, in all conditions of the street, and searches densely, ± 1 m in steps of 0.1 m and ± 2° in steps
//! of 0.4°, around the truth and around the eight best coarse minima: the search failed if the cheapest
//! of all is at the truth. D3 has to say the same.
//!
//! For some of the cases the whole disc is searched too, in steps of 0.25 m and 1°.
//!
//! Options: `--cases N` (60), `--disc N` (20) of them over the whole disc, `--seed N` (0), `--misses` to
//! print those that disagree.

use posescope::diagnosis::Code;
use posescope::diagnosis::{Evidence, Subject, Tolerance, diagnose};
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::grid::{GridParams, Offset};
use posescope::method::Method;
use posescope::params::Params;
use posescope::render::Scorer;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::trace::Trace;
use posescope_diagnosis::places::{Pairing, problem_of};
use rayon::prelude::*;

/// Coarse minima that are searched around.
const MINIMA: usize = 8;

/// Uncertainty of the reference's position \[m\].
const RADIUS_M: f64 = 10.0;

/// Places that are looked at in parallel.
const PLACES_AT_ONCE: usize = 8;

/// What was found out about one wrong pose.
struct Compared {
    method: Method,
    /// Whether the cheapest pose is at the truth, of those around the coarse minima.
    searched_says: bool,
    /// The same of the whole disc, where that was searched.
    disc_says: Option<bool>,
    verdict: Code,
    words: String,
}

fn main() -> Result<(), String> {
    let (mut cases, mut discs, mut seed, mut misses) = (60, 20, 0, false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--misses" {
            misses = true;
            continue;
        }
        let value = arguments
            .next()
            .ok_or(format!("{argument} needs a value"))?;
        let number: usize = value.parse().map_err(|_| format!("{value} is no number"))?;
        match argument.as_str() {
            "--cases" => cases = number,
            "--disc" => discs = number,
            "--seed" => seed = number as u64,
            other => return Err(format!("unknown argument {other}")),
        }
    }
    let drives = Condition::ALL.map(|c| Traversal::new(WORLD_SEED, c, Size::Full));
    // More places than are needed: most poses are right. Some at a time, so that the same cases are
    // counted whatever is done first.
    let mut found: Vec<Compared> = Vec::new();
    for first in (0..20 * cases).step_by(PLACES_AT_ONCE) {
        if found.len() >= cases {
            break;
        }
        let is_disc_searched = found.len() < discs;
        let places: Vec<usize> = (first..first + PLACES_AT_ONCE).collect();
        let of_places: Vec<Vec<Compared>> = places
            .par_iter()
            .map(|place| at(&drives, *place, seed, is_disc_searched))
            .collect();
        found.extend(of_places.into_iter().flatten());
        eprintln!("{} of {cases} cases", found.len());
    }
    found.truncate(cases);
    println!(
        "| method | wrong poses | truth outside the grid | search failed | verdict agrees | verdict agrees with the whole disc |"
    );
    println!("|---|---|---|---|---|---|");
    for method in [Method::PM, Method::MI] {
        let of_method = found.iter().filter(|one| one.method == method);
        // Where the grid leaves the truth out, neither the search failed nor the cost.
        let (outside, own): (Vec<&Compared>, Vec<&Compared>) =
            of_method.partition(|one| one.verdict == Code::D4);
        let searched = own.iter().filter(|one| one.searched_says).count();
        let agrees = |one: &Compared| (one.verdict == Code::D3) == one.searched_says;
        let agreeing = own.iter().filter(|one| agrees(one)).count();
        let by_disc = |one: &&&Compared| one.disc_says.is_some();
        let agrees_with_disc = |one: &&&Compared| one.disc_says == Some(one.verdict == Code::D3);
        let (with_disc, agreeing_with_disc) = (
            own.iter().filter(by_disc).count(),
            own.iter().filter(agrees_with_disc).count(),
        );
        println!(
            "| {method} | {} | {} | {searched} | {agreeing} of {} | {agreeing_with_disc} of {with_disc} |",
            outside.len() + own.len(),
            outside.len(),
            own.len()
        );
        let is_miss = |one: &&&Compared| !agrees(one) || by_disc(one) && !agrees_with_disc(one);
        for one in own.iter().filter(|one| misses && is_miss(one)) {
            println!(
                "<!-- {method} dense: {}, disc {:?}, verdict {}: {} -->",
                one.searched_says, one.disc_says, one.verdict, one.words
            );
        }
    }
    Ok(())
}

fn at(drives: &[Traversal; 5], place: usize, seed: u64, is_disc_searched: bool) -> Vec<Compared> {
    let (query, reference) = Pairing::numbered(drives, place, seed, false).frames(drives);
    let (problem, truth) = problem_of(query, reference, RADIUS_M);
    let params = Params::default();
    let tolerance = Tolerance::default();
    let mut compared = Vec::new();
    for method in [Method::PM, Method::MI] {
        let estimator = estimator::entry(method).make(&params);
        let mut evidence = Evidence::default();
        let outcome = estimator
            .estimate(&problem, &mut Trace::to(&mut evidence))
            .expect("nobody cancels");
        let Ok(pose) = &outcome.pose else { continue };
        if tolerance.contains(&PoseError::between(&truth, pose)) {
            continue;
        }
        let subject = Subject::new(&problem, method, &params, &outcome, &evidence);
        let verdicts = diagnose(&subject.against(Some(&truth), tolerance));
        let Some(primary) = verdicts.first() else {
            continue;
        };
        let from_truth = problem.reference_from_query(&truth);
        let mut searched = None;
        estimator.with_scorer(&problem, &mut |scorer| {
            searched = dense(scorer, &evidence, &from_truth, &tolerance, is_disc_searched);
        });
        compared.extend(searched.map(|(searched_says, disc_says)| Compared {
            method,
            searched_says,
            disc_says,
            verdict: primary.code,
            words: primary.text.clone(),
        }));
    }
    compared
}

/// Whether the cheapest pose of all is at the truth: of those around the coarse minima, and of those in
/// the whole disc too, if that is asked for. `None` where nothing there has a say.
fn dense(
    scorer: &Scorer<'_>,
    evidence: &Evidence,
    truth: &Pose,
    tolerance: &Tolerance,
    is_disc_searched: bool,
) -> Option<(bool, Option<bool>)> {
    let coarse = evidence.surfaces.first()?;
    let least = |offsets: Vec<Offset>| {
        let poses: Vec<Pose> = offsets.iter().map(Offset::reference_from_camera).collect();
        let scores = scorer.score(&poses).into_iter();
        scores
            .filter_map(|score| score.eligible_cost(coarse.least_covered))
            .reduce(f64::min)
    };
    let is_right = |offset: &Offset| {
        tolerance.contains(&PoseError::between(truth, &offset.reference_from_camera()))
    };
    let around = |centre: Offset| {
        let metres = Steps {
            most: 1.0,
            step: 0.1,
        };
        let degrees = Steps {
            most: 2.0,
            step: 0.4,
        };
        box_around(centre, metres, degrees)
    };
    let at_truth = least(around(Offset::of(truth)).filter(is_right).collect())?;
    let minima = coarse.local_minima().into_iter().take(MINIMA);
    let result = evidence.minimum.map(|minimum| minimum.offset);
    let centres = minima
        .filter_map(|(cell, _)| coarse.lattice.offset(cell))
        .chain(result);
    let elsewhere = centres
        .filter_map(|centre| least(around(centre).filter(|o| !is_right(o)).collect()))
        .fold(f64::INFINITY, f64::min);
    let in_disc = is_disc_searched.then(|| {
        let params = GridParams::default();
        let metres = Steps {
            most: RADIUS_M,
            step: 0.25,
        };
        let degrees = Steps {
            most: params.yaw_range_deg,
            step: 1.0,
        };
        let centre = Offset {
            right_m: 0.0,
            forward_m: 0.0,
            yaw_rad: 0.0,
        };
        let disc = box_around(centre, metres, degrees)
            .filter(|offset| offset.right_m.hypot(offset.forward_m) <= RADIUS_M)
            .filter(|offset| !is_right(offset));
        least(disc.collect()).unwrap_or(f64::INFINITY)
    });
    let says = |elsewhere: f64| at_truth < elsewhere;
    Some((
        says(elsewhere),
        in_disc.map(|cost| says(cost.min(elsewhere))),
    ))
}

/// From minus `most` to `most`.
#[derive(Clone, Copy)]
struct Steps {
    most: f64,
    step: f64,
}

impl Steps {
    fn all(self) -> impl Iterator<Item = f64> + Clone {
        let count = (self.most / self.step).round() as i32;
        (-count..=count).map(move |k| self.step * f64::from(k))
    }
}

/// A lattice of offsets around one, in metres to the right and forward, and in degrees.
fn box_around(centre: Offset, metres: Steps, degrees: Steps) -> impl Iterator<Item = Offset> {
    let places = move || {
        metres
            .all()
            .flat_map(move |z| metres.all().map(move |x| (x, z)))
    };
    degrees.all().flat_map(move |turn| {
        places().map(move |(x, z)| Offset {
            right_m: centre.right_m + x,
            forward_m: centre.forward_m + z,
            yaw_rad: centre.yaw_rad + turn.to_radians(),
        })
    })
}
