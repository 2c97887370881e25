//! Why a pose is wrong or missing: verdicts with their evidence.
//!
//! A verdict is a value beside the result. Nothing here changes a pose: estimators know no truth and
//! tell what they do; what they told ([`Evidence`]) is compared with the truth, where that is known,
//! and ordered tests say what failed. The first that fires is the primary verdict, those after it are
//! listed behind.
//!
//! | file | verdicts |
//! |---|---|
//! | `suspicion` | X1: the truth, a calibration or the units cannot be right |
//! | `direct` | D1 to D8: the search, the cost, or what it was not allowed to move |
//! | `settled` | D2, D3, D4, H1 of methods that search from many starts |
//! | `feature`, `guided` | R1 to R9: where the true matches went |
//! | `foreign` | those of a direct method that need a pose alone, for poses of other systems |
//! | `combined` | H1, F1, V1: hybrids, fusions, retrieval |
//! | `trust` | L1: how far a pose is to be believed without knowing the truth |
//!
//! A pose that is right carries at most L1.

mod combined;
mod descent;
mod direct;
mod evidence;
mod feature;
mod foreign;
mod guided;
mod matches;
pub mod remedies;
mod settled;
mod suspicion;
mod tolerance;
pub mod trust;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

pub use crate::code::Code;
pub use combined::{Member, diagnose_fusion, diagnose_joint, diagnose_ranking, fused_trust};
pub use evidence::Evidence;
pub use tolerance::Tolerance;
pub use trust::Trust;

use crate::estimator::{self, Failure, Outcome, Parts};
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;

/// A finding about why a pose is wrong, missing or hardly to be believed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// The code.
    pub code: Code,
    /// The finding in one sentence.
    pub text: String,
    /// The numbers behind it.
    pub evidence: Value,
}

impl Diagnosis {
    /// What an estimator that has no pose says itself.
    pub fn of_failure(failure: &Failure) -> Self {
        Self::new(failure.code(), failure.to_string(), json!({}))
    }

    fn new(code: Code, text: impl Into<String>, evidence: Value) -> Self {
        Self {
            code,
            text: text.into(),
            evidence,
        }
    }
}

/// What is judged: a method's outcome on a problem, what it told, and the truth where it is known.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// The method.
    pub method: Method,
    /// Its parameters.
    pub params: &'a Params,
    /// What it answered.
    pub outcome: &'a Outcome,
    /// What it told.
    pub evidence: &'a Evidence,
    /// How far its pose is to be believed; `None` without a pose.
    pub trust: Option<Trust>,
    /// The query's true pose, `world_from_camera`.
    pub truth: Option<&'a Pose>,
    /// When a pose is right.
    pub tolerance: Tolerance,
}

impl<'a> Subject<'a> {
    /// An outcome and what was told on the way to it.
    pub fn new(
        problem: &'a Problem,
        method: Method,
        params: &'a Params,
        outcome: &'a Outcome,
        evidence: &'a Evidence,
    ) -> Self {
        Self {
            problem,
            method,
            params,
            outcome,
            evidence,
            trust: Trust::of(problem, method, params, outcome, evidence),
            truth: None,
            tolerance: Tolerance::default(),
        }
    }

    /// The same, held against the truth: right is what is within the tolerance of it.
    #[must_use]
    pub fn against(self, truth: Option<&'a Pose>, tolerance: Tolerance) -> Self {
        Self {
            truth,
            tolerance,
            ..self
        }
    }

    /// The error of the pose, where there are both a pose and the truth.
    fn error(&self) -> Option<PoseError> {
        let pose = self.outcome.pose.as_ref().ok()?;
        Some(PoseError::between(self.truth?, pose))
    }

    fn is_right(&self) -> bool {
        self.error()
            .is_some_and(|error| self.tolerance.contains(&error))
    }

    /// The true pose of the query camera in the reference camera's frame.
    fn reference_from_truth(&self) -> Option<Pose> {
        Some(self.problem.reference_from_query(self.truth?))
    }
}

/// The verdicts on one method's outcome, the primary one first; none where nothing is wrong.
pub fn diagnose(subject: &Subject<'_>) -> Vec<Diagnosis> {
    let mut found = Vec::new();
    let doubt = subject.trust.as_ref().and_then(low_confidence);
    if !subject.is_right() {
        found.extend(suspicion::of_units(subject));
        let responsible = trust::responsible(subject.method, subject.outcome);
        let of_method = match estimator::find(responsible).map(|entry| &entry.parts) {
            Some(Parts::Features) => feature::diagnose(subject),
            Some(Parts::Cost(_)) => direct::diagnose(subject),
            Some(Parts::Own(own)) if own.shows.is_some() => settled::diagnose(subject),
            Some(Parts::Own(own)) if own.has_features => guided::diagnose(subject),
            None => foreign::diagnose(subject),
            _ => failure_alone(subject),
        };
        let combined = combined::of_hybrid(subject, responsible);
        let (suspicions, others): (Vec<_>, Vec<_>) =
            of_method.into_iter().partition(|d| d.code == Code::X1);
        found.extend(suspicions);
        found.extend(combined);
        found.extend(others);
    }
    // Where nobody knows the truth, the doubt comes before what only speaks for it.
    let speaks_for_it = |finding: &Diagnosis| matches!(finding.code, Code::D1 | Code::D8);
    let place = match subject.truth {
        None => found.iter().position(speaks_for_it),
        Some(_) => None,
    };
    let place = place.unwrap_or(found.len());
    found.splice(place..place, doubt);
    // One finding for each code: the first says most.
    let mut seen = Vec::new();
    found.retain(|finding: &Diagnosis| {
        let is_new = !seen.contains(&finding.code);
        seen.push(finding.code);
        is_new
    });
    found
}

/// What the estimator itself said, where there is no pose.
fn failure_alone(subject: &Subject<'_>) -> Vec<Diagnosis> {
    let failure = subject.outcome.pose.as_ref().err();
    failure.map(Diagnosis::of_failure).into_iter().collect()
}

fn low_confidence(trust: &Trust) -> Option<Diagnosis> {
    let probability = trust.probability?;
    trust.is_low().then(|| {
        Diagnosis::new(
            Code::L1,
            format!(
                "low confidence: poses like this one are within {} m in {:.0} % of cases",
                trust::WITHIN_M,
                // Rounded down, so that nobody reads the limit where it was missed.
                (100.0 * probability).floor()
            ),
            json!({
                "probability": probability,
                "runner_up_margin": trust.runner_up_margin,
                "inlier_spread": trust.inlier_spread,
            }),
        )
    })
}
