//! Every parameter of every estimator, by group.
//!
//! Each group describes its parameters: name, unit, range and meaning. [`Params::list`],
//! [`Params::set`] and the TOML form follow from that, and so do posescope's command line and window.

use std::str::FromStr;

use crate::cost::CostSettings;
use crate::describe::{Describe, list, set};
use crate::features::SurfParams;
use crate::grid::{GridParams, Reach, SurfaceParams};
use crate::retrieval::{IndexParams, RetrievalParams};
use crate::scale::Scale;
use crate::survey::{FramePairs, Survey, Surveyed};

pub use crate::describe::{About, Described, Domain, ParamError, Value};
pub use crate::estimator::{
    DepthRule, FeatureParams, GuidedParams, HybridParams, MultiStartParams, RobustParams,
};
pub use crate::judge::{Channels, JudgeParams};
pub use crate::render::RenderParams;
pub use crate::search::descent::DescentParams;

/// All parameters of all estimators, by group.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Params {
    /// How large the scene is.
    pub scale: Scale,
    /// What the map shows about confidence; it changes no pose.
    #[doc(hidden)]
    pub survey: Survey,
    /// What is wrong with the map, if anything is known to be: its poses have no confidence then. It changes no pose.
    #[doc(hidden)]
    pub mistake_of_map: Option<String>,
    /// How closely pairs of the map's frames fit each other, where that is known and the map was not surveyed. It changes
    /// no pose.
    #[doc(hidden)]
    pub frame_pairs: Option<FramePairs>,
    /// `surf`: detector and descriptor.
    pub surf: SurfParams,
    /// `fb`: matching, depth lift, consensus, acceptance.
    pub fb: FeatureParams,
    /// `render`: colouring and splatting.
    pub render: RenderParams,
    /// `grid`: the coarse-to-fine search of the direct methods.
    pub grid: GridParams,
    /// `pm`, `mi` and so on: a group for each registered cost.
    #[doc(hidden)]
    pub costs: CostSettings,
    /// `hy`: FB's and MI's poses of several references.
    pub hy: HybridParams,
    /// `descent`: going down by derivatives, where `search` of a cost says so.
    pub descent: DescentParams,
    /// `fb2`: matching twice.
    pub fb2: GuidedParams,
    /// `judge`: the cost by which poses of several methods are compared.
    pub judge: JudgeParams,
    /// `mi6`: the search in six freedoms.
    pub mi6: MultiStartParams,
    /// `robust`: the decision between the poses of several methods.
    pub robust: RobustParams,
    /// `retrieval`: visual words, and the verification of what they find.
    pub retrieval: RetrievalParams,
    /// `index`: what an index is built of.
    pub index: IndexParams,
    /// `surface`: a dense grid of costs.
    pub surface: SurfaceParams,
}

/// The table of the scale in a configuration.
const SCALE: &str = "scale";
/// The table of the survey in a configuration.
const SURVEY: &str = "survey";
/// The table of the map's pairs of frames in a configuration.
const FRAME_PAIRS: &str = "frame_pairs";
/// The key of the map's mistake in a configuration.
const MISTAKE_OF_MAP: &str = "mistake_of_map";

/// Reads a configuration over the defaults, as [`Params::merge_toml`] does.
impl FromStr for Params {
    type Err = ParamError;

    fn from_str(text: &str) -> Result<Self, ParamError> {
        let mut params = Self::default();
        params.merge_toml(text)?;
        Ok(params)
    }
}

impl Params {
    /// The defaults for a scene of this scale: lengths follow it.
    pub fn at_scale(scale: Scale) -> Self {
        let mut params = Self { scale, ..Self::default() };
        if !scale.is_paper() {
            params.visit_groups(|_, group| {
                for field in group.fields() {
                    field.scale(scale);
                }
            });
        }
        params
    }

    /// The defaults at the scale of these parameters.
    pub fn defaults(&self) -> Self {
        Self::at_scale(self.scale)
    }

