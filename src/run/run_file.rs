//! `run.toml`: everything that an evaluation was asked, and over which queries.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::estimates_file::EstimatesFile;
use super::experiment::Experiment;
use super::protocol::{Protocol, is_default};
use super::scene_pair::{QueryCamera, ScenePair};
use crate::diagnosis::Tolerance;
use crate::estimator::{find, methods};
use crate::fusion::Fusion;
use crate::image::Degradation;
use crate::localize::{References, Request, Selection, Setting};
use crate::method::Method;
use crate::text::UnknownWord;

/// The version of the file's form.
pub const RUN_SCHEMA: &str = "posescope.run/1";

/// One part of a run that is spread over several processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// The number of the part, from 1.
    pub number: usize,
    /// The number of parts.
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

posescope_core::serde_as_text!(Shard);

/// A run as its folder describes it. Threads are missing: results do not depend on them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "RunFileForm", into = "RunFileForm")]
pub struct RunFile {
    /// The version of the form, [`RUN_SCHEMA`].
    pub schema: String,
    /// The version of posescope.
    pub version: String,
    /// The scenes of the references, as arguments.
    pub scenes: Vec<String>,
    /// The scenes of the queries, as arguments; none where each scene has its own.
    pub queries: Vec<String>,
    /// The format of the scenes, where it was given.
    pub format: Option<String>,
    /// Which of the paper's experiments, if any.
    pub experiment: Option<Experiment>,
    /// How each query is localised.
    pub protocol: Protocol,
    /// Uncertainty radii \[m\].
    pub radii_m: Vec<f64>,
    /// Share of the frames that were drawn as queries.
    pub share: f64,
    /// How many queries at most.
    pub limit: Option<usize>,
    /// A pose with a greater translation error is a failure \[m\].
    pub failure_radius_m: f64,
    /// Which part of the run this is.
    pub shard: Option<Shard>,
    /// What files and folders hold that the protocol names; see [`inputs`](super::inputs).
    pub inputs: BTreeMap<String, String>,
    /// Scenes paired, with the queries.
    pub pairs: Vec<ScenePair>,
    /// Every parameter of the estimators, as it was written: another version may have had others.
    pub params: toml::Table,
}

/// The file, key by key in its order.
#[derive(Serialize, Deserialize)]
struct RunFileForm {
    schema: String,
    version: String,
    scenes: Vec<String>,
    queries: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    format: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    experiment: Option<Experiment>,
    // Before the methods, some of which it names.
    #[serde(default, skip_serializing_if = "is_default")]
    estimates: Vec<EstimatesFile>,
    methods: Vec<Method>,
    references: Selection,
    fusions: Vec<Fusion>,
    radii_m: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    prior_m: Option<f64>,
    share: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<usize>,
    failure_radius_m: f64,
    #[serde(default, skip_serializing_if = "is_default")]
    right: Tolerance,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    accept: Option<f64>,
    #[serde(default, skip_serializing_if = "is_default")]
    explain: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    matches: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gps: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "is_default")]
    degrade: Degradation,
    seed: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    shard: Option<Shard>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    inputs: BTreeMap<String, String>,
    #[serde(rename = "pair")]
    pairs: Vec<ScenePair>,
    params: toml::Table,
}

impl From<RunFileForm> for RunFile {
    fn from(form: RunFileForm) -> Self {
        Self {
            schema: form.schema,
            version: form.version,
            scenes: form.scenes,
            queries: form.queries,
            format: form.format,
            experiment: form.experiment,
            protocol: Protocol {
                references: form.references,
                prior_m: form.prior_m,
                methods: form.methods,
                fusions: form.fusions,
                seed: form.seed,
                right: form.right,
                accept: form.accept,
                explain: form.explain,
                estimates: form.estimates,
                matches: form.matches,
                gps: form.gps,
                degrade: form.degrade,
            },
            radii_m: form.radii_m,
            share: form.share,
            limit: form.limit,
            failure_radius_m: form.failure_radius_m,
            shard: form.shard,
            inputs: form.inputs,
            pairs: form.pairs,
            params: form.params,
        }
    }
}

impl From<RunFile> for RunFileForm {
    fn from(run: RunFile) -> Self {
        Self {
            schema: run.schema,
            version: run.version,
            scenes: run.scenes,
            queries: run.queries,
            format: run.format,
            experiment: run.experiment,
            methods: run.protocol.methods,
            references: run.protocol.references,
            fusions: run.protocol.fusions,
            radii_m: run.radii_m,
            prior_m: run.protocol.prior_m,
            share: run.share,
            limit: run.limit,
            failure_radius_m: run.failure_radius_m,
            right: run.protocol.right,
            accept: run.protocol.accept,
            explain: run.protocol.explain,
            estimates: run.protocol.estimates,
            matches: run.protocol.matches,
            gps: run.protocol.gps,
            degrade: run.protocol.degrade,
            seed: run.protocol.seed,
            shard: run.shard,
            inputs: run.inputs,
            pairs: run.pairs,
            params: run.params,
        }
    }
}

