//! How well probabilities and intervals hold.

use std::collections::{BTreeMap, BTreeSet};

use posescope::diagnosis::PoseConfidence;
use posescope::diagnosis::confidence::{Confidence, Fitted};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use super::fit::{beyond, square};
use super::trials::{Sample, Shown};
use crate::numbers::{mean, percent, print_table};

/// A probability, and whether the pose is near.
pub type Scored = (f64, bool);

/// Below this, 90 % of the squares of a normally distributed vector in space are.
const NINETY_OF_THREE: f64 = 6.251;

/// Prints how well the probabilities and intervals of these samples hold. N1 is also counted for the `silent` ones, which
/// have no pose.
pub fn judge(
    title: &str,
    samples: &[Sample],
    silent: &[Sample],
    fitted: &BTreeMap<String, Fitted>,
) {
    println!("\n## {title}\n");
    let radii: BTreeSet<u64> = samples.iter().map(|s| s.radius_m.to_bits()).collect();
    let mut groups: Vec<(String, Vec<&Sample>)> = Vec::new();
    let all: Vec<&Sample> = samples.iter().filter(|s| fitted.contains_key(&s.method)).collect();
    let (faulty, all): (Vec<&Sample>, Vec<&Sample>) =
        all.into_iter().partition(|s| s.fault.is_some());
    if !faulty.is_empty() {
        wrong_inputs(&faulty, fitted);
    }
    if all.is_empty() {
        return;
    }
    let names: BTreeSet<&str> = all.iter().map(|s| s.method.as_str()).collect();
    let of = |keep: &dyn Fn(&Sample) -> bool| -> Vec<&Sample> {
        all.iter().copied().filter(|sample| keep(sample)).collect()
    };
    for name in names {
        for (what, shown) in [("one condition", Shown::Same), ("between", Shown::Other)] {
            groups.push((format!("{name}, {what}"), of(&|s| s.method == name && s.shown == shown)));
        }
        for &radius in &radii {
            let radius_m = f64::from_bits(radius);
            let own = of(&|s| s.method == name && s.radius_m == radius_m);
            groups.push((format!("{name}, radius {radius_m:.3} m"), own));
        }
    }
    for (what, shown) in [("one condition", Shown::Same), ("between", Shown::Other)] {
        groups.push((format!("HY, {what}"), of_hybrid(&of(&|s| s.shown == shown))));
    }
    groups.push(("all".to_owned(), of(&|_| true)));
    groups.push(("nothing is shown".to_owned(), of(&|s| s.shown.is_nothing())));
    let mut likely = Vec::new();
    let mut intervals = Vec::new();
    for (name, own) in &groups {
        if own.is_empty() {
            continue;
        }
        likely.push(probabilities(name, own, fitted));
        intervals.extend(coverage(name, own, fitted));
    }
    print_table(
        "poses,number,near,calibration error / by chance,AUC,trusted of wrong,low of near,trusted of well found",
        &likely,
    );
    print_table(
        "near poses,number,median error,median interval,position in 90 %,rotation in 90 %,position in 95 %,rotation \
         in 95 %",
        &intervals,
    );
    elsewhere(&all, silent, fitted);
    as_stated(&all);
}

/// The poses of HY: those of FB, and where it has none those of MI.
fn of_hybrid<'a>(samples: &[&'a Sample]) -> Vec<&'a Sample> {
    let key = |s: &Sample| (s.of.clone(), s.pair, s.radius_m.to_bits());
    let of = |name: &'static str| samples.iter().copied().filter(move |s| s.method == name);
    let features: BTreeSet<_> = of("fb").map(key).collect();
    of("fb").chain(of("mi").filter(|sample| !features.contains(&key(sample)))).collect()
}

