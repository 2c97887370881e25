//! Places of the street: a query and a reference a few metres apart, as they are without any fault.

use posescope::cloud::Cloud;
use posescope::diagnosis::Tolerance;
use posescope::fusion::Fusion;
use posescope::geometry::Pose;
use posescope::localize::{LocalizeError, Localizer, NoObserver, QueryResult, References, Request};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::frames::{Frame, Frames};

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

/// A query frame and a reference frame of a drive.
pub struct Place<'a> {
    /// The drives.
    pub drives: &'a Drives,
    /// The query's frame.
    pub query: usize,
    /// The reference's frame.
    pub reference: usize,
    /// Number of the place.
    pub number: usize,
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
    /// The place of a number: a frame anywhere, and one 3 to 7 m before or behind it.
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
            drives,
            query,
            reference,
            number,
        }
    }

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

    /// The place without any fault.
    pub fn case(&self) -> Case {
        Case {
            query: self.frame(self.query),
            references: vec![self.frame(self.reference)],
            chosen: vec![0].into(),
            params: Params::default(),
            radius_m: 10.0,
            fusion: None,
            seed: self.number as u64,
        }
    }
}

/// A frame of a drive, seen from a pose.
pub fn frame_of(drive: &Traversal, frame: usize, world_from_camera: &Pose) -> Frame {
    let points = drive.cloud(frame);
    Frame {
        photo: drive.image_from(frame, world_from_camera),
        intrinsics: drive.intrinsics(),
        pose: Some(*world_from_camera),
        cloud: Cloud {
            points: points.into_iter().map(|point| point.position).collect(),
        },
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
