//! Builds the remedies of rules: changes of settings, for a method with its parameters.

use serde_json::Value;

use super::Family;
use crate::cost::SearchRule;
use crate::estimator::{FeatureBased, FeatureParams};
use crate::method::Method;
use crate::params::Params;

/// A change of one setting.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// A parameter, as `--set` takes it: `grid.rounds=2`.
    Set(String),
    /// Another uncertainty radius \[m\].
    Radius(f64),
    /// Another method.
    Method(Method),
    /// Another reference, this many places farther than the one used.
    Reference(usize),
    /// Another fusion of the same references, by its name.
    Fusion(&'static str),
    /// So many references of the ranking, in the place of those that were chosen of it.
    Ranked(usize),
}

/// Changes to try together.
pub type Remedy = Vec<Change>;

/// Another method.
pub(super) fn method(name: &'static str) -> Remedy {
    vec![Change::Method(Method::named(name))]
}

/// The method that mends most failures of `studies remedies`, and its search alone.
pub(super) fn many_starts() -> [Remedy; 2] {
    [method("robust"), method("mi6")]
}

/// Other references, the farther one first: it mends more of `studies remedies`.
pub(super) fn other_references() -> [Remedy; 2] {
    [2, 1].map(|farther| vec![Change::Reference(farther)])
}

/// The input of a rule's remedies: a method with its parameters and the radius of its search.
#[derive(Clone, Copy, Debug)]
pub struct Ask<'a> {
    /// The method.
    pub method: Method,
    /// How it finds its pose.
    pub family: Family,
    /// Its parameters.
    pub params: &'a Params,
    /// The uncertainty radius \[m\].
    pub radius_m: f64,
    /// What was found.
    pub evidence: &'a Value,
}

impl Ask<'_> {
    /// A parameter with another number.
    pub(super) fn set(&self, key: &str, value: f64) -> Change {
        Change::Set(format!("{key}={}", rounded(value)))
    }

    /// A parameter with another word.
    pub(super) fn word(&self, key: &str, word: &str) -> Change {
        Change::Set(format!("{key}={word}"))
    }

    /// The first key, or the second for a method with guided matching.
    pub(super) fn key(&self, first: &'static str, guided: &'static str) -> &'static str {
        match self.family {
            Family::Guided => guided,
            _ => first,
        }
    }

    /// Another radius.
    pub(super) fn radius(&self, times: f64) -> Change {
        Change::Radius(rounded(self.radius_m * times))
    }

    /// How far the truth is from the reference \[m\], where a verdict says that this is too far.
    fn too_far_m(&self) -> Option<f64> {
        let metres = |key: &str| self.evidence.get(key).and_then(Value::as_f64);
        // Of a pose that was refused, the distance is not that of the truth.
        if self.evidence.get("error").is_some_and(|error| !error.is_null()) {
            return None;
        }
        let distance_m = metres("distance_m")?;
        let allowed_m = metres("allowed_m").or_else(|| metres("radius_m"))?;
        let farthest_m = self.farthest_m(self.radius_m).max(allowed_m);
        (distance_m > farthest_m).then_some(distance_m)
    }

    /// How far a pose may be from the reference within a radius \[m\].
    fn farthest_m(&self, radius_m: f64) -> f64 {
        radius_m * (1.0 + self.params.fb.radius_slack)
    }

    /// Whether a remedy may bring the truth within reach. Where the truth is too far from the reference, only a greater
    /// radius or another reference does.
    pub(super) fn reaches(&self, remedy: &Remedy) -> bool {
        self.too_far_m().is_none_or(|distance_m| {
            remedy.iter().any(|change| match change {
                Change::Radius(radius_m) => self.farthest_m(*radius_m) >= distance_m,
                Change::Reference(_) | Change::Ranked(_) => true,
                Change::Set(_) | Change::Method(_) | Change::Fusion(_) => false,
            })
        })
    }

    /// A higher or lower floor of coverage.
    pub(super) fn floor(&self, times: f64, least: f64) -> Change {
        let floor = self.params.grid.coverage_floor * times;
        self.set("grid.coverage_floor", floor.max(least).min(1.0))
    }

    /// One more round of a search on a grid.
    pub(super) fn rounds(&self) -> Change {
        Change::Set(format!("grid.rounds={}", (self.params.grid.rounds + 1).min(10)))
    }

    /// The searches of a cost that compare more than one place.
    pub(super) fn other_searches(&self) -> Vec<Remedy> {
        let set = |search: SearchRule| self.word(&format!("{}.search", self.method), search.name());
        [SearchRule::Grid, SearchRule::MultiStart].map(|search| vec![set(search)]).into()
    }

    /// A longer search of the method's kind; `None` for methods without a search.
    pub(super) fn more_search(&self) -> Option<Change> {
        match self.family {
            Family::Grid => Some(self.rounds()),
            Family::MultiStart => {
                let starts = (2 * self.params.mi6.starts).min(200);
                Some(self.set("mi6.starts", starts as f64))
            }
            _ => None,
        }
    }

    /// Coarse positions half as far apart.
    pub(super) fn dense(&self) -> Change {
        self.set("grid.coarse_step", self.params.grid.coarse_step_m / 2.0)
    }

    /// Twice the range of yaw.
    pub(super) fn wide_yaw(&self) -> Change {
        let range = (2.0 * self.params.grid.yaw_range_deg).min(180.0);
        self.set("grid.yaw_range", range)
    }

    /// Larger splats.
    pub(super) fn wider_splat(&self) -> Change {
        Change::Set(format!("render.splat_px={}", self.params.render.splat_px + 2))
    }

    /// A looser or stricter ratio test.
    pub(super) fn ratio(&self, by: f64) -> Change {
        // With guided matching, features need not be as distinct.
        let most = if self.family == Family::Guided { 0.98 } else { 1.0 };
        let ratio = (self.matching().ratio + by).clamp(0.1, most);
        self.set(self.key("fb.ratio", "fb2.ratio"), ratio)
    }

    /// More keypoints, by a lower threshold of the detector.
    pub(super) fn more_keypoints(&self, by: f64) -> Change {
        match self.family {
            Family::Guided => self.set("fb2.contrast", self.params.fb2.sift.contrast * by),
            _ => self.set("surf.threshold", self.params.surf.threshold * by),
        }
    }

    /// How the method matches features.
    pub(super) fn matching(&self) -> FeatureParams {
        FeatureBased::of(self.family, self.params).params
    }
}

/// Rounds to three decimals, and small numbers to three digits, as shown on the command line.
fn rounded(value: f64) -> f64 {
    if value.abs() < 0.1 {
        return format!("{value:.2e}").parse().unwrap_or(value);
    }
    (value * 1000.0).round() / 1000.0
}
