//! One query, one method: the object of `run --json` and of a run folder.

use nalgebra::Matrix3x4;
use serde::{Deserialize, Serialize};

use super::explanation::Explanation;
use crate::diagnosis::{
    Assessment, Code, Confidence, Diagnosis, Family, Grade, PoseConfidence, Subject, Tolerance,
    confidence,
};
use crate::estimator::{self, CostSummary, Failure, FeatureCounts};
use crate::fusion::Fusion;
use crate::geometry::{Pose, PoseError, matrix_from_pose, pose_from_matrix};
#[cfg(doc)]
use crate::grid::GridParams;
use crate::grid::{Basin, Offset, Phase};
use crate::image::Degradation;
use crate::method::Method;
use crate::opinion::{Opinion, Standing};
use crate::params::Params;
use crate::scale::LengthUnit;
use crate::text::words;

/// The version of the result's form.
pub const SCHEMA: &str = "posescope.result/1";

/// What one method made of one query. It holds no clock, so that equal runs give equal bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QueryResult {
    /// The version of the form, [`SCHEMA`].
    pub schema: String,
    /// The name of the references' scene.
    pub scene: String,
    /// The name of the query's scene, where it is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub query_scene: Option<String>,
    /// The query frame's name.
    pub query: String,
    /// The reference frames' names.
    pub references: Vec<String>,
    /// The method.
    pub method: Method,
    /// How the method found its pose, if not in its usual way: `descent` for `pm` with `pm.search=descent`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<Family>,
    /// The fusion, if references were fused.
    pub fusion: Option<Fusion>,
    /// The seed of every random choice.
    pub seed: u64,
    /// The unit of all lengths, if it is not the metre.
    #[serde(default, skip_serializing_if = "LengthUnit::is_metre")]
    pub unit: LengthUnit,
    /// The length that stands for one metre of the paper's streets, if it is another.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub scale: f64,
    /// What was done to the query's photo before, if anything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degraded: Option<Degradation>,
    /// What an experiment varies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub setting: Option<Setting>,
    /// Whether there is a pose.
    pub status: Status,
    /// What it is worth by the truth, within the tolerance of the run.
    pub grade: Grade,
    /// Why there is none.
    pub reason: Option<Reason>,
    /// The estimated pose.
    pub pose: Option<PoseReport>,
    /// Its error, where the truth is known.
    pub error: Option<PoseError>,
    /// The error of the reference pose, where the truth is known.
    pub initial_error: Option<PoseError>,
    /// Where the features went, if features were used.
    pub counts: Option<FeatureCounts>,
    /// What the cost was like, if a cost was minimised.
    pub cost: Option<CostReport>,
    /// What our costs say of a pose that another system found.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub costs_at_pose: Vec<CostAtPose>,
    /// Why the pose is wrong, missing or uncertain, the primary verdict first.
    pub diagnosis: Vec<Diagnosis>,
    /// What was tried to make a wrong pose right, if it was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explanation: Option<Explanation>,
    /// How likely the pose is right, by what the method itself leaves behind.
    pub confidence: Option<PoseConfidence>,
    /// What posescope thinks of a pose that another system found, without the truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opinion: Option<Opinion>,
    /// How far the poses of the methods that ran before on the same reference are from this one. The
    /// confidence does not know of them, so that it depends on no other method.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub agreement: Vec<Agreement>,
    /// What each reference alone gave, where several were fused; they have no such list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per_reference: Option<Vec<QueryResult>>,
}

fn one() -> f64 {
    1.0
}

fn is_one(scale: &f64) -> bool {
    *scale == 1.0
}

/// What an experiment varies from one result of a query to the next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// The uncertainty radius \[m\].
    pub radius_m: f64,
    /// References asked for; there may be fewer within the radius.
    pub references: usize,
}

/// Whether a query was localised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// There is a pose.
    Ok,
    /// There is a reason.
    Failed,
}

words!(Status, "status": Ok = "ok", Failed = "failed");

/// A reason with its code.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reason {
    /// The code, such as `R3`.
    pub code: Code,
    /// The reason in one sentence with the numbers.
    pub text: String,
}

/// The pose of another method beside this one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// The other method.
    pub method: Method,
    /// Distance of the camera centres \[m\].
    pub translation_m: f64,
    /// Geodesic angle \[°\].
    pub rotation_deg: f64,
}

