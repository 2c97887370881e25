//! Queries and references whose poses are fitted on, or judged.

use std::sync::Arc;

use posescope::camera::Intrinsics;
use posescope::covariance::{PoseCovariance, error_vector};
use posescope::diagnosis::{Code, Evidence, PoseConfidence, Subject, confidence, diagnose};
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::image::Photo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::run::MapFit;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::scene::{self, Scene, SceneSize};
use posescope::trace::Trace;
use rand::seq::IndexedRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use super::wrong_inputs;
use crate::Failure;
use crate::frames::Frame;
use crate::numbers::at_places;
use crate::places::nearest;
use crate::real_pairs;

/// Pairs of different conditions at each place, of all twenty.
const DIFFERENT: usize = 5;

/// References of other streets at each place.
const OTHER_STREETS: usize = 1;

/// How far another street is at least \[m\], and how far turned against the query's its cameras are \[°\]: cameras on
/// one street look along it.
const OTHER_STREET_M: f64 = 60.0;
const OTHER_STREET_DEG: f64 = 60.0;

/// References are up to this share of the search radius away.
const REACH: f64 = 0.9;

/// What pairs of registered real photos are called.
pub const REAL_STREETS: &str = "real streets";

/// Whether the inputs are as they should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inputs<'a> {
    Sound,
    /// Each pair of frames once with each mistake whose name has these words.
    Wrong(&'a str),
}

/// One pose with what is known of it.
#[derive(Clone, Serialize, Deserialize)]
pub struct Sample {
    pub method: String,
    /// The number of the town, or the name of a scene.
    pub of: String,
    /// The place, and the pair of photos there.
    #[serde(default)]
    pub pair: [usize; 2],
    /// What the reference shows of the query.
    pub shown: Shown,
    /// What is wrong with the inputs.
    #[serde(default)]
    pub fault: Option<String>,
    pub radius_m: f64,
    /// The length that stands for a metre.
    pub metre: f64,
    /// What leads from the pose to the truth, as a covariance orders it; lengths in units of the scale. Where the
    /// place is not shown, nothing does.
    pub error: Option<[f64; 6]>,
    /// What the photo alone gives of the covariance.
    pub alone: Option<PoseCovariance>,
    pub names: Vec<String>,
    pub values: Vec<f64>,
    /// The confidence that posescope states, for being near; `None` where it states none.
    #[serde(default)]
    pub stated: Option<PoseConfidence>,
    /// Whether posescope says that the query may not show the place.
    #[serde(default)]
    pub named: bool,
}

/// What the reference shows of the query's place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Shown {
    /// It, in the same light and weather.
    Same,
    /// It, in others.
    Other,
    /// It, mirrored.
    Mirrored,
    /// Another town.
    Town,
    /// Another street of the town.
    Street,
    /// Noise.
    Noise,
}

impl Shown {
    /// Whether no pose is right.
    pub fn is_nothing(self) -> bool {
        !matches!(self, Self::Same | Self::Other)
    }
}

impl Sample {
    /// Whether there is no pose, and so nothing that speaks for one.
    pub fn is_silent(&self) -> bool {
        self.values.is_empty()
    }

    /// How far the pose is off: a distance in units of the scale, and an angle \[rad\].
    pub fn distances(&self) -> Option<[f64; 2]> {
        let [x, y, z, right, down, forward] = self.error?;
        let length = |a: f64, b: f64, c: f64| (a * a + b * b + c * c).sqrt();
        Some([length(right, down, forward), length(x, y, z)])
    }

    /// Whether the pose is near.
    pub fn is_near(&self) -> bool {
        let near = confidence::NEAR;
        self.distances().is_some_and(|[distance, angle]| {
            angle.to_degrees() <= near.rotation_deg && distance <= near.translation_m
        })
    }
}

/// A query and a reference.
struct Trial {
    query: Arc<Query>,
    reference: Arc<ReferenceTuple>,
    /// Without a truth no pose is near.
    truth: Option<Pose>,
    shown: Shown,
    fault: Option<&'static str>,
}

