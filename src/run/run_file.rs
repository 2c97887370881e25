//! `run.toml`: everything that an evaluation was asked, and over which queries.

use serde::{Deserialize, Serialize};

use super::experiment::Experiment;
use crate::camera::Intrinsics;
use crate::fusion;
use crate::localize::{References, Request, Selection, Setting};
use crate::method::Method;
use crate::scene::Scene;

/// The version of the file's form.
pub const RUN_SCHEMA: &str = "posescope.run/1";

/// One part of a run that is spread over several processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which part, from 1.
    pub number: usize,
    /// Of how many.
    pub of: usize,
}

impl Shard {
    /// Whether the part has the item at this place of the plan.
    pub fn has(self, item: usize) -> bool {
        item % self.of == self.number - 1
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let part = |text: &str| text.parse::<usize>().ok();
        let numbers = text.split_once('/');
        match numbers.and_then(|(number, of)| Some((part(number)?, part(of)?))) {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err("I/N expected, with I from 1 to N".to_owned()),
        }
    }
}

impl Serialize for Shard {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Shard {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

/// A run as its folder describes it. Threads are missing: results do not depend on them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFile {
    /// [`RUN_SCHEMA`].
    pub schema: String,
    /// The version of posescope.
    pub version: String,
    /// The scenes of the references, as arguments.
    pub scenes: Vec<String>,
    /// The scenes of the queries, as arguments; none where each scene has its own.
    pub queries: Vec<String>,
    /// Their format, where it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
    /// Which of the paper's experiments, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiment: Option<Experiment>,
    /// The methods, in the order of their results.
    pub methods: Vec<String>,
    /// How references are chosen.
    pub references: String,
    /// The fusions.
    pub fusions: Vec<String>,
    /// Uncertainty radii \[m\].
    pub radii_m: Vec<f64>,
    /// How far from the query's known position retrieval may look \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior_m: Option<f64>,
    /// Share of the frames that were drawn as queries.
    pub share: f64,
    /// At most as many of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<usize>,
    /// A pose with a greater translation error is a failure \[m\].
    pub failure_radius_m: f64,
    /// Seed of every random choice.
    pub seed: u64,
    /// Which part of the run this is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// Scenes paired, with the queries.
    #[serde(rename = "pair")]
    pub pairs: Vec<Pair>,
    /// Every parameter of the estimators.
    pub params: toml::Table,
}

/// A scene of references with one of queries, perhaps the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// Position of the references' scene among the scenes.
    pub scene_index: usize,
    /// The name of the references' scene.
    pub scene: String,
    /// The name of the queries' scene.
    pub query_scene: String,
    /// The camera of the queries; the first one's where they have several.
    pub camera: Camera,
    /// The camera of each query, where they have several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<Camera>,
    /// Frames that were drawn as queries; where the scenes are the same, none is a reference.
    pub drawn: Vec<String>,
    /// The queries: all that were drawn, or those of them that were named.
    pub queries: Vec<String>,
    /// When they were taken \[s\], where that is known of all.
    pub times_s: Vec<f64>,
}

/// Intrinsics \[px\], with the centre of the top-left pixel at (0, 0).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Image width.
    pub width: u32,
    /// Image height.
    pub height: u32,
    /// Focal length, horizontally.
    pub fx: f64,
    /// Focal length, vertically.
    pub fy: f64,
    /// Principal point, horizontally.
    pub cx: f64,
    /// Principal point, vertically.
    pub cy: f64,
}

impl From<Intrinsics> for Camera {
    fn from(intrinsics: Intrinsics) -> Self {
        let Intrinsics {
            fx,
            fy,
            cx,
            cy,
            width,
            height,
        } = intrinsics;
        Self {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
        }
    }
}

/// One query of a pair: what is done, written and spread as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item<'a> {
    /// Its place in the plan.
    pub index: usize,
    /// Its scenes.
    pub pair: &'a Pair,
    /// The query frame's name.
    pub query: &'a str,
    /// The query's camera.
    pub camera: Camera,
    /// When the query was taken \[s\].
    pub time_s: Option<f64>,
}