/// A pose in the forms that people paste elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseReport {
    /// `[R|t]`, row by row.
    pub world_from_camera: [[f64; 4]; 3],
    /// The camera centre \[m\].
    pub position_m: [f64; 3],
    /// The rotation, scalar last and not negative.
    pub quaternion_xyzw: [f64; 4],
}

impl From<&Pose> for PoseReport {
    fn from(pose: &Pose) -> Self {
        let matrix = matrix_from_pose(pose);
        let t = pose.translation.vector;
        let q = pose.rotation.coords;
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        Self {
            world_from_camera: std::array::from_fn(|row| {
                std::array::from_fn(|column| matrix[(row, column)])
            }),
            position_m: [t.x, t.y, t.z],
            quaternion_xyzw: [q.x * sign, q.y * sign, q.z * sign, q.w * sign],
        }
    }
}

impl PoseReport {
    /// The pose; `None` where the numbers are none.
    pub fn to_pose(&self) -> Option<Pose> {
        let rows = &self.world_from_camera;
        pose_from_matrix(&Matrix3x4::from_fn(|row, column| rows[row][column])).ok()
    }
}

/// The cost of a direct method at the poses that matter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CostReport {
    /// The cost at the reference pose.
    pub initial: Option<f64>,
    /// The cost at the estimate.
    pub best: f64,
    /// The cost at the true pose, where that is known.
    pub truth: Option<f64>,
    /// The cost at the estimate with the view's pixels shuffled.
    pub shuffled: Option<f64>,
    /// The cost at the second-best local minimum.
    pub runner_up: Option<f64>,
    /// Share of the image that is covered at the estimate.
    pub coverage_best: f64,
    /// Share of the image that is covered at the reference pose.
    pub coverage_reference: f64,
    /// Hypotheses that were scored.
    pub evaluations: u64,
    /// Whether the estimate lies where the search ends, so that it has not converged within its range: at the rim of a
    /// grid ([`GridParams::is_on_rim`]), or where the starts end ([`GridParams::is_on_edge`]).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub on_rim: bool,
    /// From how far around the truth the coarse positions lead to it ([`Basin::radius_m`]), where the
    /// truth is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub basin_m: Option<f64>,
    /// Cost of the lowest coarse minimum elsewhere less that at the truth ([`Basin::margin`]); negative
    /// where the cost prefers another place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub basin_margin: Option<f64>,
}

impl CostReport {
    fn new(summary: &CostSummary, truth: Option<f64>, on_rim: bool, basin: Option<Basin>) -> Self {
        Self {
            initial: summary.initial,
            best: summary.best,
            truth,
            shuffled: summary.shuffled,
            runner_up: summary.runner_up,
            coverage_best: summary.coverage_best,
            coverage_reference: summary.coverage_reference,
            evaluations: summary.evaluations,
            on_rim,
            basin_m: basin.map(|basin| basin.radius_m),
            basin_margin: basin.and_then(|basin| basin.margin),
        }
    }
}

/// A cost at a pose that was not searched by it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CostAtPose {
    /// The method that searches this cost.
    pub method: Method,
    /// The cost at the pose; none where too little can be compared.
    pub cost: Option<f64>,
    /// The cost at the true pose, where that is known.
    pub truth: Option<f64>,
    /// Share of the image that is covered at the pose.
    pub coverage: f64,
}

/// The costs of every method that searches one, at a pose of the query.
fn costs_at(subject: &Subject<'_>, pose: &Pose) -> Vec<CostAtPose> {
    let problem = subject.problem;
    let mut poses = vec![problem.reference_from_query(pose)];
    poses.extend(subject.truth.map(|truth| problem.reference_from_query(truth)));
    let searching = estimator::all().iter().filter(|entry| entry.cost().is_some());
    let mut costs = Vec::new();
    for entry in searching {
        let estimator = entry.make(subject.params);
        let Some(scorer) = estimator.scorer(problem) else { continue };
        let scores = scorer.score(&poses);
        costs.push(CostAtPose {
            method: entry.method,
            cost: scores[0].cost,
            truth: scores.get(1).and_then(|score| score.cost),
            coverage: f64::from(scores[0].covered) / problem.query.intrinsics.area(),
        });
    }
    costs
}