/// The poses of queries in generated towns; places take turns in towns and radii.
pub fn of_towns(
    towns: &[u64],
    places: usize,
    radii: &[f64],
    seed: u64,
    inputs: Inputs<'_>,
    methods: &[Method],
) -> Result<Vec<Sample>, Failure> {
    let drives: Vec<[Traversal; 5]> = towns
        .iter()
        .map(|town| Condition::ALL.map(|one| Traversal::new(WORLD_SEED + town, one, Size::Full)))
        .collect();
    let samples = at_places(places, |place| {
        let (town, radius_m) = (place % towns.len(), radii[place / towns.len() % radii.len()]);
        let of = towns[town].to_string();
        let trials = match inputs {
            Inputs::Sound => at(&drives[town], towns[town], place, radius_m, seed)?,
            Inputs::Wrong(words) => {
                let (query, reference) = pair_at(&drives[town], place, radius_m, seed);
                wrong(&query, &reference, words)?
            }
        };
        let mut samples = samples_of(&trials, &of, radius_m, &Params::default(), methods)?;
        for sample in &mut samples {
            sample.pair[0] = place;
        }
        Ok(samples)
    })?;
    Ok(samples.concat())
}

/// The poses of pairs of registered real photos of the street.
pub fn of_real_streets(
    radius_m: f64,
    inputs: Inputs<'_>,
    methods: &[Method],
) -> Result<Vec<Sample>, Failure> {
    let pairs = real_pairs::all()?;
    let samples = at_places(pairs.len(), |number| {
        let pair = &pairs[number];
        let trials = match inputs {
            Inputs::Sound => vec![Trial::of(&pair.query, &pair.reference, None)?],
            Inputs::Wrong(words) => wrong(&pair.query, &pair.reference, words)?,
        };
        samples_of(&trials, REAL_STREETS, radius_m, &Params::default(), methods)
    })?;
    Ok(samples.concat())
}

/// The poses of frames of a scene against each other, at most this many pairs, at the scene's own scale and radius.
pub fn of_scene(
    scene: &dyn Scene,
    pairs: usize,
    seed: u64,
    inputs: Inputs<'_>,
    methods: &[Method],
) -> Result<Vec<Sample>, Failure> {
    let scale = SceneSize::of(scene).scale;
    let (mut params, radius_m) = (Params::at_scale(scale), scale.radius());
    params.frame_pairs = MapFit::of(scene).frame_pairs;
    let frames = 0..scene.frames().len();
    let apart = |a: usize, b: usize| {
        let (a, b) = (scene.pose(a)?, scene.pose(b)?);
        let apart = PoseError::between(&a, &b);
        (apart.translation_m <= REACH * radius_m && apart.rotation_deg <= 45.0).then_some(())
    };
    let all: Vec<(usize, usize)> = frames
        .clone()
        .flat_map(|query| frames.clone().map(move |reference| (query, reference)))
        .filter(|&(query, reference)| query != reference && scene.has_cloud(reference))
        .filter(|&(query, reference)| apart(query, reference).is_some())
        .collect();
    let mut rng = Pcg64::seed_from_u64(seed);
    let chosen: Vec<(usize, usize)> = all.sample(&mut rng, pairs).copied().collect();
    let samples = at_places(chosen.len(), |number| {
        let (query, reference) = chosen[number];
        let trials = match inputs {
            Inputs::Sound => vec![Trial {
                query: scene.query(query)?,
                reference: scene.reference(reference)?,
                truth: scene.pose(query),
                shown: Shown::Same,
                fault: None,
            }],
            Inputs::Wrong(words) => {
                wrong(&Frame::read(scene, query)?, &Frame::read(scene, reference)?, words)?
            }
        };
        samples_of(&trials, scene.name(), radius_m, &params, methods)
    })?;
    Ok(samples.concat())
}

/// The samples of all of these.
fn samples_of(
    trials: &[Trial],
    of: &str,
    radius_m: f64,
    params: &Params,
    methods: &[Method],
) -> Result<Vec<Sample>, Failure> {
    let mut all = Vec::new();
    for (number, trial) in trials.iter().enumerate() {
        let mut samples = trial.samples(of, radius_m, params, methods)?;
        for sample in &mut samples {
            sample.pair[1] = number;
        }
        all.extend(samples);
    }
    Ok(all)
}

