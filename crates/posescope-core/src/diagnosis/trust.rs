//! How far an accepted pose is to be believed, without knowing the truth.
//!
//! Of what an estimator leaves behind, a few signals say how far its pose stands out from what chance
//! would give: for methods of features the inliers beyond chance, how well they fix the pose, and whether
//! the photos go together there better than elsewhere, for a direct method how deep its minimum is beside
//! the other hypotheses, the runner-up and shuffled pixels, for a search from many starts how many of them
//! end at it, and whether features lead there too. A logistic function of them is the probability of being within [`WITHIN_M`]; its coefficients were fitted on
//! some conditions of the street and are judged on others (`docs/diagnosis.md`).

mod appearance;
mod coefficients;
mod inliers;
mod minimum;
mod settled;

use serde::{Deserialize, Serialize};

pub use coefficients::probability;

use super::{Evidence, Subject};
use crate::estimator::{self, Failure, Outcome, Parts};
use crate::grid::{Phase, ScoredLattice};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use appearance::Look;
use inliers::Inliers;
use minimum::Minimum;
use settled::Settled;

/// The distance from the truth that [`Trust::probability`] speaks of \[m\].
pub const WITHIN_M: f64 = 1.0;

/// A pose of less probability has low confidence: of the queries that show nothing of their place, none
/// should be believed.
pub const LOW_CONFIDENCE: f64 = 0.98;

/// A pose of less probability is more likely wrong than right, so that what speaks against it is said
/// without knowing the truth.
const DOUBTFUL: f64 = 0.5;

/// How far a pose is to be believed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trust {
    /// Probability of being within 1 m of the truth, from this method alone; `None` for a method that
    /// was not calibrated.
    pub probability: Option<f64>,
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
    /// for FB the decimal logarithm of the number of false alarms.
    pub chance_level: Option<f64>,
}

/// What a probability is made of: names and values, in one order for all results of one family.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// The names.
    pub names: &'static [&'static str],
    /// The values; all are finite.
    pub values: Vec<f64>,
}

impl Trust {
    /// How far the pose of an outcome is to be believed; `None` where there is none.
    pub fn of(
        problem: &Problem,
        method: Method,
        params: &Params,
        outcome: &Outcome,
        evidence: &Evidence,
    ) -> Option<Self> {
        outcome.pose.as_ref().ok()?;
        let method = responsible(method, outcome);
        match Family::of(method)? {
            Family::Features(look) => of_features(problem, method, params, evidence, look),
            Family::Search => of_search(method, outcome, evidence),
            Family::Settled => of_settled(method, outcome, evidence),
        }
    }

    /// Whether the pose has low confidence.
    pub fn is_low(&self) -> bool {
        self.is_below(LOW_CONFIDENCE)
    }

    /// Whether the pose is so doubtful that what speaks against it counts.
    pub(super) fn is_doubtful(&self) -> bool {
        self.is_below(DOUBTFUL)
    }

    fn is_below(&self, limit: f64) -> bool {
        self.probability
            .is_some_and(|probability| probability < limit)
    }
}

