use posescope::doctor::{Examination, Fit, Mistake, examine};
use posescope::scene::street::{Size, Street, WORLD_SEED};
use posescope::scene::{self, Scene};

use crate::Failure;
use crate::numbers::{percent, print_table};
use crate::planted_scene::{FAULTS, Fault, Planted};

/// Does `doctor` leave sound scenes alone, and does it name planted mistakes?
///
/// Sound are drives through three towns in all conditions, whole and thinned, and the scenes that are named, whole and
/// thinned. The rules were made with the first town and with scenes as they are; the other towns were set aside. The
/// first table says what sound scenes reach, the second what each planted mistake is called.
#[derive(clap::Args)]
pub struct Options {
    /// Real scenes.
    scenes: Vec<String>,
    /// Plant mistakes, too.
    #[arg(long)]
    planted: bool,
    /// Plant two mistakes at once, and nothing else.
    #[arg(long)]
    two: bool,
    /// Leave out the sound scenes.
    #[arg(long)]
    planted_only: bool,
    /// The towns.
    #[arg(long, value_delimiter = ',', default_values_t = [0, 1, 2])]
    towns: Vec<u64>,
    /// Plant these alone, such as `WrongCamera`.
    #[arg(long, value_delimiter = ',')]
    faults: Vec<String>,
    /// Take only scenes whose description has this in it, such as `night`.
    #[arg(long, default_value = "")]
    matching: String,
    /// The distances of a sound drive's frames in frames of the drive, about a metre each.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 3, 8, 15, 30, 50])]
    spacings: Vec<usize>,
}

/// The frames of a part of a drive.
const FRAMES: usize = 24;
/// How real scenes are thinned.
const THINNED: [usize; 4] = [1, 2, 3, 5];

/// A scene whose frames are some of a larger one's.
struct Part {
    what: String,
    scene: Box<dyn Scene>,
    frames: std::ops::Range<usize>,
    step: usize,
}

impl Part {
    fn of(&self, fault: Fault) -> Planted<'_> {
        Planted::every(self.scene.as_ref(), fault, self.frames.clone(), self.step)
    }
}

/// Mistakes that one scene may have at once: what both are to be called.
const TWO: [[(Fault, Mistake); 2]; 8] = [
    [(Fault::CloudAxes, Mistake::CloudAxes), (Fault::OpenGlAxes, Mistake::PoseAxes)],
    [(Fault::MillimetreClouds, Mistake::Units), (Fault::InversePose, Mistake::InversePose)],
    [(Fault::ResizedPhotos, Mistake::WrongCamera), (Fault::OpenGlAxes, Mistake::PoseAxes)],
    [
        (Fault::MirroredCloud, Mistake::MirroredCloud),
        (Fault::ReversedPoses, Mistake::ReversedPoses),
    ],
    [(Fault::WrongCamera, Mistake::WrongCamera), (Fault::InversePose, Mistake::InversePose)],
    [
        (Fault::UpsideDown, Mistake::TurnedPhotos),
        (Fault::QuaternionOrder, Mistake::QuaternionOrder),
    ],
    [(Fault::FiveTimesTheDepth, Mistake::Units), (Fault::OpenGlAxes, Mistake::PoseAxes)],
    [(Fault::TurnedCloud, Mistake::MovedCloud), (Fault::PoseAxes, Mistake::PoseAxes)],
];

pub fn run(options: &Options) -> Result<(), Failure> {
    if options.two {
        return two(options);
    }
    if !options.planted_only {
        sound(options)?;
    }
    if options.planted || options.planted_only {
        planted(options)?;
    }
    Ok(())
}

fn towns(options: &Options) -> Result<Vec<Part>, Failure> {
    let mut parts = Vec::new();
    for &town in &options.towns {
        for condition in Street::conditions() {
            for size in [Size::Half, Size::Full] {
                for &step in &options.spacings {
                    let scene = Street::of_town(WORLD_SEED + town, condition, size)?;
                    let all = scene.frames().len();
                    let first = all.saturating_sub(FRAMES * step) / 2;
                    parts.push(Part {
                        what: format!("town {}, every {step} m", town + 1),
                        frames: first..(first + FRAMES * step).min(all),
                        scene: Box::new(scene),
                        step,
                    });
                }
            }
        }
    }
    Ok(parts)
}

