//! Which verdict does each planted fault get?
//!
//! `cargo run -p posescope-diagnosis --bin planted_faults -- --places 12` plants every kind of fault at
//! places of the street and prints Markdown: how often the primary verdict is the one that
//! `docs/diagnosis/planted_faults.csv` expects, with the truth and with it withheld, for the places of
//! even number, which the rules were made with, and for those of odd number, which were set aside. Where the
//! truth is withheld, L1 is expected of poses that should not be trusted: one that is *unsure* counts as that too,
//! and how many of them are *low* stands beside it.
//!
//! Options: `--places N` (12), `--first N` (0), `--seed N` (0), `--only FAULT`, `--half even|odd` for
//! one half alone, `--misses` to print each verdict that was not expected. `--real` plants them in pairs of
//! real photos instead, below `POSESCOPE_DATA`; faults that need another view of the place are left out.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use posescope::diagnosis::Code;
use posescope::diagnosis::{Confidence, Tolerance, confidence};
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope_diagnosis::faults;
use posescope_diagnosis::places::{Drives, Place};
use posescope_diagnosis::real_pairs;
use rayon::prelude::*;

const TABLE: &str = include_str!("../../../docs/diagnosis/planted_faults.csv");
const METHODS: [Method; 4] = Method::PAPER;
/// What stands for a pose without a verdict that is not trusted either.
const UNSURE: &str = "unsure";

/// What was asked for.
struct Options {
    places: usize,
    first: usize,
    seed: u64,
    only: Option<String>,
    half: Option<usize>,
    misses: bool,
    real: bool,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            places: 12,
            first: 0,
            seed: 0,
            only: None,
            half: None,
            misses: false,
            real: false,
        };
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
            let number = |text: String| text.parse().map_err(|_| format!("{text} is no number"));
            match argument.as_str() {
                "--places" => options.places = number(value()?)?,
                "--first" => options.first = number(value()?)?,
                "--seed" => options.seed = number(value()?)? as u64,
                "--only" => options.only = Some(value()?),
                "--half" => options.half = Some(usize::from(value()? == "odd")),
                "--misses" => options.misses = true,
                "--real" => options.real = true,
                other => return Err(format!("unknown argument {other}")),
            }
        }
        Ok(options)
    }
}

/// The expectations of a fault, by method: with the truth, and without.
struct Expected {
    known: [Vec<String>; 4],
    withheld: [Vec<String>; 4],
}

fn expectations() -> BTreeMap<String, Expected> {
    let codes = |cell: &str| -> Vec<String> { cell.split('|').map(str::to_owned).collect() };
    TABLE
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.rsplitn(8, ',').collect();
            // From the right, because the description may hold commas.
            let [mi0, pm0, fb0, hy, mi, pm, fb, rest] = cells[..] else {
                panic!("the table has nine columns: {line}");
            };
            let name = rest.split(',').next().unwrap_or_default().to_owned();
            // Without the truth, a hybrid answers as the method it took.
            let hybrid: Vec<String> = [codes(fb0), codes(mi0)].concat();
            let expected = Expected {
                known: [codes(fb), codes(pm), codes(mi), codes(hy)],
                withheld: [codes(fb0), codes(pm0), codes(mi0), hybrid],
            };
            (name, expected)
        })
        .collect()
}

/// One result and what is thought of it.
struct Judged {
    fault: &'static str,
    place: usize,
    method: usize,
    withheld: bool,
    /// The primary verdict, or `none`.
    found: String,
    text: String,
    /// Whether it is trusted, and would not be from a probability of 0.98 on.
    is_barely_trusted: bool,
    /// Whether the pose is right all the same: the fault did no harm.
    is_right: bool,
}

