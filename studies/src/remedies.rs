use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::PathBuf;

use posescope::diagnosis::remedies::{Change, Remedy, candidates, remedies};
use posescope::diagnosis::{Diagnosis, Tolerance, confidence};
use posescope::estimator;
use posescope::geometry::PoseError;
use posescope::localize::{LocalizeError, Localizer, NoObserver, QueryResult, Request};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scene::street::{Size, Street, WORLD_SEED};
use posescope::scene::{self, Scene, SceneSize};
use rand::seq::IndexedRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::Failure;
use crate::faults;
use crate::frames::Frames;
use crate::numbers::{at_places, percent, print_table};
use crate::places::{Drives, Place, nearest};

const METHODS: [&str; 8] = ["fb", "pm", "mi", "hy", "nid", "mi6", "fb2", "robust"];

/// How far references are from their queries in towns \[m\]. With the radius of [`RADIUS_M`], half of them are farther.
const APART_M: [i64; 6] = [4, 7, 9, 14, 25, 50];
const RADIUS_M: f64 = 10.0;

/// The planted faults that a remedy may mend. A mistake of a whole scene, or a query that shows nothing, is none.
const FAULTS: [&str; 18] = [
    "sparse_cloud",
    "bleeding_depths",
    "few_keypoints",
    "gamma",
    "night",
    "occluder",
    "moved_scenery",
    "strict_ratio",
    "few_trials",
    "narrow_window",
    "refused",
    "yaw",
    "looking_back",
    "outside_disc",
    "narrow_yaw",
    "bend",
    "raised_camera",
    "low_coverage",
];

/// Those that lie in the clouds of all references.
const OF_CLOUDS: [&str; 2] = ["sparse_cloud", "bleeding_depths"];

/// Which remedies mend which failures?
///
/// Localises queries by eight methods and runs each failure again with everything that any rule lists for the method,
/// every other method and other references. Counts for each primary verdict and family of methods what each remedy
/// mends, and how often the first advice, or one of the first three, mends what anything mends.
#[derive(clap::Args)]
pub struct Options {
    /// The towns, in half size.
    #[arg(long, value_delimiter = ',')]
    towns: Vec<u64>,
    /// Places of each town, each in one condition and between two; and pairs of each scene.
    #[arg(long, default_value_t = 12)]
    places: usize,
    /// Places of the first town in which each fault is planted.
    #[arg(long, default_value_t = 0)]
    planted: usize,
    /// Take pairs of frames of these scenes, too.
    #[arg(long)]
    scene: Vec<String>,
    /// Take the queries of odd number of --scene, in place of those of even number.
    #[arg(long)]
    odd: bool,
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write each failure with all that was tried as JSON lines.
    #[arg(long)]
    lines: Option<PathBuf>,
    /// Take the failures of --lines of an earlier run, too, and judge today's advice on them.
    #[arg(long)]
    from: Vec<PathBuf>,
}

/// A query that a method failed to localise, and what mends it.
#[derive(Serialize, Deserialize)]
struct Failed {
    /// Where it is from: `town`, `planted` or the scene, with what is special.
    source: String,
    method: Method,
    fell_back: bool,
    /// The parameters that are not at their defaults, as assignments.
    settings: Vec<String>,
    radius_m: f64,
    family: String,
    primary: Diagnosis,
    /// The advice for its verdict, in its order.
    advice: Vec<String>,
    /// Whether each candidate mends it.
    tried: BTreeMap<String, bool>,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let mut failed = of_towns(options)?;
    failed.extend(planted(options)?);
    for path in &options.scene {
        failed.extend(of_scene(scene::open(path, None)?.as_ref(), options)?);
    }
    for path in &options.from {
        for line in std::fs::read_to_string(path)?.lines() {
            let mut one: Failed = serde_json::from_str(line)?;
            let mut params = Params::default();
            one.settings.iter().try_for_each(|setting| params.assign(setting))?;
            one.advice = one.advice(&params);
            failed.push(one);
        }
    }
    if let Some(path) = &options.lines {
        let lines: Result<Vec<String>, _> = failed.iter().map(serde_json::to_string).collect();
        std::fs::write(path, lines?.join("\n") + "\n")?;
    }
    report(&failed);
    Ok(())
}

