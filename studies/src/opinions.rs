use std::collections::BTreeSet;

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use posescope::diagnosis::Tolerance;
use posescope::foreign::Foreign;
use posescope::geometry::{Pose, PoseError};
use posescope::localize::{LocalizeError, Localizer, NoObserver, Request};
use posescope::method::Method;
use posescope::opinion::{Opinion, Standing};
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::scene::{self, Scene, SceneSize};
use rand::seq::IndexedRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::Failure;
use crate::frames::{Frame, Frames};
use crate::numbers::{at_places, median, percent, print_table};
use crate::places::nearest;
use crate::real_pairs;
use crate::signals::{Matched, SIGNALS, print_curves};

/// What is thought of poses that are right and of poses that are not?
///
/// Gives the true pose of a query and poses beside it as those of another system, and withholds the truth. Counts what is
/// confirmed and what is contradicted, and compares the offset that is found with the true one.
#[derive(clap::Args)]
pub struct Options {
    #[arg(long, default_value_t = 40)]
    places: usize,
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The towns.
    #[arg(long, value_delimiter = ',', default_values_t = [0])]
    towns: Vec<u64>,
    /// References are so far away at most [m].
    #[arg(long, default_value_t = 10.0)]
    apart: f64,
    /// Take pairs of registered real photos below POSESCOPE_DATA.
    #[arg(long)]
    real: bool,
    /// Take pairs of frames of these scenes, --places of each.
    #[arg(long)]
    scene: Vec<String>,
    /// Print each opinion that is wrong.
    #[arg(long)]
    misses: bool,
}

/// Poses that another system may give: a name, and what leads from the true camera to the given one, with lengths as
/// shares of what counts as right.
fn planted() -> Vec<(String, Pose)> {
    let mut planted = vec![("0 truth".to_owned(), Pose::identity())];
    for share in [0.25, 0.5, 1.0, 2.0, 5.0, 10.0] {
        planted.push((format!("1 sideways {share:5.2}"), Pose::translation(share, 0.0, 0.0)));
        planted.push((format!("2 forward {share:5.2}"), Pose::translation(0.0, 0.0, share)));
    }
    for degrees in [2.0, 5.0, 10.0_f64] {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), degrees.to_radians());
        let turned = Pose::from_parts(Translation3::identity(), turn);
        planted.push((format!("3 turned {degrees:4.0}°"), turned));
    }
    planted
}

/// A query with a reference.
struct Pair {
    query: Frame,
    reference: Frame,
    params: Params,
    radius_m: f64,
    group: String,
}

/// An opinion, and how far off the pose is.
struct Judged {
    group: String,
    kind: String,
    opinion: Opinion,
    /// The true offset, in units of the scale \[m\] and \[°\].
    error: PoseError,
    /// The length that stands for a metre.
    metre: f64,
    /// What other signals say of the pose.
    signals: [f64; SIGNALS.len()],
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let judged: Vec<Judged> = if options.real {
        let pairs = real_pairs::all()?;
        at_places(pairs.len(), |at| {
            let pair = &pairs[at];
            let pair = Pair {
                query: pair.query.clone(),
                reference: pair.reference.clone(),
                params: Params::default(),
                radius_m: 10.0,
                group: "real".to_owned(),
            };
            judged(&pair, at)
        })?
        .into_iter()
        .flatten()
        .collect()
    } else if !options.scene.is_empty() {
        let mut all = Vec::new();
        for argument in &options.scene {
            let scene = scene::open(argument, None)?;
            all.extend(of_scene(scene.as_ref(), options)?);
        }
        all
    } else {
        of_towns(options)?
    };
    report(&judged, options.misses);
    Ok(())
}

