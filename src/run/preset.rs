//! Presets: the paper's experiments as files, for any scene.

use serde::Deserialize;

use crate::fusion::Fusion;
use crate::localize::Selection;
use crate::method::Method;
use crate::text::UnknownWord;

/// What an experiment asks where the user says nothing else.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Preset {
    /// What it is about, in a few words.
    pub title: String,
    /// The tables of the paper that it fills.
    pub tables: Vec<u8>,
    /// The methods.
    pub methods: Vec<Method>,
    /// How references are chosen.
    pub references: Selection,
    /// Numbers of references; each gives results.
    pub counts: Vec<usize>,
    /// How the poses of several references are fused.
    pub fusions: Vec<Fusion>,
    /// Uncertainty radii \[m\]; each gives results.
    pub radii_m: Vec<f64>,
    /// Share of the frames that are queries.
    pub share: f64,
    /// How far around the known position references are chosen \[m\]; `None` within the uncertainty radius.
    pub prior_m: Option<ByDataSet>,
    /// The translation error from which on a pose counts as a failure \[m\].
    pub failure_radius_m: ByDataSet,
}

/// A number that the paper chose for each of its data sets.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ByDataSet {
    /// For KITTI, and for any scene of another data set.
    pub kitti: f64,
    /// For RobotCar.
    pub robotcar: f64,
}

impl ByDataSet {
    /// The number for a scene of this name.
    pub fn of_scene(self, name: &str) -> f64 {
        match name.starts_with("robotcar") {
            true => self.robotcar,
            false => self.kitti,
        }
    }
}

impl Preset {
    /// Every preset: its name and its file.
    pub const ALL: [(&'static str, &'static str); 3] = [
        ("single", include_str!("../../assets/presets/single.toml")),
        ("multi", include_str!("../../assets/presets/multi.toml")),
        ("large", include_str!("../../assets/presets/large.toml")),
    ];

    /// The preset of a name.
    ///
    /// # Errors
    /// The names of all presets.
    pub fn named(name: &str) -> Result<Self, UnknownWord> {
        let unknown = || UnknownWord::among(name, "preset", Self::ALL.map(|(name, _)| name));
        let file = Self::ALL.iter().find(|(known, _)| *known == name);
        let (_, file) = file.ok_or_else(unknown)?;
        // A test reads the files.
        toml::from_str(file).map_err(|_| unknown())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Experiment, PaperProtocol, defaults};
    use super::*;

    #[test]
    fn presets_ask_what_the_experiments_of_the_paper_do() {
        for experiment in Experiment::ALL {
            let preset = Preset::named(experiment.name()).expect("a preset");
            let defaults = defaults(Some(experiment));
            let protocol = defaults.protocol;
            assert_eq!(preset.methods, protocol.methods, "{experiment}");
            assert_eq!(preset.references, protocol.references, "{experiment}");
            assert_eq!(preset.fusions, protocol.fusions, "{experiment}");
            assert_eq!(preset.radii_m, defaults.radii_m, "{experiment}");
            assert_eq!(preset.share, defaults.share, "{experiment}");
            let most = preset.counts.last().copied();
            assert_eq!(most, Some(preset.references.count()), "{experiment}");
            let by_scene = |of: fn(PaperProtocol) -> f64| ByDataSet {
                kitti: of(PaperProtocol::Kitti),
                robotcar: of(PaperProtocol::RobotCar),
            };
            let failure_radius_m = by_scene(PaperProtocol::failure_radius_m);
            assert_eq!(preset.failure_radius_m, failure_radius_m);
            let prior_m =
                (experiment == Experiment::Large).then(|| by_scene(PaperProtocol::prior_m));
            assert_eq!(preset.prior_m, prior_m, "{experiment}");
        }
        assert!(Preset::named("small").is_err());
    }
}