/// Prints how well stated probabilities and intervals hold. They include what the map and the query's camera change.
fn as_stated(samples: &[&Sample]) {
    let known: Vec<(&Sample, &PoseConfidence)> =
        samples.iter().filter_map(|sample| Some((*sample, sample.stated.as_ref()?))).collect();
    let row = |name: &str, own: &[(&Sample, &PoseConfidence)]| {
        let mut scored: Vec<Scored> =
            own.iter().map(|(sample, stated)| (stated.probability, sample.is_near())).collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let share = |is_one: &dyn Fn(&Sample) -> bool, word: Confidence| {
            let group = || own.iter().filter(|(sample, _)| is_one(sample));
            let hit = group().filter(|(_, stated)| stated.word == word).count();
            format!("{hit} of {}", group().count())
        };
        let lowered = |is_near: bool| {
            let of = |(sample, stated): &&(&Sample, &PoseConfidence)| {
                sample.is_near() == is_near && !stated.lowered_by.is_empty()
            };
            own.iter().filter(of).count()
        };
        let held = |which: usize| {
            let near = || own.iter().filter(|(sample, _)| sample.is_near());
            let is_in = |(sample, stated): &&(&Sample, &PoseConfidence)| {
                let Some((within, [m, rad])) = stated.within_95.zip(sample.distances()) else {
                    return false;
                };
                [m <= within.m / sample.metre, rad.to_degrees() <= within.deg][which]
            };
            format!("{} of {}", near().filter(is_in).count(), near().count())
        };
        vec![
            name.to_owned(),
            own.len().to_string(),
            format!("{:.3}", mean(scored.iter().map(|one| one.0))),
            format!("{:.3}", mean(scored.iter().map(|one| f64::from(u8::from(one.1))))),
            errors(&scored),
            share(&|sample| !sample.is_near(), Confidence::Trusted),
            share(&Sample::is_near, Confidence::Trusted),
            share(&Sample::is_near, Confidence::Low),
            format!("{} / {}", lowered(true), lowered(false)),
            held(0),
            held(1),
        ]
    };
    let mut rows = Vec::new();
    let of: BTreeSet<(&str, &str)> =
        known.iter().map(|(sample, _)| (sample.of.as_str(), sample.method.as_str())).collect();
    for (of, method) in of {
        let is_own = |(s, _): &(&Sample, &PoseConfidence)| s.of == of && s.method == method;
        let own: Vec<_> = known.iter().copied().filter(is_own).collect();
        rows.push(row(&format!("{of}, {method}"), &own));
    }
    rows.push(row("all", &known));
    print_table(
        "as stated,poses,mean probability,share near,calibration error / by chance,trusted of wrong,trusted of near,low of near,lowered near / wrong,position \
         in 95 %,rotation in 95 %",
        &rows,
    );
}

/// Prints how many poses are trusted, by what is wrong with the inputs.
fn wrong_inputs(samples: &[&Sample], fitted: &BTreeMap<String, Fitted>) {
    let is_trusted = |sample: &&&Sample| {
        let stated = sample.stated.as_ref().map(|stated| stated.word);
        stated == Some(Confidence::Trusted)
    };
    let row = |name: &str, of: &dyn Fn(&Sample) -> bool| {
        let (right, wrong): (Vec<&Sample>, Vec<&Sample>) =
            samples.iter().copied().filter(|s| of(s)).partition(|s| s.is_near());
        let cells = [right, wrong]
            .map(|group| format!("{} of {}", group.iter().filter(is_trusted).count(), group.len()));
        [vec![name.to_owned()], cells.to_vec()].concat()
    };
    let faults: BTreeSet<&str> = samples.iter().filter_map(|s| s.fault.as_deref()).collect();
    let mut rows: Vec<Vec<String>> =
        faults.iter().map(|fault| row(fault, &|s| s.fault.as_deref() == Some(fault))).collect();
    for name in fitted.keys() {
        rows.push(row(name, &|s| s.method == *name));
    }
    rows.push(row("all", &|_| true));
    print_table("wrong inputs,trusted of near,trusted of wrong", &rows);
}

/// Prints how many queries are said to be of another place, by what the reference shows of them. Poses are judged by what
/// was fitted, and queries without a pose by the verdict that they have.
fn elsewhere(samples: &[&Sample], silent: &[Sample], fitted: &BTreeMap<String, Fitted>) {
    let is_named = |sample: &&&Sample| {
        let fitted = &fitted[&sample.method];
        fitted.shown(&sample.values) < fitted.shown_from
    };
    let mut rows = Vec::new();
    for name in fitted.keys() {
        let own: Vec<&Sample> = samples.iter().copied().filter(|s| s.method == *name).collect();
        let share = |is_one: &dyn Fn(&Sample) -> bool| {
            let group: Vec<&&Sample> = own.iter().filter(|s| is_one(s)).collect();
            let named = group.iter().filter(|s| is_named(s)).count();
            format!("{named} of {}", group.len())
        };
        let of = |shown: Shown| {
            let without: Vec<&Sample> =
                silent.iter().filter(|s| s.method == *name && s.shown == shown).collect();
            let named = without.iter().filter(|s| s.named).count();
            let poses = share(&|s| s.shown == shown);
            if without.is_empty() {
                poses
            } else {
                format!("{poses}, {named} of {}", without.len())
            }
        };
        rows.push(vec![
            name.clone(),
            of(Shown::Town),
            of(Shown::Noise),
            of(Shown::Mirrored),
            of(Shown::Street),
            share(&|s| s.is_near() && s.shown == Shown::Same),
            share(&|s| s.is_near() && s.shown == Shown::Other),
            share(&|s| !s.is_near() && !s.shown.is_nothing()),
        ]);
    }
    print_table(
        "said to be elsewhere (poses; no pose),another town,noise,mirrored,another street,near in one condition,near between,far",
        &rows,
    );
}