/// Each place once in one condition and once in two.
fn of_towns(options: &Options) -> Result<Vec<Judged>, Failure> {
    let drives: Vec<[Traversal; 5]> = options
        .towns
        .iter()
        .map(|town| Condition::ALL.map(|one| Traversal::new(WORLD_SEED + town, one, Size::Full)))
        .collect();
    let all = at_places(options.places, |place| {
        let drives = &drives[place % drives.len()];
        let seed = options.seed.wrapping_mul(6007).wrapping_add(place as u64);
        let mut rng = Pcg64::seed_from_u64(seed);
        let day = &drives[0];
        let frames = day.frame_count();
        let query = rng.random_range(0..frames);
        let apart: f64 = rng.random_range(1.0..options.apart);
        let apart = if rng.random() { apart } else { -apart };
        let reference = (query as f64 + apart).rem_euclid(frames as f64) as usize % frames;
        let at = [query, reference].map(|frame| day.world_from_camera(frame));
        let of_query = place / options.towns.len() % 5;
        let of_other = (of_query + rng.random_range(1..5)) % 5;
        let mut found = Vec::new();
        for (group, of_reference) in [("one condition", of_query), ("between", of_other)] {
            let pair = Pair {
                query: Frame::of(&drives[of_query], nearest(&drives[of_query], &at[0])),
                reference: Frame::of(&drives[of_reference], nearest(&drives[of_reference], &at[1])),
                params: Params::default(),
                radius_m: 1.2 * options.apart,
                group: group.to_owned(),
            };
            found.extend(judged(&pair, place)?);
        }
        Ok(found)
    })?;
    Ok(all.into_iter().flatten().collect())
}

fn of_scene(scene: &dyn Scene, options: &Options) -> Result<Vec<Judged>, Failure> {
    let scale = SceneSize::of(scene).scale;
    let radius_m = scale.radius();
    let frames = 0..scene.frames().len();
    let is_pair = |&(query, reference): &(usize, usize)| {
        let poses = scene.pose(query).zip(scene.pose(reference));
        let near = poses.is_some_and(|(query, reference)| {
            let apart = PoseError::between(&query, &reference);
            apart.translation_m <= 0.9 * radius_m && apart.rotation_deg <= 45.0
        });
        query != reference && near && scene.has_cloud(reference)
    };
    let all = frames.clone().flat_map(|query| frames.clone().map(move |other| (query, other)));
    let all: Vec<(usize, usize)> = all.filter(is_pair).collect();
    let mut rng = Pcg64::seed_from_u64(options.seed);
    let chosen: Vec<(usize, usize)> = all.sample(&mut rng, options.places).copied().collect();
    let found = at_places(chosen.len(), |at| {
        let (query, reference) = chosen[at];
        let pair = Pair {
            query: Frame::read(scene, query)?,
            reference: Frame::read(scene, reference)?,
            params: Params::at_scale(scale),
            radius_m,
            group: scene.name().to_owned(),
        };
        judged(&pair, at)
    })?;
    Ok(found.into_iter().flatten().collect())
}

/// The opinions on all poses that are given for a query.
fn judged(pair: &Pair, seed: usize) -> Result<Vec<Judged>, Failure> {
    let truth = pair.query.pose.ok_or("a query with a pose expected")?;
    let metre = pair.params.scale.metre();
    let mut poses: Vec<(String, Pose)> = planted()
        .into_iter()
        .map(|(name, off)| {
            let shift = Translation3::from(metre * off.translation.vector);
            (name, truth * Pose::from_parts(shift, off.rotation))
        })
        .collect();
    poses.extend(pair.reference.pose.map(|pose| ("4 the reference's".to_owned(), pose)));
    let mut foreign = Foreign::default();
    let mut methods = Vec::new();
    for (number, (_, pose)) in poses.iter().enumerate() {
        let method = Method::called(&format!("given{number}"))?;
        foreign = foreign.with_estimates(method, [("query 0".to_owned(), *pose)].into());
        methods.push(method);
    }
    let queries = Frames::new("query", vec![Frame { pose: None, ..pair.query.clone() }]);
    let references = Frames::new("reference", vec![pair.reference.clone()]);
    let localizer = Localizer::new(&references, &queries, &pair.params, seed as u64)
        .with_tolerance(Tolerance::default().at(pair.params.scale))
        .with_foreign(foreign);
    let problem = Problem::new(queries.query(0)?, references.reference(0)?, pair.radius_m)?;
    let matched = Matched::of(&problem, &pair.params)?;
    let request = Request {
        radius_m: pair.radius_m,
        references: vec![0].into(),
        fusions: Vec::new(),
        setting: None,
    };
    let mut opinions = Vec::new();
    localizer.localize(0, 0, &[request], &methods, &mut NoObserver, |result, _| {
        opinions.push(result.opinion);
        Ok::<(), LocalizeError>(())
    })?;
    let named = poses.into_iter().zip(opinions);
    let judged = named.filter_map(|((kind, pose), opinion)| {
        let error = PoseError::between(&truth, &pose);
        let signals = matched.signals(&pose);
        Some(Judged { group: pair.group.clone(), kind, opinion: opinion?, error, metre, signals })
    });
    Ok(judged.collect())
}

