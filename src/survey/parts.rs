//! Which frames are localised, and by which references.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use xxhash_rust::xxh3::xxh3_64;

use super::SurveyRequest;
use super::answers::Part;
use crate::scene::Scene;

/// The reference of each photo, by name.
pub(super) type Pairs = BTreeMap<String, Vec<String>>;

/// A reference is far from this many times the radius on.
const FAR: f64 = 3.0;

/// Of so many photos near a reference, one is localised far from one, and one mirrored.
const SHARE: usize = 5;

/// The photos of each part with their references. A part without photos is left out.
pub(super) fn choose(
    scene: &dyn Scene,
    radius_m: f64,
    request: &SurveyRequest,
) -> BTreeMap<Part, Pairs> {
    let frames = Frames::of(scene, request.seed);
    let least_m = request.spacing_m.unwrap_or(0.0);
    let is_near = |away_m: f64| (least_m..=radius_m).contains(&away_m);
    let is_far = |away_m: f64| away_m >= FAR * radius_m;
    let near = spread(&frames.with_reference(&is_near), request.queries);
    let few = request.queries.div_ceil(SHARE);
    let far = spread(&frames.with_reference(&is_far), few);
    let near = match request.spacing_m {
        Some(_) => frames.nearest(&near, &is_near),
        None => frames.drawn(&near, Part::Near, &is_near),
    };
    let mirrored: Vec<&String> = near.keys().collect();
    let mirrored: Pairs =
        spread(&mirrored, few).into_iter().map(|name| (name.clone(), near[name].clone())).collect();
    let worse = if request.degrade.is_none() { Pairs::new() } else { near.clone() };
    let far = frames.drawn(&far, Part::Far, &is_far);
    let parts =
        [(Part::Near, near), (Part::Worse, worse), (Part::Far, far), (Part::Mirrored, mirrored)];
    parts.into_iter().filter(|(_, pairs)| !pairs.is_empty()).collect()
}

/// Frames, evenly over the map and at most so many, each with the reference that a query there may have: the nearest
/// one that is at least this far away, or one half the radius away.
pub(super) fn expected(
    scene: &dyn Scene,
    radius_m: f64,
    spacing_m: Option<f64>,
    most: usize,
) -> Vec<(usize, usize)> {
    let frames = Frames::of(scene, 0);
    let is_near = |away_m: f64| (spacing_m.unwrap_or(0.0)..=radius_m).contains(&away_m);
    let from_m = spacing_m.unwrap_or(0.5 * radius_m);
    let chosen = spread(&frames.with_reference(&is_near), most).into_iter();
    let with_reference = chosen.filter_map(|frame| {
        let off = |away_m: f64| (away_m - from_m).abs();
        let references = frames.references_of(frame, &is_near);
        let (reference, _) = references.min_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
        Some((frame.0, reference))
    });
    with_reference.collect()
}

/// At most so many of these, evenly.
fn spread<T: Copy>(all: &[T], count: usize) -> Vec<T> {
    let count = count.min(all.len());
    (0..count).map(|at| all[at * all.len() / count]).collect()
}

/// The frames of a map with a known position.
struct Frames<'a> {
    scene: &'a dyn Scene,
    seed: u64,
    /// Frames and their positions.
    placed: Vec<(usize, Vector3<f64>)>,
    /// Those that can be references.
    references: Vec<(usize, Vector3<f64>)>,
}

impl<'a> Frames<'a> {
    fn of(scene: &'a dyn Scene, seed: u64) -> Self {
        let frames = 0..scene.frames().len();
        let placed =
            frames.filter_map(|frame| Some((frame, scene.pose(frame)?.translation.vector)));
        let placed: Vec<_> = placed.collect();
        let references = placed.iter().filter(|(frame, _)| scene.has_cloud(*frame)).copied();
        Self { scene, seed, references: references.collect(), placed }
    }

