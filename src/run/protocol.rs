//! How queries are localised.

mod applied;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::estimates_file::EstimatesFile;
use super::limit::Limit;
use super::preset::{Preset, default_failure_radius_m};
use super::reference::Reference;
use super::survey_file::SurveyFrom;
use crate::diagnosis::Tolerance;
use crate::estimator;
use crate::fusion::Fusion;
use crate::image::Degradation;
use crate::localize::Selection;
use crate::method::Method;
use crate::scene::SceneSize;
use crate::text::UnknownWord;

/// How each query is localised. This one struct defines the options of the command line, the table
/// `[protocol]` of `run.toml`, the header of a lesson and the requests of the window. Its keys in files are the
/// names of the options, and its doc comments are their help.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Protocol {
    /// Take the queries from another scene with the same world frame
    ///
    /// `eval` takes several; it pairs every scene of references with every scene of queries.
    #[cfg_attr(feature = "cli", arg(long, help_heading = "Queries", value_name = "SCENE"))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub query_scene: Vec<String>,
    /// Rough positions of the queries
    ///
    /// A table with the columns `name x y z` in the scene's world frame, or `name latitude longitude`. The latter
    /// must also list at least three frames with a known pose.
    #[cfg_attr(
        feature = "cli",
        arg(long, help_heading = "Queries", value_name = "FILE", hide_short_help = true)
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gps: Option<PathBuf>,
    /// Draw this many queries, or this share of the frames
    ///
    /// --seed determines the draw. Frames drawn by a percentage are not used as references; frames drawn by a
    /// number may be.
    #[cfg_attr(feature = "cli", arg(long, help_heading = "Queries", value_name = "40|10%"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<Limit>,
    /// Degrade the query photos first, for example gamma=0.4,noise=8,invert; --help lists the steps
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            help_heading = "Queries",
            value_name = "STEP=STRENGTH,…",
            required = false,
            hide_short_help = true,
            long_help = crate::run::degradations()
        )
    )]
    #[serde(skip_serializing_if = "is_default")]
    pub degrade: Degradation,
    /// A frame, or random:K, nearest:K, matches:K, retrieve:K [default: random:1]
    ///
    /// A frame needs a known pose and a cloud; repeatable. The other forms choose K frames near the query's known
    /// position: at random, the nearest, those with the most feature matches, or the best of the retrieval index.
    /// If the position is unknown, matches:K and retrieve:K search all frames. The default for photos without
    /// --gps is matches:1.
    #[cfg_attr(
        feature = "cli",
        arg(long = "reference", help_heading = "References", value_name = "FRAME|HOW:K")
    )]
    #[serde(rename = "reference")]
    pub references: Vec<Reference>,
    /// The uncertainty radius: how far from the reference to search, in metres [default: 15]
    ///
    /// The direct methods search a disc around the reference that is twice as wide as this. Their time grows with
    /// the square of the radius: 30 takes four times as long as 15. References are chosen within the same distance
    /// of the query, unless --prior is given. `eval` takes several radii and runs each.
    #[cfg_attr(
        feature = "cli",
        arg(
            long = "radius",
            help_heading = "References",
            value_name = "METRES",
            value_delimiter = ',',
            allow_negative_numbers = true,
            value_parser = crate::run::positive
        )
    )]
    #[serde(rename = "radius")]
    pub radii_m: Vec<f64>,
    /// Choose references within this distance of the query, in metres [default: the radius]
    #[cfg_attr(
        feature = "cli",
        arg(
            long = "prior",
            help_heading = "References",
            value_name = "METRES",
            allow_negative_numbers = true,
            value_parser = crate::run::positive
        )
    )]
    #[serde(rename = "prior", skip_serializing_if = "Option::is_none")]
    pub prior_m: Option<f64>,
    /// The retrieval index for retrieve:K [default: the file that `posescope index` writes]
    ///
    /// `eval` takes one per scene, in the same order.
    #[cfg_attr(
        feature = "cli",
        arg(long, help_heading = "References", value_name = "FILE", hide_short_help = true)
    )]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub index: Vec<PathBuf>,
    // Parsed before the methods, which may use its names.
    /// Evaluate the poses of another system as a method of this name; repeatable
    ///
    /// FILE is in TUM or KITTI format, COLMAP's images.txt, or lines of `name qw qx qy qz x y z`. The name `truth` puts its
    /// poses in the place of the queries' true ones.
    #[cfg_attr(
        feature = "cli",
        arg(long, help_heading = "Methods", value_name = "NAME=FILE", hide_short_help = true)
    )]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub estimates: Vec<EstimatesFile>,
    /// The methods.
    #[cfg_attr(
        feature = "cli",
        arg(
            long = "method",
            help = about_methods(),
            help_heading = "Methods",
            value_name = "fb,pm,mi,hy",
            value_delimiter = ',',
            value_parser = crate::run::method
        )
    )]
    #[serde(rename = "method")]
    pub methods: Vec<Method>,
    /// Fuse several references to one pose: maxf, avg, wavg, r-wavg or joint
    ///
    /// joint uses all references in one estimate, where the method can; the others combine the poses of the single
    /// references. Without this option, each reference gives its own pose; `eval` fuses several by r-wavg.
    #[cfg_attr(
        feature = "cli",
        arg(long = "fusion", help_heading = "Methods", value_name = "HOW", value_delimiter = ',')
    )]
    #[serde(rename = "fusion", skip_serializing_if = "Vec::is_empty")]
    pub fusions: Vec<Fusion>,
    /// Use the matches of another system instead of those of fb
    ///
    /// DIR holds hloc's features and matches (.h5), or QUERY_REFERENCE_matches.npz or .txt for each pair.
    #[cfg_attr(
        feature = "cli",
        arg(long, help_heading = "Methods", value_name = "DIR", hide_short_help = true)
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub matches: Option<PathBuf>,
    /// Use the options of an experiment of the paper: single, multi or large
    ///
    /// single: one random reference within 10, 15, 20 and 25 m. multi: 1 to 5 references and all fusions. large:
    /// retrieve:5 within a prior of 200 m (RobotCar 50 m). All draw a tenth of the frames as queries. Other options
    /// override the preset.
    #[cfg_attr(
        feature = "cli",
        arg(long = "preset", help_heading = "Methods", value_name = "NAME")
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<Preset>,
    /// The seed of every random choice [default: 0]
    #[cfg_attr(
        feature = "cli",
        arg(long, help_heading = "Methods", value_name = "N", required = false)
    )]
    pub seed: u64,
    /// The largest error of a right pose [default: 1m,5deg]
    #[cfg_attr(
        feature = "cli",
        arg(long, help_heading = "Judging", value_name = "METRES,DEGREES", required = false)
    )]
    #[serde(skip_serializing_if = "is_default")]
    pub right: Tolerance,
    /// The error in metres from which the paper counts a failure [default: 10, RobotCar 20]
    #[cfg_attr(
        feature = "cli",
        arg(
            long = "failure-radius",
            help_heading = "Judging",
            value_name = "METRES",
            allow_negative_numbers = true,
            value_parser = crate::run::positive,
            hide_short_help = true
        )
    )]
    #[serde(rename = "failure-radius", skip_serializing_if = "Option::is_none")]
    pub failure_radius_m: Option<f64>,
    /// Refuse poses with a lower probability than this
    ///
    /// It is the probability of being right.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            help_heading = "Judging",
            value_name = "PROBABILITY",
            allow_negative_numbers = true,
            value_parser = crate::run::probability
        )
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_confidence: Option<f64>,
    /// The survey that confidence follows, or none [default: the last of this map]
    ///
    /// DIR is a folder that `posescope survey` has written. `none` leaves confidence as it was fitted on generated
    /// towns.
    #[cfg_attr(
        feature = "cli",
        arg(long, help_heading = "Judging", value_name = "DIR|none", hide_short_help = true)
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub survey: Option<SurveyFrom>,
    /// Try variations of each wrong result and report what helps
    ///
    /// At most RUNS variations per result, 12 if RUNS is left out.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            help_heading = "Judging",
            value_name = "RUNS",
            required = false,
            num_args = 0..=1,
            default_missing_value = "12"
        )
    )]
    #[serde(skip_serializing_if = "is_default")]
    pub explain: usize,
    /// The format of the scenes [default: detected]
    #[cfg_attr(
        feature = "cli",
        arg(long, help_heading = "Everywhere", value_name = "NAME", hide_short_help = true)
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
}