impl RunFile {
    /// All items of the run in their order, those of other shards too.
    pub fn plan(&self) -> impl Iterator<Item = Item<'_>> {
        let queries = self.pairs.iter().flat_map(|pair| {
            let queries = pair.queries.iter().enumerate();
            queries.map(move |(at, query)| (pair, at, query))
        });
        queries.enumerate().map(|(index, (pair, at, query))| Item {
            index,
            pair,
            query,
            camera: pair.cameras.get(at).copied().unwrap_or(pair.camera),
            time_s: pair.times_s.get(at).copied(),
        })
    }

    /// The items of this shard.
    pub fn items(&self) -> impl Iterator<Item = Item<'_>> {
        self.plan()
            .filter(|item| self.shard.is_none_or(|shard| shard.has(item.index)))
    }

    /// The methods.
    pub fn methods(&self) -> Vec<Method> {
        let methods = self.methods.iter();
        methods.filter_map(|name| name.parse().ok()).collect()
    }

    /// The fusions.
    pub fn fusions(&self) -> Vec<&'static fusion::Entry> {
        let fusions = self.fusions.iter();
        fusions.filter_map(|name| fusion::find(name)).collect()
    }

    /// How references are chosen.
    pub fn selection(&self) -> Selection {
        self.references.parse().unwrap_or(Selection::Random(1))
    }

    /// What is asked of every query, still without references: by radius, then number of references.
    pub fn settings(&self) -> Vec<Setting> {
        let most_references = self.selection().count();
        let counts = match self.experiment {
            Some(Experiment::Multi) => 1..=most_references,
            _ => most_references..=most_references,
        };
        let radii = self.radii_m.iter();
        radii
            .flat_map(|&radius_m| {
                counts.clone().map(move |references| Setting {
                    radius_m,
                    references,
                })
            })
            .collect()
    }

    /// The request of a setting, with as many of the chosen references.
    pub fn request(&self, setting: Setting, chosen: &References) -> Request {
        let count = setting.references.min(chosen.frames.len());
        Request {
            radius_m: setting.radius_m,
            references: References {
                frames: chosen.frames[..count].to_vec(),
                ranking: chosen.ranking.clone(),
            },
            fusions: self.fusions(),
            setting: Some(setting),
        }
    }

    /// Results of each query.
    pub fn results_per_item(&self) -> usize {
        self.methods.len() * self.settings().len() * self.fusions.len().max(1)
    }

    /// Whether every name in it is known; says which is not.
    pub(super) fn check(&self) -> Result<(), String> {
        let unknown_method = |name: &&String| name.parse::<Method>().is_err();
        let unknown_fusion = |name: &&String| fusion::find(name).is_none();
        let unknown = (self.methods.iter().find(unknown_method))
            .or_else(|| self.fusions.iter().find(unknown_fusion));
        if let Some(name) = unknown {
            return Err(format!("`{name}` is neither a method nor a fusion"));
        }
        if self.methods.is_empty() || self.radii_m.is_empty() {
            return Err("a run has at least one method and one radius".to_owned());
        }
        self.references.parse::<Selection>().map(drop)
    }

    /// The same run in one piece.
    pub fn whole(&self) -> Self {
        Self {
            shard: None,
            ..self.clone()
        }
    }
}

/// When the queries of a scene were taken, if that is known of all.
pub(super) fn times_of(scene: &dyn Scene, queries: &[usize]) -> Vec<f64> {
    let times: Option<Vec<f64>> = queries.iter().map(|&frame| scene.time_s(frame)).collect();
    times.unwrap_or_default()
}

/// The camera of the first of some frames, and that of each where they have several.
pub(super) fn cameras_of(scene: &dyn Scene, frames: &[usize]) -> (Camera, Vec<Camera>) {
    let camera = |frame: usize| Camera::from(scene.intrinsics(frame));
    let first = camera(frames.first().copied().unwrap_or(0));
    let cameras: Vec<Camera> = frames.iter().map(|&frame| camera(frame)).collect();
    match cameras.iter().all(|camera| *camera == first) {
        true => (first, Vec::new()),
        false => (first, cameras),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_read_and_share_the_items_out() {
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"]
            .map(|text| text.parse().expect("a shard"))
            .into();
        for item in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.has(item)).count(), 1);
        }
        for wrong in ["0/3", "4/3", "1/0", "1", "a/b", ""] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