fn real(options: &Options) -> Result<Vec<Part>, Failure> {
    let mut parts = Vec::new();
    for argument in &options.scenes {
        for step in THINNED {
            let scene = scene::open(argument, None)?;
            let all = scene.frames().len();
            if step == 1 || all >= 4 * step {
                let what = format!("{}, every {step}", scene.name());
                parts.push(Part { what, frames: 0..all, scene, step });
            }
        }
    }
    Ok(parts)
}

/// What sound scenes reach, and what is said of them.
fn sound(options: &Options) -> Result<(), Failure> {
    let mut rows: Vec<(String, Vec<Part>)> = Vec::new();
    let parts = towns(options)?.into_iter().chain(real(options)?);
    for part in parts.filter(|part| part.what.contains(&options.matching)) {
        match rows.iter_mut().find(|(what, _)| *what == part.what) {
            Some((_, parts)) => parts.push(part),
            None => rows.push((part.what.clone(), vec![part])),
        }
    }
    let mut table = Vec::new();
    let (mut all, mut accused) = (0, Vec::new());
    for (what, parts) in rows {
        let (mut fits, mut unexplained, mut unjudged, mut named) = (0, 0, 0, 0);
        let mut least = [f64::INFINITY; 3];
        for part in &parts {
            let found = examine(&part.of(Fault::Nothing));
            all += 1;
            if let Some(finding) = &found.finding {
                named += 1;
                accused.push(format!(
                    "{what}, {}, {} px wide: {:?}, {}",
                    part.scene.name(),
                    part.scene.intrinsics(0).width,
                    finding.mistake,
                    finding.remedy
                ));
            }
            match found.fit {
                Some(Fit::Fits) => {
                    fits += 1;
                    if let Some(agreement) = found.agreement {
                        let numbers =
                            [agreement.motions, agreement.carried.map(f64::tanh), agreement.edges];
                        for (least, number) in least.iter_mut().zip(numbers) {
                            *least = least.min(number.unwrap_or(f64::INFINITY));
                        }
                    }
                }
                Some(Fit::Unexplained) => unexplained += 1,
                Some(Fit::NoSharedView) | None => unjudged += 1,
            }
        }
        eprintln!("{what}: {} scenes", parts.len());
        let number =
            |number: f64| if number.is_finite() { format!("{number:.2}") } else { "–".into() };
        let mut cells = vec![what];
        cells.extend(
            [parts.len(), named, fits, unexplained, unjudged].map(|count| count.to_string()),
        );
        cells.extend(least.map(number));
        table.push(cells);
    }
    print_table(
        "sound scenes,number,a mistake is named,fit,do not fit,cannot be judged,least share of features that poses \
         explain,least correlation of grey values,least log ratio of edges",
        &table,
    );
    println!("{} of {all} sound scenes are accused.\n", accused.len());
    for one in accused {
        println!("- {one}");
    }
    Ok(())
}

/// The scenes that mistakes are planted in.
fn parts_to_plant_in(options: &Options) -> Result<Vec<Part>, Failure> {
    let mut parts = Vec::new();
    for &town in &options.towns {
        for (condition, size) in
            [("overcast", Size::Half), ("sun", Size::Full), ("night", Size::Half)]
        {
            for step in [1, 3] {
                let scene = Street::of_town(WORLD_SEED + town, condition, size)?;
                parts.push(Part {
                    what: format!("town {}, {condition}, every {step} m", town + 1),
                    scene: Box::new(scene),
                    frames: 100..100 + 40 * step,
                    step,
                });
            }
        }
    }
    parts.extend(real(options)?.into_iter().filter(|part| part.step == 1));
    parts.retain(|part| part.what.contains(&options.matching));
    Ok(parts)
}

