//! Did the search fail, or the cost? The verdict beside a dense search.
//!
//! `cargo run -p posescope-diagnosis --bin search_or_cost -- --cases 60` takes poses of PM and MI that are
//! wrong, in all conditions of the street, and searches densely, ± 1 m in steps of 0.1 m and ± 2° in steps
//! of 0.4°, around the truth and around the eight best coarse minima: the search failed if the cheapest
//! of all is at the truth. D3 has to say the same.
//!
//! Options: `--cases N` (60), `--seed N` (0), `--misses` to print those that disagree.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use posescope::code::Code;
use posescope::diagnosis::{Evidence, Subject, Tolerance, diagnose};
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::grid::Offset;
use posescope::image::Photo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::render::Scorer;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::trace::Trace;
use posescope_diagnosis::places::frame_of;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// Coarse minima that are searched around.
const MINIMA: usize = 8;

/// What was found out about one wrong pose.
struct Compared {
    method: Method,
    searched_says: bool,
    verdict: Code,
    words: String,
}

fn main() -> Result<(), String> {
    let (mut cases, mut seed, mut misses) = (60, 0, false);
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
            "--seed" => seed = number as u64,
            other => return Err(format!("unknown argument {other}")),
        }
    }
    let drives = Condition::ALL.map(|c| Traversal::new(WORLD_SEED, c, Size::Full));
    let found = Mutex::new(Vec::new());
    let count = AtomicUsize::new(0);
    // More places than are needed: most poses are right.
    (0..20 * cases).into_par_iter().for_each(|place| {
        if count.load(Ordering::Relaxed) >= cases {
            return;
        }
        for compared in at(&drives, place, seed) {
            count.fetch_add(1, Ordering::Relaxed);
            if let Ok(mut found) = found.lock() {
                found.push(compared);
                eprintln!("{} of {cases} cases", found.len());
            }
        }
    });
    let found = found.into_inner().map_err(|error| error.to_string())?;
    println!("| method | wrong poses | truth outside the grid | search failed | verdict agrees |");
    println!("|---|---|---|---|---|");
    for method in [Method::PM, Method::MI] {
        let of_method = found.iter().filter(|one| one.method == method);
        // Where the grid leaves the truth out, neither the search failed nor the cost.
        let (outside, own): (Vec<&Compared>, Vec<&Compared>) =
            of_method.partition(|one| one.verdict == Code::D4);
        let searched = own.iter().filter(|one| one.searched_says).count();
        let agrees = |one: &Compared| (one.verdict == Code::D3) == one.searched_says;
        let agreeing = own.iter().filter(|one| agrees(one)).count();
        println!(
            "| {method} | {} | {} | {searched} | {agreeing} of {} |",
            outside.len() + own.len(),
            outside.len(),
            own.len()
        );
        for one in own.iter().filter(|one| misses && !agrees(one)) {
            println!(
                "<!-- {method} dense: {}, verdict {}: {} -->",
                one.searched_says, one.verdict, one.words
            );
        }
    }
    Ok(())
}

fn at(drives: &[Traversal; 5], place: usize, seed: u64) -> Vec<Compared> {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(6007).wrapping_add(place as u64));
    let (queries, references) = (
        &drives[rng.random_range(0..5)],
        &drives[rng.random_range(0..5)],
    );
    let query = rng.random_range(0..queries.frame_count());
    let truth = queries.world_from_camera(query);
    let apart: f64 = rng.random_range(1.0..9.5);
    let ahead = truth * nalgebra::Point3::new(0.0, 0.0, apart);
    let away = |frame: &usize| {
        (references.world_from_camera(*frame).translation.vector - ahead.coords).norm()
    };
    let reference = (0..references.frame_count())
        .min_by(|a, b| away(a).total_cmp(&away(b)))
        .unwrap_or(0);
    let frame = frame_of(queries, query, &truth);
    let query = Query::new("query", Photo::from_color(frame.photo), frame.intrinsics)
        .expect("a whole frame");
    let pose = references.world_from_camera(reference);
    let frame = frame_of(references, reference, &pose);
    let photo = Photo::from_color(frame.photo);
    let reference = ReferenceTuple::new("reference", photo, frame.intrinsics, pose, frame.cloud);
    let problem = Problem::new(query, reference.expect("a whole frame"), 10.0).expect("a radius");
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
        let mut searched_says = None;
        estimator.with_scorer(&problem, &mut |scorer| {
            searched_says = dense(scorer, &evidence, &from_truth, &tolerance);
        });
        compared.extend(searched_says.map(|searched_says| Compared {
            method,
            searched_says,
            verdict: primary.code,
            words: primary.text.clone(),
        }));
    }
    compared
}

/// Whether the cheapest pose of all is at the truth; `None` where nothing there has a say.
fn dense(
    scorer: &Scorer<'_>,
    evidence: &Evidence,
    truth: &Pose,
    tolerance: &Tolerance,
) -> Option<bool> {
    let coarse = evidence.surfaces.first()?;
    let least = |centre: Offset, is_counted: &dyn Fn(&Offset) -> bool| {
        let offsets: Vec<Offset> = (-5..=5)
            .flat_map(|turn| (-10..=10).flat_map(move |z| (-10..=10).map(move |x| (turn, z, x))))
            .map(|(turn, z, x)| Offset {
                right_m: centre.right_m + 0.1 * f64::from(x),
                forward_m: centre.forward_m + 0.1 * f64::from(z),
                yaw_rad: centre.yaw_rad + (0.4 * f64::from(turn)).to_radians(),
            })
            .filter(is_counted)
            .collect();
        let poses: Vec<Pose> = offsets.iter().map(Offset::reference_from_camera).collect();
        let scores = scorer.score(&poses).into_iter();
        scores
            .filter_map(|score| score.eligible_cost(coarse.least_covered))
            .reduce(f64::min)
    };
    let is_right = |offset: &Offset| {
        tolerance.contains(&PoseError::between(truth, &offset.reference_from_camera()))
    };
    let at_truth = least(Offset::of(truth), &is_right)?;
    let minima = coarse.local_minima().into_iter().take(MINIMA);
    let result = evidence.minimum.map(|minimum| minimum.offset);
    let centres = minima
        .filter_map(|(cell, _)| coarse.lattice.offset(cell))
        .chain(result);
    let elsewhere = centres
        .filter_map(|centre| least(centre, &|offset| !is_right(offset)))
        .fold(f64::INFINITY, f64::min);
    Some(at_truth < elsewhere)
}