/// What is wrong with the text of a `run.toml`, and where.
#[derive(Debug)]
pub(super) struct RunFileError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong, on one line.
    pub message: String,
}

/// Where the values stand that are held against each other once all are read.
#[derive(Deserialize)]
struct Places {
    schema: Spanned<String>,
    methods: Spanned<Vec<Method>>,
    radii_m: Spanned<Vec<f64>>,
    pair: Vec<ScenePairPlaces>,
}

#[derive(Deserialize)]
struct ScenePairPlaces {
    scene_index: Spanned<usize>,
}

impl Places {
    /// The first thing that is wrong, with its place \[bytes\].
    fn wrong(&self, run: &RunFile) -> Option<(usize, String)> {
        if run.schema != RUN_SCHEMA {
            let message = format!("schema {RUN_SCHEMA} expected, {} found", run.schema);
            return Some((self.schema.span().start, message));
        }
        if run.protocol.methods.is_empty() {
            let message = "a run has at least one method".to_owned();
            return Some((self.methods.span().start, message));
        }
        let unknown = run.protocol.methods.iter().find(|method| {
            let mut brought = run.protocol.estimates.iter();
            find(**method).is_none() && !brought.any(|file| file.method == **method)
        });
        if let Some(method) = unknown {
            let error = UnknownWord::among(method.name(), "method", methods().map(Method::name));
            return Some((self.methods.span().start, error.to_string()));
        }
        let is_length = |radius: &f64| *radius > 0.0 && radius.is_finite();
        if run.radii_m.is_empty() || !run.radii_m.iter().all(is_length) {
            let message = "one positive radius or more expected".to_owned();
            return Some((self.radii_m.span().start, message));
        }
        let scenes = run.scenes.len();
        let mut pairs = self.pair.iter().map(|pair| &pair.scene_index);
        let outside = pairs.find(|index| *index.get_ref() >= scenes)?;
        let message = format!(
            "scene_index {} names none of the {scenes} scenes, which are counted from 0",
            outside.get_ref()
        );
        Some((outside.span().start, message))
    }
}

/// One query of a pair: what is done, written and spread as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunItem<'a> {
    /// Its place in the plan.
    pub index: usize,
    /// Its scenes.
    pub pair: &'a ScenePair,
    /// The query frame's name.
    pub query: &'a str,
    /// The query's camera.
    pub camera: QueryCamera,
    /// When the query was taken \[s\].
    pub time_s: Option<f64>,
}

impl RunFile {
    /// All items of the run in their order, those of other shards too.
    pub fn plan(&self) -> impl Iterator<Item = RunItem<'_>> {
        let queries = self.pairs.iter().flat_map(|pair| {
            let queries = pair.queries.iter().enumerate();
            queries.map(move |(at, query)| (pair, at, query))
        });
        queries
            .enumerate()
            .map(|(index, (pair, at, query))| RunItem {
                index,
                pair,
                query,
                camera: pair.cameras.get(at).copied().unwrap_or(pair.camera),
                time_s: pair.times_s.get(at).copied(),
            })
    }

    /// The items of this shard.
    pub fn items(&self) -> impl Iterator<Item = RunItem<'_>> {
        self.plan()
            .filter(|item| self.shard.is_none_or(|shard| shard.has(item.index)))
    }

    /// What is asked of every query, still without references: by radius, then number of references.
    pub fn settings(&self) -> Vec<Setting> {
        let most_references = self.protocol.references.count();
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
                ..chosen.clone()
            },
            fusions: self.protocol.fusions.clone(),
            setting: Some(setting),
        }
    }

    /// Results of each query.
    pub fn results_per_item(&self) -> usize {
        let protocol = &self.protocol;
        protocol.methods.len() * self.settings().len() * protocol.fusions.len().max(1)
    }

    /// Reads the text of a `run.toml` and checks it.
    pub(super) fn read(text: &str) -> Result<Self, RunFileError> {
        let error_at = |at: usize, message: String| RunFileError {
            line: text[..at.min(text.len())].matches('\n').count() + 1,
            message: message.replace('\n', " "),
        };
        let syntax = |error: toml::de::Error| {
            let at = error.span().map_or(0, |span| span.start);
            error_at(at, error.message().to_owned())
        };
        let run: Self = toml::from_str(text).map_err(syntax)?;
        let places: Places = toml::from_str(text).map_err(syntax)?;
        match places.wrong(&run) {
            Some((at, message)) => Err(error_at(at, message)),
            None => Ok(run),
        }
    }

    /// The description of the same run in one piece.
    pub fn whole(&self) -> Self {
        Self {
            shard: None,
            ..self.clone()
        }
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