    /// Calls `visit` with each group and its parameters.
    #[doc(hidden)]
    pub fn visit_groups(&mut self, mut visit: impl FnMut(&'static str, &mut dyn Describe)) {
        visit("surf", &mut self.surf);
        visit("fb", &mut self.fb);
        visit("render", &mut self.render);
        visit("grid", &mut self.grid);
        for (group, params) in self.costs.groups() {
            visit(group, params);
        }
        visit("hy", &mut self.hy);
        visit("descent", &mut self.descent);
        visit("fb2", &mut self.fb2);
        visit("judge", &mut self.judge);
        visit("mi6", &mut self.mi6);
        visit("robust", &mut self.robust);
        visit("retrieval", &mut self.retrieval);
        visit("index", &mut self.index);
        visit("surface", &mut self.surface);
    }

    /// All parameters with their present values.
    pub fn list(&self) -> Vec<Described> {
        let mut rows = Vec::new();
        self.clone().visit_groups(|group, params| {
            rows.extend(
                list(params)
                    .into_iter()
                    .map(|row| Described { key: format!("{group}.{}", row.key), ..row }),
            );
        });
        rows
    }

    /// Sets one parameter from text, as `--set` does: `fb.ratio=0.7`.
    ///
    /// # Errors
    /// [`ParamError`] with what was expected.
    pub fn assign(&mut self, assignment: &str) -> Result<(), ParamError> {
        let Some((key, value)) = assignment.split_once('=') else {
            return Err(ParamError::NotAnAssignment(assignment.to_owned()));
        };
        self.set(key.trim(), value.trim())
    }

    /// Sets the parameter `key` (`group.name`) from text.
    ///
    /// # Errors
    /// [`ParamError`] with what was expected.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), ParamError> {
        let (wanted_group, name) = key.split_once('.').unwrap_or(("", key));
        let mut outcome = None;
        self.visit_groups(|group, params| {
            if group == wanted_group {
                outcome = set(params, name, value);
            }
        });
        match outcome {
            Some(Ok(())) => Ok(()),
            Some(Err(expected)) => Err(ParamError::BadValue {
                key: key.to_owned(),
                expected: expected.to_string(),
                given: value.to_owned(),
            }),
            None => {
                Err(ParamError::Unknown { key: key.to_owned(), nearest: self.nearest_key(key) })
            }
        }
    }

    /// Whether every parameter has a value that it accepts. A field that is written to is not checked before.
    ///
    /// # Errors
    /// [`ParamError::BadValue`] of the first that has none.
    pub fn check(&self) -> Result<(), ParamError> {
        let mut outcome = Ok(());
        self.clone().visit_groups(|group, params| {
            for row in list(params) {
                if outcome.is_ok() && !row.domain.accepts(row.value) {
                    outcome = Err(ParamError::BadValue {
                        key: format!("{group}.{}", row.key),
                        expected: row.domain.to_string(),
                        given: row.value.to_string(),
                    });
                }
            }
        });
        outcome
    }

    /// Sets parameters from a configuration: TOML with one table per group.
    ///
    /// # Errors
    /// [`ParamError`] for the first key that cannot be set.
    pub fn merge_toml(&mut self, text: &str) -> Result<(), ParamError> {
        let table: toml::Table =
            text.parse().map_err(|error: toml::de::Error| ParamError::Syntax(error.to_string()))?;
        for (group, entries) in &table {
            if group == SCALE {
                let scale =
                    entries.clone().try_into().ok().filter(|scale: &Scale| scale.is_sound());
                self.scale = scale.ok_or_else(|| ParamError::BadValue {
                    key: group.clone(),
                    expected: "metre = LENGTH and is_metric = true | false".to_owned(),
                    given: entries.to_string(),
                })?;
                continue;
            }
            if group == SURVEY {
                let survey = entries.clone().try_into().ok().filter(Survey::is_sound);
                self.survey = survey.ok_or_else(|| ParamError::BadValue {
                    key: group.clone(),
                    expected: "a table of shift, slope, position and rotation for each method"
                        .to_owned(),
                    given: entries.to_string(),
                })?;
                continue;
            }
            if group == FRAME_PAIRS {
                let pairs = entries.clone().try_into().ok().filter(FramePairs::is_sound);
                self.frame_pairs = Some(pairs.ok_or_else(|| ParamError::BadValue {
                    key: group.clone(),
                    expected: "a table of pairs, near, position, rotation and reach".to_owned(),
                    given: entries.to_string(),
                })?);
                continue;
            }
            if group == MISTAKE_OF_MAP {
                let mistake = entries.as_str().map(str::to_owned);
                self.mistake_of_map = Some(mistake.ok_or_else(|| ParamError::BadValue {
                    key: group.clone(),
                    expected: "a sentence".to_owned(),
                    given: entries.to_string(),
                })?);
                continue;
            }
            let Some(entries) = entries.as_table() else {
                return Err(ParamError::Syntax(format!(
                    "`{group}` is outside a group; parameters belong to tables such as [fb]"
                )));
            };
            for (name, value) in entries {
                let text = match value {
                    toml::Value::String(text) => text.clone(),
                    other => other.to_string(),
                };
                self.set(&format!("{group}.{name}"), &text)?;
            }
        }
        Ok(())
    }

