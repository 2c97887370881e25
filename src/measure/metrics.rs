//! The figures of many queries.
//!
//! A *success* is defined as in the paper: a pose within the failure radius of the run. A *right* pose is within
//! the tolerance `--right`. Medians and RMSE are over successes, and also, as in the paper, over queries that all
//! methods report as solved, whatever the error. Their rotation is the greatest Euler angle, as in the paper. The
//! recall uses the rotation angle, and counts a failure as an infinite error.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::chance::Chance;
use super::groups::grouped;
use crate::diagnosis::{Code, Grade};
use crate::fusion::Fusion;
use crate::geometry::PoseError;
use crate::localize::{QueryResult, Setting, Status};
use crate::method::Method;
use crate::opinion::Standing;

/// The limits of the recall: metres and degrees.
pub const RECALL_LIMITS: [(f64, f64); 3] = [(0.25, 2.0), (0.5, 5.0), (5.0, 10.0)];

/// The paper's success (section 4.2): there is a pose, and its error is below the failure radius if the truth is
/// known. An error of NaN is not below.
pub(super) fn is_success(result: &QueryResult, failure_radius_m: f64) -> bool {
    let is_near = |error: &PoseError| error.translation_m < failure_radius_m;
    result.status == Status::Ok && result.error.as_ref().is_none_or(is_near)
}

/// A group of results that differ only in query and method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Group {
    /// The references' scene.
    pub scene: String,
    /// The queries' scene, if it is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub query_scene: Option<String>,
    /// The setting of the experiment.
    pub setting: Option<Setting>,
    /// The fusion.
    pub fusion: Option<Fusion>,
}

impl Group {
    /// The group of a result.
    pub fn of(result: &QueryResult) -> Self {
        Self {
            scene: result.scene.clone(),
            query_scene: result.query_scene.clone(),
            setting: result.setting,
            fusion: result.fusion,
        }
    }

    /// The scenes of references and, if different, of queries.
    pub fn scenes(&self) -> String {
        match &self.query_scene {
            Some(queries) => format!("{} ← {queries}", self.scene),
            None => self.scene.clone(),
        }
    }
}

impl std::fmt::Display for Group {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.scenes())?;
        if let Some(setting) = &self.setting {
            write!(f, ", {} m, {} ref.", setting.radius_m, setting.references)?;
        }
        match &self.fusion {
            Some(fusion) => write!(f, ", {fusion}"),
            None => Ok(()),
        }
    }
}

/// Median and root mean square of errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The number of errors.
    pub count: usize,
    /// Median translation error \[m\].
    pub median_m: Option<f64>,
    /// Median of the greatest Euler angle \[°\].
    pub median_deg: Option<f64>,
    /// Root mean square of the translation error \[m\].
    pub rmse_m: Option<f64>,
    /// Root mean square of the greatest Euler angle \[°\].
    pub rmse_deg: Option<f64>,
}

impl Spread {
    fn of(errors: &[PoseError]) -> Self {
        let metres: Vec<f64> = errors.iter().map(|error| error.translation_m).collect();
        let degrees: Vec<f64> = errors.iter().map(|error| error.max_euler_deg).collect();
        Self {
            count: errors.len(),
            median_m: median(&metres),
            median_deg: median(&degrees),
            rmse_m: rmse(&metres),
            rmse_deg: rmse(&degrees),
        }
    }
}

/// The median; for an even number of values, the mean of the middle two.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    if sorted.len() % 2 == 1 {
        return Some(upper);
    }
    Some((sorted[sorted.len() / 2 - 1] + upper) / 2.0)
}

