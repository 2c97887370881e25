//! What only several queries can show: a mistake of a whole scene.
//!
//! One query's verdict about a camera, about poses or about a cloud may be chance. Where several queries agree on one
//! value, it is not.

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::{Value, json};

use super::groups::grouped;
use crate::diagnosis::{Code, Diagnosis};
use crate::localize::QueryResult;

/// The least number of queries that agree.
const MIN_QUERIES: usize = 3;
/// Values agree if they differ by no more than this share.
const AGREEING: f64 = 0.02;
/// The share of all queries that must agree if fewer than [`MIN_QUERIES`] of them are certain.
const COMMON_HINT: f64 = 0.25;

/// A mistake that several queries agree on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The verdict of the single queries.
    pub code: Code,
    /// The scene or the method with the mistake.
    pub of: String,
    /// The number of queries that agree.
    pub queries: usize,
    /// The mistake in one sentence.
    pub text: String,
    /// The value that they agree on.
    pub evidence: Value,
}

/// What a verdict says about a whole scene.
#[derive(Clone, Debug, PartialEq)]
enum Claim {
    /// Another focal length and centre of a camera \[px\].
    Camera { whose: &'static str, seen: [f64; 3], stated: [f64; 3] },
    /// Poses are meant otherwise.
    Poses { reading: String },
    /// Lengths have another unit.
    Units { unit: String },
    /// Clouds do not belong to the photos.
    Clouds,
}

/// A claim of one query. `of` is the scene that it is about, or the method with the poses.
struct Vote<'a> {
    query: &'a str,
    claim: Claim,
    /// Whether the query alone is nearly certain of it; else it is a hint.
    certain: bool,
}

/// The mistakes that queries of these results agree on, in the order of the results.
pub fn findings(results: &[&QueryResult]) -> Vec<Finding> {
    let votes = results.iter().flat_map(|result| {
        let alone = result.per_reference.iter().flatten();
        let verdicts = alone.chain([*result]).flat_map(|one| &one.diagnosis);
        let suspicions = verdicts.filter(|verdict| verdict.code == Code::X1);
        let claims = suspicions.filter_map(|verdict| Some((claim(verdict)?, is_certain(verdict))));
        claims.map(|(claim, certain)| {
            let queries = result.query_scene.as_ref().unwrap_or(&result.scene);
            let of = match &claim {
                Claim::Camera { whose: QUERY, .. } => queries.clone(),
                Claim::Poses { .. } if is_given(result) => result.method.to_string(),
                _ => result.scene.clone(),
            };
            let kind = std::mem::discriminant(&claim);
            ((of, format!("{kind:?}")), Vote { query: &result.query, claim, certain })
        })
    });
    let by_subject = grouped(votes).into_iter();
    let agreed = by_subject.filter_map(|((of, _), votes)| agreed(of, &votes, results));
    without_references(results).into_iter().chain(agreed).collect()
}

/// Pairs of scenes in which no query has a reference.
fn without_references(results: &[&QueryResult]) -> Vec<Finding> {
    let pairs =
        grouped(results.iter().map(|result| ((&result.scene, &result.query_scene), *result)));
    let lacking = pairs.into_iter().filter_map(|((scene, query_scene), results)| {
        let queries: BTreeSet<&str> = results.iter().map(|result| result.query.as_str()).collect();
        let is_lacking = results.iter().all(|result| result.references.is_empty());
        (is_lacking && queries.len() >= MIN_QUERIES).then(|| Finding {
            code: Code::R1,
            of: scene.clone(),
            queries: queries.len(),
            text: format!(
                "None of {} queries of {} has a reference in {scene}. The poses may be in another unit or place.",
                queries.len(),
                query_scene.as_ref().unwrap_or(scene)
            ),
            evidence: json!({}),
        })
    });
    lacking.collect()
}

/// The camera of the queries alone.
const QUERY: &str = "query";
/// The camera of queries and references.
const BOTH: &str = "both";

fn is_given(result: &QueryResult) -> bool {
    crate::estimator::find(result.method).is_none()
}