impl Judged {
    /// How far off the pose is, in units of the scale.
    fn off(&self) -> f64 {
        self.error.translation_m / self.metre
    }

    fn is_right(&self) -> bool {
        self.off() <= 0.251 && self.error.rotation_deg <= 2.01
    }

    fn is_wrong(&self) -> bool {
        self.off() >= 0.999 || self.error.rotation_deg >= 4.99
    }
}

fn report(judged: &[Judged], prints_misses: bool) {
    let groups: BTreeSet<&str> = judged.iter().map(|one| one.group.as_str()).collect();
    let kinds: BTreeSet<&str> = judged.iter().map(|one| one.kind.as_str()).collect();
    for group in groups {
        println!("\n## {group}\n");
        let row = |name: &str, is: &dyn Fn(&Judged) -> bool| {
            let own: Vec<&Judged> =
                judged.iter().filter(|one| one.group == group && is(one)).collect();
            let of = |standing: Standing| {
                let count = own.iter().filter(|one| one.opinion.standing == standing).count();
                format!("{:.1} %", percent(count, own.len()))
            };
            // The estimate of how far off, against how far off it is, where it is confirmed or contradicted.
            let decided = own.iter().filter(|one| one.opinion.standing != Standing::Undecided);
            let mut off: Vec<f64> = decided
                .filter_map(|one| {
                    let offset = Vector3::from(one.opinion.offset_m?).norm();
                    Some(((offset - one.error.translation_m) / one.metre).abs())
                })
                .collect();
            off.sort_by(f64::total_cmp);
            let ninety = off.get(off.len() * 9 / 10).copied().unwrap_or(f64::NAN);
            vec![
                name.to_owned(),
                own.len().to_string(),
                of(Standing::Confirmed),
                of(Standing::Contradicted),
                of(Standing::Undecided),
                format!("{:.3}", median(off.iter().copied())),
                format!("{ninety:.3}"),
            ]
        };
        let mut rows: Vec<Vec<String>> =
            kinds.iter().map(|kind| row(&kind[2..], &|one| one.kind == *kind)).collect();
        rows.push(row("all within 0.25 and 2°", &Judged::is_right));
        rows.push(row("all from 1 or 5° on", &Judged::is_wrong));
        print_table(
            "given,number,confirmed,contradicted,undecided,median off by,90 % off by",
            &rows,
        );
    }
    println!("\n## Other signals: wrong poses that are named, by the rate of false alarms\n");
    let cases = judged.iter().filter(|one| one.is_right() || one.is_wrong()).map(|one| {
        let doubt = 1.0 - one.opinion.probability;
        (one.is_wrong(), [&[doubt], one.signals.as_slice()].concat())
    });
    let names = [&["second opinion"], SIGNALS.as_slice()].concat();
    print_curves(&names, &cases.collect::<Vec<_>>());
    let is_miss = |one: &&Judged| {
        one.is_right() && one.opinion.standing == Standing::Contradicted
            || one.is_wrong() && one.opinion.standing == Standing::Confirmed
    };
    for one in judged.iter().filter(is_miss).filter(|_| prints_misses) {
        println!("<!-- {} {}: {} -->", one.group, one.kind, one.opinion.because);
    }
}