/// A pair with each mistake in its inputs whose name has these words.
fn wrong(query: &Frame, reference: &Frame, words: &str) -> Result<Vec<Trial>, Failure> {
    let planted = wrong_inputs::planted(query, reference, words).into_iter();
    planted.map(|(fault, query, reference)| Trial::of(&query, &reference, Some(fault))).collect()
}

/// Maps whose frames see much of the same: of real drives or scenes, or the begin of a drive in each of two lights.
pub fn maps(
    is_real: bool,
    towns: &[u64],
    scenes: &[String],
) -> Result<Vec<(String, Vec<Frame>)>, Failure> {
    /// Frames of a generated drive, one metre apart.
    const FRAMES: usize = 40;
    if is_real {
        return Ok(vec![("drive 0013".to_owned(), real_pairs::drive()?)]);
    }
    if scenes.is_empty() {
        let drives = towns.iter().take(1).flat_map(|town| {
            [Condition::Overcast, Condition::Night]
                .map(|one| (one, Traversal::new(WORLD_SEED + town, one, Size::Full)))
        });
        let frames = drives.map(|(one, drive)| {
            (one.name().to_owned(), (0..FRAMES).map(|frame| Frame::of(&drive, frame)).collect())
        });
        return Ok(frames.collect());
    }
    let read = |argument: &String| -> Result<(String, Vec<Frame>), Failure> {
        let scene = scene::open(argument, None)?;
        let frames = (0..scene.frames().len()).map(|frame| Frame::read(scene.as_ref(), frame));
        Ok((scene.name().to_owned(), frames.collect::<Result<_, _>>()?))
    };
    scenes.iter().map(read).collect()
}

/// A pair of frames of one drive.
fn pair_at(drives: &[Traversal; 5], place: usize, radius_m: f64, seed: u64) -> (Frame, Frame) {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(7919).wrapping_add(place as u64));
    let drive = &drives[place % drives.len()];
    let frames = drive.frame_count();
    let query = rng.random_range(0..frames);
    let apart: f64 = rng.random_range(1.0..REACH * radius_m);
    let apart = if rng.random() { apart } else { -apart };
    let reference = (query as f64 + apart).rem_euclid(frames as f64) as usize % frames;
    (Frame::of(drive, query), Frame::of(drive, reference))
}

