use std::collections::BTreeMap;

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

/// Results that should not be, all results, and the greatest probability, by what was done and method.
#[derive(Default)]
struct Counts(BTreeMap<(&'static str, &'static str), (usize, usize, f64)>);

impl Counts {
    fn add(&mut self, kind: &'static str, result: &QueryResult, is_bad: bool) {
        let tally = (usize::from(is_bad), 1, probability(result));
        self.add_tally((kind, result.method.name()), tally);
    }

    fn add_tally(
        &mut self,
        key: (&'static str, &'static str),
        (bad, all, most): (usize, usize, f64),
    ) {
        let tally = self.0.entry(key).or_default();
        *tally = (tally.0 + bad, tally.1 + all, tally.2.max(most));
    }

    fn print(&self, title: &str) {
        let mut kinds: Vec<&str> = self.0.keys().map(|(kind, _)| *kind).collect();
        kinds.dedup();
        let rows = kinds.into_iter().map(|kind| {
            let cells = METHODS.map(|method| {
                let tally = self.0.get(&(kind, method.name())).copied();
                let (bad, all, most) = tally.unwrap_or_default();
                format!("{bad} of {all}, at most {most:.2}")
            });
            [vec![kind.to_owned()], cells.to_vec()].concat()
        });
        println!("\n## {title}\n");
        print_table(",fb,pm,mi,hy", &rows.collect::<Vec<_>>());
    }
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let conditions = all_conditions();
    let counted = options.chosen.each(|place| {
        let [mut one, mut two] = [Counts::default(), Counts::default()];
        match place.street() {
            None => grade(&place.case(), &mut one)?,
            Some(street) => {
                let (query, reference) = (place.number % 5, (place.number / 5) % 5);
                for (counts, reference) in [(&mut one, query), (&mut two, reference)] {
                    let drives = [query, reference].map(|condition| &conditions[condition]);
                    grade(&between(place, street, drives), counts)?;
                }
            }
        }
        Ok([unknowable(place)?, one, two])
    })?;
    let mut sums = [const { Counts(BTreeMap::new()) }; 3];
    for of_place in counted {
        for (sum, counts) in sums.iter_mut().zip(of_place) {
            counts.0.into_iter().for_each(|(key, tally)| sum.add_tally(key, tally));
        }
    }
    let [unknowable, one, two] = &sums;
    unknowable.print("Queries that show nothing of their place: trusted poses");
    one.print("Query and reference of one condition");
    two.print("Query and reference of any two conditions");
    Ok(())
}

fn unknowable(place: &Place<'_>) -> Result<Counts, Failure> {
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
    let mut counts = Counts::default();
    for (kind, photo) in photos {
        case.query.photo = photo;
        for result in case.results(&METHODS, false)? {
            let is_trusted = result.confidence_word() == Some(Confidence::Trusted);
            counts.add(kind, &result, result.status == Status::Ok && is_trusted);
        }
    }
    Ok(counts)
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

/// Counts the verdicts and the confidence of a right pose, and of a wrong one.
fn grade(case: &Case, counts: &mut Counts) -> Result<(), Failure> {
    let is_alarm = |result: &QueryResult| result.diagnosis.iter().any(|d| d.code.is_failure());
    let (known, withheld) = (case.results(&METHODS, true)?, case.results(&METHODS, false)?);
    for (known, withheld) in known.iter().zip(&withheld) {
        let p = probability(withheld);
        let word = withheld.confidence_word();
        let verdicts: &[(&str, bool)] = match known.grade {
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
        verdicts.iter().for_each(|&(kind, is_bad)| counts.add(kind, withheld, is_bad));
    }
    Ok(())
}