fn rmse(values: &[f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let squares: f64 = values.iter().map(|value| value * value).sum();
    Some((squares / values.len() as f64).sqrt())
}

/// The figures of a method on a group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// The group.
    #[serde(flatten)]
    pub group: Group,
    /// The method.
    pub method: Method,
    /// The number of queries.
    pub queries: usize,
    /// The number of queries with a pose: the method reports them as solved, whatever the error.
    pub poses: usize,
    /// The number of poses that are not on the edge of a direct method's grid, where the search has not converged
    /// within its range (paper, section 4.2).
    #[serde(default)]
    pub off_rim: usize,
    /// The number of queries without a reference; they count as failures.
    #[serde(default)]
    pub without_reference: usize,
    /// The number of queries with a right pose, within the tolerance of the run.
    #[serde(default)]
    pub right: usize,
    /// The number of queries with a pose within the failure radius.
    pub successes: usize,
    /// Successes over queries.
    pub success_rate: f64,
    /// Errors of the successes.
    pub of_successes: Spread,
    /// Errors of the queries that the method reports as solved, whatever the error.
    #[serde(default)]
    pub of_solved: Spread,
    /// Errors of the queries that every method reports as solved, whatever the errors.
    pub of_common: Spread,
    /// Shares of the queries within [`RECALL_LIMITS`], with failures counted as infinite; `None` if the truth is
    /// unknown.
    pub recall: Option<[f64; 3]>,
    /// The count of each primary verdict.
    #[serde(default)]
    pub verdicts: BTreeMap<Code, usize>,
    /// The success rate of chance; `None` if the truth is unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chance: Option<Chance>,
    /// Median probability of being right, over poses with a confidence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_confidence: Option<f64>,
    /// How many poses of another system an opinion comes to; empty for posescope's own.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub opinions: BTreeMap<Standing, usize>,
    /// Median time of the method \[s\]; not in summaries, which contain no times.
    #[serde(skip)]
    pub median_s: Option<f64>,
    /// All errors, failures as infinite, for custom limits; `None` if the truth is unknown.
    #[serde(skip)]
    pub errors: Option<Vec<(f64, f64)>>,
}

impl Measures {
    /// A number of queries as a share of all.
    pub fn share(&self, count: usize) -> f64 {
        share(count, self.queries)
    }

    /// Successes over the queries that had a reference.
    pub fn success_rate_with_reference(&self) -> f64 {
        share(self.successes, self.queries - self.without_reference)
    }

    /// A figure by its name in tables and gates; shares from 0 to 1.
    pub fn figure(&self, name: &str) -> Option<f64> {
        let (own, common) = (&self.of_successes, &self.of_common);
        match name {
            "queries" => Some(self.queries as f64),
            "solved" => Some(self.share(self.poses)),
            "off_rim" => Some(self.share(self.off_rim)),
            "right" => Some(self.share(self.right)),
            "success" => Some(self.success_rate),
            "success_with_reference" => Some(self.success_rate_with_reference()),
            "chance_reference" => Some(self.chance?.reference_pose),
            "chance_random" => Some(self.chance?.random_pose),
            "median_m" => own.median_m,
            "median_deg" => own.median_deg,
            "rmse_m" => own.rmse_m,
            "rmse_deg" => own.rmse_deg,
            "solved_median_m" => self.of_solved.median_m,
            "solved_median_deg" => self.of_solved.median_deg,
            "solved_rmse_m" => self.of_solved.rmse_m,
            "solved_rmse_deg" => self.of_solved.rmse_deg,
            "common" => Some(common.count as f64),
            "common_percent" => Some(self.share(common.count)),
            "common_median_m" => common.median_m,
            "common_median_deg" => common.median_deg,
            "recall_025" => Some(self.recall?[0]),
            "recall_050" => Some(self.recall?[1]),
            "recall_500" => Some(self.recall?[2]),
            "median(confidence)" => self.median_confidence,
            "median(time)" => self.median_s,
            "confirmed" => self.share_of_opinion(Standing::Confirmed),
            "contradicted" => self.share_of_opinion(Standing::Contradicted),
            "undecided" => self.share_of_opinion(Standing::Undecided),
            _ => None,
        }
    }

    /// The share of poses with an opinion that it comes to; `None` without any.
    fn share_of_opinion(&self, standing: Standing) -> Option<f64> {
        let all: usize = self.opinions.values().sum();
        (all > 0).then(|| share(self.opinions.get(&standing).copied().unwrap_or(0), all))
    }

