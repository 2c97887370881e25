//! How likely an accepted pose is right, and how far it may be off, without knowing the truth.
//!
//! The evidence of an estimator shows how far its pose stands out from chance. For feature-based methods these are
//! the inliers beyond chance, how well they determine the pose, and whether the photos agree better there than
//! elsewhere. For a grid search it is the depth of the minimum compared with other hypotheses, the runner-up and
//! shuffled pixels. For a multi-start search it is how many of them end there, whether features agree, how many
//! matches the pose explains, and whether the photos agree better there than elsewhere. Whether both photos were taken in
//! the same light says how much of that to expect. A logistic function of these signals is the probability of being
//! [near](NEAR). How far a pose that is near is off follows from the inliers or
//! the edges that fix it, scaled by another function of the same signals. Both together say how likely the pose is
//! right, whatever error still counts as right. What is fitted was fitted on generated towns with default parameters,
//! and evaluated on others (numbers in `studies/README.md`). Lengths are in units of the scene's scale.

mod appearance;
mod coefficients;
mod edges;
mod explained;
mod inliers;
mod light;
mod lowered;
mod minimum;
mod settled;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use coefficients::{Fitted, fit, fitted, units};
pub use lowered::Lowered;

use super::numbers::with_digits;
use super::{Family, Subject, Tolerance};
use crate::covariance::PoseCovariance;
use crate::estimator::{self, CostSummary, Failure, Outcome};
use crate::grid::ScoredLattice;
use crate::method::Method;
use crate::params::Params;
use crate::stats::median_and_deviation;
use crate::survey::Surveyed;
use crate::text::words;
use appearance::Look;

/// A pose that is this near to the truth was found, however well, at the scale of the paper.
pub const NEAR: Tolerance = Tolerance { translation_m: 1.0, rotation_deg: 5.0 };

/// The least probability of a trusted pose.
pub const TRUSTED_FROM: f64 = 0.95;

/// Below this probability, confidence is low: the pose is more likely wrong than right.
pub const LOW_BELOW: f64 = 0.5;

/// How likely a pose is right, as a word; from the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Confidence {
    /// At least [`TRUSTED_FROM`].
    Trusted,
    /// Neither trusted nor low.
    Unsure,
    /// Below [`LOW_BELOW`].
    Low,
}

impl Confidence {
    /// That of a probability.
    pub fn of(probability: f64) -> Self {
        match probability {
            p if p >= TRUSTED_FROM => Self::Trusted,
            p if p >= LOW_BELOW => Self::Unsure,
            _ => Self::Low,
        }
    }

    /// The glyph, the same everywhere.
    pub fn glyph(self) -> &'static str {
        match self {
            Self::Trusted => "◇",
            Self::Unsure => "◈",
            Self::Low => "◆",
        }
    }
}

words!(Confidence, "confidence": Trusted = "trusted", Unsure = "unsure", Low = "low");

/// What the probability of a pose was fitted on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Calibration {
    /// Generated towns.
    #[default]
    #[serde(alias = "street")]
    Generated,
    /// Generated towns, and then a survey of the map.
    Map,
    /// Generated towns, and then how closely pairs of the map's frames fit each other.
    FramePairs,
}

/// A distance and an angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Within {
    /// Distance \[m, or the unit of the scene\].
    pub m: f64,
    /// Angle \[°\].
    pub deg: f64,
}

/// As people read it.
impl fmt::Display for Within {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} m and {}°", with_digits(self.m, 2), with_digits(self.deg, 2))
    }
}

impl From<Tolerance> for Within {
    fn from(tolerance: Tolerance) -> Self {
        Self { m: tolerance.translation_m, deg: tolerance.rotation_deg }
    }
}

impl Default for Within {
    fn default() -> Self {
        NEAR.into()
    }
}