/// Measures an outcome against the true pose, where it is known; `assessment` is that of the subject.
pub fn evaluate(scene: &str, subject: &Subject<'_>, assessment: Assessment) -> QueryResult {
    let Subject { problem, method, outcome, truth, .. } = *subject;
    let cost_at_truth = truth.filter(|_| outcome.cost.is_some()).and_then(|truth_pose| {
        let estimator = estimator::find(method)?.make(subject.params);
        match estimator.scorer(problem) {
            Some(scorer) => scorer.score(&[problem.reference_from_query(truth_pose)])[0].cost,
            None => estimator.compare_at(problem, truth_pose)?.score.cost,
        }
    });
    let responsible = confidence::responsible(method, outcome);
    let [family, usual] =
        [subject.params, &Params::default()].map(|params| Family::of(responsible, params));
    // Lattices that a search did not follow say nothing of it.
    let basin = truth.filter(|_| family != Some(Family::Descent)).and_then(|truth| {
        let place = Offset::of(&problem.reference_from_query(truth));
        subject.evidence.surface(Phase::PositionCoarse)?.basin(&place)
    });
    let on_rim = subject.evidence.minimum.is_some_and(|minimum| {
        let (grid, radius_m) = (&subject.params.grid, problem.uncertainty_radius_m);
        match family {
            Some(Family::Grid) => grid.is_on_rim(&minimum.offset, radius_m),
            // The headings of its starts end elsewhere, and no heading is out of their reach.
            Some(Family::MultiStart) => grid.is_on_edge(&minimum.offset, radius_m),
            _ => false,
        }
    });
    QueryResult {
        references: vec![problem.reference.name.clone()],
        family: family.filter(|_| family != usual),
        initial_error: truth
            .map(|truth| PoseError::between(truth, &problem.reference.world_from_camera)),
        counts: outcome.counts,
        cost: outcome
            .cost
            .as_ref()
            .map(|summary| CostReport::new(summary, cost_at_truth, on_rim, basin)),
        costs_at_pose: match &outcome.pose {
            // A method that is in no registry is another system.
            Ok(pose) if estimator::find(method).is_none() => costs_at(subject, pose),
            _ => Vec::new(),
        },
        grade: assessment.grade,
        diagnosis: assessment.verdicts,
        confidence: assessment.confidence,
        ..QueryResult::new(
            scene,
            &problem.query.name,
            method,
            problem.seed,
            outcome.pose.as_ref(),
            truth,
            subject.tolerance,
        )
    }
}

impl QueryResult {
    /// What follows from the pose alone; without references, counts and costs.
    pub fn new(
        scene: &str,
        query: &str,
        method: Method,
        seed: u64,
        pose: Result<&Pose, &Failure>,
        truth: Option<&Pose>,
        right: Tolerance,
    ) -> Self {
        let error = truth.zip(pose.ok()).map(|(truth, pose)| PoseError::between(truth, pose));
        Self {
            schema: SCHEMA.to_owned(),
            scene: scene.to_owned(),
            query_scene: None,
            query: query.to_owned(),
            references: Vec::new(),
            method,
            family: None,
            fusion: None,
            seed,
            unit: LengthUnit::Metre,
            scale: 1.0,
            degraded: None,
            setting: None,
            status: if pose.is_ok() { Status::Ok } else { Status::Failed },
            grade: Grade::of(pose.is_ok(), error.as_ref(), right),
            reason: pose
                .err()
                .map(|failure| Reason { code: Code::of(failure), text: failure.to_string() }),
            pose: pose.ok().map(PoseReport::from),
            error,
            initial_error: None,
            counts: None,
            cost: None,
            costs_at_pose: Vec::new(),
            diagnosis: pose.err().map(Diagnosis::of_failure).into_iter().collect(),
            explanation: None,
            confidence: None,
            opinion: None,
            agreement: Vec::new(),
            per_reference: Some(Vec::new()),
        }
    }

    /// The grade as it may be shown: what the truth decides is unmeasured where the truth is hidden.
    pub fn grade_shown(&self, shows_truth: bool) -> Grade {
        match self.grade {
            Grade::Right | Grade::Wrong if !shows_truth => Grade::Unmeasured,
            grade => grade,
        }
    }

