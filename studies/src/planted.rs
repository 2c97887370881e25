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
/// docs/diagnosis/planted_faults.csv expects (X1 counts behind it too), with the truth and with it withheld. The rules were made with the
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
    /// Whether it was expected.
    is_hit: bool,
    /// Whether it is trusted against what was expected, and would not be from a probability of 0.98 on.
    is_barely_trusted: bool,
    /// Whether the pose is right all the same: the fault did no harm.
    is_right: bool,
    /// What was expected and found.
    words: String,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let expected = expectations()?;
    let only = options.only.as_deref();
    let found = options.chosen.each(|place| at(place, only, &expected))?;
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
            report(&here, options.misses);
        }
    }
    Ok(())
}

/// All faults at one place.
fn at(
    place: &Place<'_>,
    only: Option<&str>,
    expected: &BTreeMap<String, Expected>,
) -> Result<Vec<Judged>, Failure> {
    let mut judged = Vec::new();
    let is_right = |result: &QueryResult| result.grade == Grade::Right;
    // A place at which a method fails anyway says nothing about a fault.
    let mut sound: Vec<bool> = place.case().results(&METHODS, true)?.iter().map(is_right).collect();
    // The hybrid needs its second method where a fault takes the first.
    sound[3] &= sound[2];
    for &(fault, plant) in faults::ALL {
        let expected = expected.get(fault).ok_or(format!("{fault} is not in the table"))?;
        if only.is_some_and(|only| only != fault) {
            continue;
        }
        let mut case = place.case();
        if plant(place, &mut case).is_none() {
            continue;
        }
        let [known, withheld] = [case.results(&METHODS, true)?, case.results(&METHODS, false)?];
        for method in (0..METHODS.len()).filter(|&method| sound[method]) {
            let is_right = is_right(&known[method]);
            for (is_withheld, result) in [(false, &known[method]), (true, &withheld[method])] {
                let codes = &expected[usize::from(is_withheld)][method];
                let is_doubted = codes.iter().any(|code| code == Code::L1.name());
                let is_unsure = is_withheld && result.confidence_word() == Some(Confidence::Unsure);
                let (found, text) = match result.diagnosis.first() {
                    Some(primary) => (primary.code.name(), primary.text.as_str()),
                    None if is_unsure => (UNSURE, ""),
                    None => ("none", ""),
                };
                // X1 of one query stands behind what needs no suspicion, and counts there too.
                let suspicion = Code::X1.name();
                let is_suspected = result.diagnosis.iter().any(|one| one.code == Code::X1);
                let is_expected =
                    codes.iter().any(|code| code == found || code == suspicion && is_suspected);
                // A pose that is right carries at most L1, whatever was done to it.
                let is_hit = if is_right {
                    ["none", UNSURE, Code::L1.name()].contains(&found)
                } else {
                    is_expected || found == UNSURE && is_doubted
                };
                let barely = confidence::TRUSTED_FROM..0.98;
                let probability = result.confidence.as_ref().map(|one| one.probability);
                let (number, name) = (place.number, METHODS[method]);
                let codes = if is_right { "none".to_owned() } else { codes.join("|") };
                judged.push(Judged {
                    fault,
                    place: number,
                    method,
                    is_withheld,
                    found: found.to_owned(),
                    is_hit,
                    is_barely_trusted: is_doubted
                        && probability.is_some_and(|p| barely.contains(&p)),
                    is_right,
                    words: format!(
                        "{fault} {number} {name}: {codes} expected, {found} found: {text}"
                    ),
                });
            }
        }
    }
    Ok(judged)
}

fn report(found: &[&Judged], prints_misses: bool) {
    let mut rows = Vec::new();
    for &(fault, _) in faults::ALL {
        let mut row = vec![fault.to_owned()];
        for method in 0..METHODS.len() {
            let own =
                found.iter().copied().filter(|one| one.fault == fault && one.method == method);
            let (right, wrong): (Vec<&Judged>, Vec<&Judged>) = own.partition(|one| one.is_right);
            let hits = wrong.iter().filter(|one| one.is_hit).count();
            row.push(format!("{hits}/{} ({} right)", wrong.len(), right.len()));
        }
        let own = found.iter().filter(|one| one.fault == fault);
        if own.clone().next().is_some() {
            rows.push(row);
        }
        let mut misses: Vec<_> = own.filter(|one| prints_misses && !one.is_hit).collect();
        misses.sort_by_key(|one| one.method);
        misses.iter().for_each(|one| println!("<!-- {} -->", one.words));
    }
    let count = |is: &dyn Fn(&Judged) -> bool| found.iter().filter(|one| is(one)).count();
    let (right, alarms) = (count(&|one| one.is_right), count(&|one| one.is_right && !one.is_hit));
    let hits = count(&|one| !one.is_right && one.is_hit);
    let only_unsure = count(&|one| !one.is_right && one.is_hit && one.found == UNSURE);
    let missed =
        |is: &dyn Fn(&Judged) -> bool| count(&|one| !one.is_right && !one.is_hit && is(one));
    let barely_trusted = missed(&|one| one.is_barely_trusted);
    let kept_by_hybrid = missed(&|one| one.found == Code::H1.name());
    let all = found.len() - right;
    print_table("fault,fb,pm,mi,hy", &rows);
    println!(
        "As expected: {hits} of {all} ({:.1} %), {only_unsure} of them unsure without a verdict; with H1 for each \
         hybrid that kept a wrong pose {} ({:.1} %); {barely_trusted} more if poses were trusted from 0.98 on; false \
         alarms at right poses: {alarms} of {right}.",
        percent(hits, all),
        hits + kept_by_hybrid,
        percent(hits + kept_by_hybrid, all),
    );
}