/// How likely a pose is right, and how far it may be off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseConfidence {
    /// Probability of being right, from this method alone.
    pub probability: f64,
    /// The same in one word.
    pub word: Confidence,
    /// What still counts as right.
    #[serde(default)]
    pub within: Within,
    /// What the probability was fitted on.
    pub calibrated_on: Calibration,
    /// Why it is lower than the method's evidence says.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lowered_by: Vec<Lowered>,
    /// How far 95 % of the poses like this one are off at most, of those that are right.
    #[serde(default)]
    pub within_95: Option<Within>,
    /// The covariance of the pose, if it is right.
    #[serde(default)]
    pub covariance: Option<PoseCovariance>,
    /// Standard deviation of the camera centre along its own axes, right, down, forward \[m\].
    pub position_std_m: Option<[f64; 3]>,
    /// Standard deviation of the rotation about the same axes \[°\].
    pub rotation_std_deg: Option<[f64; 3]>,
    /// Root mean square distance of the inliers from their centre, as a share of the image's diagonal;
    /// of methods that have inliers.
    pub inlier_spread: Option<f64>,
    /// How much deeper the minimum is than the runner-up, in robust standard deviations of the coarse
    /// costs; of methods that search a cost, where there is a runner-up.
    pub runner_up_margin: Option<f64>,
    /// What chance alone would give: the cost of shuffled pixels for a method that searches a cost;
    /// for methods of features the decimal logarithm of the number of false alarms.
    pub chance_level: Option<f64>,
}

/// A probability as people read it. Rounded down, so that a limit that was missed never reads as reached.
pub fn percent(probability: f64) -> String {
    match (100.0 * probability).floor() {
        0.0 => "under 1 %".to_owned(),
        percent => format!("{percent:.0} %"),
    }
}

