//! For posescope's own crates: may change in any version.
//!
//! What a result is worth, and why it is wrong or missing.
//!
//! An [`Assessment`] is made once for each result, from its pose, the truth where that is known, and the
//! tolerance: a *grade*, a *confidence* and *verdicts* with their evidence. Nothing here changes a pose.
//! Estimators know no truth; they emit events, and what verdicts need of those is an [`Evidence`].
//!
//! | file | what it holds |
//! |---|---|
//! | `rules`, one file for each code in `rules/` | the table of verdicts: test, sentence, proof, remedies |
//! | `case` | what a rule looks at |
//! | `matches`, `search`, `free_search` | what the truth says about matches, a grid search, a search in six freedoms |
//! | `confidence` | how likely a pose is right, without the truth |
//! | `fused` | fused poses and rankings |
//! | `readings` | other meanings of the numbers of a pose |
//! | `remedies` | what may help |
//!
//! A pose that is right carries at most L1.

mod ask;
mod assessment;
mod axes;
mod case;
pub mod confidence;
mod evidence;
mod free_search;
mod fused;
mod matches;
mod numbers;
mod proof;
pub(crate) mod readings;
mod relation;
pub mod remedies;
mod rules;
mod search;
mod tolerance;

use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use assessment::{Assessment, Grade};
pub use axes::{OPENGL_AXES, VEHICLE_AXES, other_axes};
pub use case::{Case, FusionCase, Member, RankingCase};
pub use confidence::{Confidence, PoseConfidence};
pub use evidence::Evidence;
pub use fused::{diagnose_fusion, diagnose_ranking, fused_confidence};
pub use matches::true_match_px;
pub use proof::{MapOverlay, Proof};
pub use rules::{Code, DecidedAt, RULES, Rule, Test};
pub use tolerance::Tolerance;

pub use crate::estimator::Family;
use crate::estimator::Outcome;
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use confidence::Trust;
use search::FinishedSearch;

/// A verdict on why a pose is wrong, missing or uncertain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// The code.
    pub code: Code,
    /// The verdict in one or two sentences, made from the evidence.
    pub text: String,
    /// The numbers behind it.
    pub evidence: Value,
}

impl Diagnosis {
    /// The kind of picture that proves it.
    pub fn proof(&self) -> Proof {
        let rule = self.code.rule();
        (rule.proof_on)(&self.evidence).unwrap_or(rule.proof)
    }
}

/// What is assessed: a method's outcome on a problem, what it emitted, and the truth where it is known.
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
    /// What it emitted.
    pub evidence: &'a Evidence,
    /// How likely its pose is right; `None` without a pose, and where it cannot be known.
    pub confidence: Option<PoseConfidence>,
    /// The query's true pose, `world_from_camera`.
    pub truth: Option<&'a Pose>,
    /// When a pose is right.
    pub tolerance: Tolerance,
    /// What the confidence follows from.
    trust: Option<Trust>,
}

impl<'a> Subject<'a> {
    /// An outcome and what was emitted on the way to it.
    pub fn new(
        problem: &'a Problem,
        method: Method,
        params: &'a Params,
        outcome: &'a Outcome,
        evidence: &'a Evidence,
    ) -> Self {
        let tolerance = Tolerance::default().at(params.scale);
        let subject = Self {
            problem,
            method,
            params,
            outcome,
            evidence,
            confidence: None,
            truth: None,
            tolerance,
            trust: None,
        };
        let trust = Trust::of(&subject);
        Self { trust, ..subject }.against(None, tolerance)
    }

    /// The same, compared with the truth: a pose within the tolerance of it is right.
    #[must_use]
    pub fn against(self, truth: Option<&'a Pose>, tolerance: Tolerance) -> Self {
        let confidence = self.trust.as_ref().map(|trust| trust.confidence(tolerance));
        Self { truth, tolerance, confidence, ..self }
    }

    /// The same, with what became of the answer.
    #[must_use]
    pub fn answering(self, outcome: &'a Outcome) -> Self {
        Self { outcome, ..self }
    }

    /// What the pose is worth by the truth.
    pub fn grade(&self) -> Grade {
        let has_pose = self.outcome.pose.is_ok();
        Grade::of(has_pose, self.error().as_ref(), self.tolerance)
    }

    /// The error of the pose, where there are both a pose and the truth.
    fn error(&self) -> Option<PoseError> {
        let pose = self.outcome.pose.as_ref().ok()?;
        Some(PoseError::between(self.truth?, pose))
    }

