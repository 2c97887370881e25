//! Presets: the paper's experiments as files, for any scene.

use serde::Deserialize;

use super::experiment::Experiment;
use super::limit::Limit;
use super::protocol::Protocol;
use super::reference::Reference;
use crate::fusion::Fusion;
use crate::localize::Selection;
use crate::method::Method;
use crate::text::UnknownWord;

/// The defaults of an experiment, which options override.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Preset {
    /// A short title.
    pub title: String,
    /// The tables of the paper that it reproduces.
    pub tables: Vec<u8>,
    /// The methods.
    pub methods: Vec<Method>,
    /// How references are chosen.
    pub references: Selection,
    /// Numbers of references, each with its own results.
    pub counts: Vec<usize>,
    /// How the poses of several references are fused.
    pub fusions: Vec<Fusion>,
    /// Uncertainty radii \[m\], each with its own results.
    pub radii_m: Vec<f64>,
    /// Share of the frames that are queries.
    pub share: f64,
    /// The prior \[m\] within which references are chosen; `None`: the uncertainty radius.
    pub prior_m: Option<ByDataSet>,
    /// The translation error from which a pose counts as a failure \[m\].
    pub failure_radius_m: ByDataSet,
}

/// A number that depends on the paper's data set.
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
        if name.starts_with("robotcar") {
            self.robotcar
        } else {
            self.kitti
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

/// The protocol of a preset, or without one of every frame against one random reference. `scene` is the name of
/// the references' scene: the paper uses other numbers for RobotCar than for KITTI.
///
/// # Errors
/// A preset that cannot be read; a test reads them all.
pub fn defaults(experiment: Option<Experiment>, scene: &str) -> Result<Protocol, UnknownWord> {
    let Some(experiment) = experiment else {
        return Ok(Protocol {
            failure_radius_m: Some(default_failure_radius_m(scene)),
            ..Protocol::default()
        });
    };
    let preset = Preset::named(experiment.name())?;
    Ok(Protocol {
        preset: Some(experiment),
        methods: preset.methods,
        references: vec![Reference::Chosen(preset.references)],
        fusions: preset.fusions,
        radii_m: preset.radii_m,
        limit: Some(Limit::Percent(100.0 * preset.share)),
        prior_m: preset.prior_m.map(|prior| prior.of_scene(scene)),
        failure_radius_m: Some(preset.failure_radius_m.of_scene(scene)),
        ..Protocol::default()
    })
}

/// The translation error from which a pose counts as a failure \[m\], by the references' scene.
pub fn default_failure_radius_m(scene: &str) -> f64 {
    let radius = ByDataSet {
        kitti: 10.0,
        robotcar: 20.0,
    };
    radius.of_scene(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_ask_what_the_experiments_of_the_paper_do() {
        let of = |name: &str, scene: &str| {
            let experiment: Experiment = name.parse().expect("an experiment");
            defaults(Some(experiment), scene).expect("a preset")
        };
        let single = of("single", "kitti/00");
        assert_eq!(single.radii_m, [10.0, 15.0, 20.0, 25.0]);
        assert_eq!(single.methods, [Method::FB, Method::PM, Method::MI]);
        assert_eq!(single.limit, Some(Limit::Percent(10.0)));
        let multi = of("multi", "kitti/00");
        let five = Reference::Chosen(Selection::Random(5));
        assert_eq!(multi.references, [five]);
        assert_eq!(multi.fusions, Fusion::of_the_paper().collect::<Vec<_>>());
        let large = |scene| {
            let large = of("large", scene);
            (large.prior_m, large.failure_radius_m)
        };
        assert_eq!(large("kitti/00"), (Some(200.0), Some(10.0)));
        assert_eq!(large("robotcar/a"), (Some(50.0), Some(20.0)));
        for experiment in Experiment::ALL {
            let preset = Preset::named(experiment.name()).expect("a preset");
            let most = preset.counts.last().copied();
            assert_eq!(most, Some(preset.references.count()), "{experiment}");
        }
        assert!(Preset::named("small").is_err());
    }
}
