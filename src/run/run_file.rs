//! `run.toml`: the request of an evaluation and its queries.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use posescope_core::text::expect_name;
use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

use super::preset::{Preset, default_failure_radius_m};
use super::protocol::{Protocol, known};
use super::scene_pair::{QueryCamera, ScenePair};
use super::scene_paths;
use super::survey_file::SurveyFrom;
use crate::describe::ParamError;
use crate::localize::{QueryResult, References, Request, Setting};
use crate::method::Method;
use crate::params::Params;

/// The version of the file format.
pub const RUN_SCHEMA: &str = "posescope.run/1";

/// What the name of an input file begins with.
pub(super) const CONTENT_OF: &str = "content of ";

/// One part of a run that is split over several processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// The number of the part, from 1.
    pub number: usize,
    /// The number of parts.
    pub of: usize,
}

impl Shard {
    /// Whether the part contains the item at this position of the plan.
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

/// The description of a run in its folder. Threads are missing: results do not depend on them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFile {
    /// The version of the file format, [`RUN_SCHEMA`].
    pub schema: String,
    /// The version of posescope.
    pub version: String,
    /// The scenes of the references, as given on the command line.
    pub scenes: Vec<String>,
    /// Which part of the run this is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// How queries are localised, with all defaults filled in.
    pub protocol: Protocol,
    /// Hashes of the protocol's files and folders; see [`inputs`](super::inputs).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub inputs: BTreeMap<String, String>,
    /// The paths of scenes, files and folders relative to the run folder, by the arguments that name them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub paths: BTreeMap<String, String>,
    /// The pairs of scenes, with the queries.
    #[serde(rename = "pair")]
    pub pairs: Vec<ScenePair>,
    /// Every parameter of the estimators, as written: another version may have other parameters.
    pub params: toml::Table,
}

/// An error in the text of a `run.toml`.
#[derive(Debug)]
pub(super) struct RunFileError {
    /// The line, counted from 1.
    pub line: usize,
    /// The error, on one line.
    pub message: String,
}

/// The first invalid value: the keys that lead to it, and a message.
fn invalid(run: &RunFile) -> Option<(String, String)> {
    if run.schema != RUN_SCHEMA {
        let message = format!("schema {RUN_SCHEMA} expected, {} found", run.schema);
        return Some(("schema".to_owned(), message));
    }
    let protocol = &run.protocol;
    let at_methods = |message: String| Some(("protocol.method".to_owned(), message));
    if protocol.methods.is_empty() {
        return at_methods("at least one method expected".to_owned());
    }
    let others: Vec<Method> = protocol.estimates.iter().map(|file| file.method).collect();
    if let Err(error) = known(&protocol.methods, &others) {
        return at_methods(error.to_string());
    }
    let is_length = |radius: &f64| *radius > 0.0 && radius.is_finite();
    if protocol.radii_m.is_empty() || !protocol.radii_m.iter().all(is_length) {
        let message = "at least one radius above 0 expected".to_owned();
        return Some(("protocol.radius".to_owned(), message));
    }
    for (at, pair) in run.pairs.iter().enumerate() {
        let names = [&pair.scene, &pair.query_scene].into_iter().chain(&pair.queries);
        let mut names = names.chain(&pair.drawn).chain(pair.references.iter().flatten());
        if let Err(message) = names.try_for_each(|name| expect_name(name)) {
            return Some((format!("pair.{at}"), message));
        }
    }
    let scenes = run.scenes.len();
    let pair = run.pairs.iter().position(|pair| pair.scene_index >= scenes)?;
    let message = format!(
        "a scene_index below {scenes} expected, the number of scenes; {} found",
        run.pairs[pair].scene_index
    );
    Some((format!("pair.{pair}.scene_index"), message))
}

/// Where the value of these keys begins in a text \[bytes\]. A number is a position in a list.
fn place(text: &str, keys: &str) -> Option<usize> {
    let mut value = DeValue::Table(DeTable::parse(text).ok()?.into_inner());
    let mut start = 0;
    for key in keys.split('.') {
        let inner = match key.parse::<usize>() {
            Ok(at) => value.get(at),
            Err(_) => value.get(key),
        };
        start = inner?.span().start;
        value = inner?.get_ref().clone();
    }
    Some(start)
}

/// One query of a pair: the unit of work, of writing and of sharding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunItem<'a> {
    /// Its position in the plan.
    pub index: usize,
    /// Its scenes.
    pub pair: &'a ScenePair,
    /// The query frame's name.
    pub query: &'a str,
    /// The query's camera.
    pub camera: QueryCamera,
    /// When the query was taken \[s\].
    pub time_s: Option<f64>,
    /// Its own references, by name.
    pub references: Option<&'a [String]>,
}

