//! How far an accepted pose is to be believed, without knowing the truth.
//!
//! Of what an estimator leaves behind, a few signals say how far its pose stands out from what chance
//! would give: for FB the inliers beyond chance and how well they fix the pose, for a direct method
//! how deep its minimum is beside the other hypotheses, the runner-up and shuffled pixels. A logistic
//! function of them is the probability of being within [`WITHIN_M`]; its coefficients were fitted on
//! some conditions of the street and are judged on others (`docs/diagnosis.md`).

mod coefficients;

use nalgebra::Matrix6;
use serde::{Deserialize, Serialize};

pub use coefficients::probability;

use super::Evidence;
use crate::estimator::{self, Outcome, Parts};
use crate::features::FeatureState;
use crate::grid::{Phase, ScoredLattice};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::solver::{Correspondence, pose_covariance};

/// The distance from the truth that [`Trust::probability`] speaks of \[m\].
pub const WITHIN_M: f64 = 1.0;

/// A pose of less probability has low confidence: of the queries that show nothing of their place, none
/// should be believed.
pub const LOW_CONFIDENCE: f64 = 0.975;

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
        match estimator::find(responsible(method, outcome))?.parts {
            Parts::Features => of_features(problem, params, evidence),
            Parts::Cost(_) => of_search(method, outcome, evidence),
            Parts::Hybrid(_) | Parts::Own(_) => None,
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

/// The signals of an outcome with a pose, as the probability takes them.
pub fn signals(
    problem: &Problem,
    method: Method,
    params: &Params,
    outcome: &Outcome,
    evidence: &Evidence,
) -> Option<Signals> {
    outcome.pose.as_ref().ok()?;
    match estimator::find(responsible(method, outcome))?.parts {
        Parts::Features => {
            let consensus = Inliers::of(problem, params, evidence)?;
            Some(consensus.signals(problem, evidence))
        }
        Parts::Cost(_) => Some(Minimum::of(outcome, evidence)?.signals()),
        Parts::Hybrid(_) | Parts::Own(_) => None,
    }
}

fn of_features(problem: &Problem, params: &Params, evidence: &Evidence) -> Option<Trust> {
    let inliers = Inliers::of(problem, params, evidence)?;
    let signals = inliers.signals(problem, evidence);
    let covariance = inliers.covariance;
    let deviation = |first: usize| {
        covariance.map(|c| std::array::from_fn(|axis| c[(first + axis, first + axis)].sqrt()))
    };
    Some(Trust {
        probability: probability(Method::FB, &signals.values),
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
        probability: probability(responsible(method, outcome), &minimum.signals().values),
        position_std_m: deviations.map(|[right, forward, _]| [right, 0.0, forward]),
        rotation_std_deg: deviations.map(|[.., yaw]| [0.0, yaw.to_degrees(), 0.0]),
        inlier_spread: None,
        runner_up_margin: minimum.runner_up_margin,
        chance_level: outcome.cost.as_ref()?.shuffled,
    })
}

/// What FB's inliers say.
struct Inliers {
    count: usize,
    correspondences: usize,
    spread: f64,
    median_residual_px: f64,
    covariance: Option<Matrix6<f64>>,
}

impl Inliers {
    fn of(problem: &Problem, params: &Params, evidence: &Evidence) -> Option<Self> {
        let features = evidence.query.as_ref()?;
        let (states, lifted) = (evidence.states.as_ref()?, evidence.lifted.as_ref()?);
        let refined = evidence.refined.as_ref()?;
        let mut residuals = Vec::new();
        let mut inliers = Vec::new();
        for lifted in lifted.iter() {
            if let (Some(FeatureState::Inlier { residual_px }), Some(point)) =
                (states.get(lifted.query), lifted.point)
            {
                let pixel = features.keypoints.get(lifted.query)?.pixel();
                inliers.push(Correspondence { pixel, point });
                residuals.push(*residual_px);
            }
        }
        let intrinsics = &problem.query.intrinsics;
        let (width, height) = (f64::from(intrinsics.width), f64::from(intrinsics.height));
        let threshold = params.fb.mlesac.inlier_threshold_px;
        let median_residual_px = median(&mut residuals).unwrap_or(threshold);
        // A residual is of two axes; the median of a Rayleigh distribution is 1.177 σ. A perfect fit of
        // few points is no proof of perfect pixels.
        let sigma_px = (median_residual_px / 1.177).max(0.3);
        let camera_from_reference = refined.reference_from_query.inverse();
        Some(Self {
            count: inliers.len(),
            correspondences: refined.correspondences,
            spread: root_mean_square_distance(&inliers) / width.hypot(height),
            median_residual_px,
            covariance: pose_covariance(&inliers, intrinsics, &camera_from_reference, sigma_px),
        })
    }

    fn signals(&self, problem: &Problem, evidence: &Evidence) -> Signals {
        const NAMES: &[&str] = &[
            "inliers",
            "inlier_share",
            "beyond_chance",
            "spread",
            "deviation",
            "residual",
            "distance",
        ];
        let log10_nfa = evidence
            .judged
            .as_ref()
            .map_or(0.0, |judged| judged.acceptance.log10_nfa);
        let distance_m = evidence.judged.as_ref().map_or(0.0, |j| j.distance_m);
        let deviation_m = self.covariance.map_or(1e3, |c| {
            (c[(3, 3)] + c[(4, 4)] + c[(5, 5)]).sqrt().clamp(1e-4, 1e3)
        });
        Signals {
            names: NAMES,
            values: vec![
                (self.count as f64).ln_1p(),
                self.count as f64 / self.correspondences.max(1) as f64,
                (-log10_nfa).max(0.0).ln_1p(),
                self.spread,
                deviation_m.ln(),
                self.median_residual_px,
                distance_m / problem.believed_within_m(),
            ],
        }
    }
}

fn root_mean_square_distance(inliers: &[Correspondence]) -> f64 {
    let count = inliers.len().max(1) as f64;
    let sum = inliers
        .iter()
        .fold(nalgebra::Vector2::zeros(), |sum, c| sum + c.pixel.coords);
    let centre = sum / count;
    let squared: f64 = inliers
        .iter()
        .map(|c| (c.pixel.coords - centre).norm_squared())
        .sum();
    (squared / count).sqrt()
}

/// What the lattices of a search say about its minimum.
struct Minimum {
    /// In robust standard deviations of the coarse costs, below their median.
    depth: f64,
    /// The same of the coarse minimum.
    coarse_depth: f64,
    /// The same of the reference pose.
    start_depth: f64,
    /// How much deeper than the runner-up, in the same unit; `None` where there is none.
    runner_up_margin: Option<f64>,
    /// Share of the cost of shuffled pixels that is saved.
    gain: f64,
    /// Covered pixels over those covered at the reference pose.
    coverage: f64,
    /// Depth of the yaw that was chosen among the others, as above.
    yaw_depth: f64,
    /// The standard deviation that all this is measured in.
    deviation: f64,
}

impl Minimum {
    fn of(outcome: &Outcome, evidence: &Evidence) -> Option<Self> {
        let summary = outcome.cost.as_ref()?;
        // Without one there is nothing to judge.
        evidence.minimum?;
        let coarse = surface(evidence, Phase::PositionCoarse)?;
        let mut costs = eligible_costs(coarse);
        let coarse_best = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let (centre, deviation) = centre_and_deviation(&mut costs)?;
        let depth = |cost: f64| (centre - cost) / deviation;
        let yaw_surface = surface(evidence, Phase::YawCoarse);
        let yaw_depth = yaw_surface.and_then(|surface| {
            let mut costs = eligible_costs(surface);
            let best = costs.iter().copied().fold(f64::INFINITY, f64::min);
            let (centre, deviation) = centre_and_deviation(&mut costs)?;
            Some((centre - best) / deviation)
        });
        let shuffled = summary.shuffled.unwrap_or(1.0).max(f64::MIN_POSITIVE);
        Some(Self {
            depth: depth(summary.best),
            coarse_depth: depth(coarse_best),
            start_depth: summary.initial.map_or(0.0, depth),
            runner_up_margin: summary
                .runner_up
                .map(|runner_up| (runner_up - coarse_best) / deviation),
            gain: 1.0 - summary.best / shuffled,
            coverage: summary.coverage_best / summary.coverage_reference.max(f64::MIN_POSITIVE),
            yaw_depth: yaw_depth.unwrap_or(0.0),
            deviation,
        })
    }

    /// How far the pose is from the reference is none of them: on the street right ones are near, by how its
    /// pairs are drawn, and on real drives they are not.
    fn signals(&self) -> Signals {
        const NAMES: &[&str] = &[
            "depth",
            "refined_by",
            "margin",
            "above_start",
            "gain",
            "coverage",
            "yaw_depth",
        ];
        let margin = self.runner_up_margin.unwrap_or(self.coarse_depth);
        Signals {
            names: NAMES,
            values: vec![
                tamed(self.depth),
                tamed(self.depth - self.coarse_depth),
                tamed(margin),
                tamed(self.depth - self.start_depth),
                self.gain,
                self.coverage.clamp(1e-3, 1e3).ln(),
                tamed(self.yaw_depth),
            ],
        }
    }

    /// Standard deviations of right and forward \[m\] and yaw \[rad\]: how far one has to go from the
    /// minimum until the cost has risen by as much as coarse costs differ anyway, by the parabola
    /// through the minimum and its neighbours on the fine lattices.
    fn deviations(&self, evidence: &Evidence) -> Option<[f64; 3]> {
        let position = surface(evidence, Phase::PositionFine)?;
        let yaw = surface(evidence, Phase::YawFine)?;
        let along = |surface: &ScoredLattice, step: usize| -> Option<f64> {
            let cell = surface.minimum()?;
            let cost = |cell: usize| surface.scores.get(cell).copied()??.cost;
            let (before, after) = (cost(cell.checked_sub(step)?)?, cost(cell + step)?);
            let curvature = (before + after - 2.0 * cost(cell)?) / surface.lattice.step.powi(2);
            (curvature > 0.0).then(|| (2.0 * self.deviation / curvature).sqrt())
        };
        Some([
            along(position, 1)?,
            along(position, position.lattice.columns)?,
            along(yaw, 1)?,
        ])
    }
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
    fn a_pose_is_doubted_below_one_half_and_believed_from_thirty_nine_in_forty_on() {
        let doubted = [0.0, 0.49, 0.5, 0.97, 0.975, 1.0].map(|p| said(Some(p)).is_doubtful());
        assert_eq!(doubted, [true, true, false, false, false, false]);
        let low = [0.0, 0.49, 0.5, 0.97, 0.975, 1.0].map(|p| said(Some(p)).is_low());
        assert_eq!(low, [true, true, true, true, false, false]);
        // Of a method that was not calibrated nothing is known.
        assert!(!said(None).is_doubtful() && !said(None).is_low());
    }
}