/// Each place with a reference in the query's condition and one in another, at all distances in turn.
fn of_towns(options: &Options) -> Result<Vec<Failed>, Failure> {
    let conditions: Vec<&str> = Street::conditions().collect();
    let all = at_places(options.towns.len() * options.places, |number| {
        let town = options.towns[number / options.places];
        let mut rng =
            Pcg64::seed_from_u64(options.seed.wrapping_mul(7919).wrapping_add(number as u64));
        let of_query = rng.random_range(0..conditions.len());
        let of_other = (of_query + rng.random_range(1..conditions.len())) % conditions.len();
        let scene = |condition: usize| {
            Street::of_town(WORLD_SEED + town, conditions[condition], Size::Half)
        };
        let queries = scene(of_query)?;
        let frames = queries.frames().len() as i64;
        let query = rng.random_range(0..frames);
        let mut failed = Vec::new();
        for (at, of_reference) in [of_query, of_other].into_iter().enumerate() {
            let apart = APART_M[(number + 3 * at) % APART_M.len()];
            let apart = if rng.random() { apart } else { -apart };
            let near =
                queries.traversal().world_from_camera((query + apart).rem_euclid(frames) as usize);
            let references = scene(of_reference)?;
            let reference = nearest(references.traversal(), &near);
            let source = format!(
                "town {} → {}, {} m",
                conditions[of_reference],
                conditions[of_query],
                apart.abs()
            );
            let params = Params::default();
            let localizer = Localizer::new(&references, &queries, &params, number as u64);
            failed.extend(explained(
                &localizer,
                query as usize,
                &asked(reference, RADIUS_M),
                &source,
            )?);
        }
        Ok(failed)
    })?;
    Ok(all.into_iter().flatten().collect())
}

/// Each fault at some places of the first town, with more references around.
fn planted(options: &Options) -> Result<Vec<Failed>, Failure> {
    let Some(town) = options.towns.first().filter(|_| options.planted > 0) else {
        return Ok(Vec::new());
    };
    let drives = Drives::of_town(WORLD_SEED + town, Size::Half);
    let faults = faults::ALL.iter().filter(|(name, _)| FAULTS.contains(name));
    let cases: Vec<_> =
        faults.flat_map(|fault| (0..options.planted).map(move |number| (fault, number))).collect();
    let all = at_places(cases.len(), |at| {
        let ((name, plant), number) = cases[at];
        let place = Place::numbered(&drives, number, options.seed);
        let street = place.street().ok_or("a place of the street expected")?;
        let mut case = place.case();
        let around = [-8, -5, -2, 2, 5, 8].map(|metres| street.frame_at(street.reference, metres));
        let around = around.into_iter().filter(|frame| *frame != street.query);
        case.references.extend(around.map(|frame| street.frame(frame)));
        let times = if OF_CLOUDS.contains(name) { case.references.len() } else { 1 };
        for reference in 0..times {
            case.references.swap(0, reference);
            let is_planted = plant(&place, &mut case).is_some();
            case.references.swap(0, reference);
            if !is_planted {
                return Ok(Vec::new());
            }
        }
        let queries = Frames::new("query", vec![case.query]);
        let references = Frames::new("reference", case.references);
        let localizer = Localizer::new(&references, &queries, &case.params, case.seed);
        explained(&localizer, 0, &asked(0, case.request.radius_m), &format!("planted {name}"))
    })?;
    Ok(all.into_iter().flatten().collect())
}

/// Pairs of a scene, drawn among those that are not much farther apart than the radius.
fn of_scene(scene: &dyn Scene, options: &Options) -> Result<Vec<Failed>, Failure> {
    let scale = SceneSize::of(scene).scale;
    let (radius_m, params) = (scale.radius(), Params::at_scale(scale));
    let frames = 0..scene.frames().len();
    let is_pair = |&(query, reference): &(usize, usize)| {
        let poses = scene.pose(query).zip(scene.pose(reference));
        let near = poses.is_some_and(|(query, reference)| {
            let apart = PoseError::between(&query, &reference);
            apart.translation_m <= 1.1 * radius_m && apart.rotation_deg <= 45.0
        });
        query != reference
            && query % 2 == usize::from(options.odd)
            && near
            && scene.has_cloud(reference)
    };
    let all = frames.clone().flat_map(|query| frames.clone().map(move |other| (query, other)));
    let all: Vec<(usize, usize)> = all.filter(is_pair).collect();
    let mut rng = Pcg64::seed_from_u64(options.seed);
    let chosen: Vec<(usize, usize)> = all.sample(&mut rng, options.places).copied().collect();
    let found = at_places(chosen.len(), |at| {
        let (query, reference) = chosen[at];
        let localizer = Localizer::new(scene, scene, &params, at as u64)
            .with_tolerance(Tolerance::default().at(scale));
        explained(&localizer, query, &asked(reference, radius_m), scene.name())
    })?;
    Ok(found.into_iter().flatten().collect())
}

