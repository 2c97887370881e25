//! Presets: the paper's experiments, for any scene.

use std::fmt;
use std::str::FromStr;

use serde::Deserialize;

use crate::fusion::Fusion;
use crate::localize::Selection;
use crate::method::Method;
use crate::text::UnknownWord;

/// One of the experiments of the paper's section 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// One random reference within 10, 15, 20 and 25 m (section 4.3, table 3).
    Single,
    /// One to five references, four fusions (section 4.4, table 4).
    Multi,
    /// References from retrieval within a large prior (section 4.5, tables 5 and 6).
    Large,
}

/// The defaults of a preset in its file, which options override.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Defaults {
    pub methods: Vec<Method>,
    pub references: Selection,
    pub fusions: Vec<Fusion>,
    pub radii_m: Vec<f64>,
    /// The share of the frames that are queries.
    pub share: f64,
    /// The prior \[m\] within which references are chosen; `None`: the uncertainty radius.
    pub prior_m: Option<ByDataSet>,
    pub failure_radius_m: ByDataSet,
}

/// A number that depends on the paper's data set.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ByDataSet {
    /// For KITTI, and for any scene of another data set.
    kitti: f64,
    robotcar: f64,
}

impl ByDataSet {
    /// The number for a scene of this name.
    pub fn of_scene(self, name: &str) -> f64 {
        if name.starts_with("robotcar") { self.robotcar } else { self.kitti }
    }
}

impl Preset {
    /// All presets with their names and files.
    const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Single, "single", include_str!("../../assets/presets/single.toml")),
        (Self::Multi, "multi", include_str!("../../assets/presets/multi.toml")),
        (Self::Large, "large", include_str!("../../assets/presets/large.toml")),
    ];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    pub(super) fn defaults(self) -> Defaults {
        let defaults = toml::from_str(Self::ALL[self as usize].2);
        defaults.unwrap_or_else(|error| unreachable!("a test reads the file: {error}"))
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Preset {
    type Err = UnknownWord;

    fn from_str(name: &str) -> Result<Self, UnknownWord> {
        let found = Self::ALL.into_iter().find(|(_, known, _)| *known == name);
        let unknown = || UnknownWord::among(name, "preset", Self::ALL.map(|(_, name, _)| name));
        found.map(|(preset, ..)| preset).ok_or_else(unknown)
    }
}

posescope_core::serde_as_text!(Preset);

/// The translation error from which a pose counts as a failure \[m\], by the references' scene.
pub fn default_failure_radius_m(scene: &str) -> f64 {
    let radius = ByDataSet { kitti: 10.0, robotcar: 20.0 };
    radius.of_scene(scene)
}