fn judged(
    (fault, place, withheld): (&'static str, usize, bool),
    method: usize,
    result: &QueryResult,
    is_right: bool,
) -> Judged {
    let primary = result.diagnosis.first();
    let is_unsure = result.confidence_word() == Some(Confidence::Unsure);
    let probability = result.confidence.as_ref().map(|one| one.probability);
    Judged {
        fault,
        place,
        method,
        withheld,
        found: match primary {
            Some(primary) => primary.code.to_string(),
            None if withheld && is_unsure => UNSURE.to_owned(),
            None => "none".to_owned(),
        },
        text: primary.map_or_else(String::new, |primary| primary.text.clone()),
        is_barely_trusted: probability
            .is_some_and(|p| (confidence::TRUSTED_FROM..0.98).contains(&p)),
        is_right,
    }
}

fn main() -> Result<(), String> {
    let options = Options::parse(std::env::args().skip(1))?;
    let expected = expectations();
    if options.real {
        return in_real_pairs(&options, &expected);
    }
    let drives = Drives::new();
    let done = AtomicUsize::new(0);
    let numbers: Vec<usize> = (options.first..options.first + options.places)
        .filter(|number| options.half.is_none_or(|half| number % 2 == half))
        .collect();
    let found: Vec<Judged> = numbers
        .par_iter()
        .flat_map_iter(|&number| {
            let place = Place::numbered(&drives, number, options.seed);
            let found = at(&place, options.only.as_deref());
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            eprintln!("{count} of {} places", numbers.len());
            found
        })
        .collect();
    for half in [0, 1] {
        let of_half: Vec<&Judged> = found.iter().filter(|j| j.place % 2 == half).collect();
        if !of_half.is_empty() {
            let name = [
                "Places that the rules were made with",
                "Places that were set aside",
            ][half];
            report(name, &of_half, &expected, options.misses);
        }
    }
    Ok(())
}

/// The faults in pairs of real photos.
fn in_real_pairs(options: &Options, expected: &BTreeMap<String, Expected>) -> Result<(), String> {
    let pairs = real_pairs::all()?;
    if pairs.is_empty() {
        println!("skipped: no data");
        return Ok(());
    }
    let found: Vec<Judged> = pairs
        .par_iter()
        .enumerate()
        .flat_map_iter(|(number, pair)| {
            eprintln!("{}", pair.name);
            at(&Place::real(pair, number), options.only.as_deref())
        })
        .collect();
    let all: Vec<&Judged> = found.iter().collect();
    report(
        &format!("{} pairs of real photos", pairs.len()),
        &all,
        expected,
        options.misses,
    );
    Ok(())
}

/// All faults at one place.
fn at(place: &Place<'_>, only: Option<&str>) -> Vec<Judged> {
    let mut found = Vec::new();
    let tolerance = Tolerance::default();
    let is_right =
        |result: &QueryResult| result.error.is_some_and(|error| tolerance.contains(&error));
    // A place at which a method fails anyway says nothing about a fault.
    let mut sound: Vec<bool> = place
        .case()
        .results(&METHODS, true)
        .iter()
        .map(is_right)
        .collect();
    // The hybrid needs its second method where a fault takes the first.
    sound[3] &= sound[2];
    for &(fault, plant) in faults::ALL {
        if only.is_some_and(|only| only != fault) {
            continue;
        }
        let Some(case) = plant(place) else { continue };
        let known = case.results(&METHODS, true);
        let withheld = case.results(&METHODS, false);
        for (method, (known, withheld)) in known.iter().zip(&withheld).enumerate() {
            if !sound[method] {
                continue;
            }
            let is_right = is_right(known);
            found.push(judged(
                (fault, place.number, false),
                method,
                known,
                is_right,
            ));
            found.push(judged(
                (fault, place.number, true),
                method,
                withheld,
                is_right,
            ));
        }
    }
    found
}

fn report(title: &str, found: &[&Judged], expected: &BTreeMap<String, Expected>, misses: bool) {
    println!("\n## {title}\n");
    for withheld in [false, true] {
        let of_kind: Vec<&&Judged> = found.iter().filter(|j| j.withheld == withheld).collect();
        let title = if withheld {
            "truth withheld"
        } else {
            "truth known"
        };
        println!("\n### {title}\n\n| fault | fb | pm | mi | hy |\n|---|---|---|---|---|");
        let mut by_code: BTreeMap<String, (usize, usize)> = BTreeMap::new();
        let mut confusion: BTreeMap<(String, String), usize> = BTreeMap::new();
        let mut false_alarms = (0, 0);
        let mut kept_by_hybrid = 0;
        let (mut only_unsure, mut barely_trusted) = (0, 0);
        for &(fault, _) in faults::ALL {
            let Some(expected) = expected.get(fault) else {
                panic!("{fault} is not in the table");
            };
            let mut cells = Vec::new();
            for (method, name) in METHODS.iter().enumerate() {
                let codes = if withheld {
                    &expected.withheld[method]
                } else {
                    &expected.known[method]
                };
                let here = of_kind
                    .iter()
                    .filter(|j| j.fault == fault && j.method == method);
                let (mut hits, mut count, mut harmless) = (0, 0, 0);
                for judged in here {
                    // A pose that is right carries at most L1, whatever was done to it.
                    if judged.is_right {
                        harmless += 1;
                        false_alarms.1 += 1;
                        let may =
                            ["none", UNSURE, Code::L1.name()].contains(&judged.found.as_str());
                        false_alarms.0 += usize::from(!may);
                        if !may && misses {
                            println!(
                                "<!-- false alarm {fault} {} {}: {} {} -->",
                                judged.place, name, judged.found, judged.text
                            );
                        }
                        continue;
                    }
                    count += 1;
                    let is_unsure = judged.found == UNSURE;
                    let expects_doubt = codes.iter().any(|code| code == Code::L1.name());
                    let is_hit = codes.contains(&judged.found) || is_unsure && expects_doubt;
                    only_unsure += usize::from(is_unsure && is_hit);
                    barely_trusted +=
                        usize::from(!is_hit && expects_doubt && judged.is_barely_trusted);
                    hits += usize::from(is_hit);
                    kept_by_hybrid += usize::from(!is_hit && judged.found == Code::H1.name());
                    let main = codes[0].clone();
                    let of_code = by_code.entry(main.clone()).or_default();
                    of_code.0 += usize::from(is_hit);
                    of_code.1 += 1;
                    let shown = if is_hit {
                        main.clone()
                    } else {
                        judged.found.clone()
                    };
                    *confusion.entry((main, shown)).or_default() += 1;
                    if !is_hit && misses {
                        println!(
                            "<!-- {fault} {} {}: {} expected, {} found: {} -->",
                            judged.place,
                            name,
                            codes.join("|"),
                            judged.found,
                            judged.text
                        );
                    }
                }
                let harmless = if harmless > 0 {
                    format!(" ({harmless} right)")
                } else {
                    String::new()
                };
                cells.push(format!("{hits}/{count}{harmless}"));
            }
            if cells.iter().any(|cell| cell != "0/0") {
                println!("| {fault} | {} |", cells.join(" | "));
            }
        }
        let (hits, count) = by_code
            .values()
            .fold((0, 0), |all, one| (all.0 + one.0, all.1 + one.1));
        println!(
            "\nPrimary verdict as expected: {hits} of {count} ({:.1} %), with H1 for each hybrid that kept a \
             wrong pose {} ({:.1} %); false alarms at right poses: {} of {}.\n",
            percent(hits, count),
            hits + kept_by_hybrid,
            percent(hits + kept_by_hybrid, count),
            false_alarms.0,
            false_alarms.1
        );
        if withheld {
            println!(
                "Of those {only_unsure} are unsure, without a verdict. {barely_trusted} more would be if poses were \
                 trusted from 0.98 on.\n"
            );
        }
        println!("| expected | as expected | found instead |\n|---|---|---|");
        for (code, (hits, count)) in &by_code {
            let instead: Vec<String> = confusion
                .iter()
                .filter(|((expected, found), _)| expected == code && found != code)
                .map(|((_, found), times)| format!("{found} {times}"))
                .collect();
            println!("| {code} | {hits}/{count} | {} |", instead.join(", "));
        }
    }
}

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}