fn asked(reference: usize, radius_m: f64) -> Request {
    Request { radius_m, references: vec![reference].into(), fusions: Vec::new(), setting: None }
}

/// The failures of all methods on a query, each with what mends it.
fn explained(
    localizer: &Localizer<'_>,
    query: usize,
    asked: &Request,
    source: &str,
) -> Result<Vec<Failed>, Failure> {
    let methods = METHODS.map(Method::named);
    let mut results: Vec<QueryResult> = Vec::new();
    localizer.localize(
        0,
        query,
        std::slice::from_ref(asked),
        &methods,
        &mut NoObserver,
        |one, _| {
            results.push(one);
            Ok::<(), LocalizeError>(())
        },
    )?;
    // The same method asked the same is right or not, whatever it should mend.
    let right = |one: &QueryResult| ((one.method, Vec::new()), !one.grade.is_failure());
    let mut known: HashMap<(Method, Vec<String>), bool> = results.iter().map(right).collect();
    let mut failed = Vec::new();
    for result in results.iter().filter(|one| one.grade.is_failure()) {
        let Some(primary) = result.diagnosis.first() else { continue };
        let (method, fell_back, params) = (result.method, result.fell_back(), localizer.params());
        let label = |remedy: &Remedy| words(remedy, method, fell_back, params, asked.radius_m);
        let mut tried = BTreeMap::new();
        for remedy in candidates(method, fell_back, params, asked.radius_m) {
            let Some(changed) = localizer.changed(method, asked, query, &remedy) else { continue };
            let is_method = matches!(remedy[..], [Change::Method(_)]);
            let args = if is_method { Vec::new() } else { changed.args.clone() };
            let mends = known.entry((changed.method, args));
            let mends = *mends.or_insert_with(|| changed.run(localizer, query).is_some());
            tried.insert(label(&remedy), mends);
        }
        let responsible = confidence::responsible_of(method, fell_back);
        let family = estimator::entry(responsible).family(params);
        let plain = Params::default().list();
        let changed =
            params.list().into_iter().zip(plain).filter(|(now, plain)| now.value != plain.value);
        let mut one = Failed {
            source: source.to_owned(),
            method,
            fell_back,
            settings: changed.map(|(now, _)| format!("{}={}", now.key, now.value)).collect(),
            radius_m: asked.radius_m,
            family: family.map_or("none".to_owned(), |family| format!("{family:?}")),
            primary: primary.clone(),
            advice: Vec::new(),
            tried,
        };
        one.advice = one.advice(params);
        failed.push(one);
    }
    Ok(failed)
}

/// A remedy in words that are the same for all queries and for all methods of a family.
fn words(
    remedy: &Remedy,
    method: Method,
    fell_back: bool,
    params: &Params,
    radius_m: f64,
) -> String {
    let responsible = confidence::responsible_of(method, fell_back);
    let value_in = |params: &Params, key: &str| {
        let found = params.list().into_iter().find(|one| one.key == key);
        found.map(|one| one.value.to_string()).unwrap_or_default()
    };
    let word = |change: &Change| match change {
        Change::Radius(other) => format!("radius × {}", (other / radius_m * 100.0).round() / 100.0),
        Change::Method(other) => format!("method {other}"),
        Change::Reference(farther) => format!("another reference, {farther}"),
        Change::Fusion(name) => format!("fusion {name}"),
        Change::Ranked(count) => format!("{count} of the ranking"),
        Change::Set(assignment) => {
            let (key, value) = assignment.split_once('=').unwrap_or((assignment, ""));
            if value_in(&params.defaults(), key) == value {
                return format!("{key} back to its default");
            }
            if key.strip_prefix(responsible.name()) == Some(".search") {
                return format!("search={value}");
            }
            // Lengths follow the scale of the scene.
            let is_length = ["grid.coarse_step", "grid.fine_range"].contains(&key);
            match (value.parse::<f64>(), value_in(params, key).parse::<f64>()) {
                (Ok(then), Ok(now)) if is_length => {
                    format!("{key} × {}", (then / now * 100.0).round() / 100.0)
                }
                _ => assignment.clone(),
            }
        }
    };
    remedy.iter().map(word).collect::<Vec<_>>().join(" ")
}

/// The failures of one verdict and family.
struct Group<'a>(Vec<&'a Failed>);