    /// What may be shown of it: with the truth hidden, nothing that needs the truth.
    #[must_use]
    pub fn shown(&self, shows_truth: bool) -> Self {
        let mut shown = self.clone();
        if shows_truth {
            return shown;
        }
        shown.grade = self.grade_shown(false);
        shown.error = None;
        shown.initial_error = None;
        shown.explanation = None;
        shown.diagnosis.retain(|found| !found.code.rule().needs_truth);
        if let Some(cost) = &mut shown.cost {
            cost.truth = None;
        }
        for cost in &mut shown.costs_at_pose {
            cost.truth = None;
        }
        let alone = shown.per_reference.iter_mut().flatten();
        alone.for_each(|one| *one = one.shown(false));
        shown
    }

    /// What became of the query: the reason of a failure, or the grade with the error.
    pub fn words(&self) -> String {
        match &self.reason {
            Some(reason) => format!("{} {}", reason.code, reason.text),
            None => self.grade.words(self.error.as_ref()),
        }
    }

    /// The same result, graded by another tolerance.
    #[must_use]
    pub fn graded(self, right: Tolerance) -> Self {
        Self { grade: Grade::of(self.status == Status::Ok, self.error.as_ref(), right), ..self }
    }

    /// Its confidence in one word, where it has one.
    pub fn confidence_word(&self) -> Option<Confidence> {
        self.confidence.as_ref().map(|confidence| confidence.word)
    }

    /// How the method found its pose; `None` for a hybrid in its usual way.
    pub fn family(&self) -> Option<Family> {
        self.family.or_else(|| Family::of(self.method, &Params::default()))
    }

    /// Whether a hybrid took its second method's answer.
    pub fn fell_back(&self) -> bool {
        let is_hybrid = estimator::find(self.method).is_some_and(|entry| entry.hybrid().is_some());
        is_hybrid && (self.cost.is_some() || self.status == Status::Failed)
    }

    /// Whether it is among the results to look at first: it failed, or nothing measures it and a second opinion
    /// contradicts it.
    pub fn is_suspect(&self) -> bool {
        let is_contradicted = || {
            let opinion = self.opinion.as_ref();
            opinion.is_some_and(|opinion| opinion.standing == Standing::Contradicted)
        };
        self.grade.is_failure() || self.grade == Grade::Unmeasured && is_contradicted()
    }

    /// How far off its position is \[m\]: by the truth, or else by a second opinion.
    pub fn off_m(&self) -> Option<f64> {
        let estimated = self.opinion.as_ref().and_then(Opinion::distance_m);
        self.error.map(|error| error.translation_m).or(estimated)
    }

    /// The same, as it stands in the list of another result.
    pub fn nested(&self) -> Self {
        Self { per_reference: None, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn with_the_truth_hidden_nothing_is_left_that_needs_it() {
        let error = json!({"translation_m": 12.5, "rotation_deg": 1.0, "max_euler_deg": 1.0});
        let finding = |code: &str| json!({"code": code, "text": "A sentence.", "evidence": {}});
        let result = json!({
            "schema": SCHEMA, "scene": "street", "query": "000070", "references": ["000062"],
            "method": "mi", "seed": 0, "status": "ok", "grade": "wrong",
            "error": error, "initial_error": error,
            "costs_at_pose": [{"method": "mi", "cost": 0.9, "coverage": 0.1, "truth": 0.8}],
            "diagnosis": [finding("D2"), finding("D1"), finding("L1")],
            "explanation": {"helped": [], "runs": 3, "complete": true}
        });
        let alone: QueryResult = serde_json::from_value(result).expect("a result");
        let fused = QueryResult { per_reference: Some(vec![alone.clone()]), ..alone };
        assert_eq!(fused.shown(true), fused);
        let hidden = fused.shown(false);
        let inside = hidden.per_reference.as_ref().expect("kept")[0].clone();
        for shown in [&hidden, &inside] {
            assert_eq!(shown.grade, Grade::Unmeasured);
            assert_eq!((shown.error, shown.initial_error), (None, None));
            assert_eq!(shown.explanation, None);
            assert_eq!(shown.costs_at_pose[0].truth, None);
            assert_eq!(shown.costs_at_pose[0].cost, Some(0.9));
            let codes: Vec<Code> = shown.diagnosis.iter().map(|one| one.code).collect();
            assert_eq!(codes, [Code::D1, Code::L1]);
        }
    }
}
