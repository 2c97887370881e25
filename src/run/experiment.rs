//! The paper's experiments, and which frames they take as queries.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64;

use super::protocol::Protocol;
use super::scene_pair::{ScenePair, cameras_of, times_of};
use crate::fusion::Fusion;
use crate::localize::Selection;
use crate::method::Method;
use crate::scene::{Scene, SceneError};
use crate::text::UnknownWord;

/// One of the experiments of the paper's section 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Experiment {
    /// One random reference within 10, 15, 20 and 25 m (section 4.3, table 3).
    Single,
    /// One to five references, four fusions (section 4.4, table 4).
    Multi,
    /// References from retrieval within a large prior (section 4.5, tables 5 and 6).
    Large,
}

impl Experiment {
    /// All experiments.
    pub const ALL: [Self; 3] = [Self::Single, Self::Multi, Self::Large];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Multi => "multi",
            Self::Large => "large",
        }
    }
}

impl fmt::Display for Experiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Experiment {
    type Err = UnknownWord;

    fn from_str(name: &str) -> Result<Self, UnknownWord> {
        let found = Self::ALL.into_iter().find(|known| known.name() == name);
        found.ok_or_else(|| UnknownWord::among(name, "experiment", Self::ALL.map(Self::name)))
    }
}

posescope_core::serde_as_text!(Experiment);

/// What an experiment asks where the user says nothing else.
#[derive(Clone, Debug, PartialEq)]
pub struct Defaults {
    /// How queries are localised; fusions are of use where there are several references.
    pub protocol: Protocol,
    /// Uncertainty radii \[m\].
    pub radii_m: &'static [f64],
    /// Share of the frames that are queries.
    pub share: f64,
}

const WITHOUT_HYBRID: &[Method] = &[Method::FB, Method::PM, Method::MI];

/// What is asked in an experiment, or without one: every frame against one reference.
pub fn defaults(experiment: Option<Experiment>) -> Defaults {
    let protocol = Protocol {
        fusions: Fusion::all().filter(|f| f.name == "r-wavg").collect(),
        ..Protocol::default()
    };
    match experiment {
        None => Defaults {
            protocol,
            radii_m: &[Protocol::RADIUS_M],
            share: 1.0,
        },
        Some(Experiment::Single) => Defaults {
            protocol: Protocol {
                methods: WITHOUT_HYBRID.to_vec(),
                fusions: Vec::new(),
                ..protocol
            },
            radii_m: &[10.0, 15.0, 20.0, 25.0],
            share: 0.1,
        },
        Some(Experiment::Multi) => Defaults {
            protocol: Protocol {
                methods: WITHOUT_HYBRID.to_vec(),
                references: Selection::Random(5),
                fusions: Fusion::of_the_paper().collect(),
                ..protocol
            },
            radii_m: &[10.0],
            share: 0.1,
        },
        Some(Experiment::Large) => Defaults {
            protocol: Protocol {
                references: Selection::Retrieved(5),
                ..protocol
            },
            radii_m: &[Protocol::RADIUS_M],
            share: 0.1,
        },
    }
}

/// What the paper asked of each of its data sets (sections 4.2 and 4.5): any scene can be held to either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaperProtocol {
    /// A prior of 200 m, failures from 10 m.
    Kitti,
    /// A prior of 50 m, failures from 20 m.
    RobotCar,
}

impl PaperProtocol {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Kitti, Self::RobotCar];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kitti => "kitti",
            Self::RobotCar => "robotcar",
        }
    }

    /// That of a scene where nobody asks for another.
    pub fn of_scene(scene: &str) -> Self {
        match scene.starts_with(Self::RobotCar.name()) {
            true => Self::RobotCar,
            false => Self::Kitti,
        }
    }

    /// How far retrieval looks around the query's known position \[m\].
    pub fn prior_m(self) -> f64 {
        match self {
            Self::Kitti => 200.0,
            Self::RobotCar => 50.0,
        }
    }

    /// The translation error from which on a pose counts as a failure \[m\].
    pub fn failure_radius_m(self) -> f64 {
        match self {
            Self::Kitti => 10.0,
            Self::RobotCar => 20.0,
        }
    }
}