/// The method whose pose an outcome has: of a hybrid the one that it took.
pub(super) fn responsible(method: Method, outcome: &Outcome) -> Method {
    match estimator::find(method).and_then(|entry| entry.hybrid()) {
        Some(parts) if outcome.fell_back => parts.second,
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
    let trust = subject.trust.as_ref();
    match trust.and_then(|trust| trust.probability) {
        Some(probability) if probability < needed => Outcome {
            pose: Err(Failure::LowConfidence {
                probability,
                needed,
            }),
            ..subject.outcome.clone()
        },
        _ => subject.outcome.clone(),
    }
}

/// The signals of an outcome with a pose, as the probability takes them.
pub fn signals(
    problem: &Problem,
    method: Method,
    params: &Params,
    outcome: &Outcome,
    evidence: &Evidence,
) -> Option<Signals> {
    outcome.pose.as_ref().ok()?;
    let method = responsible(method, outcome);
    match Family::of(method)? {
        Family::Features(look) => {
            let consensus = Inliers::of(problem, params, evidence, look)?;
            Some(consensus.signals(evidence))
        }
        Family::Search => Some(Minimum::of(outcome, evidence)?.signals()),
        Family::Settled => Some(Settled::of(outcome, evidence)?.signals()),
    }
}

/// What the poses of a method are judged by.
enum Family {
    /// The inliers of a consensus, and what is seen at its pose.
    Features(Look),
    /// The lattices of a search, one after the other.
    Search,
    /// Where many starts of a search settled.
    Settled,
}

impl Family {
    /// `None` for hybrids, which have none of their own, and for other systems.
    fn of(method: Method) -> Option<Self> {
        match &estimator::find(method)?.parts {
            Parts::Features => Some(Self::Features(Look::QUICK)),
            Parts::Cost(_) => Some(Self::Search),
            Parts::Own(own) if own.shows.is_some() => Some(Self::Settled),
            Parts::Own(_) => Some(Self::Features(Look::THOROUGH)),
            Parts::Hybrid(_) => None,
        }
    }
}

fn of_features(
    problem: &Problem,
    method: Method,
    params: &Params,
    evidence: &Evidence,
    look: Look,
) -> Option<Trust> {
    let inliers = Inliers::of(problem, params, evidence, look)?;
    let signals = inliers.signals(evidence);
    let covariance = inliers.covariance;
    let deviation = |first: usize| {
        covariance.map(|c| std::array::from_fn(|axis| c[(first + axis, first + axis)].sqrt()))
    };
    Some(Trust {
        probability: probability(method, &signals.values),
        position_std_m: deviation(3),
        rotation_std_deg: deviation(0).map(|d: [f64; 3]| d.map(f64::to_degrees)),
        inlier_spread: Some(inliers.spread),
        runner_up_margin: None,
        chance_level: evidence.judged.as_ref().map(|j| j.acceptance.log10_nfa),
    })
}

fn of_search(method: Method, outcome: &Outcome, evidence: &Evidence) -> Option<Trust> {
    let minimum = Minimum::of(outcome, evidence)?;
    let deviations = minimum.deviations(evidence);
    Some(Trust {
        probability: probability(method, &minimum.signals().values),
        position_std_m: deviations.map(|[right, forward, _]| [right, 0.0, forward]),
        rotation_std_deg: deviations.map(|[.., yaw]| [0.0, yaw.to_degrees(), 0.0]),
        inlier_spread: None,
        runner_up_margin: minimum.runner_up_margin,
        chance_level: outcome.cost.as_ref()?.shuffled,
    })
}

fn of_settled(method: Method, outcome: &Outcome, evidence: &Evidence) -> Option<Trust> {
    let settled = Settled::of(outcome, evidence)?;
    Some(Trust {
        probability: probability(method, &settled.signals().values),
        position_std_m: None,
        rotation_std_deg: None,
        inlier_spread: None,
        runner_up_margin: settled.runner_up_margin,
        chance_level: outcome.cost.as_ref()?.shuffled,
    })
}

/// Large values say little more than moderate ones.
fn tamed(value: f64) -> f64 {
    value.signum() * value.abs().ln_1p()
}

fn surface(evidence: &Evidence, phase: Phase) -> Option<&ScoredLattice> {
    let found = |surface: &&std::sync::Arc<ScoredLattice>| surface.lattice.phase == phase;
    evidence.surfaces.iter().find(found).map(AsRef::as_ref)
}

fn eligible_costs(surface: &ScoredLattice) -> Vec<f64> {
    (0..surface.scores.len())
        .filter_map(|cell| surface.eligible_cost(cell))
        .collect()
}

/// The median, and the standard deviation that a normal distribution of the same median absolute
/// deviation has.
fn centre_and_deviation(values: &mut [f64]) -> Option<(f64, f64)> {
    let centre = median(values)?;
    let mut deviations: Vec<f64> = values.iter().map(|value| (value - centre).abs()).collect();
    let deviation = 1.4826 * median(&mut deviations)?;
    Some((centre, deviation.max(1e-9)))
}

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(probability: Option<f64>) -> Trust {
        Trust {
            probability,
            position_std_m: None,
            rotation_std_deg: None,
            inlier_spread: None,
            runner_up_margin: None,
            chance_level: None,
        }
    }

    #[test]
    fn a_pose_is_doubted_below_one_half_and_believed_from_forty_nine_in_fifty_on() {
        let doubted = [0.0, 0.49, 0.5, 0.97, 0.98, 1.0].map(|p| said(Some(p)).is_doubtful());
        assert_eq!(doubted, [true, true, false, false, false, false]);
        let low = [0.0, 0.49, 0.5, 0.97, 0.98, 1.0].map(|p| said(Some(p)).is_low());
        assert_eq!(low, [true, true, true, true, false, false]);
        // Of a method that was not calibrated nothing is known.
        assert!(!said(None).is_doubtful() && !said(None).is_low());
    }
}
