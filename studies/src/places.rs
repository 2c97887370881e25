//! Places: a query and a reference a few metres apart, as they are without any fault.

use image::RgbImage;
use posescope::cloud::Cloud;
use posescope::diagnosis::Tolerance;
use posescope::geometry::Pose;
use posescope::localize::{LocalizeError, Localizer, NoObserver, QueryResult, Request};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::Failure;
use crate::frames::{Frame, Frames};
use crate::numbers::at_places;
use crate::real_pairs::{self, RealPair};

/// Which places a study looks at.
#[derive(clap::Args)]
pub struct Chosen {
    /// Number of places on the street.
    #[arg(long, default_value_t = 12)]
    pub places: usize,
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Take the pairs of real photos below POSESCOPE_DATA instead of the street.
    #[arg(long)]
    pub real: bool,
}

impl Chosen {
    /// What the work makes of each place.
    pub fn each<T: Send>(
        &self,
        work: impl Fn(&Place<'_>) -> Result<T, Failure> + Sync,
    ) -> Result<Vec<T>, Failure> {
        if self.real {
            let pairs = real_pairs::all()?;
            return at_places(pairs.len(), |number| {
                work(&Place { ground: Ground::Real(&pairs[number]), number })
            });
        }
        let drives = Drives::of_town(WORLD_SEED, Size::Full);
        at_places(self.places, |number| work(&Place::numbered(&drives, number, self.seed)))
    }
}

/// The street in all conditions, in the order of [`Condition::ALL`].
pub fn all_conditions() -> [Traversal; 5] {
    Condition::ALL.map(|condition| Traversal::new(WORLD_SEED, condition, Size::Full))
}

/// The frame of a drive that is nearest to a pose.
pub fn nearest(drive: &Traversal, pose: &Pose) -> usize {
    let target = pose.translation.vector;
    let away = |frame: &usize| (drive.world_from_camera(*frame).translation.vector - target).norm();
    let nearest = (0..drive.frame_count()).min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.unwrap_or(0)
}

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
    /// The drives through a town, with photos of a size.
    pub fn of_town(world_seed: u64, size: Size) -> Self {
        let drive = |seed, condition| Traversal::new(seed, condition, size);
        Self {
            day: drive(world_seed, Condition::Overcast),
            night: drive(world_seed, Condition::Night),
            elsewhere: drive(world_seed + 1, Condition::Overcast),
        }
    }
}

/// A query and a reference.
pub struct Place<'a> {
    ground: Ground<'a>,
    /// Number of the place.
    pub number: usize,
}

enum Ground<'a> {
    /// On the street, which can be seen from anywhere.
    Street(StreetPlace<'a>),
    /// Where two photos and scans were taken.
    Real(&'a RealPair),
}

/// A query frame and a reference frame of the drive by day.
pub struct StreetPlace<'a> {
    pub drives: &'a Drives,
    pub query: usize,
    pub reference: usize,
}

/// A query to localise, and all that it is localised with.
#[derive(Clone)]
pub struct Case {
    /// The query; its pose is the truth.
    pub query: Frame,
    pub references: Vec<Frame>,
    /// How they were found, and what is asked of them.
    pub request: Request,
    pub params: Params,
    pub seed: u64,
}

impl<'a> Place<'a> {
    /// The place of the street with a number: a frame anywhere, and one 3 to 7 m before or behind it.
    pub fn numbered(drives: &'a Drives, number: usize, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(1009).wrapping_add(number as u64));
        let frames = drives.day.frame_count();
        let query = rng.random_range(0..frames);
        let apart = rng.random_range(3..8);
        let reference =
            if rng.random() { (query + apart) % frames } else { (query + frames - apart) % frames };
        let place = StreetPlace { drives, query, reference };
        Self { ground: Ground::Street(place), number }
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
            request: Request {
                radius_m: 10.0,
                references: vec![0].into(),
                fusions: Vec::new(),
                setting: None,
            },
            params: Params::default(),
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
                Some(street.frame(street.frame_at(street.reference, 12)).cloud)
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
        Frame::of(&self.drives.day, frame)
    }
}

impl Case {
    /// The results of the methods, in their order; with the truth, or without.
    pub fn results(
        &self,
        methods: &[Method],
        truth_is_known: bool,
    ) -> Result<Vec<QueryResult>, Failure> {
        let mut query = self.query.clone();
        query.pose = query.pose.filter(|_| truth_is_known);
        let queries = Frames::new("query", vec![query]);
        let references = Frames::new("reference", self.references.clone());
        let localizer = Localizer::new(&references, &queries, &self.params, self.seed);
        let localizer = localizer.with_tolerance(Tolerance::default());
        let mut results = Vec::new();
        let keep = |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        };
        let requests = std::slice::from_ref(&self.request);
        localizer.localize(0, 0, requests, methods, &mut NoObserver, keep)?;
        Ok(results)
    }
}