impl FromStr for PaperProtocol {
    type Err = UnknownWord;

    fn from_str(name: &str) -> Result<Self, UnknownWord> {
        let found = Self::ALL.into_iter().find(|one| one.name() == name);
        found.ok_or_else(|| UnknownWord::among(name, "protocol", Self::ALL.map(Self::name)))
    }
}

/// The translation error from which on a pose counts as a failure \[m\], by the references' scene.
pub fn default_failure_radius_m(scene: &str) -> f64 {
    PaperProtocol::of_scene(scene).failure_radius_m()
}

/// Which frames become queries.
#[derive(Clone, Copy, Debug)]
pub struct Draw<'a> {
    /// Share of the frames with a known pose.
    pub share: f64,
    /// How many frames at most.
    pub limit: Option<usize>,
    /// Only these of those drawn; all, if none is named.
    pub only: &'a [String],
    /// The seed of the choice.
    pub seed: u64,
}

/// Why there are no queries.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// Errors could not be measured, nor references be found.
    #[error("{scene}: no frame has a known pose")]
    NoPose {
        /// The scene.
        scene: String,
    },
    /// It exists, but is not one of the queries.
    #[error("{scene}: frame {frame} is not among the {drawn} queries drawn")]
    NotDrawn {
        /// The scene.
        scene: String,
        /// The frame.
        frame: String,
        /// Number of queries.
        drawn: usize,
    },
    /// There is no such frame.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl Draw<'_> {
    /// Pairs a scene of references, the one at `scene_index`, with one of queries.
    ///
    /// # Errors
    /// [`DrawError`].
    pub fn pair(
        &self,
        scene_index: usize,
        references: &dyn Scene,
        queries: &dyn Scene,
    ) -> Result<ScenePair, DrawError> {
        let drawn = self.frames(queries)?;
        let wanted: BTreeSet<usize> = self
            .only
            .iter()
            .map(|name| {
                let frame = queries.find(name)?;
                if drawn.contains(&frame) {
                    return Ok(frame);
                }
                Err(DrawError::NotDrawn {
                    scene: queries.name().to_owned(),
                    frame: queries.frames()[frame].clone(),
                    drawn: drawn.len(),
                })
            })
            .collect::<Result<_, DrawError>>()?;
        let asked: Vec<usize> = drawn
            .iter()
            .copied()
            .filter(|frame| wanted.is_empty() || wanted.contains(frame))
            .collect();
        let names = |frames: &[usize]| {
            let frames = frames.iter();
            let names = frames.map(|&frame| queries.frames()[frame].clone());
            names.collect::<Vec<_>>()
        };
        let (camera, cameras) = cameras_of(queries, &asked);
        // Where every frame is a query, all the others are its references.
        let left_out = if self.share < 1.0 { &drawn[..] } else { &[] };
        Ok(ScenePair {
            scene_index,
            scene: references.name().to_owned(),
            query_scene: queries.name().to_owned(),
            camera,
            cameras,
            drawn: names(left_out),
            queries: names(&asked),
            times_s: times_of(queries, &asked),
        })
    }

    /// In the order of the scene. Which ones depends on the seed and the scene's name.
    fn frames(&self, scene: &dyn Scene) -> Result<Vec<usize>, DrawError> {
        let mut frames: Vec<usize> = (0..scene.frames().len())
            .filter(|&frame| scene.pose(frame).is_some())
            .collect();
        if frames.is_empty() {
            return Err(DrawError::NoPose {
                scene: scene.name().to_owned(),
            });
        }
        let count = ((self.share * frames.len() as f64).round() as usize).max(1);
        let count = count.min(self.limit.unwrap_or(count));
        if count < frames.len() {
            let text = format!("{}/{}/queries", self.seed, scene.name());
            let seed = xxhash_rust::xxh3::xxh3_64(text.as_bytes());
            frames.shuffle(&mut Pcg64::seed_from_u64(seed));
            frames.truncate(count);
            frames.sort_unstable();
        }
        Ok(frames)
    }
}