    /// Share of the queries within limits \[m, °\], with failures counted as infinite.
    pub fn recall_within(&self, limit_m: f64, limit_deg: f64) -> Option<f64> {
        let errors = self.errors.as_ref()?;
        let within = |error: &&(f64, f64)| error.0 <= limit_m && error.1 <= limit_deg;
        Some(share(errors.iter().filter(within).count(), errors.len()))
    }
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// The figures of all groups and methods of a run, in the order of their first results.
pub fn measure<'a>(
    results: impl IntoIterator<Item = &'a QueryResult>,
    failure_radius_m: f64,
) -> Vec<Measures> {
    grouped(results.into_iter().map(|result| (Group::of(result), result)))
        .into_iter()
        .flat_map(|(group, results)| measure_group(&group, &results, failure_radius_m))
        .collect()
}

fn measure_group(group: &Group, rows: &[&QueryResult], failure_radius_m: f64) -> Vec<Measures> {
    let methods = grouped(rows.iter().map(|row| (row.method, *row)));
    let solved = methods.iter().map(|(_, rows)| {
        let solved = rows.iter().filter(|row| row.status == Status::Ok);
        solved.map(|row| row.query.as_str()).collect::<BTreeSet<_>>()
    });
    let solved: Vec<BTreeSet<&str>> = solved.collect();
    let is_common = |query: &str| solved.iter().all(|queries| queries.contains(query));
    let measure = |(method, rows): &(Method, Vec<&QueryResult>)| {
        let errors_of = |wanted: &dyn Fn(&QueryResult) -> bool| {
            let errors = rows.iter().filter(|row| wanted(row));
            Spread::of(&errors.filter_map(|row| row.error).collect::<Vec<_>>())
        };
        let success = |row: &QueryResult| is_success(row, failure_radius_m);
        let is_on_rim = |row: &QueryResult| row.cost.as_ref().is_some_and(|cost| cost.on_rim);
        let count =
            |wanted: &dyn Fn(&QueryResult) -> bool| rows.iter().filter(|row| wanted(row)).count();
        let confidences = rows.iter().filter_map(|row| row.confidence.as_ref());
        let confidences: Vec<f64> = confidences.map(|one| one.probability).collect();
        // A pose without an error means that the truth is unknown.
        let has_truth = rows.iter().all(|row| row.error.is_some() || row.status == Status::Failed);
        let error = |row: &&QueryResult| match (row.error, success(row)) {
            (Some(error), true) => (error.translation_m, error.rotation_deg),
            _ => (f64::INFINITY, f64::INFINITY),
        };
        let mut measures = Measures {
            group: group.clone(),
            method: *method,
            queries: rows.len(),
            poses: count(&|row| row.status == Status::Ok),
            off_rim: count(&|row| row.status == Status::Ok && !is_on_rim(row)),
            without_reference: count(&|row| row.references.is_empty()),
            right: count(&|row| row.grade == Grade::Right),
            successes: count(&success),
            success_rate: share(count(&success), rows.len()),
            of_successes: errors_of(&success),
            of_solved: errors_of(&|row| row.status == Status::Ok),
            of_common: errors_of(&|row| is_common(&row.query)),
            recall: None,
            verdicts: BTreeMap::new(),
            chance: Chance::of(
                rows.iter().map(|row| {
                    let away_m = row.initial_error.map(|error| error.translation_m);
                    (away_m, row.setting.map(|setting| setting.radius_m))
                }),
                failure_radius_m,
            ),
            median_confidence: median(&confidences),
            opinions: BTreeMap::new(),
            median_s: None,
            errors: has_truth.then(|| rows.iter().map(error).collect()),
        };
        for opinion in rows.iter().filter_map(|row| row.opinion.as_ref()) {
            *measures.opinions.entry(opinion.standing).or_default() += 1;
        }
        for primary in rows.iter().filter_map(|row| row.diagnosis.first()) {
            *measures.verdicts.entry(primary.code).or_default() += 1;
        }
        measures.recall = has_truth
            .then(|| RECALL_LIMITS.map(|(m, deg)| measures.recall_within(m, deg).unwrap_or(0.0)));
        measures
    };
    methods.iter().map(measure).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use serde_json::json;

    use super::*;
    use crate::diagnosis::Diagnosis;
    use crate::localize::{CostReport, SCHEMA};

    /// A result of fb or mi with an error in metres, and as many degrees; none where it failed.
    pub fn row(query: &str, method: &str, error: Option<f64>) -> QueryResult {
        let grade = match error {
            None => Grade::NoPose,
            Some(error) if error <= 2.0 => Grade::Right,
            Some(_) => Grade::Wrong,
        };
        let error = error.map(|error| PoseError {
            translation_m: error,
            rotation_deg: error,
            max_euler_deg: error / 2.0,
        });
        let result = json!({
            "schema": SCHEMA, "scene": "street", "query": query, "references": ["000000"], "method": method,
            "seed": 0, "status": if error.is_some() { "ok" } else { "failed" }, "grade": grade,
            "error": error, "diagnosis": []
        });
        serde_json::from_value(result).expect("a result")
    }

    /// A verdict without its words.
    pub fn finding(code: Code) -> Diagnosis {
        Diagnosis { code, text: String::new(), evidence: json!({}) }
    }

    /// The cost of a direct method.
    pub fn cost(best: f64, basin_m: Option<f64>, on_rim: bool) -> CostReport {
        let cost = json!({
            "best": best, "coverage_best": 0.5, "coverage_reference": 0.5, "evaluations": 1,
            "basin_m": basin_m, "on_rim": on_rim
        });
        serde_json::from_value(cost).expect("a cost")
    }

    /// Four queries; mi fails on the second by 12 m, fb on the last by its own report.
    pub fn rows() -> Vec<QueryResult> {
        let errors = [
            ("a", Some(0.1), Some(1.0)),
            ("b", Some(0.2), Some(12.0)),
            ("c", Some(0.6), Some(3.0)),
            ("d", None, Some(2.0)),
        ];
        errors
            .iter()
            .flat_map(|(query, fb, mi)| [row(query, "fb", *fb), row(query, "mi", *mi)])
            .collect()
    }

    #[test]
    fn four_queries_are_measured_as_by_hand() {
        let measures = measure(&rows(), 10.0);
        let [fb, mi] = measures.as_slice() else {
            panic!("two methods: {measures:?}");
        };
        assert_eq!((fb.queries, fb.poses, fb.successes), (4, 3, 3));
        assert_eq!((mi.queries, mi.poses, mi.successes), (4, 4, 3));
        assert_eq!(fb.success_rate, 0.75);
        assert_eq!(fb.of_successes.median_m, Some(0.2));
        assert_eq!(mi.of_successes.median_m, Some(2.0));
        // Both have a pose of a, b and c, though that of b is 12 m off.
        assert_eq!(fb.of_common.count, 3);
        assert_eq!(fb.of_common.median_m, Some(0.2));
        assert_eq!(mi.of_common.median_m, Some(3.0));
        let rmse = mi.of_successes.rmse_m.expect("there are successes");
        assert!((rmse - (14.0f64 / 3.0).sqrt()).abs() < 1e-12);
        // Failures are infinite: they count among the queries, never among those within a limit.
        assert_eq!(fb.recall, Some([0.5, 0.5, 0.75]));
        assert_eq!(mi.recall, Some([0.0, 0.0, 0.75]));
        assert_eq!(mi.recall_within(100.0, 180.0), Some(0.75));
    }

    #[test]
    fn minima_on_the_rim_and_queries_without_a_reference_are_counted_apart() {
        let mut rows =
            vec![row("a", "mi", Some(1.0)), row("b", "mi", Some(3.0)), row("c", "mi", None)];
        rows[1].cost = Some(cost(1.0, None, true));
        rows[2].references.clear();
        let measures = &measure(&rows, 10.0)[0];
        assert_eq!((measures.poses, measures.off_rim), (2, 1));
        assert_eq!(measures.without_reference, 1);
        assert!((measures.success_rate - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(measures.success_rate_with_reference(), 1.0);
    }

    #[test]
    fn without_truth_there_is_a_success_rate_and_no_error() {
        let mut rows = vec![row("a", "fb", Some(1.0)), row("b", "fb", None)];
        rows[0].error = None;
        let measures = measure(&rows, 10.0);
        assert_eq!(measures[0].success_rate, 0.5);
        assert_eq!(measures[0].of_successes.median_m, None);
        assert_eq!(measures[0].recall, None);
    }

    #[test]
    fn where_all_fail_there_is_no_median() {
        let measures = measure(&[row("a", "fb", None)], 10.0);
        assert_eq!(measures[0].of_successes, Spread::of(&[]));
        assert_eq!(measures[0].recall, Some([0.0; 3]));
    }
}
