//! Places: a query and a reference a few metres apart, as they are without any fault.

use image::RgbImage;
use posescope::cloud::Cloud;
use posescope::diagnosis::Tolerance;
use posescope::fusion::Fusion;
use posescope::geometry::Pose;
use posescope::image::Photo;
use posescope::localize::{LocalizeError, Localizer, NoObserver, QueryResult, References, Request};
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::frames::{Frame, Frames};
use crate::real_pairs::RealPair;

/// The drives that places are taken from.
pub struct Drives {
    /// The drive by default.
    pub day: Traversal,
    /// The same streets at night.
    pub night: Traversal,
    /// Another town.
    pub elsewhere: Traversal,
}

impl Drives {
    /// All of them, at full size.
    pub fn new() -> Self {
        let drive = |seed, condition| Traversal::new(seed, condition, Size::Full);
        Self {
            day: drive(WORLD_SEED, Condition::Overcast),
            night: drive(WORLD_SEED, Condition::Night),
            elsewhere: drive(WORLD_SEED + 1, Condition::Overcast),
        }
    }
}

impl Default for Drives {
    fn default() -> Self {
        Self::new()
    }
}

/// A query and a reference.
pub struct Place<'a> {
    /// Where it is.
    pub ground: Ground<'a>,
    /// Number of the place.
    pub number: usize,
}

/// Where a place is.
pub enum Ground<'a> {
    /// On the street, which can be seen from anywhere.
    Street(StreetPlace<'a>),
    /// Where somebody took two photos and scans.
    Real(&'a RealPair),
}

/// A query frame and a reference frame of a drive.
pub struct StreetPlace<'a> {
    /// The drives.
    pub drives: &'a Drives,
    /// The query's frame.
    pub query: usize,
    /// The reference's frame.
    pub reference: usize,
}

/// A query to localise, and all that it is localised with.
#[derive(Clone)]
pub struct Case {
    /// The query; its pose is the truth.
    pub query: Frame,
    /// The references.
    pub references: Vec<Frame>,
    /// How they were found.
    pub chosen: References,
    /// The parameters.
    pub params: Params,
    /// The uncertainty radius \[m\].
    pub radius_m: f64,
    /// The fusion, where there are several references.
    pub fusion: Option<Fusion>,
    /// Seed of every random choice.
    pub seed: u64,
}

impl<'a> Place<'a> {
    /// The place of the street with a number: a frame anywhere, and one 3 to 7 m before or behind it.
    pub fn numbered(drives: &'a Drives, number: usize, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(1009).wrapping_add(number as u64));
        let frames = drives.day.frame_count();
        let query = rng.random_range(0..frames);
        let apart = rng.random_range(3..8);
        let reference = match rng.random() {
            true => (query + apart) % frames,
            false => (query + frames - apart) % frames,
        };
        Self {
            ground: Ground::Street(StreetPlace {
                drives,
                query,
                reference,
            }),
            number,
        }
    }

    /// A place of real photos and scans.
    pub fn real(pair: &'a RealPair, number: usize) -> Self {
        Self {
            ground: Ground::Real(pair),
            number,
        }
    }

    /// The place on the street, if it is there.
    pub fn street(&self) -> Option<&StreetPlace<'a>> {
        match &self.ground {
            Ground::Street(place) => Some(place),
            Ground::Real(_) => None,
        }
    }

    /// The place without any fault.
    pub fn case(&self) -> Case {
        let (query, reference) = match &self.ground {
            Ground::Street(street) => (street.frame(street.query), street.frame(street.reference)),
            Ground::Real(pair) => (pair.query.clone(), pair.reference.clone()),
        };
        Case {
            query,
            references: vec![reference],
            chosen: vec![0].into(),
            params: Params::default(),
            radius_m: 10.0,
            fusion: None,
            seed: self.number as u64,
        }
    }

    /// A photo of another town, of the query's size.
    pub fn foreign_photo(&self) -> RgbImage {
        match &self.ground {
            Ground::Street(street) => {
                let drive = &street.drives.elsewhere;
                drive.image(street.query % drive.frame_count())
            }
            Ground::Real(pair) => pair.foreign_photo.clone(),
        }
    }

    /// The cloud of a frame some 12 m farther than the reference.
    pub fn farther_cloud(&self) -> Option<Cloud> {
        match &self.ground {
            Ground::Street(street) => {
                let farther = street.frame_at(street.reference, 12);
                Some(cloud_of(&street.drives.day, farther))
            }
            Ground::Real(pair) => pair.farther_cloud.clone(),
        }
    }
}

