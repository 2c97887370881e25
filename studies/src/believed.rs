use std::collections::BTreeSet;

use image::{Rgb, RgbImage, imageops};
use posescope::diagnosis::{Confidence, Grade};
use posescope::localize::{QueryResult, Status};
use posescope::method::Method;
use posescope::scene::street::Traversal;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::Failure;
use crate::frames::Frame;
use crate::numbers::print_table;
use crate::places::{Case, Chosen, Place, StreetPlace, all_conditions, nearest};

const METHODS: [Method; 4] = Method::PAPER;

/// Is a pose trusted that cannot be known, or one doubted that is right?
///
/// Localises queries that show nothing of their place without the truth, and counts the poses that are trusted. Then
/// localises proper queries of all conditions against references of all, and counts failure verdicts on right poses,
/// right poses of low confidence, and wrong poses that are trusted from 0.95 and from 0.98 on.
#[derive(clap::Args)]
pub struct Options {
    #[command(flatten)]
    chosen: Chosen,
}

/// What was counted of one result.
struct Counted {
    table: usize,
    /// What was done, or what the pose is.
    kind: &'static str,
    method: Method,
    /// Whether it should not be.
    is_bad: bool,
    probability: f64,
}

impl Counted {
    fn new(table: usize, kind: &'static str, result: &QueryResult, is_bad: bool) -> Self {
        Self { table, kind, method: result.method, is_bad, probability: probability(result) }
    }
}

/// The tables, in the order of [`Counted::table`].
const TABLES: [&str; 3] = [
    "Queries that show nothing of their place: trusted poses",
    "Query and reference of one condition",
    "Query and reference of any two conditions",
];

pub fn run(options: &Options) -> Result<(), Failure> {
    let conditions = all_conditions();
    let counted = options.chosen.each(|place| {
        let mut counted = unknowable(place)?;
        match place.street() {
            None => counted.extend(graded(&place.case(), 1)?),
            Some(street) => {
                let (query, reference) = (place.number % 5, (place.number / 5) % 5);
                for (table, reference) in [(1, query), (2, reference)] {
                    let drives = [query, reference].map(|condition| &conditions[condition]);
                    counted.extend(graded(&between(place, street, drives), table)?);
                }
            }
        }
        Ok(counted)
    })?;
    for (table, title) in TABLES.into_iter().enumerate() {
        let own = counted.iter().flatten().filter(|one| one.table == table);
        let own: Vec<&Counted> = own.collect();
        let kinds: BTreeSet<&str> = own.iter().map(|one| one.kind).collect();
        let rows = kinds.into_iter().map(|kind| {
            let cells = METHODS.map(|method| {
                let own = || own.iter().filter(|one| one.kind == kind && one.method == method);
                let bad = own().filter(|one| one.is_bad).count();
                let most = own().map(|one| one.probability).fold(0.0, f64::max);
                format!("{bad} of {}, at most {most:.2}", own().count())
            });
            [vec![kind.to_owned()], cells.to_vec()].concat()
        });
        println!("\n## {title}\n");
        print_table(",fb,pm,mi,hy", &rows.collect::<Vec<_>>());
    }
    Ok(())
}

fn unknowable(place: &Place<'_>) -> Result<Vec<Counted>, Failure> {
    let mut case = place.case();
    let own = case.query.photo.clone();
    let mut rng = Pcg64::seed_from_u64(place.number as u64);
    let (width, height) = own.dimensions();
    let mut noise = RgbImage::new(width, height);
    noise.pixels_mut().for_each(|pixel| *pixel = Rgb([rng.random(); 3]));
    let photos = [
        ("grey", RgbImage::from_pixel(width, height, Rgb([128; 3]))),
        ("noise", noise),
        ("mirrored", imageops::flip_horizontal(&own)),
        ("upside down", imageops::rotate180(&own)),
        ("another town", place.foreign_photo()),
    ];
    let mut counted = Vec::new();
    for (kind, photo) in photos {
        case.query.photo = photo;
        for result in case.results(&METHODS, false)? {
            let is_trusted = result.confidence_word() == Some(Confidence::Trusted);
            let is_bad = result.status == Status::Ok && is_trusted;
            counted.push(Counted::new(0, kind, &result, is_bad));
        }
    }
    Ok(counted)
}

fn probability(result: &QueryResult) -> f64 {
    let confidence = result.confidence.as_ref();
    confidence.map_or(0.0, |confidence| confidence.probability)
}

/// The query of a place in one condition and its reference in another.
fn between(place: &Place<'_>, street: &StreetPlace<'_>, drives: [&Traversal; 2]) -> Case {
    let day = &street.drives.day;
    let at = |drive, frame| Frame::of(drive, nearest(drive, &day.world_from_camera(frame)));
    Case {
        query: at(drives[0], street.query),
        references: vec![at(drives[1], street.reference)],
        ..place.case()
    }
}

/// The verdicts and the confidence of right poses, and of wrong ones.
fn graded(case: &Case, table: usize) -> Result<Vec<Counted>, Failure> {
    let is_alarm = |result: &QueryResult| result.diagnosis.iter().any(|d| d.code.is_failure());
    let (known, withheld) = (case.results(&METHODS, true)?, case.results(&METHODS, false)?);
    let mut counted = Vec::new();
    for (known, withheld) in known.iter().zip(&withheld) {
        let p = probability(withheld);
        let word = withheld.confidence_word();
        let verdicts: &[(&'static str, bool)] = match known.grade {
            Grade::Wrong => {
                &[("wrong, from 0.95 on", p >= 0.95), ("wrong, from 0.98 on", p >= 0.98)]
            }
            Grade::Right => &[
                ("right, with a failure verdict, truth known", is_alarm(known)),
                ("right, with a failure verdict, truth withheld", is_alarm(withheld)),
                ("right, low confidence", word == Some(Confidence::Low)),
                ("right, not trusted", word != Some(Confidence::Trusted)),
            ],
            _ => &[],
        };
        let of_verdict = |&(kind, is_bad)| Counted::new(table, kind, withheld, is_bad);
        counted.extend(verdicts.iter().map(of_verdict));
    }
    Ok(counted)
}