fn probabilities(
    name: &str,
    samples: &[&Sample],
    fitted: &BTreeMap<String, Fitted>,
) -> Vec<String> {
    let probability = |sample: &Sample| fitted[&sample.method].probability(&sample.values);
    let mut scored: Vec<Scored> = samples.iter().map(|s| (probability(s), s.is_near())).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let share = |of: &dyn Fn(&Sample) -> bool, word: Confidence| {
        let own: Vec<&&Sample> = samples.iter().filter(|s| of(s)).collect();
        let hit = own.iter().filter(|s| Confidence::of(probability(s)) == word).count();
        if own.is_empty() {
            "–".to_owned()
        } else {
            format!("{:.1} % of {}", percent(hit, own.len()), own.len())
        }
    };
    let near = scored.iter().filter(|s| s.1).count();
    vec![
        name.to_owned(),
        scored.len().to_string(),
        format!("{:.1} %", percent(near, scored.len())),
        errors(&scored),
        area_under_curve(&scored).map_or("–".to_owned(), |area| format!("{area:.3}")),
        share(&|s| !s.is_near(), Confidence::Trusted),
        share(&Sample::is_near, Confidence::Low),
        share(&is_well_found, Confidence::Trusted),
    ]
}

/// Whether a pose is within half of what is near.
fn is_well_found(sample: &Sample) -> bool {
    let half = sample.error.map(|error| error.map(|part| 2.0 * part));
    Sample { error: half, ..sample.clone() }.is_near()
}

fn coverage(
    name: &str,
    samples: &[&Sample],
    fitted: &BTreeMap<String, Fitted>,
) -> Option<Vec<String>> {
    let near: Vec<&&Sample> = samples.iter().filter(|s| s.is_near() && s.alone.is_some()).collect();
    if near.is_empty() {
        return None;
    }
    let within = |first: usize| {
        let is_in = |s: &&&&Sample| square(&fitted[&s.method], s, first) <= NINETY_OF_THREE;
        percent(near.iter().filter(is_in).count(), near.len())
    };
    let held = |which: usize| {
        let is_in = |s: &&&&Sample| beyond(&fitted[&s.method], s)[which] <= 1.0;
        percent(near.iter().filter(is_in).count(), near.len())
    };
    let size = |s: &Sample| s.distances().map_or(f64::NAN, |[distance, _]| distance);
    let error = crate::numbers::median(near.iter().map(|s| size(s)));
    let interval =
        crate::numbers::median(near.iter().map(|s| size(s) / beyond(&fitted[&s.method], s)[0]));
    let mut cells = vec![
        name.to_owned(),
        near.len().to_string(),
        format!("{error:.3}"),
        format!("{interval:.3}"),
    ];
    cells.extend([within(3), within(0), held(0), held(1)].map(|share| format!("{share:.1} %")));
    Some(cells)
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
pub fn calibration_error(scored: &[Scored]) -> f64 {
    let all = scored.len() as f64;
    let error = |(predicted, actual, count): (f64, f64, usize)| {
        (predicted - actual).abs() * count as f64 / all
    };
    tenths(scored).map(error).sum()
}

/// The calibration error, and what it would be by chance.
fn errors(scored: &[Scored]) -> String {
    format!("{:.3} / {:.3}", calibration_error(scored), error_by_chance(scored))
}

/// What [`calibration_error`] would be on average if each pose were near as often as its probability says: few poses
/// differ from their probabilities by chance.
fn error_by_chance(scored: &[Scored]) -> f64 {
    const DRAWS: usize = 200;
    let mut rng = Pcg64::seed_from_u64(0);
    mean((0..DRAWS).map(|_| {
        let drawn = |(probability, _): &Scored| (*probability, rng.random::<f64>() < *probability);
        calibration_error(&scored.iter().map(drawn).collect::<Vec<_>>())
    }))
}

/// The share of pairs of a near and a far pose in which the near one is believed more; ties are half.
/// `None` where there is no such pair.
pub fn area_under_curve(scored: &[Scored]) -> Option<f64> {
    let (near, far): (Vec<Scored>, Vec<Scored>) = scored.iter().copied().partition(|s| s.1);
    let beats = |a: &Scored, b: &Scored| match a.0.total_cmp(&b.0) {
        std::cmp::Ordering::Greater => 1.0,
        std::cmp::Ordering::Equal => 0.5,
        std::cmp::Ordering::Less => 0.0,
    };
    let wins: f64 = near.iter().flat_map(|a| far.iter().map(move |b| beats(a, b))).sum();
    let pairs = near.len() * far.len();
    (pairs > 0).then(|| wins / pairs as f64)
}