/// Whether a field can be left out of a file.
pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// One random reference, the methods of the paper.
impl Default for Protocol {
    fn default() -> Self {
        Self {
            query_scene: Vec::new(),
            gps: None,
            limit: None,
            degrade: Degradation::default(),
            references: vec![Reference::Chosen(Selection::Random(1))],
            radii_m: vec![Self::RADIUS_M],
            prior_m: None,
            index: Vec::new(),
            estimates: Vec::new(),
            methods: Method::PAPER.to_vec(),
            fusions: Vec::new(),
            matches: None,
            preset: None,
            seed: 0,
            right: Tolerance::default(),
            failure_radius_m: None,
            min_confidence: None,
            survey: None,
            explain: 0,
            format: None,
        }
    }
}

/// Options that take one list, `fb,pm`; others are repeated.
const LISTS: [&str; 3] = ["method", "fusion", "radius"];

/// Why a protocol is invalid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProtocolError {
    /// An option that does not exist, or another value than it takes.
    #[error("{0}")]
    Option(String),
    /// A method that is neither built in nor defined by `--estimates`.
    #[error("{0}, or a name defined by --estimates")]
    UnknownMethod(UnknownWord),
    /// Two files of poses with the same name.
    #[error("--estimates {0} is given twice; give each file its own name")]
    Twice(Method),
    /// Both frames and a way of choosing them.
    #[error(
        "--reference takes either frames, or one of random:K, nearest:K, matches:K and retrieve:K"
    )]
    References,
}