/// What a probability is made of: names and finite values, in one order for all results of one family.
pub type Signals = Vec<(&'static str, f64)>;

impl PoseConfidence {
    /// A probability alone.
    pub fn new(probability: f64, within: Within) -> Self {
        Self {
            probability,
            word: Confidence::of(probability),
            within,
            calibrated_on: Calibration::Generated,
            lowered_by: Vec::new(),
            within_95: None,
            covariance: None,
            position_std_m: None,
            rotation_std_deg: None,
            inlier_spread: None,
            runner_up_margin: None,
            chance_level: None,
        }
    }

    /// How far such poses are off, as people read it; lengths in metres. `None` where that tells nothing.
    pub fn interval(&self) -> Option<String> {
        /// A pose that may be so many times as far off as a right one has no place.
        const TELLING: f64 = 10.0;
        let known = self.within_95.filter(|known| known.m <= TELLING * self.within.m)?;
        Some(format!("95 % of such poses within {known}"))
    }

    /// Why a pose is less likely right than it seems, as people read it; lengths in metres.
    pub fn because(&self) -> Option<String> {
        let why: Vec<String> = self.lowered_by.iter().map(ToString::to_string).collect();
        (!why.is_empty()).then(|| why.join(", and "))
    }

    /// The probability as people read it, with the glyph of a low one before it.
    pub fn likely(&self) -> String {
        let percent = percent(self.probability);
        match self.word {
            Confidence::Low => format!("{} {percent}", Confidence::Low.glyph()),
            _ => percent,
        }
    }
}

/// What a method leaves behind that speaks for its pose or against it.
#[derive(Clone, Debug)]
pub struct Evidenced {
    /// What a probability is made of.
    pub signals: Signals,
    /// The covariance of the pose by what fixes it alone; `None` where nothing does.
    pub alone: Option<PoseCovariance>,
    inlier_spread: Option<f64>,
    runner_up_margin: Option<f64>,
    chance_level: Option<f64>,
}

/// How far a pose can be trusted, whatever counts as right.
#[derive(Clone, Debug)]
pub(super) struct Trust {
    evidenced: Evidenced,
    /// The probability of being [`NEAR`].
    near: f64,
    /// That of poses that are near, and how many times farther than those of a normal distribution 95 % of the
    /// errors go.
    spread: Option<(PoseCovariance, f64)>,
    /// What near is at the scale of the scene.
    is_near: Tolerance,
    calibrated_on: Calibration,
    lowered_by: Vec<Lowered>,
    elsewhere: Option<f64>,
}

impl Trust {
    /// That of a subject's pose; `None` without a pose, for a method for which nothing was fitted, and, unless the map was
    /// surveyed, for a map that has a mistake, and for one of another scale than those that it was fitted on if it is not
    /// known how closely its frames fit each other: there, poses that are wrong would be trusted.
    pub(super) fn of(subject: &Subject<'_>) -> Option<Self> {
        let method = responsible(subject.method, subject.outcome);
        let (scale, survey) = (subject.params.scale, subject.params.survey.of(method));
        let pairs = subject.params.frame_pairs.filter(|_| survey.is_none());
        let is_known = scale.is_paper() || pairs.is_some();
        if survey.is_none() && (subject.params.mistake_of_map.is_some() || !is_known) {
            return None;
        }
        let evidenced = evidenced(subject)?;
        let fitted = fitted(method)?;
        let surveyed = survey.copied().unwrap_or(Surveyed::UNCHANGED);
        let values: Vec<f64> = evidenced.signals.iter().map(|(_, value)| *value).collect();
        let spread = evidenced.alone.map(|alone| {
            let spread = surveyed.covariance(&fitted.covariance(&alone, &values, scale));
            (pairs.map_or(spread, |pairs| pairs.covariance(&spread)), fitted.tail)
        });
        let calibrated_on = match pairs {
            Some(_) => Calibration::FramePairs,
            None if surveyed != Surveyed::UNCHANGED => Calibration::Map,
            None => Calibration::Generated,
        };
        let shown = fitted.shown(&values);
        let mut lowered_by = Vec::new();
        let mut lower = |probability: f64, why: Option<Lowered>| {
            let lowered = why.as_ref().map_or(probability, |why| why.applied(probability));
            lowered_by.extend(why.filter(|_| lowered < probability));
            lowered
        };
        let near = lower(fitted.probability(&values), lowered::by_radius(subject, fitted));
        let near = surveyed.probability(near);
        let near = pairs.map_or(near, |pairs| pairs.probability(near, scale));
        let near = lower(near, pairs.and_then(|pairs| lowered::by_freedoms(subject, &pairs.reach)));
        let near = lower(near, lowered::by_camera(subject));
        Some(Self {
            elsewhere: Some(shown).filter(|shown| *shown < fitted.shown_from),
            near,
            spread,
            is_near: NEAR.at(scale),
            evidenced,
            calibrated_on,
            lowered_by,
        })
    }

    /// The confidence that a pose is right, where a pose within this tolerance is.
    pub(super) fn confidence(&self, right: Tolerance) -> PoseConfidence {
        let Evidenced { inlier_spread, runner_up_margin, chance_level, .. } = self.evidenced;
        let probability = self.near * self.share_of_near(right);
        let within_95 =
            self.spread.as_ref().map(|(spread, tail)| spread.scaled(*tail).holding(0.95));
        let covariance = self.spread.as_ref().map(|(spread, _)| *spread);
        let deviations = covariance.as_ref().map(PoseCovariance::deviations);
        let three = |first: usize, unit: f64| {
            deviations.map(|all| [0, 1, 2].map(|axis| unit * all[first + axis]))
        };
        PoseConfidence {
            within_95: within_95.map(Within::from),
            position_std_m: three(3, 1.0),
            rotation_std_deg: three(0, 1_f64.to_degrees()),
            covariance,
            inlier_spread,
            runner_up_margin,
            chance_level,
            calibrated_on: self.calibrated_on,
            lowered_by: self.lowered_by.clone(),
            ..PoseConfidence::new(probability, right.into())
        }
    }

    /// How likely the pose is near beside one of a query that shows another place, where that is less than of nearly
    /// all poses that are near.
    pub(super) fn elsewhere(&self) -> Option<f64> {
        self.elsewhere
    }

    /// How many of the poses that are near are right. Where more than near is right, all are.
    fn share_of_near(&self, right: Tolerance) -> f64 {
        let is_stricter = right.translation_m < self.is_near.translation_m
            || right.rotation_deg < self.is_near.rotation_deg;
        match &self.spread {
            Some((spread, tail)) if is_stricter => {
                let errors = spread.scaled(*tail);
                // Of a spread so wide that none of the errors drawn is near, none is right.
                let near = errors.share_within(self.is_near).max(f64::MIN_POSITIVE);
                (errors.share_within(right) / near).min(1.0)
            }
            _ => 1.0,
        }
    }
}

/// The method whose pose an outcome has: of a hybrid the one that it took.
pub fn responsible(method: Method, outcome: &Outcome) -> Method {
    responsible_of(method, outcome.fell_back)
}

/// The method whose pose a result has: of a hybrid the one that it took.
pub fn responsible_of(method: Method, fell_back: bool) -> Method {
    match estimator::find(method).and_then(|entry| entry.hybrid()) {
        Some(parts) if fell_back => parts.second,
        Some(parts) => parts.first,
        None => method,
    }
}

/// The outcome, without its pose where that is less probably right than its method lets pass, or than
/// `asked` for.
pub fn accepted(subject: &Subject<'_>, asked: Option<f64>) -> Outcome {
    let of_method = estimator::find(subject.method)
        .map_or(0.0, |entry| entry.least_probability(subject.params));
    let needed = asked.unwrap_or(0.0).max(of_method);
    match &subject.confidence {
        Some(one) if one.probability < needed => Outcome {
            pose: Err(Failure::LowConfidence {
                probability: one.probability,
                needed,
                because: one.because(),
            }),
            ..subject.outcome.clone()
        },
        _ => subject.outcome.clone(),
    }
}

/// What a method leaves behind with its pose; `None` without one, and for a search other than the method's own.
pub fn evidenced(subject: &Subject<'_>) -> Option<Evidenced> {
    let &Subject { problem, method, params, outcome, evidence, .. } = subject;
    let pose = outcome.pose.as_ref().ok()?;
    let responsible = responsible(method, outcome);
    let family = Family::of(responsible, params)?;
    // What was fitted for a method was fitted to its own search.
    let is_usual = Family::of(responsible, &Params::default()) == Some(family);
    let at = problem.reference_from_query(pose);
    let of_search = |found: Option<Evidenced>| {
        Some(Evidenced { alone: edges::covariance(problem, params, &at), ..found? })
    };
    // A grid has three freedoms, so on a real road its right poses are beside the minimum, where the photos agree less
    // than in generated towns. So a glance would doubt them.
    let with_glance = |mut found: Evidenced| {
        found.signals.extend(appearance::signals(problem, params, &at, Look::GLANCE));
        found
    };
    let mut found = match family {
        _ if !is_usual => None,
        Family::Features => inliers::evidenced(subject, Look::QUICK),
        Family::Guided => inliers::evidenced(subject, Look::THOROUGH),
        Family::Grid => of_search(minimum::evidenced(outcome, evidence)),
        Family::MultiStart => of_search(settled::evidenced(subject)).map(with_glance),
        Family::Descent | Family::Given => None,
    }?;
    // The farther a method looked, the more it may have confused with the place.
    let radius = problem.uncertainty_radius_m() / params.scale.metre();
    found.signals.push(("radius", radius.ln()));
    found.signals.push(light::signal(problem));
    Some(found)
}

/// Large values say little more than moderate ones.
fn signed_log(value: f64) -> f64 {
    value.signum() * value.abs().ln_1p()
}

/// The eligible costs of some poses.
struct Costs {
    median: f64,
    /// Their robust standard deviation.
    deviation: f64,
    least: f64,
}

impl Costs {
    fn of<'s>(surfaces: impl IntoIterator<Item = &'s ScoredLattice>) -> Option<Self> {
        let mut costs = Vec::new();
        for surface in surfaces {
            let cells = 0..surface.scores.len();
            costs.extend(cells.filter_map(|cell| surface.eligible_cost(cell)));
        }
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let (median, deviation) = median_and_deviation(&mut costs)?;
        Some(Self { median, deviation, least })
    }

    /// How far a cost is below the median, in standard deviations.
    fn depth(&self, cost: f64) -> f64 {
        (self.median - cost) / self.deviation
    }
}

