//! How likely an accepted pose is right, without knowing the truth.
//!
//! The evidence of an estimator shows how far its pose stands out from chance. For feature-based methods these are
//! the inliers beyond chance, how well they determine the pose, and whether the photos agree better there than
//! elsewhere. For a grid search it is the depth of the minimum compared with other hypotheses, the runner-up and
//! shuffled pixels. For a multi-start search it is how many of them end there, and whether features agree. A
//! logistic function of these signals is the probability of being within [`WITHIN_M`]. Its coefficients were
//! fitted on some conditions of the street with default parameters, and evaluated on others (numbers in
//! `studies/README.md`).

mod appearance;
mod coefficients;
mod inliers;
mod minimum;
mod settled;

use serde::{Deserialize, Serialize};

pub use coefficients::probability;

use super::{Family, Subject};
use crate::estimator::{self, CostSummary, Failure, Outcome};
use crate::grid::ScoredLattice;
use crate::method::Method;
use crate::params::Params;
use crate::stats::median_and_deviation;
use crate::text::words;
use appearance::Look;

/// The distance from the truth that [`PoseConfidence::probability`] refers to \[m\].
pub const WITHIN_M: f64 = 1.0;

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

/// What the coefficients of a probability were fitted on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Calibration {
    /// Conditions of the built-in street.
    #[default]
    Street,
}

/// How likely a pose is right, and how far it may be off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseConfidence {
    /// Probability of being within 1 m of the truth, from this method alone.
    pub probability: f64,
    /// The same in one word.
    pub word: Confidence,
    /// What the probability was calibrated on.
    pub calibrated_on: Calibration,
    /// Standard deviation of the camera centre along its own axes, right, down, forward \[m\]; 0 along
    /// what is not searched. `None` where nothing fixes the pose.
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
    pub fn new(probability: f64) -> Self {
        Self {
            probability,
            word: Confidence::of(probability),
            calibrated_on: Calibration::Street,
            position_std_m: None,
            rotation_std_deg: None,
            inlier_spread: None,
            runner_up_margin: None,
            chance_level: None,
        }
    }

    /// The probability as people read it, with the glyph of a low one before it.
    pub fn likely(&self) -> String {
        let percent = percent(self.probability);
        match self.word {
            Confidence::Low => format!("{} {percent}", Confidence::Low.glyph()),
            _ => percent,
        }
    }

    /// That of a subject's pose; `None` without a pose, for a method that was not calibrated, and for a scene of
    /// another scale than those of the calibration.
    pub(super) fn of(subject: &Subject<'_>) -> Option<Self> {
        if !subject.params.scale.is_paper() {
            return None;
        }
        let (signals, rest) = left_behind(subject)?;
        let values: Vec<f64> = signals.iter().map(|(_, value)| *value).collect();
        let probability = probability(responsible(subject.method, subject.outcome), &values)?;
        Some(Self { probability, word: Confidence::of(probability), ..rest })
    }
}

/// The method whose pose an outcome has: of a hybrid the one that it took.
pub fn responsible(method: Method, outcome: &Outcome) -> Method {
    responsible_of(method, outcome.fell_back)
}

/// The method whose pose a result has: of a hybrid the one that it took.
pub(super) fn responsible_of(method: Method, fell_back: bool) -> Method {
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
    match subject.confidence.as_ref().map(|one| one.probability) {
        Some(probability) if probability < needed => Outcome {
            pose: Err(Failure::LowConfidence { probability, needed }),
            ..subject.outcome.clone()
        },
        _ => subject.outcome.clone(),
    }
}

/// The signals of a subject with a pose, as the probability takes them.
pub fn signals(subject: &Subject<'_>) -> Option<Signals> {
    Some(left_behind(subject)?.0)
}

/// The signals of a subject with a pose, and its confidence but for the probability.
fn left_behind(subject: &Subject<'_>) -> Option<(Signals, PoseConfidence)> {
    let &Subject { method, params, outcome, evidence, .. } = subject;
    outcome.pose.as_ref().ok()?;
    let responsible = responsible(method, outcome);
    let family = Family::of(responsible, params)?;
    // The coefficients of a method were fitted to its own search.
    let is_usual = Family::of(responsible, &Params::default()) == Some(family);
    match family {
        _ if !is_usual => None,
        Family::Features => inliers::signals(subject, Look::QUICK),
        Family::Guided => inliers::signals(subject, Look::THOROUGH),
        Family::Grid => minimum::signals(outcome, evidence),
        Family::MultiStart => settled::signals(outcome, evidence),
        Family::Descent | Family::Given => None,
    }
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
    fn a_limit_that_was_missed_does_not_read_as_reached() {
        let texts = [0.003, 0.4999, 0.9499, 1.0].map(percent);
        assert_eq!(texts, ["under 1 %", "49 %", "94 %", "100 %"]);
        let likely = [0.34, 0.5].map(|probability| PoseConfidence::new(probability).likely());
        assert_eq!(likely, ["◆ 34 %", "50 %"]);
    }
}
