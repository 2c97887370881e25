//! What the methods are measured on: places of the street, and pairs of frames of any scene.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use posescope::geometry::{Pose, PoseError};
use posescope::localize::frames_within;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::{Scene, SceneError};
use xxhash_rust::xxh3::xxh3_64;

use crate::Failure;

/// Cameras on one street look along it; those turned by more against each other share no view \[°\].
const UNRELATED_DEG: f64 = 60.0;

/// A query with its reference and the truth.
pub struct Case {
    /// The rows of the table that it counts in.
    pub rows: Vec<String>,
    pub problem: Problem,
    /// `world_from_camera` of the query.
    pub truth: Pose,
}

/// A number that depends on the words alone.
pub fn draw(seed: u64, words: &[&dyn std::fmt::Display]) -> usize {
    let words: String = words.iter().map(|word| format!("/{word}")).collect();
    xxh3_64(format!("{seed}{words}").as_bytes()) as usize
}

/// A frame out of one of so many equal stretches of a scene.
pub fn frame_of_stretch(scene: &dyn Scene, stretch: usize, stretches: usize, seed: u64) -> usize {
    let frames = scene.frames().len();
    let begin = stretch * frames / stretches;
    let end = ((stretch + 1) * frames / stretches).max(begin + 1);
    begin + draw(seed, &[&"place", &stretch]) % (end - begin)
}

/// How far the pose of a frame is from another.
fn between(scene: &dyn Scene, frame: usize, pose: &Pose) -> Option<PoseError> {
    Some(PoseError::between(pose, &scene.pose(frame)?))
}

/// The same in metres; infinite without a pose.
fn apart_m(scene: &dyn Scene, frame: usize, pose: &Pose) -> f64 {
    between(scene, frame, pose).map_or(f64::INFINITY, |apart| apart.translation_m)
}

/// How queries get their references.
pub struct Plan {
    pub seed: u64,
    /// How far from the query its reference is at least and at most, and the uncertainty radius \[m\].
    pub from_m: f64,
    pub radius_m: f64,
    /// How far from the query its reference is instead, at least, so that they show nothing in common
    /// \[m\].
    pub unrelated_m: Option<f64>,
}

impl Plan {
    /// The cases of one of so many places of the street: each pair of conditions, the reference's and the query's.
    pub fn at_place(
        &self,
        place: usize,
        places: usize,
        pairs: &[[&dyn Scene; 2]],
    ) -> Result<Vec<Case>, Failure> {
        let mut frames = Remembered::default();
        let mut cases = Vec::new();
        for [references, queries] in pairs {
            let frame = frame_of_stretch(*queries, place, places, self.seed);
            let truth = queries.pose(frame).ok_or("the street knows its poses")?;
            let is_same = references.name() == queries.name();
            let is_near = |candidate: &usize| {
                between(*references, *candidate, &truth).is_some_and(|apart| {
                    match self.unrelated_m {
                        Some(least) => {
                            apart.translation_m >= least && apart.rotation_deg >= UNRELATED_DEG
                        }
                        None => apart.translation_m <= self.radius_m,
                    }
                })
            };
            let chosen = (0..references.frames().len())
                .filter(|candidate| !is_same || *candidate != frame)
                .filter(is_near)
                .min_by_key(|candidate| draw(self.seed, &[&frame, candidate]) as u64);
            if let Some(chosen) = chosen {
                let condition = |scene: &dyn Scene| scene.name().replacen("street:", "", 1);
                let cell = format!("{} → {}", condition(*references), condition(*queries));
                let kind = if is_same { "all equal" } else { "all other" };
                let query = frames.query(*queries, frame)?;
                let reference = frames.reference(*references, chosen)?;
                cases.push(self.case(vec![cell, kind.to_owned()], query, reference, truth));
            }
        }
        Ok(cases)
    }

    /// One of so many starts, whose distances from the truth are spread evenly up to the radius: the reference pose
    /// is the start. Its rows are those of bins of distance.
    pub fn of_start(
        &self,
        start: usize,
        starts: usize,
        bins: usize,
        [references, queries]: [&dyn Scene; 2],
    ) -> Result<Vec<Case>, Failure> {
        let frame = draw(self.seed, &[&"start", &start]) % queries.frames().len();
        let truth = queries.pose(frame).ok_or("the street knows its poses")?;
        let wanted_m = self.radius_m * (start as f64 + 0.5) / starts as f64;
        let is_same = references.name() == queries.name();
        let place = truth.translation.vector.into();
        let within =
            frames_within(references, &place, self.radius_m, &|other| is_same && other == frame);
        let apart = |other: &usize| apart_m(references, *other, &truth);
        let off = |other: &usize| (apart(other) - wanted_m).abs();
        let Some(chosen) = within.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))) else {
            return Ok(Vec::new());
        };
        let width = self.radius_m / bins as f64;
        let from = width * (apart(&chosen) / width).floor();
        let row = format!("{from:4.1} to {:.1} m", from + width);
        let mut frames = Remembered::default();
        let (query, reference) =
            (frames.query(queries, frame)?, frames.reference(references, chosen)?);
        Ok(vec![self.case(vec![row, "all".to_owned()], query, reference, truth)])
    }

    /// A frame of a scene as a query against every frame with a cloud that is as far apart as planned.
    pub fn pairs(&self, scene: &dyn Scene, at: usize) -> Result<Vec<Case>, Failure> {
        let Some(truth) = scene.pose(at) else {
            return Ok(Vec::new());
        };
        let is_paired = |other: &usize| {
            let apart = apart_m(scene, *other, &truth);
            *other != at
                && scene.has_cloud(*other)
                && (self.from_m..=self.radius_m).contains(&apart)
        };
        let mut frames = Remembered::default();
        let case = |other| {
            let rows = vec![scene.name().to_owned()];
            let (query, reference) = (frames.query(scene, at)?, frames.reference(scene, other)?);
            Ok(self.case(rows, query, reference, truth))
        };
        (0..scene.frames().len()).filter(is_paired).map(case).collect()
    }

    fn case(
        &self,
        rows: Vec<String>,
        query: Arc<Query>,
        reference: Arc<ReferenceTuple>,
        truth: Pose,
    ) -> Case {
        let mut problem = Problem::new(query, reference, self.radius_m).expect("a radius");
        problem.seed = self.seed;
        Case { rows, problem, truth }
    }
}

/// Frames that were read, by scene and frame, which remember what methods make of them.
#[derive(Default)]
struct Remembered {
    queries: HashMap<(String, usize), Arc<Query>>,
    references: HashMap<(String, usize), Arc<ReferenceTuple>>,
}

impl Remembered {
    fn query(&mut self, scene: &dyn Scene, frame: usize) -> Result<Arc<Query>, SceneError> {
        Ok(match self.queries.entry((scene.name().to_owned(), frame)) {
            Entry::Occupied(known) => Arc::clone(known.get()),
            Entry::Vacant(place) => {
                let query = Arc::unwrap_or_clone(scene.query(frame)?).remembering();
                Arc::clone(place.insert(Arc::new(query)))
            }
        })
    }

    fn reference(
        &mut self,
        scene: &dyn Scene,
        frame: usize,
    ) -> Result<Arc<ReferenceTuple>, SceneError> {
        Ok(match self.references.entry((scene.name().to_owned(), frame)) {
            Entry::Occupied(known) => Arc::clone(known.get()),
            Entry::Vacant(place) => {
                let reference = Arc::unwrap_or_clone(scene.reference(frame)?).remembering();
                Arc::clone(place.insert(Arc::new(reference)))
            }
        })
    }
}