    /// The configuration that [`Self::merge_toml`] reads back to these parameters.
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        if let Some(mistake) = &self.mistake_of_map {
            text += &format!("{MISTAKE_OF_MAP} = {}\n\n", toml::Value::from(mistake.as_str()));
        }
        if !self.scale.is_paper() {
            let (metre, is_metric) = (self.scale.metre(), self.scale.is_metric());
            text += &format!("[{SCALE}]\nmetre = {metre:?}\nis_metric = {is_metric}\n\n");
        }
        if let Some(FramePairs { pairs, near, position, rotation, reach }) = self.frame_pairs {
            text += &format!(
                "[{FRAME_PAIRS}]\npairs = {pairs}\nnear = {near}\nposition = {position:?}\nrotation = {rotation:?}\n\n"
            );
            let Reach { level, ahead } = reach;
            text += &format!("[{FRAME_PAIRS}.reach]\nlevel = {level:?}\nahead = {ahead:?}\n\n");
        }
        for (method, one) in self.survey.methods() {
            let Surveyed { shift, slope, position, rotation } = one;
            text += &format!(
                "[{SURVEY}.{method}]\nshift = {shift:?}\nslope = {slope:?}\nposition = {position:?}\nrotation = {rotation:?}\n\n"
            );
        }
        let mut group = String::new();
        for row in self.list() {
            let (row_group, name) = row.key.split_once('.').unwrap_or(("", &row.key));
            if row_group != group {
                if !group.is_empty() {
                    text.push('\n');
                }
                text.push_str(&format!("[{row_group}]\n"));
                group = row_group.to_owned();
            }
            let value = match row.value {
                Value::Choice(choice) => format!("{choice:?}"),
                Value::Number(number) => format!("{number:?}"),
                other => other.to_string(),
            };
            text.push_str(&format!("{name} = {value}\n"));
        }
        text
    }

    /// The assignments that turn the defaults at this scale into these parameters.
    pub fn changes(&self) -> Vec<String> {
        let defaults = self.defaults().list();
        self.list()
            .into_iter()
            .zip(defaults)
            .filter(|(row, default)| row.value != default.value)
            .map(|(row, _)| format!("{}={}", row.key, row.value))
            .collect()
    }

    /// The key that shares most letters, in order, with a mistyped one.
    fn nearest_key(&self, key: &str) -> Option<String> {
        let name_of = |key: &str| key.rsplit('.').next().unwrap_or_default().to_owned();
        self.list()
            .into_iter()
            .map(|row| {
                let whole = strsim::jaro_winkler(&row.key, key);
                let name = strsim::jaro_winkler(&name_of(&row.key), &name_of(key));
                (whole.max(name), row.key)
            })
            .filter(|(similarity, _)| *similarity > 0.8)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, key)| key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_can_be_set_to_its_own_value_and_every_key_is_unique() {
        let mut params = Params::default();
        let rows = params.list();
        for row in &rows {
            params.set(&row.key, &row.value.to_string()).unwrap_or_else(|error| panic!("{error}"));
            assert!(!row.about.help().is_empty(), "{} needs a help text", row.key);
        }
        assert_eq!(params, Params::default());
        let mut keys: Vec<_> = rows.iter().map(|row| &row.key).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), rows.len());
    }

    #[test]
    fn a_field_outside_its_range_is_named() {
        assert_eq!(Params::default().check(), Ok(()));
        assert_eq!(Params::at_scale(Scale::of_depth(1.8, true)).check(), Ok(()));
        let checked = |change: fn(&mut Params)| {
            let mut params = Params::default();
            change(&mut params);
            params.check().expect_err("out of range").to_string()
        };
        assert_eq!(checked(|params| params.grid.rounds = 0), "`grid.rounds` takes 1 … 10, not `0`");
        assert_eq!(
            checked(|params| params.render.splat_px = 2),
            "`render.splat_px` takes odd numbers 1 … 15, not `2`"
        );
        assert_eq!(
            checked(|params| params.fb.ratio = f64::NAN),
            "`fb.ratio` takes 0.1 … 1, not `NaN`"
        );
    }

    #[test]
    fn the_written_configuration_reads_back() {
        let mut params = Params::default();
        params.assign("fb.ratio=0.7").expect("a good value");
        params.assign("fb.accept=paper").expect("a good value");
        params.assign("surf.upright = false").expect("a good value");
        params.assign("mi.bins=32").expect("a good value");
        let mut read = Params::default();
        read.merge_toml(&params.to_toml()).expect("own output");
        assert_eq!(read, params);
        assert_eq!(
            params.changes(),
            ["surf.upright=false", "fb.ratio=0.7", "fb.accept=paper", "mi.bins=32"]
        );
    }

    #[test]
    fn lengths_follow_the_scale_and_are_no_change() {
        let room = Params::at_scale(Scale::of_depth(1.8, true));
        assert_eq!((room.grid.coarse_step_m, room.grid.fine_step_m), (0.1, 0.02));
        assert_eq!((room.mi6.deg_per_m, room.grid.yaw_step_deg), (30.0, 1.0));
        assert_eq!(room.changes(), [""; 0]);
        let mut changed = room.clone();
        changed.assign("grid.coarse_step=1").expect("a good value");
        assert_eq!(changed.changes(), ["grid.coarse_step=1"]);
        assert_eq!(changed.to_toml().parse(), Ok(changed));
        for depth in [0.0, 1e9] {
            let extreme = Params::at_scale(Scale::of_depth(depth, false));
            assert_eq!(extreme.to_toml().parse(), Ok(extreme), "{depth}");
        }
        for wrong in ["scale = 1.0", "[scale]\nmetre = -1.0\nis_metric = true"] {
            assert!(wrong.parse::<Params>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_survey_is_read_as_it_was_written_and_is_no_change() {
        let surveyed = Surveyed { shift: -0.25, slope: 0.75, position: 2.0, rotation: 1.5 };
        let survey: Survey = [(crate::method::Method::FB, surveyed)].into_iter().collect();
        let mistake_of_map = Some("a \"mistake\"".to_owned());
        let reach = Reach { level: 0.75, ahead: 0.5 };
        let frame_pairs =
            Some(FramePairs { pairs: 16, near: 12, position: 2.5, rotation: 1.0, reach });
        let room = Params::at_scale(Scale::of_depth(1.8, true));
        let params = Params { survey, mistake_of_map, frame_pairs, ..room };
        assert_eq!(params.changes(), [""; 0]);
        assert_eq!(params.to_toml().parse(), Ok(params));
        // Runs that were begun before searches were looked at have no reach.
        let older = "[frame_pairs]\npairs = 2\nnear = 1\nposition = 1.0\nrotation = 1.0";
        let older: Params = older.parse().expect("it was complete");
        assert_eq!(older.frame_pairs.map(|pairs| pairs.reach), Some(Reach::ALL));
        for wrong in [
            "mistake_of_map = 1.0",
            "frame_pairs = 1.0",
            "[frame_pairs]\npairs = 1\nnear = 2\nposition = 1.0\nrotation = 1.0",
            "[frame_pairs]\npairs = 2\nnear = 1\nposition = 1.0\nrotation = 1.0\nreach = { level = 0.5, ahead = 1.0 }",
            "survey = 1.0",
            "[survey.fb]\nshift = 0.0",
            "[survey.fb]\nshift = 0.0\nslope = 0.0\nposition = 1.0\nrotation = 1.0",
            "[survey.fb]\nshift = nan\nslope = 1.0\nposition = 1.0\nrotation = 1.0",
        ] {
            assert!(wrong.parse::<Params>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_wrong_assignment_says_what_is_expected() {
        let mut params = Params::default();
        let message = |outcome: Result<(), ParamError>| outcome.expect_err("wrong").to_string();
        assert_eq!(message(params.assign("fb.ratio=1.7")), "`fb.ratio` takes 0.1 … 1, not `1.7`");
        assert_eq!(
            message(params.assign("fb.ratoi=0.7")),
            "`fb.ratoi` is not a parameter (did you mean `fb.ratio`?); `posescope params` lists all"
        );
        assert_eq!(
            message(params.assign("fb.accept=never")),
            "`fb.accept` takes consensus | paper, not `never`"
        );
        assert_eq!(
            message(params.assign("fb.ratio")),
            "`fb.ratio` is not an assignment; write for example `fb.ratio=0.7`"
        );
        assert!(message(params.merge_toml("ratio = 1")).contains("outside a group"));
        assert!(message(params.merge_toml("[fb\n")).contains("line 1"));
        assert_eq!(params, Params::default());
    }
}