/// Pairs of equal and of different conditions at one place, and queries that do not show it.
fn at(
    drives: &[Traversal; 5],
    town: u64,
    place: usize,
    radius_m: f64,
    seed: u64,
) -> Result<Vec<Trial>, Failure> {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(7919).wrapping_add(place as u64));
    let share: f64 = rng.random();
    let apart: f64 = rng.random_range(-REACH * radius_m..REACH * radius_m);
    let day = &drives[0];
    let frames = day.frame_count();
    let middle = (share * frames as f64) as usize % frames;
    let beside = (middle as f64 + apart).rem_euclid(frames as f64) as usize % frames;
    let [at_query, at_reference] = [middle, beside].map(|frame| day.world_from_camera(frame));
    let mut sides = Vec::new();
    for drive in drives {
        let query = nearest(drive, &at_query);
        // The query itself is no reference.
        let mut reference = nearest(drive, &at_reference);
        if reference == query {
            reference = (query + 1) % drive.frame_count();
        }
        let truth = drive.world_from_camera(query);
        // What is drawn at random depends on the name.
        let name = format!("{reference:06}");
        let (query, reference) = (Frame::of(drive, query), Frame::of(drive, reference));
        sides.push((query.named("query").query(0)?, truth, reference.named(&name).reference(0)?));
    }
    let trial = |query: &Arc<Query>, reference: &Arc<ReferenceTuple>, truth, shown| Trial {
        query: Arc::clone(query),
        reference: Arc::clone(reference),
        truth,
        shown,
        fault: None,
    };
    let mut trials = Vec::new();
    for (query, truth, reference) in &sides {
        trials.push(trial(query, reference, Some(*truth), Shown::Same));
    }
    let all = 0..sides.len();
    let different: Vec<(usize, usize)> = all
        .clone()
        .flat_map(|a| all.clone().map(move |b| (a, b)))
        .filter(|(a, b)| a != b)
        .collect();
    for &(of_query, of_reference) in different.sample(&mut rng, DIFFERENT) {
        let ((query, truth, _), (.., reference)) = (&sides[of_query], &sides[of_reference]);
        trials.push(trial(query, reference, Some(*truth), Shown::Other));
    }
    let (query, truth, reference) = &sides[place % sides.len()];
    let color = query.photo().color.as_ref().ok_or("a photo in colour expected")?;
    let elsewhere = Traversal::new(WORLD_SEED + town + 1000, Condition::Overcast, Size::Full);
    let of_another_town = elsewhere.image(7 * place % elsewhere.frame_count());
    let camera: Intrinsics = *query.intrinsics();
    let mut noise = color.clone();
    for pixel in noise.pixels_mut() {
        pixel.0 = [rng.random(); 3];
    }
    let unknowable = [
        (image::imageops::flip_horizontal(color), Shown::Mirrored),
        (of_another_town, Shown::Town),
        (noise, Shown::Noise),
    ];
    for (photo, shown) in unknowable {
        let query = Arc::new(Query::new("unknowable", Photo::from_color(photo), camera)?);
        trials.push(trial(&query, reference, None, shown));
    }
    let is_other_street = |frame: &usize| {
        let between = PoseError::between(truth, &day.world_from_camera(*frame));
        between.translation_m >= OTHER_STREET_M && between.rotation_deg >= OTHER_STREET_DEG
    };
    let others: Vec<usize> = (0..frames).filter(is_other_street).collect();
    for &frame in others.sample(&mut rng, OTHER_STREETS) {
        let reference = Frame::of(day, frame).named(&format!("{frame:06}")).reference(0)?;
        trials.push(trial(query, &reference, None, Shown::Street));
    }
    Ok(trials)
}

impl Trial {
    /// A pair of one condition.
    fn of(query: &Frame, reference: &Frame, fault: Option<&'static str>) -> Result<Self, Failure> {
        Ok(Self {
            query: query.clone().named("query").query(0)?,
            reference: reference.clone().named("reference").reference(0)?,
            truth: query.pose,
            shown: Shown::Same,
            fault,
        })
    }

    /// A sample of every method that gives a pose.
    fn samples(
        &self,
        of: &str,
        radius_m: f64,
        params: &Params,
        methods: &[Method],
    ) -> Result<Vec<Sample>, Failure> {
        let problem = Problem::new(Arc::clone(&self.query), Arc::clone(&self.reference), radius_m)?;
        let units = confidence::units(params.scale);
        let mut samples = Vec::new();
        for &method in methods {
            let mut evidence = Evidence::default();
            let estimator = estimator::entry(method).make(params);
            let outcome = estimator.estimate(&problem, &mut Trace::to(&mut evidence))?;
            let subject = Subject::new(&problem, method, params, &outcome, &evidence)
                .against(None, confidence::NEAR.at(params.scale));
            let evidenced = confidence::evidenced(&subject);
            let named = diagnose(&subject).iter().any(|one| one.code == Code::N1);
            let (mut error, mut alone, mut signals) = (None, None, Vec::new());
            match (&outcome.pose, evidenced) {
                (Ok(pose), Some(evidenced)) => {
                    let away = |truth| error_vector(&truth, pose).component_div(&units);
                    error = self.truth.map(away);
                    (alone, signals) = (evidenced.alone, evidenced.signals);
                }
                (Ok(_), None) => continue,
                (Err(_), _) => {}
            }
            let (names, values): (Vec<&str>, Vec<f64>) = signals.into_iter().unzip();
            samples.push(Sample {
                method: method.name().to_owned(),
                of: of.to_owned(),
                pair: [0, 0],
                shown: self.shown,
                fault: self.fault.map(str::to_owned),
                radius_m,
                metre: params.scale.metre(),
                error: error.map(Into::into),
                alone,
                names: names.iter().map(ToString::to_string).collect(),
                values,
                stated: subject.confidence.clone(),
                named,
            });
        }
        Ok(samples)
    }
}