impl RunFile {
    /// All items of the run in order, including those of other shards.
    pub fn plan(&self) -> impl Iterator<Item = RunItem<'_>> {
        let queries = self.pairs.iter().flat_map(|pair| {
            let queries = pair.queries.iter().enumerate();
            queries.map(move |(at, query)| (pair, at, query))
        });
        queries.enumerate().map(|(index, (pair, at, query))| RunItem {
            index,
            pair,
            query,
            camera: pair.cameras.get(at).copied().unwrap_or(pair.camera),
            time_s: pair.times_s.get(at).copied(),
            references: pair.references.get(at).map(Vec::as_slice),
        })
    }

    /// The items of this shard.
    pub fn items(&self) -> impl Iterator<Item = RunItem<'_>> {
        self.plan().filter(|item| self.shard.is_none_or(|shard| shard.has(item.index)))
    }

    /// The settings that every query is localised with: by radius, then by number of references.
    pub fn settings(&self) -> Vec<Setting> {
        let most_references = self.protocol.reference_count();
        let counts = match self.protocol.preset {
            Some(Preset::Multi) => 1..=most_references,
            _ => most_references..=most_references,
        };
        let radii = self.protocol.radii_m.iter();
        radii
            .flat_map(|&radius_m| {
                counts.clone().map(move |references| Setting { radius_m, references })
            })
            .collect()
    }

    /// The parameters of the estimators: those of the file override the defaults of this version.
    ///
    /// # Errors
    /// A parameter that this version does not have.
    pub fn params(&self) -> Result<Params, ParamError> {
        self.params.to_string().parse()
    }

    /// The translation error from which the paper counts a pose as a failure \[m\].
    pub fn failure_radius_m(&self) -> f64 {
        let scene = self.pairs.first().map_or("", |pair| pair.scene.as_str());
        self.protocol.failure_radius_m.unwrap_or_else(|| default_failure_radius_m(scene))
    }

    /// The scene of a pair's queries, as an argument.
    pub fn query_argument(&self, pair: &ScenePair) -> Option<&str> {
        match pair.query_index {
            Some(at) => self.protocol.query_scene.get(at).map(String::as_str),
            None => self.scenes.get(pair.scene_index).map(String::as_str),
        }
    }

    /// The description of this run in a folder.
    pub(super) fn located_in(&self, folder: &Path) -> Self {
        let arguments = RefCell::new(BTreeMap::new());
        self.with_arguments(&|argument| {
            if let Some(path) = scene_paths::relative_to(folder, argument) {
                arguments.borrow_mut().insert(argument.to_owned(), path);
            }
            argument.to_owned()
        });
        Self { paths: arguments.into_inner(), ..self.clone() }
    }

    /// The run of a folder with arguments that find its scenes and files from the present working folder.
    pub(super) fn found_from(self, folder: &Path) -> Self {
        self.with_arguments(&|argument| match self.paths.get(argument) {
            Some(path) => scene_paths::found_again(folder, path, argument),
            None => argument.to_owned(),
        })
    }

    /// The run with each path in one spelling: equal runs have equal ones.
    pub(super) fn canonical(&self) -> Self {
        let spelt = |argument: &str| {
            scene_paths::canonical(argument).unwrap_or_else(|| argument.to_owned())
        };
        Self { paths: BTreeMap::new(), ..self.with_arguments(&spelt) }
    }

    /// The run with its scenes, files and folders as this function of their arguments.
    fn with_arguments(&self, change: &dyn Fn(&str) -> String) -> Self {
        let all = |arguments: &[String]| arguments.iter().map(|one| change(one)).collect();
        let path = |path: &PathBuf| scene_paths::of_text(path, change);
        let mut run = self.clone();
        run.scenes = all(&run.scenes);
        let protocol = &mut run.protocol;
        protocol.query_scene = all(&protocol.query_scene);
        protocol.index = protocol.index.iter().map(path).collect();
        protocol.gps = protocol.gps.as_ref().map(path);
        protocol.matches = protocol.matches.as_ref().map(path);
        for file in &mut protocol.estimates {
            file.path = path(&file.path);
        }
        if let Some(SurveyFrom::Folder(folder)) = &mut protocol.survey {
            *folder = path(folder);
        }
        let name = |name: String| match name.strip_prefix(CONTENT_OF) {
            Some(argument) => format!("{CONTENT_OF}{}", change(argument)),
            None => name,
        };
        let inputs = run.inputs.into_iter();
        run.inputs = inputs.map(|(input, sum)| (name(input), sum)).collect();
        run
    }

    /// The run with the numbers of its query scenes, which versions before did not write.
    fn numbered(mut self) -> Self {
        let (scenes, given) = (self.scenes.len(), self.protocol.query_scene.clone());
        let are_all = self.pairs.len() == scenes * given.len();
        for (at, pair) in self.pairs.iter_mut().enumerate() {
            if pair.query_index.is_none() && !given.is_empty() {
                // Every scene of references is paired with every scene of queries, or with those of failed queries.
                let name = pair.query_scene.rsplit('/').next().unwrap_or_default();
                let named =
                    || given.iter().position(|one| one.trim_end_matches('/').ends_with(name));
                pair.query_index =
                    if are_all { Some(at % given.len()) } else { named().or(Some(0)) };
            }
        }
        self
    }

    /// The pair of scenes of a result.
    pub fn pair_of(&self, result: &QueryResult) -> Option<&ScenePair> {
        let queries = result.query_scene.as_ref().unwrap_or(&result.scene);
        let mut pairs = self.pairs.iter();
        pairs.find(|pair| pair.scene == result.scene && pair.query_scene == *queries)
    }

    /// The request of a setting, with its number of the chosen references.
    pub fn request(&self, setting: Setting, chosen: &References) -> Request {
        let count = setting.references.min(chosen.frames.len());
        Request {
            radius_m: setting.radius_m,
            references: References { frames: chosen.frames[..count].to_vec(), ..chosen.clone() },
            fusions: self.protocol.fusions.clone(),
            setting: Some(setting),
        }
    }

    /// The number of results per query.
    pub fn results_per_item(&self) -> usize {
        let protocol = &self.protocol;
        protocol.methods.len() * self.settings().len() * protocol.fusions.len().max(1)
    }

    /// Reads the text of a `run.toml` and checks it.
    pub(super) fn read(text: &str) -> Result<Self, RunFileError> {
        let error_at = |at: usize, message: String| RunFileError {
            line: text[..at.min(text.len())].matches('\n').count() + 1,
            message: message.replace('\n', " ").chars().take(400).collect(),
        };
        let syntax = |error: toml::de::Error| {
            let at = error.span().map_or(0, |span| span.start);
            error_at(at, error.message().to_owned())
        };
        let run: Self = toml::from_str(text).map_err(syntax)?;
        match invalid(&run) {
            Some((keys, message)) => Err(error_at(place(text, &keys).unwrap_or(0), message)),
            None => Ok(run.numbered()),
        }
    }

    /// The description of the same run without shards.
    pub fn whole(&self) -> Self {
        Self { shard: None, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_read_and_share_the_items_out() {
        let shards: Vec<Shard> =
            ["1/3", "2/3", "3/3"].map(|text| text.parse().expect("a shard")).into();
        for item in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.has(item)).count(), 1);
        }
        for wrong in ["0/3", "4/3", "1/0", "1", "a/b", ""] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_run_is_read_as_it_was_written_and_an_unknown_key_is_refused_with_its_line() {
        let run = RunFile {
            schema: RUN_SCHEMA.to_owned(),
            version: "1".to_owned(),
            scenes: vec!["street".to_owned()],
            shard: Some(Shard { number: 2, of: 3 }),
            protocol: Protocol {
                methods: vec![Method::FB, Method::MI],
                radii_m: vec![3.0],
                seed: 7,
                ..Protocol::default()
            },
            inputs: BTreeMap::new(),
            paths: BTreeMap::new(),
            pairs: Vec::new(),
            params: Params::default().to_toml().parse().expect("a table"),
        };
        let text = toml::to_string(&run).expect("TOML");
        assert_eq!(RunFile::read(&text).expect("our own"), run);
        let at = 1 + text.lines().position(|line| line.starts_with("seed = ")).expect("is there");
        let error = RunFile::read(&text.replacen("seed = ", "sed = ", 1)).expect_err("unknown");
        assert_eq!(error.line, at);
        assert!(error.message.contains("`sed`"), "{}", error.message);
    }

    #[test]
    fn query_scenes_of_older_folders_get_their_numbers() {
        let camera = QueryCamera { width: 2, height: 1, fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.0 };
        let pair = |query_scene: &str| ScenePair {
            scene_index: 0,
            query_index: None,
            scene: "map".to_owned(),
            query_scene: query_scene.to_owned(),
            camera,
            cameras: Vec::new(),
            drawn: Vec::new(),
            queries: Vec::new(),
            times_s: Vec::new(),
            references: Vec::new(),
        };
        let numbers = |given: &[&str], pairs: &[&str]| -> Vec<Option<usize>> {
            let run = RunFile {
                schema: RUN_SCHEMA.to_owned(),
                version: "1".to_owned(),
                scenes: vec!["map".to_owned()],
                shard: None,
                protocol: Protocol {
                    query_scene: given.iter().map(|one| (*one).to_owned()).collect(),
                    ..Protocol::default()
                },
                inputs: BTreeMap::new(),
                paths: BTreeMap::new(),
                pairs: pairs.iter().map(|name| pair(name)).collect(),
                params: toml::Table::new(),
            };
            let read = RunFile::read(&toml::to_string(&run).expect("TOML")).expect("our own");
            read.pairs.iter().map(|pair| pair.query_index).collect()
        };
        let given = ["q/00", "street:night", "q/snow/"];
        let all = numbers(&given, &["kitti/00", "street:night", "snow"]);
        assert_eq!(all, [Some(0), Some(1), Some(2)]);
        assert_eq!(numbers(&given, &["snow", "kitti/00"]), [Some(2), Some(0)]);
        assert_eq!(numbers(&[], &["map"]), [None]);
    }
}