fn is_certain(verdict: &Diagnosis) -> bool {
    verdict.evidence.get("certain").and_then(Value::as_bool).unwrap_or(true)
}

/// What a verdict claims of a whole scene; `None` for what is of one query.
fn claim(verdict: &Diagnosis) -> Option<Claim> {
    let evidence = &verdict.evidence;
    let camera = |key: &str| {
        let number = |name: &str| evidence.get(key)?.get(name)?.as_f64();
        Some([number("fx")?, number("cx")?, number("cy")?])
    };
    if let (Some(seen), Some(stated)) = (camera("camera"), camera("stated")) {
        let whose = if evidence.get("explained").is_some() { QUERY } else { BOTH };
        return Some(Claim::Camera { whose, seen, stated });
    }
    let word = |key: &str| Some(evidence.get(key)?.as_str()?.to_owned());
    if let Some(unit) = word("unit") {
        return Some(Claim::Units { unit });
    }
    if let Some(reading) = word("reading") {
        return Some(Claim::Poses { reading });
    }
    evidence.get("wrong_depth").is_some().then_some(Claim::Clouds)
}

/// The claim that most queries agree on, if they are enough.
fn agreed(of: String, votes: &[Vote<'_>], results: &[&QueryResult]) -> Option<Finding> {
    let queries_of = |wanted: &dyn Fn(&&Vote<'_>) -> bool| -> BTreeSet<&str> {
        votes.iter().filter(wanted).map(|vote| vote.query).collect()
    };
    let queries_for = |claim: &Claim| queries_of(&|vote| claim.agrees(&vote.claim));
    // Claims that are equal are asked once.
    let mut claims: Vec<&Claim> = Vec::new();
    for vote in votes {
        if !claims.contains(&&vote.claim) {
            claims.push(&vote.claim);
        }
    }
    let candidates = claims.into_iter().map(|claim| (queries_for(claim), claim));
    // Of equal ones the first.
    let (queries, claim) =
        candidates.reduce(|best, next| if next.0.len() > best.0.len() { next } else { best })?;
    let voting = queries_of(&|_| true);
    let certain = queries_of(&|vote| vote.certain && claim.agrees(&vote.claim));
    let all: BTreeSet<&str> = results.iter().map(|result| result.query.as_str()).collect();
    // A mistake of a whole scene is seen in many of its queries; chance agrees in a few of many.
    let is_common = 3 * queries.len() >= voting.len()
        && claim.is_common(queries.len(), all.len())
        && (certain.len() >= MIN_QUERIES || queries.len() as f64 >= COMMON_HINT * all.len() as f64);
    let (text, evidence) = claim.words(&of, queries.len());
    (queries.len() >= MIN_QUERIES && is_common).then_some(Finding {
        code: Code::X1,
        of,
        queries: queries.len(),
        text,
        evidence,
    })
}

impl Claim {
    fn agrees(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Camera { whose, seen: [f, x, y], stated },
                Self::Camera { whose: other_whose, seen: [g, u, v], stated: other_stated },
            ) => {
                let same_centre = (x - u).hypot(y - v) <= AGREEING * f;
                let same_length = (f / g - 1.0).abs() <= AGREEING;
                whose == other_whose && stated == other_stated && same_centre && same_length
            }
            (one, other) => one == other,
        }
    }

    /// Whether so many queries are enough of all. Only clouds have no value to agree on.
    fn is_common(&self, queries: usize, all: usize) -> bool {
        *self != Self::Clouds || 2 * queries >= all
    }

    fn words(&self, of: &str, queries: usize) -> (String, Value) {
        match self {
            Self::Camera { whose, seen, stated } => {
                let cameras = if *whose == QUERY { "queries" } else { "queries and references" };
                let text = format!(
                    "The camera of the {cameras} of {of} is suspect: {queries} queries agree on a focal length of \
                     {:.0} px and a centre of ({:.0}, {:.0}), not {:.0} px and ({:.0}, {:.0}).",
                    seen[0], seen[1], seen[2], stated[0], stated[1], stated[2]
                );
                let camera = |[fx, cx, cy]: [f64; 3]| json!({ "fx": fx, "cx": cx, "cy": cy });
                (text, json!({ "camera": camera(*seen), "stated": camera(*stated) }))
            }
            Self::Poses { reading } => (
                format!(
                    "The poses of {of} are in another convention: read as {reading}, they agree with {queries} queries."
                ),
                json!({ "reading": reading }),
            ),
            Self::Units { unit } => (
                format!("The clouds of {of} are in {unit}, by their depths in {queries} queries."),
                json!({ "unit": unit }),
            ),
            Self::Clouds => (
                format!("The clouds of {of} do not fit its photos, by {queries} queries."),
                json!({}),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::metrics::tests::row;

    fn with_camera(query: &str, fx: f64) -> QueryResult {
        let camera = |fx: f64| json!({ "fx": fx, "fy": fx, "cx": 320.0, "cy": 240.0 });
        let evidence = json!({ "explained": 3, "camera": camera(fx), "stated": camera(500.0) });
        let verdict = Diagnosis { code: Code::X1, text: String::new(), evidence };
        QueryResult { diagnosis: vec![verdict], ..row(query, "fb", Some(9.0)) }
    }

    fn found(rows: &[QueryResult]) -> Vec<Finding> {
        findings(&rows.iter().collect::<Vec<_>>())
    }

    #[test]
    fn three_queries_that_agree_on_a_camera_are_a_finding() {
        let rows = [("a", 600.0), ("b", 603.0), ("c", 900.0), ("d", 598.0)]
            .map(|(q, f)| with_camera(q, f));
        let found = found(&rows);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].queries, found[0].of.as_str()), (3, "street"));
        assert!(found[0].text.contains("600 px"), "{}", found[0].text);
    }

    #[test]
    fn hints_count_where_a_quarter_of_the_queries_agree() {
        let hint = |query: &str, certain: bool| {
            let mut result = with_camera(query, 600.0);
            result.diagnosis[0].evidence["certain"] = json!(certain);
            result
        };
        let right = |at: usize| row(&format!("right {at}"), "fb", Some(0.1));
        let with_right = |certain: bool, count: usize| {
            let hints = ["a", "b", "c"].map(|query| hint(query, certain));
            found(&hints.into_iter().chain((0..count).map(right)).collect::<Vec<_>>()).len()
        };
        assert_eq!([with_right(false, 9), with_right(false, 10), with_right(true, 10)], [1, 0, 1]);
    }

    #[test]
    fn a_scene_without_any_reference_is_a_finding() {
        let lacking = |query: &str| QueryResult { references: vec![], ..row(query, "fb", None) };
        let found_one = found(&["a", "b", "c"].map(lacking));
        assert_eq!((found_one.len(), found_one[0].queries), (1, 3));
        assert_eq!(found(&["a", "b"].map(lacking)), []);
        let one_has = [lacking("a"), lacking("b"), lacking("c"), row("d", "fb", Some(0.1))];
        assert_eq!(found(&one_has), []);
    }

    #[test]
    fn queries_that_disagree_or_are_few_are_none() {
        let of = |lengths: &[f64]| {
            let rows = lengths.iter().enumerate();
            found(&rows.map(|(at, f)| with_camera(&at.to_string(), *f)).collect::<Vec<_>>())
        };
        assert_eq!(of(&[600.0, 601.0]), []);
        assert_eq!(of(&[300.0, 400.0, 600.0, 800.0]), []);
        let scattered: Vec<f64> = (0..10).map(|at| 300.0 * 1.1_f64.powi(at)).collect();
        assert_eq!(of(&[&scattered[..], &[600.0, 601.0, 602.0]].concat()), []);
        // One query counts once, however many of its methods agree.
        let same = [with_camera("a", 600.0), with_camera("a", 600.0), with_camera("a", 601.0)];
        assert_eq!(found(&same), []);
    }
}
