use std::collections::BTreeMap;

use posescope::diagnosis::{Code, Confidence, Grade, confidence};
use posescope::localize::QueryResult;
use posescope::method::Method;

use crate::Failure;
use crate::faults;
use crate::numbers::{percent, print_table};
use crate::places::{Chosen, Place};

const TABLE: &str = include_str!("../../docs/diagnosis/planted_faults.csv");
const METHODS: [Method; 4] = Method::PAPER;
/// What stands for a pose without a verdict that is not trusted either.
const UNSURE: &str = "unsure";

/// Which verdict does each planted fault get?
///
/// Plants every kind of fault, and counts how often the primary verdict is the one that
/// docs/diagnosis/planted_faults.csv expects, with the truth and with it withheld. The rules were made with the
/// places of even number; those of odd number were set aside. Where the truth is withheld, L1 is expected of poses
/// that should not be trusted, and a pose that is unsure counts as that too. On real pairs, faults that need another
/// view of the place are left out.
#[derive(clap::Args)]
pub struct Options {
    #[command(flatten)]
    chosen: Chosen,
    /// This fault alone.
    #[arg(long)]
    only: Option<String>,
    /// Print each verdict that was not expected.
    #[arg(long)]
    misses: bool,
}

/// The verdicts that are expected of a fault, by method: with the truth, and without.
type Expected = [[Vec<String>; 4]; 2];

fn expectations() -> Result<BTreeMap<String, Expected>, Failure> {
    let codes = |cell: &str| -> Vec<String> { cell.split('|').map(str::to_owned).collect() };
    let expected_of = |line: &str| -> Result<(String, Expected), Failure> {
        // From the right, because the description may hold commas.
        let cells: Vec<&str> = line.rsplitn(8, ',').collect();
        let [mi0, pm0, fb0, hy, mi, pm, fb, rest] = cells[..] else {
            return Err(format!("the table has nine columns: {line}").into());
        };
        let name = rest.split(',').next().unwrap_or_default().to_owned();
        // Without the truth, a hybrid answers as the method it took.
        let hybrid = [codes(fb0), codes(mi0)].concat();
        let known = [fb, pm, mi, hy].map(codes);
        Ok((name, [known, [codes(fb0), codes(pm0), codes(mi0), hybrid]]))
    };
    TABLE.lines().skip(1).map(expected_of).collect()
}

/// One result and what is thought of it.
struct Judged {
    fault: &'static str,
    place: usize,
    method: usize,
    is_withheld: bool,
    /// The primary verdict, `unsure` or `none`.
    found: String,
    text: String,
    /// Whether it is trusted, and would not be from a probability of 0.98 on.
    is_barely_trusted: bool,
    /// Whether the pose is right all the same: the fault did no harm.
    is_right: bool,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let expected = expectations()?;
    let only = options.only.as_deref();
    let found = options.chosen.each(|place| at(place, only))?;
    let found: Vec<Judged> = found.into_iter().flatten().collect();
    let halves: &[(&str, usize)] = if options.chosen.real {
        &[("Pairs of real photos", 2)]
    } else {
        &[("Places that the rules were made with", 0), ("Places that were set aside", 1)]
    };
    for &(title, half) in halves {
        for (is_withheld, truth) in [(false, "truth known"), (true, "truth withheld")] {
            println!("\n## {title}, {truth}\n");
            let is_here = |one: &&Judged| {
                one.is_withheld == is_withheld && (half == 2 || one.place % 2 == half)
            };
            let here: Vec<&Judged> = found.iter().filter(is_here).collect();
            report(&here, &expected, options.misses)?;
        }
    }
    Ok(())
}