/// The help of `--method`, which names the methods that are not from the paper.
#[cfg(feature = "cli")]
fn about_methods() -> String {
    let others = estimator::methods().filter(|method| !Method::PAPER.contains(method));
    let others: Vec<&str> = others.map(Method::name).collect();
    let (last, first) = others.split_last().map_or(("", &[][..]), |(last, first)| (*last, first));
    format!(
        "The methods; {} and {last} are not from the paper [default: fb,pm,mi,hy]",
        first.join(", ")
    )
}

impl Protocol {
    /// Variations of a wrong result by default.
    pub const EXPLAINING_RUNS: usize = 12;

    /// The default uncertainty radius \[m\].
    pub const RADIUS_M: f64 = 15.0;

    /// The protocol with its methods in the order of the registry, followed by the other systems.
    ///
    /// # Errors
    /// [`ProtocolError`].
    pub fn checked(mut self) -> Result<Self, ProtocolError> {
        let others: Vec<Method> = self.estimates.iter().map(|file| file.method).collect();
        known(&self.methods, &others)?;
        if let Some(twice) = (1..others.len()).find(|&at| others[..at].contains(&others[at])) {
            return Err(ProtocolError::Twice(others[twice]));
        }
        let is_frame = |one: &Reference| matches!(one, Reference::Frame(_));
        if self.references.len() > 1 && !self.references.iter().all(is_frame) {
            return Err(ProtocolError::References);
        }
        let lengths = self.radii_m.iter().chain(&self.prior_m).chain(&self.failure_radius_m);
        if let Some(length) = lengths.copied().find(|length| !(*length > 0.0 && length.is_finite()))
        {
            return Err(ProtocolError::Option(format!("{length}: a length above 0 expected")));
        }
        if let Some(probability) = self.min_confidence.filter(|p| !(*p > 0.0 && *p <= 1.0)) {
            let expected = "a probability above 0 and up to 1 expected";
            return Err(ProtocolError::Option(format!("{probability}: {expected}")));
        }
        let ours = estimator::methods().filter(|method| self.methods.contains(method));
        self.methods = ours.chain(others).collect();
        Ok(self)
    }

    /// These defaults for a scene of this size.
    #[must_use]
    pub fn at_size(self, size: &SceneSize) -> Self {
        let length = |paper_m| size.scale.length(paper_m);
        let radii_m = match self.preset {
            Some(_) => self.radii_m.iter().copied().map(length).collect(),
            None => vec![size.radius_m()],
        };
        let right = Tolerance { translation_m: length(self.right.translation_m), ..self.right };
        Self {
            radii_m,
            prior_m: self.prior_m.map(length),
            failure_radius_m: self.failure_radius_m.map(length),
            right,
            ..self
        }
    }

