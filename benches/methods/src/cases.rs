//! What the methods are measured on: places of the street, and pairs of frames of a scene.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use posescope::geometry::{Pose, PoseError};
use posescope::memo::Memo;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::street::{Size, Street};
use posescope::scene::{Scene, SceneError};
use xxhash_rust::xxh3::xxh3_64;

/// Values that a frame remembers: each is used several times, and then not again.
const REMEMBERED: usize = 40;

/// Cameras on one street look along it; those turned by more against each other share no view \[°\].
const UNRELATED_DEG: f64 = 60.0;

/// A query with its reference and the truth.
pub struct Case {
    /// Where it belongs in the table: `overcast → night`.
    pub cell: String,
    /// What is asked.
    pub problem: Problem,
    /// `world_from_camera` of the query.
    pub truth: Pose,
}

/// Which places of the street, in which conditions.
#[derive(Clone, Debug)]
pub struct Places {
    /// How many, one out of each of as many equal stretches of the route.
    pub count: usize,
    /// Draws frames and references.
    pub seed: u64,
    /// How far from the query its reference is, at most, and the uncertainty radius \[m\].
    pub radius_m: f64,
    /// How far from the query its reference is instead, at least, so that they show nothing in common
    /// \[m\].
    pub unrelated_m: Option<f64>,
    /// Pairs of conditions: the reference's, the query's.
    pub pairs: Vec<(String, String)>,
}

impl Places {
    /// The cases of one place, those of the table of conditions in `docs/street.md`.
    pub fn cases(&self, place: usize) -> Result<Vec<Case>, SceneError> {
        let mut scenes: HashMap<&str, Street> = HashMap::new();
        for name in self.pairs.iter().flat_map(|(a, b)| [a, b]) {
            if !scenes.contains_key(name.as_str()) {
                scenes.insert(name, Street::new(name, Size::Full)?);
            }
        }
        let mut queries: HashMap<&str, Arc<Query>> = HashMap::new();
        let mut references: HashMap<(&str, usize), Arc<ReferenceTuple>> = HashMap::new();
        let mut cases = Vec::new();
        for (of_reference, of_query) in &self.pairs {
            let drive = &scenes[of_query.as_str()];
            let frame = self.frame(drive.frames().len(), place);
            let truth = drive.pose(frame).expect("the street knows its poses");
            let other = &scenes[of_reference.as_str()];
            let is_near = |candidate: &usize| {
                let pose = other.pose(*candidate).expect("the street knows its poses");
                let apart = PoseError::between(&truth, &pose).translation_m;
                match self.unrelated_m {
                    Some(least) => {
                        let turned = PoseError::between(&truth, &pose).rotation_deg;
                        apart >= least && turned >= UNRELATED_DEG
                    }
                    None => apart <= self.radius_m,
                }
            };
            let draw = |candidate: &usize| {
                xxh3_64(format!("{}/{frame}/{candidate}", self.seed).as_bytes())
            };
            let Some(chosen) = (0..other.frames().len())
                .filter(|&candidate| of_reference != of_query || candidate != frame)
                .filter(is_near)
                .min_by_key(draw)
            else {
                continue;
            };
            if !queries.contains_key(of_query.as_str()) {
                queries.insert(of_query, query(drive, frame)?);
            }
            let key = (of_reference.as_str(), chosen);
            let reference = match references.entry(key) {
                Entry::Occupied(known) => Arc::clone(known.get()),
                Entry::Vacant(place) => Arc::clone(place.insert(reference(other, chosen)?)),
            };
            cases.push(Case {
                cell: format!("{of_reference} → {of_query}"),
                problem: Problem {
                    query: Arc::clone(&queries[of_query.as_str()]),
                    reference,
                    uncertainty_radius_m: self.radius_m,
                    prior_m: None,
                    matches: None,
                    seed: self.seed,
                },
                truth,
            });
        }
        Ok(cases)
    }

    fn frame(&self, frames: usize, place: usize) -> usize {
        let begin = place * frames / self.count;
        let end = ((place + 1) * frames / self.count).max(begin + 1);
        let draw = xxh3_64(format!("{}/place/{place}", self.seed).as_bytes()) as usize;
        begin + draw % (end - begin)
    }
}

/// Every ordered pair of frames that are at most so far apart, by query.
pub fn pairs(
    scene: &dyn Scene,
    truth: &dyn Fn(usize) -> Option<Pose>,
    from_m: f64,
    radius_m: f64,
) -> Result<Vec<Vec<Case>>, SceneError> {
    let mut of_queries = Vec::new();
    let mut references: HashMap<usize, Arc<ReferenceTuple>> = HashMap::new();
    for at in 0..scene.frames().len() {
        let Some(pose) = truth(at) else { continue };
        let mut asked = None;
        let mut cases = Vec::new();
        for other in 0..scene.frames().len() {
            let Some(known) = truth(other).filter(|_| other != at && scene.has_cloud(other)) else {
                continue;
            };
            let apart = PoseError::between(&pose, &known).translation_m;
            if apart < from_m || apart > radius_m {
                continue;
            }
            if asked.is_none() {
                asked = Some(query(scene, at)?);
            }
            let reference = match references.entry(other) {
                Entry::Occupied(known) => Arc::clone(known.get()),
                Entry::Vacant(place) => {
                    let made = reference(scene, other)?;
                    let made = ReferenceTuple {
                        world_from_camera: known,
                        memo: made.memo.shared(),
                        ..ReferenceTuple::clone(&made)
                    };
                    Arc::clone(place.insert(Arc::new(made)))
                }
            };
            let query = asked.clone().expect("it was read");
            cases.push(Case {
                cell: scene.name().to_owned(),
                problem: Problem {
                    query,
                    reference,
                    uncertainty_radius_m: radius_m,
                    prior_m: None,
                    matches: None,
                    seed: 0,
                },
                truth: pose,
            });
        }
        of_queries.push(cases);
    }
    Ok(of_queries)
}

/// Every frame of one scene as a query against every frame with a cloud of another, which shows nothing
/// in common: a pose in its reference's frame is wrong wherever it is.
pub fn unrelated(
    references: &dyn Scene,
    queries: &dyn Scene,
    radius_m: f64,
) -> Result<Vec<Vec<Case>>, SceneError> {
    let has_cloud = (0..references.frames().len()).filter(|&frame| references.has_cloud(frame));
    let tuples: Result<Vec<_>, _> = has_cloud
        .map(|frame| reference(references, frame))
        .collect();
    let tuples = tuples?;
    let of_query = |frame| {
        let query = query(queries, frame)?;
        let cases = tuples.iter().map(|reference| Case {
            cell: "unrelated".to_owned(),
            problem: Problem {
                query: Arc::clone(&query),
                reference: Arc::clone(reference),
                uncertainty_radius_m: radius_m,
                prior_m: None,
                matches: None,
                seed: 0,
            },
            truth: Pose::translation(1e6, 0.0, 0.0),
        });
        Ok(cases.collect())
    };
    (0..queries.frames().len()).map(of_query).collect()
}

fn query(scene: &dyn Scene, frame: usize) -> Result<Arc<Query>, SceneError> {
    let query = scene.query(frame)?;
    Ok(Arc::new(Query {
        memo: Memo::of(REMEMBERED),
        ..Query::clone(&query)
    }))
}

fn reference(scene: &dyn Scene, frame: usize) -> Result<Arc<ReferenceTuple>, SceneError> {
    let reference = scene.reference(frame)?;
    Ok(Arc::new(ReferenceTuple {
        memo: Memo::of(REMEMBERED),
        ..ReferenceTuple::clone(&reference)
    }))
}