    /// Whether its confidence is low.
    fn is_low(&self) -> bool {
        let word = self.confidence.as_ref().map(|confidence| confidence.word);
        word == Some(Confidence::Low)
    }

    /// The true pose of the query camera in the reference camera's frame.
    fn reference_from_truth(&self) -> Option<Pose> {
        Some(self.problem.reference_from_query(self.truth?))
    }
}

/// The verdicts on one method's outcome, the primary one first; none where nothing is wrong.
pub fn diagnose(subject: &Subject<'_>) -> Vec<Diagnosis> {
    let grade = subject.grade();
    let responsible = confidence::responsible(subject.method, subject.outcome);
    let Some(family) = Family::of(responsible, subject.params) else {
        let failure = subject.outcome.pose.as_ref().err();
        return failure.map(Diagnosis::of_failure).into_iter().collect();
    };
    let estimator = search::estimator_of(subject, family).filter(|_| grade != Grade::Right);
    let search = estimator.as_ref().and_then(|one| FinishedSearch::of(subject, one.as_ref()));
    let mut found = tried(&Case::new(subject, family, search.as_ref()), grade);
    // A method's own failure, unless a rule says more than that something else is suspect.
    let is_suspicion = |one: &Diagnosis| matches!(one.code, Code::X1 | Code::N1);
    let is_explained = found.iter().any(|one| one.code.is_failure() && !is_suspicion(one));
    if let (Err(failure), false) = (&subject.outcome.pose, is_explained) {
        let place = found.iter().take_while(|one| is_suspicion(one)).count();
        let reported = Diagnosis::of_failure(failure);
        found.retain(|one| one.code != reported.code);
        found.insert(place, reported);
    }
    // Without the truth, the doubt comes before what only speaks for it.
    if subject.truth.is_none() {
        found.sort_by_key(|one| one.code != Code::L1 && matches!(one.code, Code::D1 | Code::D8));
    }
    found
}

/// The verdicts of all rules that apply, in their order.
fn tried(case: &Case<'_>, grade: Grade) -> Vec<Diagnosis> {
    let mut found = Vec::new();
    let mut is_concluded = false;
    for rule in RULES {
        let Test::Method(test) = rule.test else {
            continue;
        };
        let applies = rule.applies_to.contains(&case.family)
            && (!rule.needs_truth || case.subject.truth.is_some())
            && !(rule.code.is_failure() && (grade == Grade::Right || is_concluded));
        if let Some(verdict) = applies.then(|| test(case)).flatten() {
            is_concluded |= rule.is_conclusive;
            found.push(verdict);
        }
    }
    in_order(found, case.family)
}

/// The verdicts with each that yields to others behind the last of those.
fn in_order(mut found: Vec<Diagnosis>, family: Family) -> Vec<Diagnosis> {
    for at in (0..found.len()).rev() {
        let yields_to = (found[at].code.rule().yields_to)(family, &found[at].evidence);
        let last = found.iter().rposition(|other| yields_to.contains(&other.code));
        if let Some(last) = last.filter(|&last| last > at) {
            found[at..=last].rotate_left(1);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_one_query_says_of_a_scene_comes_behind_what_needs_no_suspicion() {
        let order = |evidence: Value, family: Family, others: [Code; 2]| {
            let found =
                |code: Code, evidence: Value| Diagnosis { code, text: String::new(), evidence };
            let [first, second] = others.map(|code| found(code, json!({})));
            let all = vec![found(Code::X1, evidence), first, second];
            in_order(all, family).iter().map(|one| one.code).collect::<Vec<_>>()
        };
        use Code::{D3, D7, R1, R3, X1};
        let camera = || json!({ "camera": {} });
        assert_eq!(order(camera(), Family::Features, [R1, R3]), [R1, X1, R3]);
        assert_eq!(order(camera(), Family::Grid, [D3, D7]), [D3, D7, X1]);
        assert_eq!(order(camera(), Family::Grid, [D3, R3]), [X1, D3, R3]);
        // Another system's poses in another convention, units and the truth are no suspicion of a scene.
        let poses = || json!({ "reading": "inverted" });
        assert_eq!(order(poses(), Family::Features, [R1, R3]), [R1, X1, R3]);
        assert_eq!(order(poses(), Family::Given, [D3, D7]), [X1, D3, D7]);
        assert_eq!(order(json!({ "unit": "mm" }), Family::Grid, [D3, D7]), [X1, D3, D7]);
    }
}