/// All faults at one place.
fn at(place: &Place<'_>, only: Option<&str>) -> Result<Vec<Judged>, Failure> {
    let mut found = Vec::new();
    let is_right = |result: &QueryResult| result.grade == Grade::Right;
    // A place at which a method fails anyway says nothing about a fault.
    let mut sound: Vec<bool> = place.case().results(&METHODS, true)?.iter().map(is_right).collect();
    // The hybrid needs its second method where a fault takes the first.
    sound[3] &= sound[2];
    for &(fault, plant) in faults::ALL {
        if only.is_some_and(|only| only != fault) {
            continue;
        }
        let Some(case) = plant(place) else { continue };
        let [known, withheld] = [case.results(&METHODS, true)?, case.results(&METHODS, false)?];
        for method in (0..METHODS.len()).filter(|&method| sound[method]) {
            for (is_withheld, result) in [(false, &known[method]), (true, &withheld[method])] {
                let primary = result.diagnosis.first();
                let is_unsure = is_withheld && result.confidence_word() == Some(Confidence::Unsure);
                let probability = result.confidence.as_ref().map(|one| one.probability);
                let barely = confidence::TRUSTED_FROM..0.98;
                found.push(Judged {
                    fault,
                    place: place.number,
                    method,
                    is_withheld,
                    found: match primary {
                        Some(primary) => primary.code.to_string(),
                        None if is_unsure => UNSURE.to_owned(),
                        None => "none".to_owned(),
                    },
                    text: primary.map_or_else(String::new, |primary| primary.text.clone()),
                    is_barely_trusted: probability.is_some_and(|p| barely.contains(&p)),
                    is_right: is_right(&known[method]),
                });
            }
        }
    }
    Ok(found)
}

fn report(
    found: &[&Judged],
    expected: &BTreeMap<String, Expected>,
    prints_misses: bool,
) -> Result<(), Failure> {
    let (mut all, mut hits, mut kept_by_hybrid) = (0, 0, 0);
    let (mut only_unsure, mut barely_trusted) = (0, 0);
    let (mut right, mut alarms) = (0, 0);
    let mut rows = Vec::new();
    for &(fault, _) in faults::ALL {
        let expected = expected.get(fault).ok_or(format!("{fault} is not in the table"))?;
        let mut row = vec![fault.to_owned()];
        for (method, name) in METHODS.iter().enumerate() {
            let (mut own, mut own_hits, mut harmless) = (0, 0, 0);
            for one in found.iter().filter(|j| j.fault == fault && j.method == method) {
                let codes = &expected[usize::from(one.is_withheld)][method];
                let is_doubted = codes.iter().any(|code| code == Code::L1.name());
                let is_unsure = one.found == UNSURE;
                // A pose that is right carries at most L1, whatever was done to it.
                let is_hit = if one.is_right {
                    ["none", UNSURE, Code::L1.name()].contains(&one.found.as_str())
                } else {
                    codes.contains(&one.found) || is_unsure && is_doubted
                };
                if !is_hit && prints_misses {
                    let codes = if one.is_right { "none".to_owned() } else { codes.join("|") };
                    let Judged { place, found, text, .. } = one;
                    println!(
                        "<!-- {fault} {place} {name}: {codes} expected, {found} found: {text} -->"
                    );
                }
                if one.is_right {
                    harmless += 1;
                    alarms += usize::from(!is_hit);
                    continue;
                }
                own += 1;
                own_hits += usize::from(is_hit);
                only_unsure += usize::from(is_hit && is_unsure);
                barely_trusted += usize::from(!is_hit && is_doubted && one.is_barely_trusted);
                kept_by_hybrid += usize::from(!is_hit && one.found == Code::H1.name());
            }
            row.push(format!("{own_hits}/{own} ({harmless} right)"));
            (all, hits, right) = (all + own, hits + own_hits, right + harmless);
        }
        if found.iter().any(|one| one.fault == fault) {
            rows.push(row);
        }
    }
    print_table("fault,fb,pm,mi,hy", &rows);
    println!(
        "As expected: {hits} of {all} ({:.1} %), {only_unsure} of them unsure without a verdict; with H1 for each \
         hybrid that kept a wrong pose {} ({:.1} %); {barely_trusted} more if poses were trusted from 0.98 on; false \
         alarms at right poses: {alarms} of {right}.",
        percent(hits, all),
        hits + kept_by_hybrid,
        percent(hits + kept_by_hybrid, all),
    );
    Ok(())
}