impl Group<'_> {
    fn count(&self, is: impl Fn(&Failed) -> bool) -> usize {
        self.0.iter().filter(|one| is(one)).count()
    }

    fn labels(&self) -> BTreeSet<&str> {
        self.0.iter().flat_map(|one| one.tried.keys().map(String::as_str)).collect()
    }

    /// The three remedies of which each mends most of what those before it do not, and how many they mend.
    fn best_three(&self) -> (Vec<&str>, Vec<usize>) {
        let (mut chosen, mut counts): (Vec<&str>, Vec<usize>) = Default::default();
        for _ in 0..3 {
            let with = |label: &str| {
                self.count(|one| {
                    one.mended_by(label) || chosen.iter().any(|own| one.mended_by(own))
                })
            };
            let labels = self.labels();
            // Of equal ones the first.
            let Some(best) = labels.into_iter().rev().max_by_key(|label| with(label)) else {
                break;
            };
            let count = with(best);
            if counts.last().unwrap_or(&0) >= &count {
                break;
            }
            counts.push(count);
            chosen.push(best);
        }
        (chosen, counts)
    }
}

impl Failed {
    /// The advice for its verdict, but for what could not be tried.
    fn advice(&self, params: &Params) -> Vec<String> {
        let advice = remedies(&self.primary, self.method, self.fell_back, params, self.radius_m);
        let words = |one| words(one, self.method, self.fell_back, params, self.radius_m);
        advice.iter().map(words).filter(|label| self.tried.contains_key(label)).collect()
    }

    fn mended_by(&self, label: &str) -> bool {
        self.tried.get(label).copied().unwrap_or(false)
    }

    fn is_mendable(&self) -> bool {
        self.tried.values().any(|mends| *mends)
    }

    /// Whether one of the first pieces of advice mends it.
    fn is_mended_by_first(&self, number: usize) -> bool {
        self.advice.iter().take(number).any(|label| self.mended_by(label))
    }
}

fn report(failed: &[Failed]) {
    let mut groups: BTreeMap<(&str, &str), Group<'_>> = BTreeMap::new();
    for one in failed {
        let key = (one.primary.code.name(), one.family.as_str());
        groups.entry(key).or_insert_with(|| Group(Vec::new())).0.push(one);
    }
    println!("\n## What the advice mends\n");
    let rows = groups.iter().map(|((code, family), group)| {
        let (labels, counts) = group.best_three();
        let best = labels.iter().zip(&counts).map(|(label, count)| format!("{label} ({count})"));
        vec![
            format!("{code} {family}"),
            group.0.len().to_string(),
            group.count(Failed::is_mendable).to_string(),
            group.count(|one| one.is_mended_by_first(1)).to_string(),
            group.count(|one| one.is_mended_by_first(3)).to_string(),
            best.collect::<Vec<_>>().join("; "),
        ]
    });
    print_table(
        "verdict and family,failures,mended by anything,by the first advice,by one of the first three,the best three \
         and what they mend together",
        &rows.collect::<Vec<_>>(),
    );
    let sum = |is: &dyn Fn(&Failed) -> bool| failed.iter().filter(|one| is(one)).count();
    let mendable = sum(&Failed::is_mendable);
    let [first, three] = [1, 3].map(|number| sum(&|one| one.is_mended_by_first(number)));
    // The one remedy that mends most of each verdict and family, and the one that mends most of all.
    let best: usize =
        groups.values().map(|group| group.best_three().1.first().copied().unwrap_or(0)).sum();
    let all = Group(failed.iter().collect());
    let (single, singles) = all.best_three();
    println!(
        "Of {} failures, anything mends {mendable}. Of these, the first advice mends {first} ({:.0} %), one of the first \
         three {three} ({:.0} %). The best remedy of each verdict and family mends {best} ({:.0} %); of all, \
         {} mends {}.",
        failed.len(),
        percent(first, mendable),
        percent(three, mendable),
        percent(best, mendable),
        single.first().unwrap_or(&"none"),
        singles.first().unwrap_or(&0),
    );
    println!("\n## What each remedy mends\n");
    let mut rows = Vec::new();
    for ((code, family), group) in &groups {
        let mut own: Vec<(usize, usize, &str)> = Vec::new();
        for label in group.labels() {
            let tried = group.count(|one| one.tried.contains_key(label));
            own.push((group.count(|one| one.mended_by(label)), tried, label));
        }
        own.sort_by_key(|(mended, ..)| std::cmp::Reverse(*mended));
        for (mended, tried, label) in own.into_iter().filter(|(mended, ..)| *mended > 0) {
            let name = format!("{code} {family}");
            rows.push(vec![name, label.to_owned(), tried.to_string(), mended.to_string()]);
        }
    }
    print_table("verdict and family,remedy,tried,mended", &rows);
}
