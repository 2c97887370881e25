//! How often is a wrong pose trusted, and a right pose doubted?
//!
//! `cargo run -p posescope-diagnosis --bin believed -- --places 40` measures three things:
//!
//! 1. Queries that do not show their place (grey, noise, mirrored, upside down, another town), with the truth
//!    withheld. It counts the poses that are trusted. None should be.
//! 2. Queries of every condition against references of every condition. It counts right poses that carry a
//!    failure verdict, with and without the truth, and right poses of low confidence. Few should.
//! 3. Wrong poses that are trusted, at the limit of 0.95 and at 0.98.
//!
//! Options: `--places N` (40), `--seed N` (0), `--real yes` for the pairs of real photos below
//! `POSESCOPE_DATA` instead of the street.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use image::{Rgb, RgbImage};
use posescope::diagnosis::{Confidence, Grade};
use posescope::localize::{QueryResult, Status};
use posescope::method::Method;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope_diagnosis::places::{Case, Drives, Place, StreetPlace, frame_of};
use posescope_diagnosis::real_pairs;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rayon::prelude::*;

const METHODS: [Method; 4] = Method::PAPER;

/// Results by what was done and method.
type Counts = BTreeMap<(&'static str, &'static str), Tally>;

/// Results that were not to be, all results, and the greatest probability that was said.
#[derive(Clone, Copy, Default)]
struct Tally {
    bad: usize,
    all: usize,
    most: f64,
}

impl Tally {
    fn add(&mut self, is_bad: bool, probability: f64) {
        self.bad += usize::from(is_bad);
        self.all += 1;
        self.most = self.most.max(probability);
    }
}

fn main() -> Result<(), String> {
    let mut arguments = std::env::args().skip(1);
    let (mut places, mut seed, mut is_real) = (40, 0, false);
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
            "--real" => is_real = value == "yes",
            "--seed" => seed = number()? as u64,
            other => return Err(format!("unknown argument {other}")),
        }
    }
    let counted = match is_real {
        true => in_real_pairs()?,
        false => on_the_street(places, seed),
    };
    let mut sums = [Counts::new(), Counts::new(), Counts::new()];
    for of_place in counted {
        for (sum, counts) in sums.iter_mut().zip(of_place) {
            add(sum, counts);
        }
    }
    let [unknowable, one, two] = &sums;
    print(
        "Queries that show nothing of their place: trusted poses",
        unknowable,
    );
    print("Query and reference of one condition", one);
    print("Query and reference of any two conditions", two);
    Ok(())
}

/// What was counted at each place: of queries that show nothing of it, of proper ones in one condition, and in
/// two.
fn on_the_street(places: usize, seed: u64) -> Vec<[Counts; 3]> {
    let drives = Drives::new();
    let conditions = Condition::ALL.map(|c| (c, Traversal::new(WORLD_SEED, c, Size::Full)));
    let done = AtomicUsize::new(0);
    let at = |number| {
        let place = Place::numbered(&drives, number, seed);
        let proper = place.street().map(|street| {
            let cases = in_two_conditions(&place, street, &conditions);
            cases.map(|case| graded(&[case]))
        });
        let [one, two] = proper.unwrap_or_default();
        let counts = [unknowable(&place), one, two];
        let count = done.fetch_add(1, Ordering::Relaxed) + 1;
        eprintln!("{count} of {places} places");
        counts
    };
    (0..places).into_par_iter().map(at).collect()
}

fn in_real_pairs() -> Result<Vec<[Counts; 3]>, String> {
    let pairs = real_pairs::all()?;
    if pairs.is_empty() {
        println!("skipped: no data");
    }
    let counted = pairs.par_iter().enumerate().map(|(number, pair)| {
        let place = Place::real(pair, number);
        eprintln!("{}", pair.name);
        [unknowable(&place), graded(&[place.case()]), Counts::new()]
    });
    Ok(counted.collect())
}

fn add(all: &mut Counts, some: Counts) {
    for (key, tally) in some {
        let entry = all.entry(key).or_default();
        entry.bad += tally.bad;
        entry.all += tally.all;
        entry.most = entry.most.max(tally.most);
    }
}