/// Share of the cost of shuffled pixels that is saved, and covered pixels over those covered at the
/// reference pose.
fn gain_and_coverage(summary: &CostSummary) -> Signals {
    let shuffled = summary.shuffled.unwrap_or(1.0).max(f64::MIN_POSITIVE);
    let coverage = summary.coverage_best / summary.coverage_reference.max(f64::MIN_POSITIVE);
    vec![("gain", 1.0 - summary.best / shuffled), ("coverage", coverage.clamp(1e-3, 1e3).ln())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scale::Scale;

    #[test]
    fn a_pose_is_trusted_from_nineteen_in_twenty_on_and_low_below_one_half() {
        let words = [0.0, 0.499, 0.5, 0.949, 0.95, 1.0].map(Confidence::of);
        use Confidence::{Low, Trusted, Unsure};
        assert_eq!(words, [Low, Low, Unsure, Unsure, Trusted, Trusted]);
        for one in Confidence::ALL {
            assert_eq!(one.word().parse(), Ok(one));
        }
    }

    #[test]
    fn what_was_fitted_is_complete() {
        for method in ["fb", "pm", "mi", "fb2", "mi6", "robust"] {
            let fitted = fitted(Method::named(method)).expect(method);
            let signals = fitted.signals.len();
            assert_eq!((fitted.seen.len(), fitted.near.len()), (signals, signals + 1), "{method}");
            assert_eq!(fitted.shown.len(), signals + 1, "{method}");
            assert!((0.0..0.9).contains(&fitted.shown_from), "{method}: {}", fitted.shown_from);
            for weights in &fitted.deviations {
                assert_eq!(weights.len(), signals + 2, "{method}");
            }
            // A signal that is beyond all that was seen says no more than the outermost.
            let far = |by: f64| -> Vec<f64> { vec![by; signals] };
            let alone =
                PoseCovariance::new(1e-4 * nalgebra::Matrix6::identity()).expect("positive");
            let of = |by| fitted.covariance(&alone, &far(by), Scale::PAPER);
            assert_eq!(of(1e3), of(1e6), "{method}");
            assert!((0.5..5.0).contains(&fitted.tail), "{method}: {}", fitted.tail);
        }
        assert!(super::fitted(Method::HY).is_none());
    }

    #[test]
    fn in_the_same_light_more_must_speak_for_a_pose() {
        for method in ["fb", "pm", "mi", "fb2", "mi6", "robust"] {
            let fitted = fitted(Method::named(method)).expect(method);
            assert_eq!(fitted.signals.last().map(String::as_str), Some("light"), "{method}");
            let with_light = |light: f64| {
                let middle = fitted.seen.iter().map(|[least, most]| 0.5 * (least + most));
                let mut signals: Vec<f64> = middle.collect();
                *signals.last_mut().expect("the light") = light.ln();
                (fitted.probability(&signals), fitted.shown(&signals))
            };
            let (same, other) = (with_light(0.04), with_light(0.3));
            assert!(same.0 < other.0 && same.1 < other.1, "{method}: {same:?}, {other:?}");
        }
    }

    #[test]
    fn a_limit_that_was_missed_does_not_read_as_reached() {
        let texts = [0.003, 0.4999, 0.9499, 1.0].map(percent);
        assert_eq!(texts, ["under 1 %", "49 %", "94 %", "100 %"]);
        let likely = [0.34, 0.5]
            .map(|probability| PoseConfidence::new(probability, Within::default()).likely());
        assert_eq!(likely, ["◆ 34 %", "50 %"]);
    }
}
