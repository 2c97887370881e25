//! What the methods are measured on: places of the street, and pairs of frames of any scene.

use std::sync::Arc;

use posescope::geometry::{Pose, PoseError};
use posescope::localize::frames_within;
use posescope::problem::Problem;
use posescope::scene::{CachedScene, FrameStore, Scene};
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
#[derive(clap::Args)]
pub struct Plan {
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// The uncertainty radius, and how far a reference is from its query at most [m].
    #[arg(long = "radius", value_name = "RADIUS", default_value_t = 10.0)]
    pub radius_m: f64,
    /// How far the frames of a pair of --scene are apart at least [m].
    #[arg(long = "from", value_name = "FROM", default_value_t = 0.0)]
    pub from_m: f64,
    /// Take references of the street at least so far away, which show nothing that the query shows [m].
    #[arg(long = "unrelated", value_name = "UNRELATED")]
    pub unrelated_m: Option<f64>,
}

/// A scene of references and one of queries, whose frames are cached: they remember what methods make of them.
type Pair<'a> = [CachedScene<'a>; 2];

impl Plan {
    /// The cases of one of so many places of the street: each pair of conditions, the reference's and the query's.
    pub fn at_place(
        &self,
        place: usize,
        places: usize,
        pairs: &[[Arc<dyn Scene>; 2]],
    ) -> Result<Vec<Case>, Failure> {
        let store = Arc::<FrameStore>::default();
        let mut cases = Vec::new();
        for pair in pairs {
            let pair = pair.each_ref().map(|scene| store.of(scene));
            let [references, queries] = &pair;
            let frame = frame_of_stretch(queries, place, places, self.seed);
            let truth = queries.pose(frame).ok_or("the street knows its poses")?;
            let is_same = references.name() == queries.name();
            let is_near = |candidate: &usize| {
                let apart = between(references, *candidate, &truth);
                apart.is_some_and(|apart| match self.unrelated_m {
                    Some(m) => apart.translation_m >= m && apart.rotation_deg >= UNRELATED_DEG,
                    None => apart.translation_m <= self.radius_m,
                })
            };
            let chosen = (0..references.frames().len())
                .filter(|candidate| !is_same || *candidate != frame)
                .filter(is_near)
                .min_by_key(|candidate| draw(self.seed, &[&frame, candidate]) as u64);
            if let Some(chosen) = chosen {
                let condition = |scene: &dyn Scene| scene.name().replacen("street:", "", 1);
                let cell = format!("{} → {}", condition(references), condition(queries));
                let kind = if is_same { "all equal" } else { "all other" };
                cases.push(self.case(
                    vec![cell, kind.to_owned()],
                    &pair,
                    [chosen, frame],
                    truth,
                )?);
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
        pair: &[Arc<dyn Scene>; 2],
    ) -> Result<Vec<Case>, Failure> {
        let store = Arc::<FrameStore>::default();
        let pair = pair.each_ref().map(|scene| store.of(scene));
        let [references, queries] = &pair;
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
        Ok(vec![self.case(vec![row, "all".to_owned()], &pair, [chosen, frame], truth)?])
    }

    /// A frame of a scene as a query against every frame with a cloud that is as far apart as planned.
    pub fn pairs(&self, scene: &Arc<dyn Scene>, at: usize) -> Result<Vec<Case>, Failure> {
        let Some(truth) = scene.pose(at) else {
            return Ok(Vec::new());
        };
        let is_paired = |other: &usize| {
            let apart = apart_m(scene.as_ref(), *other, &truth);
            *other != at
                && scene.has_cloud(*other)
                && (self.from_m..=self.radius_m).contains(&apart)
        };
        let store = Arc::<FrameStore>::default();
        let pair = [store.of(scene), store.of(scene)];
        let case = |other| self.case(vec![scene.name().to_owned()], &pair, [other, at], truth);
        (0..scene.frames().len()).filter(is_paired).map(case).collect()
    }

    /// The case of two frames, the reference and the query.
    fn case(
        &self,
        rows: Vec<String>,
        [references, queries]: &Pair<'_>,
        [reference, query]: [usize; 2],
        truth: Pose,
    ) -> Result<Case, Failure> {
        let (query, reference) = (queries.query(query)?, references.reference(reference)?);
        let problem = Problem::new(query, reference, self.radius_m)?.with_seed(self.seed);
        Ok(Case { rows, problem, truth })
    }
}