fn print(title: &str, counts: &Counts) {
    println!(
        "\n## {title}\n\n| | {} |\n|---|---|---|---|---|",
        METHODS.map(Method::name).join(" | ")
    );
    let mut kinds: Vec<&str> = counts.keys().map(|(kind, _)| *kind).collect();
    kinds.dedup();
    for kind in kinds {
        let cells = METHODS.map(|method| {
            let tally = counts.get(&(kind, method.name())).copied();
            let Tally { bad, all, most } = tally.unwrap_or_default();
            format!("{bad} of {all}, at most {most:.2}")
        });
        println!("| {kind} | {} |", cells.join(" | "));
    }
}

fn unknowable(place: &Place<'_>) -> Counts {
    let case = place.case();
    let own = &case.query.photo;
    let mut rng = Pcg64::seed_from_u64(place.number as u64);
    let mut noise = RgbImage::new(own.width(), own.height());
    noise
        .pixels_mut()
        .for_each(|pixel| *pixel = Rgb([rng.random(); 3]));
    let photos = [
        (
            "grey",
            RgbImage::from_pixel(own.width(), own.height(), Rgb([128; 3])),
        ),
        ("noise", noise),
        ("mirrored", image::imageops::flip_horizontal(own)),
        ("upside down", image::imageops::rotate180(own)),
        ("another town", place.foreign_photo()),
    ];
    let mut counts = Counts::new();
    for (kind, photo) in photos {
        let mut case = case.clone();
        case.query.photo = photo;
        for result in case.results(&METHODS, false) {
            let is_trusted = result.confidence_word() == Some(Confidence::Trusted);
            let entry = counts.entry((kind, result.method.name())).or_default();
            entry.add(
                result.status == Status::Ok && is_trusted,
                probability(&result),
            );
        }
    }
    counts
}

fn probability(result: &QueryResult) -> f64 {
    let confidence = result.confidence.as_ref();
    confidence.map_or(0.0, |confidence| confidence.probability)
}

/// The query and the reference of the place in two conditions each.
fn in_two_conditions(
    place: &Place<'_>,
    street: &StreetPlace<'_>,
    conditions: &[(Condition, Traversal); 5],
) -> [Case; 2] {
    let (query, reference) = (place.number % 5, (place.number / 5) % 5);
    let day = &street.drives.day;
    let nearest = |drive: &Traversal, frame: usize| {
        let target = day.world_from_camera(frame).translation.vector;
        let away = |k: &usize| (drive.world_from_camera(*k).translation.vector - target).norm();
        (0..drive.frame_count())
            .min_by(|a, b| away(a).total_cmp(&away(b)))
            .unwrap_or(0)
    };
    [(query, query), (query, reference)].map(|(query, reference)| {
        let (queries, references) = (&conditions[query].1, &conditions[reference].1);
        let query = nearest(queries, street.query);
        let reference = nearest(references, street.reference);
        Case {
            query: frame_of(queries, query, &queries.world_from_camera(query)),
            references: vec![frame_of(
                references,
                reference,
                &references.world_from_camera(reference),
            )],
            ..place.case()
        }
    })
}

/// Counts verdicts and confidences of right poses, and of wrong ones.
fn graded(cases: &[Case]) -> Counts {
    let mut counts = Counts::new();
    for case in cases {
        let (known, withheld) = (case.results(&METHODS, true), case.results(&METHODS, false));
        for (known, withheld) in known.iter().zip(&withheld) {
            let p = probability(withheld);
            if known.grade == Grade::Wrong {
                for (kind, limit) in [("wrong, from 0.95 on", 0.95), ("wrong, from 0.98 on", 0.98)]
                {
                    let entry = counts.entry((kind, known.method.name())).or_default();
                    entry.add(p >= limit, p);
                }
            }
            if known.grade != Grade::Right {
                continue;
            }
            let is_alarm =
                |result: &QueryResult| result.diagnosis.iter().any(|d| d.code.is_failure());
            let word = withheld.confidence_word();
            for (kind, bad) in [
                (
                    "right, with a failure verdict, truth known",
                    is_alarm(known),
                ),
                (
                    "right, with a failure verdict, truth withheld",
                    is_alarm(withheld),
                ),
                ("right, low confidence", word == Some(Confidence::Low)),
                ("right, not trusted", word != Some(Confidence::Trusted)),
            ] {
                let entry = counts.entry((kind, known.method.name())).or_default();
                entry.add(bad, probability(withheld));
            }
        }
    }
    counts
}