impl StreetPlace<'_> {
    /// The frame some metres behind the reference or before it.
    pub fn frame_at(&self, from: usize, metres: isize) -> usize {
        let frames = self.drives.day.frame_count() as isize;
        (from as isize + metres).rem_euclid(frames) as usize
    }

    /// A frame of the drive by day.
    pub fn frame(&self, frame: usize) -> Frame {
        frame_of(
            &self.drives.day,
            frame,
            &self.drives.day.world_from_camera(frame),
        )
    }

    /// The same from another pose; the cloud stays that of the frame.
    pub fn frame_from(&self, frame: usize, world_from_camera: &Pose) -> Frame {
        frame_of(&self.drives.day, frame, world_from_camera)
    }
}

/// A query in any condition of the street, and a reference ahead of it in any other.
pub struct Pairing {
    /// The condition of the query, by its place in [`Condition::ALL`].
    pub queries: usize,
    /// The query's frame.
    pub query: usize,
    /// The condition of the reference.
    pub references: usize,
    /// The reference's frame.
    pub reference: usize,
}

impl Pairing {
    /// The pairing with a number: a reference 1 to 9.5 m ahead, of the query's condition alone or of
    /// any. `drives` are those of [`Condition::ALL`].
    pub fn numbered(
        drives: &[Traversal; 5],
        number: usize,
        seed: u64,
        is_same_condition: bool,
    ) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(6007).wrapping_add(number as u64));
        let (queries, other) = (rng.random_range(0..5), rng.random_range(0..5));
        let references = if is_same_condition { queries } else { other };
        let query = rng.random_range(0..drives[queries].frame_count());
        let truth = drives[queries].world_from_camera(query);
        let apart: f64 = rng.random_range(1.0..9.5);
        let ahead = truth * nalgebra::Point3::new(0.0, 0.0, apart);
        let drive = &drives[references];
        let away = |frame: &usize| {
            (drive.world_from_camera(*frame).translation.vector - ahead.coords).norm()
        };
        let reference = (0..drive.frame_count())
            .min_by(|a, b| away(a).total_cmp(&away(b)))
            .unwrap_or(0);
        Self {
            queries,
            query,
            references,
            reference,
        }
    }

    /// Query and reference.
    pub fn frames(&self, drives: &[Traversal; 5]) -> (Frame, Frame) {
        let frame = |drive: &Traversal, frame: usize| {
            frame_of(drive, frame, &drive.world_from_camera(frame))
        };
        (
            frame(&drives[self.queries], self.query),
            frame(&drives[self.references], self.reference),
        )
    }
}

/// A query localised against a reference within a radius \[m\], and the query's true pose.
///
/// # Panics
/// Where a frame has no pose, no pixel or no point.
pub fn problem_of(query: Frame, reference: Frame, radius_m: f64) -> (Problem, Pose) {
    let (truth, pose) = (query.pose, reference.pose);
    let photo = Photo::from_color(query.photo);
    let query = Query::new("query", photo, query.intrinsics).expect("a whole frame");
    let photo = Photo::from_color(reference.photo);
    let reference = ReferenceTuple::new(
        "reference",
        photo,
        reference.intrinsics,
        pose.expect("a frame with its pose"),
        reference.cloud,
    );
    let problem = Problem::new(query, reference.expect("a whole frame"), radius_m);
    (
        problem.expect("a radius"),
        truth.expect("a frame with its pose"),
    )
}

fn cloud_of(drive: &Traversal, frame: usize) -> Cloud {
    let points = drive.cloud(frame).into_iter();
    Cloud {
        points: points.map(|point| point.position).collect(),
    }
}

/// A frame of a drive, seen from a pose.
pub fn frame_of(drive: &Traversal, frame: usize, world_from_camera: &Pose) -> Frame {
    Frame {
        photo: drive.image_from(frame, world_from_camera),
        intrinsics: drive.intrinsics(),
        pose: Some(*world_from_camera),
        cloud: cloud_of(drive, frame),
    }
}

impl Case {
    /// The results of the methods, in their order; with the truth, or without.
    pub fn results(&self, methods: &[Method], truth_is_known: bool) -> Vec<QueryResult> {
        let query = Frame {
            pose: self.query.pose.filter(|_| truth_is_known),
            ..self.query.clone()
        };
        let queries = Frames::new("queries", "query ", vec![query]);
        let references = Frames::new("references", "reference ", self.references.clone());
        let localizer = Localizer::new(&references, &queries, &self.params, self.seed)
            .with_tolerance(Tolerance::default());
        let request = Request {
            radius_m: self.radius_m,
            references: self.chosen.clone(),
            fusions: self.fusion.into_iter().collect(),
            setting: None,
        };
        let mut results = Vec::new();
        let keep = |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        let done = localizer.localize(0, 0, &[request], methods, &mut NoObserver, keep);
        done.expect("frames in memory can be read, and nobody cancels");
        results
    }
}