/// The mistakes that are named, one after the other.
fn named(found: &Examination) -> Vec<Mistake> {
    let first = found.finding.as_ref();
    let chain = std::iter::successors(first, |finding| finding.then.as_deref());
    let mut named: Vec<_> = chain.map(|finding| finding.mistake).collect();
    // A second reading of the same kind makes the numbers of the first one exact.
    named.dedup();
    named
}

/// What two mistakes at once are called.
fn two(options: &Options) -> Result<(), Failure> {
    let parts = parts_to_plant_in(options)?;
    let (mut table, mut otherwise) = (Vec::new(), Vec::new());
    for [(fault, mistake), (other_fault, other)] in TWO {
        let mut counts = [0; 4];
        for part in &parts {
            let one = part.of(fault);
            let both = Planted::every(&one, other_fault, 0..one.frames().len(), 1);
            let found = examine(&both);
            let named = named(&found);
            let right = named.iter().filter(|one| [mistake, other].contains(one)).count();
            let at = match (right, named.len()) {
                (2, 2) => 0,
                (1, 1) => 1,
                (_, 0) => 3,
                _ => 2,
            };
            counts[at] += 1;
            if at > 0 {
                let remedy = found.finding.as_ref().map(|one| &one.remedy);
                otherwise.push(format!(
                    "{fault:?} and {other_fault:?}, {}: {:?}, {named:?}, {remedy:?}",
                    part.what, found.fit
                ));
            }
        }
        eprintln!("{fault:?} and {other_fault:?}: {counts:?}");
        let mut cells = vec![format!("{fault:?} and {other_fault:?}")];
        cells.extend(counts.map(|count| count.to_string()));
        table.push(cells);
    }
    print_table("planted,both named,one named,another is named,none is named", &table);
    for one in otherwise {
        println!("- {one}");
    }
    Ok(())
}

/// What planted mistakes are called.
fn planted(options: &Options) -> Result<(), Failure> {
    let parts = parts_to_plant_in(options)?;
    let mut table = Vec::new();
    let mut otherwise = Vec::new();
    let mut sums = [0; 5];
    let others =
        [(Fault::PoseOneLineOff, Some(Mistake::PoseOfNeighbour)), (Fault::DepthsOfNoise, None)];
    let is_asked_for =
        |fault: Fault| options.faults.is_empty() || options.faults.contains(&format!("{fault:?}"));
    let faults = FAULTS.into_iter().chain(others).filter(|(fault, _)| is_asked_for(*fault));
    for (fault, expected) in faults {
        let mut counts = [0; 5];
        for part in &parts {
            let found = examine(&part.of(fault));
            let first = found.finding.as_ref();
            let named = named(&found);
            let beside = first
                .is_some_and(|one| one.or.iter().any(|(mistake, _)| Some(*mistake) == expected));
            let at = match (expected, first) {
                (None, None) => 0,
                (Some(expected), Some(_)) if named == [expected] => 0,
                (Some(expected), Some(_)) if named.contains(&expected) || beside => 1,
                (_, Some(_)) => 2,
                _ if found.fit == Some(Fit::NoSharedView) || found.fit.is_none() => 3,
                _ => 4,
            };
            counts[at] += 1;
            if at > 0 {
                let fit = found.fit;
                let remedy = first.map(|one| one.remedy.as_str());
                otherwise.push(format!("{fault:?}, {}: {fit:?}, {named:?}, {remedy:?}", part.what));
            }
        }
        eprintln!("{fault:?}: {counts:?}");
        for (sum, count) in sums.iter_mut().zip(counts) {
            *sum += count;
        }
        let mut cells = vec![format!("{fault:?}")];
        cells.extend(counts.map(|count| count.to_string()));
        table.push(cells);
    }
    let all: usize = sums.iter().sum();
    let mut cells = vec!["all".to_owned()];
    cells.extend(sums.map(|count| format!("{:.1} %", percent(count, all))));
    table.push(cells);
    print_table(
        "planted,named right,named among others,named wrongly,cannot be judged,no mistake is named",
        &table,
    );
    for one in otherwise {
        println!("- {one}");
    }
    Ok(())
}