    /// The references of a frame at such distances, with them.
    fn references_of<'b>(
        &'b self,
        (frame, at): (usize, Vector3<f64>),
        is_one: &'b dyn Fn(f64) -> bool,
    ) -> impl Iterator<Item = (usize, f64)> + 'b {
        let others = self.references.iter().filter(move |(other, _)| *other != frame);
        let away = others.map(move |(other, place)| (*other, (place - at).norm()));
        away.filter(|(_, away_m)| is_one(*away_m))
    }

    /// The frames that have a reference at such a distance.
    fn with_reference(&self, is_one: &dyn Fn(f64) -> bool) -> Vec<(usize, Vector3<f64>)> {
        let placed = self.placed.iter().copied();
        placed.filter(|frame| self.references_of(*frame, is_one).next().is_some()).collect()
    }

    /// A random reference of each frame. The draw depends on the frame alone.
    fn drawn(
        &self,
        frames: &[(usize, Vector3<f64>)],
        part: Part,
        is_one: &dyn Fn(f64) -> bool,
    ) -> Pairs {
        self.pairs(frames, |frame| {
            let references: Vec<usize> =
                self.references_of(frame, is_one).map(|(reference, _)| reference).collect();
            let (seed, part) = (self.seed, part.name());
            let text = format!("{seed}/{}/survey/{part}", self.scene.frames()[frame.0]);
            let mut rng = Pcg64::seed_from_u64(xxh3_64(text.as_bytes()));
            (!references.is_empty()).then(|| references[rng.random_range(0..references.len())])
        })
    }

    /// The nearest reference of each frame.
    fn nearest(&self, frames: &[(usize, Vector3<f64>)], is_one: &dyn Fn(f64) -> bool) -> Pairs {
        self.pairs(frames, |frame| {
            let references = self.references_of(frame, is_one);
            references.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(reference, _)| reference)
        })
    }

    fn pairs(
        &self,
        frames: &[(usize, Vector3<f64>)],
        reference: impl Fn((usize, Vector3<f64>)) -> Option<usize>,
    ) -> Pairs {
        let name = |frame: usize| self.scene.frames()[frame].clone();
        let pairs =
            frames.iter().filter_map(|&frame| Some((name(frame.0), vec![name(reference(frame)?)])));
        pairs.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;
    use crate::survey::SurveyRequest;

    fn request(spacing_m: Option<f64>) -> SurveyRequest {
        SurveyRequest {
            scene: "street".to_owned(),
            format: None,
            methods: SurveyRequest::METHODS.to_vec(),
            radius_m: None,
            spacing_m,
            queries: 10,
            degrade: "gamma=2".parse().expect("a degradation"),
            seed: 0,
            config: None,
            assignments: Vec::new(),
            out: "survey".into(),
        }
    }

    #[test]
    fn photos_are_spread_over_the_map_and_have_references_at_the_distances_of_their_part() {
        let street = scene::open("street", None).expect("is built in");
        let away = |(query, references): (&String, &Vec<String>)| {
            let place = |name: &str| {
                let frame = street.find(name).expect("is there");
                street.pose(frame).expect("is known").translation.vector
            };
            assert_eq!(references.len(), 1);
            (place(query) - place(&references[0])).norm()
        };
        let parts = choose(street.as_ref(), 15.0, &request(None));
        let sizes: Vec<usize> = parts.values().map(Pairs::len).collect();
        assert_eq!(sizes, [10, 10, 2, 2]);
        assert!(parts[&Part::Near].iter().map(away).all(|away| away > 0.0 && away <= 15.0));
        assert!(parts[&Part::Far].iter().map(away).all(|away| away >= 45.0));
        assert_eq!(parts[&Part::Near], parts[&Part::Worse]);
        let near = &parts[&Part::Near];
        assert!(parts[&Part::Mirrored].iter().all(|(query, of)| near[query] == *of));
        // The nearest frame that is not too near.
        let spaced = choose(street.as_ref(), 15.0, &request(Some(4.0)));
        assert!(spaced[&Part::Near].iter().map(away).all(|away| (4.0..6.0).contains(&away)));
        assert!(!choose(street.as_ref(), 1e-3, &request(None)).contains_key(&Part::Near));
    }

    #[test]
    fn as_many_as_there_are_are_spread_evenly() {
        assert_eq!(spread(&[1, 2, 3, 4, 5, 6], 3), [1, 3, 5]);
        assert_eq!(spread(&[1, 2], 5), [1, 2]);
        assert_eq!(spread::<usize>(&[], 5), [0; 0]);
    }
}
