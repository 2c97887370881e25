//! Verdicts on a pose that another system found: those of a direct method that need the pose alone.
//!
//! How the pose was found is not known, so no verdict speaks of that; what the images say of it is the
//! same whoever found it. The cost of MI is asked, which bears the greatest changes of appearance.

use std::sync::Arc;

use serde_json::json;

use super::{Code, Diagnosis, Evidence, Subject, direct, failure_alone};
use crate::cost::shuffled;
use crate::estimator::{self, CostSummary, Outcome};
use crate::event::MinimumAssessed;
use crate::grid::{Lattice, Offset, Phase, ScoredLattice, least_covered};
use crate::method::Method;
use crate::render::Score;

/// The method whose cost is asked.
const JUDGE: Method = Method::MI;

/// What speaks of a grid that nobody searched.
const OF_A_SEARCH: [Code; 2] = [Code::D4, Code::D8];

/// The verdicts on a pose from elsewhere, held against the truth.
pub(super) fn diagnose(subject: &Subject<'_>) -> Vec<Diagnosis> {
    if subject.truth.is_none() || subject.outcome.pose.is_err() {
        return failure_alone(subject);
    }
    let Some(stated) = stated(subject) else {
        return Vec::new();
    };
    let Some((outcome, evidence)) = stated.as_searched(subject) else {
        return vec![nothing_to_see(&stated)];
    };
    let judged = Subject {
        method: JUDGE,
        outcome: &outcome,
        evidence: &evidence,
        ..subject.clone()
    };
    let mut found = direct::diagnose(&judged);
    found.retain(|finding| !OF_A_SEARCH.contains(&finding.code));
    if found.is_empty() {
        found.extend(stated.beside_the_truth());
    }
    let at_pose = stated.at_pose.cost;
    found
        .into_iter()
        .map(|finding| in_words(finding, at_pose))
        .collect()
}

/// What the judge's cost is at the pose and at the reference.
struct Stated {
    offset: Offset,
    at_pose: Score,
    at_reference: Score,
    at_truth: Option<Score>,
    shuffled: Option<f64>,
}

fn stated(subject: &Subject<'_>) -> Option<Stated> {
    let Subject {
        problem, params, ..
    } = *subject;
    let pose = subject.outcome.pose.as_ref().ok()?;
    let reference_from_query = problem.reference_from_query(pose);
    let entry = estimator::find(JUDGE)?;
    let measure = params.costs.of(entry.cost()?)?.cost();
    let mut stated = None;
    entry.make(params).with_scorer(problem, &mut |scorer| {
        let start = Offset::default().reference_from_camera();
        let mut poses = vec![reference_from_query, start];
        poses.extend(subject.reference_from_truth());
        let scores = scorer.score(&poses);
        let pairs = scorer.compare(&reference_from_query).pairs;
        let pairs = shuffled(&pairs, problem.random_seed("shuffled pixels"));
        stated = Some(Stated {
            offset: Offset::of(&reference_from_query),
            at_pose: scores[0],
            at_reference: scores[1],
            at_truth: scores.get(2).copied(),
            shuffled: measure.evaluate(&pairs),
        });
    });
    stated
}

impl Stated {
    fn least_covered(&self, subject: &Subject<'_>) -> u32 {
        least_covered(
            subject.params.grid.coverage_floor,
            self.at_reference.covered,
        )
    }

    /// The outcome of a search that ended in the pose and looked at nothing else; `None` where the
    /// pose has no say.
    fn as_searched(&self, subject: &Subject<'_>) -> Option<(Outcome, Evidence)> {
        let problem = subject.problem;
        let least_covered = self.least_covered(subject);
        let best = self.at_pose.eligible_cost(least_covered)?;
        let area = problem.query.intrinsics.area();
        let initial = self.at_reference.cost;
        let summary = CostSummary {
            initial,
            best,
            shuffled: self.shuffled,
            runner_up: None,
            coverage_best: f64::from(self.at_pose.covered) / area,
            coverage_reference: f64::from(self.at_reference.covered) / area,
            evaluations: 0,
        };
        let outcome = Outcome {
            cost: Some(summary),
            ..subject.outcome.clone()
        };
        let radius_m = problem.uncertainty_radius_m;
        let start = Offset::default();
        let lattice = Lattice::new(Phase::PositionCoarse, start, radius_m, &subject.params.grid);
        let surface = lattice.ok().map(|lattice| ScoredLattice {
            scores: vec![None; lattice.cells()],
            lattice,
            least_covered,
        });
        let evidence = Evidence {
            surfaces: surface.into_iter().map(Arc::new).collect(),
            minimum: Some(MinimumAssessed {
                offset: self.offset,
                initial,
                best,
                shuffled: self.shuffled,
                runner_up: None,
            }),
            ..Evidence::default()
        };
        Some((outcome, evidence))
    }
}

impl Stated {
    /// Where the truth is out of reach of a search, its own cost still says which of both is preferred.
    fn beside_the_truth(&self) -> Option<Diagnosis> {
        let (pose, truth) = (self.at_pose.cost?, self.at_truth?.cost?);
        let code = if truth < pose { Code::D3 } else { Code::D2 };
        let evidence = json!({ "cost_near_truth": truth, "cost_at_result": pose });
        Some(Diagnosis::new(code, "", evidence))
    }
}

/// At the pose, next to nothing of the reference is in view.
fn nothing_to_see(stated: &Stated) -> Diagnosis {
    let (covered, of) = (stated.at_pose.covered, stated.at_reference.covered);
    Diagnosis::new(
        Code::D1,
        format!(
            "at this pose the view of the reference's cloud covers {covered} px, and {of} at the \
             reference: hardly anything speaks for it"
        ),
        json!({ "judge": JUDGE.name(), "covered": covered, "covered_at_reference": of }),
    )
}

/// What was said of a search, said of a pose.
fn in_words(finding: Diagnosis, at_pose: Option<f64>) -> Diagnosis {
    let here = at_pose.map_or("nothing".to_owned(), |cost| format!("{cost:.4}"));
    let near = finding.evidence["cost_near_truth"].as_f64();
    let near = near.map_or("nothing".to_owned(), |cost| format!("{cost:.4}"));
    let text = match finding.code {
        Code::D3 => format!(
            "the cost of {JUDGE} tells this pose from the truth: it is {here} here and {near} near the \
             truth"
        ),
        Code::D2 => format!(
            "the cost of {JUDGE} does not prefer the truth either: it is {here} here, and near the truth \
             at best {near}"
        ),
        Code::X1 | Code::D5 => finding.text,
        _ => format!("by the cost of {JUDGE}, {}", finding.text),
    };
    let mut evidence = finding.evidence;
    if let Some(entries) = evidence.as_object_mut() {
        entries.insert("judge".to_owned(), json!(JUDGE.name()));
    }
    Diagnosis {
        code: finding.code,
        text,
        evidence,
    }
}