    /// The first uncertainty radius \[m\].
    pub fn radius_m(&self) -> f64 {
        self.radii_m.first().copied().unwrap_or(Self::RADIUS_M)
    }

    /// How references are chosen; one at random if they are named.
    pub fn selection(&self) -> Selection {
        let chosen = self.references.iter().find_map(|one| match one {
            Reference::Chosen(selection) => Some(*selection),
            Reference::Frame(_) => None,
        });
        chosen.unwrap_or(Selection::Random(1))
    }

    /// How many references each query gets at most.
    pub fn reference_count(&self) -> usize {
        let named = self.named_references().count();
        if named > 0 { named } else { self.selection().count() }
    }

    /// Chooses the references of each query.
    pub fn select(&mut self, selection: Selection) {
        self.references = vec![Reference::Chosen(selection)];
    }

    /// Whether references are named, not chosen.
    pub fn is_by_hand(&self) -> bool {
        let mut references = self.references.iter();
        references.all(|one| matches!(one, Reference::Frame(_)))
    }

    /// The frames that are named as references.
    pub fn named_references(&self) -> impl Iterator<Item = &str> {
        self.references.iter().filter_map(|one| match one {
            Reference::Frame(name) => Some(name.as_str()),
            Reference::Chosen(_) => None,
        })
    }

    /// Names the references of each query.
    pub fn name_references(&mut self, frames: &[String]) {
        self.references = frames.iter().cloned().map(Reference::Frame).collect();
    }

    /// The options that differ from the defaults, each with its value.
    pub fn options(&self) -> Vec<(String, String)> {
        let (own, default) = (table(self), table(&Self::default()));
        let changed = own.into_iter().filter(|(key, value)| default.get(key) != Some(value));
        changed
            .flat_map(|(key, value)| {
                let values = match value {
                    toml::Value::Array(values) if LISTS.contains(&key.as_str()) => {
                        let words: Vec<String> = values.into_iter().map(word).collect();
                        vec![words.join(",")]
                    }
                    toml::Value::Array(values) => values.into_iter().map(word).collect(),
                    other => vec![word(other)],
                };
                values.into_iter().map(move |value| (key.clone(), value))
            })
            .collect()
    }
}

/// The protocol of a preset, or without one of every frame against one random reference. `scene` is the name of
/// the references' scene: the paper uses other numbers for RobotCar than for KITTI.
pub fn defaults(preset: Option<Preset>, scene: &str) -> Protocol {
    let Some(defaults) = preset.map(Preset::defaults) else {
        return Protocol {
            failure_radius_m: Some(default_failure_radius_m(scene)),
            ..Protocol::default()
        };
    };
    Protocol {
        preset,
        methods: defaults.methods,
        references: vec![Reference::Chosen(defaults.references)],
        fusions: defaults.fusions,
        radii_m: defaults.radii_m,
        limit: Some(Limit::Percent(100.0 * defaults.share)),
        prior_m: defaults.prior_m.map(|prior| prior.of_scene(scene)),
        failure_radius_m: Some(defaults.failure_radius_m.of_scene(scene)),
        ..Protocol::default()
    }
}

/// Checks that every method is built in or one of `others`.
///
/// # Errors
/// [`ProtocolError::UnknownMethod`].
pub fn known(methods: &[Method], others: &[Method]) -> Result<(), ProtocolError> {
    let mut methods = methods.iter();
    let unknown =
        methods.find(|method| estimator::find(**method).is_none() && !others.contains(method));
    match unknown {
        Some(method) => Err(ProtocolError::UnknownMethod(UnknownWord::among(
            method.name(),
            "method",
            estimator::methods().map(Method::name),
        ))),
        None => Ok(()),
    }
}

/// The protocol as written in a file.
fn table(protocol: &Protocol) -> toml::Table {
    let written = toml::Table::try_from(protocol);
    written.unwrap_or_else(|error| unreachable!("every field has a form in TOML: {error}"))
}

/// A value as written on a command line.
fn word(value: toml::Value) -> String {
    match value {
        toml::Value::String(text) => text,
        toml::Value::Float(number) => number.to_string(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests;
