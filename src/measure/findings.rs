//! Mistakes of a whole scene: what only several queries can show, and what `posescope doctor` says of the scene.
//!
//! One query's verdict about a camera, about poses or about a cloud may be chance. Where several queries agree on one
//! value, it is not.

use std::collections::BTreeSet;
use std::mem::discriminant;

use serde_json::{Value, json};

use super::finding::Finding;
use super::groups::grouped;
use crate::diagnosis::{Code, Diagnosis, Grade};
use crate::doctor::{self, Subject};
use crate::localize::QueryResult;

/// The least number of queries that agree.
const MIN_QUERIES: usize = 3;
/// Values agree if they differ by no more than this share.
const AGREEING: f64 = 0.02;
/// The share of all queries that must agree if fewer than [`MIN_QUERIES`] of them are certain.
const COMMON_HINT: f64 = 0.25;
/// The share of all queries whose clouds must not fit, by whatever value.
const COMMON_MISFIT: f64 = 1.0 / 3.0;
/// The share of a scene's queries that fail where a mistake of the scene matters.
const COMMON_FAILURE: f64 = 0.25;

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

/// The mistakes that queries of these results agree on, in the order of the results, and before them what
/// `posescope doctor` says of scenes whose queries fail often.
pub fn findings(results: &[&QueryResult], examined: &[Finding]) -> Vec<Finding> {
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
            (of, Vote { query: &result.query, claim, certain })
        })
    });
    let by_subject = grouped(votes).into_iter();
    let agreed = by_subject.flat_map(|(of, votes)| agreed(&of, votes, results));
    let failing = failing_scenes(results);
    let quoted = examined.iter().filter(|one| failing.contains(&one.of)).cloned();
    let mut found: Vec<Finding> = without_references(results).into_iter().chain(quoted).collect();
    for one in agreed {
        match found.iter_mut().find(|known| known.doctor && known.of == one.of) {
            None => found.push(one),
            Some(known) if is_same(known, &one) => {
                let text = format!("{} `posescope doctor` agrees.", one.text);
                *known = Finding { doctor: true, text, ..one };
            }
            // Neither explains both, so neither is hidden.
            Some(_) => {
                let text =
                    format!("{} `posescope doctor` names another mistake: compare both.", one.text);
                found.push(Finding { text, ..one });
            }
        }
    }
    // What the truth says of a file of poses, posescope's own poses need not say again.
    let of_files = super::systematic::of_given_poses(results).into_iter();
    let is_new =
        |one: &Finding| !found.iter().any(|known| known.of == one.of && known.about == one.about);
    let of_files: Vec<Finding> = of_files.filter(is_new).collect();
    found.extend(of_files);
    found
}

/// Whether `posescope doctor` names the mistake that queries agree on.
fn is_same(by_doctor: &Finding, by_queries: &Finding) -> bool {
    let text = |finding: &Finding, key: &str| {
        finding.evidence.get(key).and_then(Value::as_str).map(str::to_owned)
    };
    let remedy = text(by_doctor, "remedy").unwrap_or_default();
    let is_read_so = match text(by_queries, "reading").as_deref() {
        Some("camera_from_world (inverted)") => remedy.starts_with("invert"),
        Some("quaternions with w first") => remedy.contains("w x y z"),
        Some("quaternions with w last") => remedy.contains("x y z w"),
        Some(axes) if axes.contains("axes") => remedy.contains(axes),
        _ => true,
    };
    by_doctor.about == by_queries.about && is_read_so
}

/// What `posescope doctor` says of a scene.
pub fn of_examination(scene: &str, found: &doctor::Finding) -> Finding {
    let about = found.mistake.about();
    let or: String = found
        .or
        .iter()
        .map(|(mistake, remedy)| format!(" Or {}; {remedy}.", mistake.about()))
        .collect();
    Finding {
        code: Code::X1,
        of: scene.to_owned(),
        about: found.mistake.subject(),
        queries: 0,
        doctor: true,
        text: format!("`posescope doctor` says of {scene}: {about}; {}.{or}", found.remedy),
        evidence: json!({ "remedy": found.remedy }),
    }
}

/// The scenes of references whose queries fail so often that a mistake of the scene may be the cause. Where a method is
/// right, the scene is not to blame.
pub fn failing_scenes(results: &[&QueryResult]) -> BTreeSet<String> {
    let of_scenes = grouped(results.iter().map(|result| (&result.scene, *result))).into_iter();
    let failing = of_scenes.filter(|(_, results)| {
        let of = |is: &dyn Fn(Grade) -> bool| -> BTreeSet<&str> {
            let those = results.iter().filter(|result| is(result.grade));
            those.map(|result| result.query.as_str()).collect()
        };
        let right = of(&|grade| grade == Grade::Right);
        let failed: BTreeSet<&str> = &of(&Grade::is_failure) - &right;
        let share = failed.len() as f64 / queries_of(results).len() as f64;
        failed.len() >= MIN_QUERIES && share >= COMMON_FAILURE
    });
    failing.map(|(scene, _)| scene.clone()).collect()
}

fn queries_of<'a>(results: &[&'a QueryResult]) -> BTreeSet<&'a str> {
    results.iter().map(|result| result.query.as_str()).collect()
}

/// Pairs of scenes in which no query has a reference.
fn without_references(results: &[&QueryResult]) -> Vec<Finding> {
    let pairs =
        grouped(results.iter().map(|result| ((&result.scene, &result.query_scene), *result)));
    let lacking = pairs.into_iter().filter_map(|((scene, query_scene), results)| {
        let queries = queries_of(&results);
        let is_lacking = results.iter().all(|result| result.references.is_empty());
        (is_lacking && queries.len() >= MIN_QUERIES).then(|| Finding {
            code: Code::R1,
            of: scene.clone(),
            about: Subject::Poses,
            queries: queries.len(),
            doctor: false,
            text: format!(
                "None of {} queries of {} has a frame of {scene} with a pose and a cloud within the radius. Raise --radius, or \
                 check the unit and the frame of the poses.",
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

/// What the votes about a scene or a method agree on.
fn agreed(of: &str, votes: Vec<Vote<'_>>, results: &[&QueryResult]) -> Vec<Finding> {
    let all = queries_of(results).len();
    // Cameras that differ from query to query say no more than that the clouds do not fit.
    let misfits: BTreeSet<&str> =
        votes.iter().filter(|vote| vote.claim.is_misfit()).map(|vote| vote.query).collect();
    let of_kinds = grouped(votes.into_iter().map(|vote| (discriminant(&vote.claim), vote)));
    let mut found: Vec<Finding> =
        of_kinds.iter().filter_map(|(_, votes)| most_agree(of, votes, all)).collect();
    let is_common =
        misfits.len() >= MIN_QUERIES && misfits.len() as f64 >= COMMON_MISFIT * all as f64;
    if is_common && !found.iter().any(|one| one.about == Subject::Camera) {
        found.push(Claim::Clouds.finding(of, misfits.len()));
    }
    found
}

/// The claim that most queries agree on, if they are enough of `all`.
fn most_agree(of: &str, votes: &[Vote<'_>], all: usize) -> Option<Finding> {
    let queries_of = |wanted: &dyn Fn(&&Vote<'_>) -> bool| -> BTreeSet<&str> {
        votes.iter().filter(wanted).map(|vote| vote.query).collect()
    };
    let queries_for = |claim: &Claim| queries_of(&|vote| claim.agrees(&vote.claim));
    // Claims that are equal are asked once. Clouds have no value to agree on.
    let mut claims: Vec<&Claim> = Vec::new();
    for vote in votes {
        if vote.claim != Claim::Clouds && !claims.contains(&&vote.claim) {
            claims.push(&vote.claim);
        }
    }
    let candidates = claims.into_iter().map(|claim| (queries_for(claim), claim));
    // Of equal ones the first.
    let (queries, claim) =
        candidates.reduce(|best, next| if next.0.len() > best.0.len() { next } else { best })?;
    let voting = queries_of(&|_| true);
    let certain = queries_of(&|vote| vote.certain && claim.agrees(&vote.claim));
    // A mistake of a whole scene is seen in many of its queries; chance agrees in a few of many.
    let is_common = 3 * queries.len() >= voting.len()
        && (certain.len() >= MIN_QUERIES || queries.len() as f64 >= COMMON_HINT * all as f64);
    (queries.len() >= MIN_QUERIES && is_common).then(|| claim.finding(of, queries.len()))
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

    /// Whether it may only mean that the clouds do not fit the photos of the references.
    fn is_misfit(&self) -> bool {
        matches!(self, Self::Clouds | Self::Camera { whose: BOTH, .. })
    }

    fn about(&self) -> Subject {
        match self {
            Self::Camera { .. } => Subject::Camera,
            Self::Poses { reading } if reading.ends_with("metres") => Subject::Units,
            Self::Poses { .. } => Subject::Poses,
            Self::Units { .. } => Subject::Units,
            Self::Clouds => Subject::Clouds,
        }
    }

    fn finding(&self, of: &str, queries: usize) -> Finding {
        let (text, evidence) = self.words(of, queries);
        let of = of.to_owned();
        Finding { code: Code::X1, of, about: self.about(), queries, doctor: false, text, evidence }
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
                format!(
                    "The clouds of {of} do not fit its photos, by {queries} queries: they are of other frames, or moved, or \
                     the camera is another."
                ),
                json!({}),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Mistake;
    use crate::measure::metrics::tests::row;

    fn with_camera(query: &str, fx: f64) -> QueryResult {
        let camera = |fx: f64| json!({ "fx": fx, "fy": fx, "cx": 320.0, "cy": 240.0 });
        let evidence = json!({ "explained": 3, "camera": camera(fx), "stated": camera(500.0) });
        let verdict = Diagnosis { code: Code::X1, text: String::new(), evidence };
        QueryResult { diagnosis: vec![verdict], ..row(query, "fb", Some(9.0)) }
    }

    fn found(rows: &[QueryResult]) -> Vec<Finding> {
        findings(&rows.iter().collect::<Vec<_>>(), &[])
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

    fn with_misfit(query: &str) -> QueryResult {
        let evidence = json!({ "wrong_depth": 5, "certain": false });
        let verdict = Diagnosis { code: Code::X1, text: String::new(), evidence };
        QueryResult { diagnosis: vec![verdict], ..row(query, "fb", Some(9.0)) }
    }

    #[test]
    fn clouds_that_do_not_fit_in_a_third_of_the_queries_are_a_finding() {
        let with_right = |misfits: &[QueryResult], count: usize| {
            let right = (0..count).map(|at| row(&format!("right {at}"), "fb", Some(0.1)));
            let of: Vec<Subject> = found(&misfits.iter().cloned().chain(right).collect::<Vec<_>>())
                .iter()
                .map(|one| one.about)
                .collect();
            of
        };
        let misfits = ["a", "b", "c"].map(with_misfit);
        assert_eq!(with_right(&misfits, 6), [Subject::Clouds]);
        assert_eq!(with_right(&misfits, 7), []);
        assert_eq!(with_right(&misfits[..2], 0), []);
        // A camera of queries and references that is another in each query is a cloud that does not fit.
        let camera_of_both = |query: &str, fx: f64| {
            let mut result = with_camera(query, fx);
            let evidence = result.diagnosis[0].evidence.as_object_mut().expect("an object");
            evidence.remove("explained");
            result
        };
        let each = [("a", 600.0), ("b", 700.0), ("c", 800.0)].map(|(q, f)| camera_of_both(q, f));
        assert_eq!(with_right(&each, 6), [Subject::Clouds]);
        let same = ["a", "b", "c"].map(|query| camera_of_both(query, 600.0));
        assert_eq!(with_right(&same, 6), [Subject::Camera]);
    }

    #[test]
    fn what_the_doctor_says_is_quoted_and_what_queries_say_beside_it() {
        let says = |mistake: Mistake| {
            let found = doctor::Finding {
                mistake,
                remedy: "correct it".into(),
                correction: None,
                stated: Default::default(),
                otherwise: Default::default(),
                or: Vec::new(),
                then: None,
            };
            of_examination("street", &found)
        };
        let rows = ["a", "b", "c"].map(|query| with_camera(query, 600.0));
        let with = |mistake| findings(&rows.iter().collect::<Vec<_>>(), &[says(mistake)]);

        let agreed = with(Mistake::WrongCamera);
        assert_eq!((agreed.len(), agreed[0].queries, agreed[0].doctor), (1, 3, true));
        assert!(agreed[0].text.ends_with("`posescope doctor` agrees."), "{}", agreed[0].text);

        let otherwise = with(Mistake::InversePose);
        assert_eq!(otherwise.iter().map(|one| one.queries).collect::<Vec<_>>(), [0, 3]);
        assert_eq!(otherwise[0].about, Subject::Poses);
        assert!(otherwise[0].text.contains("correct it"), "{}", otherwise[0].text);
        assert!(otherwise[1].text.contains("names another mistake"), "{}", otherwise[1].text);

        // The same part of the scene, in another reading.
        let read = |reading: &str, remedy: &str| {
            let of = |evidence| Finding { evidence, ..says(Mistake::PoseAxes) };
            is_same(&of(json!({ "remedy": remedy })), &of(json!({ "reading": reading })))
        };
        let axes = "read the poses with camera axes (x, -y, -z), those of OpenGL";
        assert!(read("camera axes (x, -y, -z)", axes));
        assert!(!read("camera axes (z, -x, -y)", axes));
        assert!(!read("camera axes (x, -y, -z)", "reverse the order of the poses"));
        assert!(read("camera_from_world (inverted)", "invert each pose"));
        assert!(!read("quaternions with w first", "invert each pose"));
    }

    #[test]
    fn a_scene_in_which_a_method_is_right_is_not_to_blame() {
        let with = |other: f64| {
            let queries = ["a", "b", "c", "d"];
            let rows = queries
                .iter()
                .flat_map(|query| [row(query, "pm", Some(99.0)), row(query, "fb", Some(other))]);
            let rows: Vec<QueryResult> = rows.collect();
            failing_scenes(&rows.iter().collect::<Vec<_>>()).len()
        };
        assert_eq!([with(0.1), with(50.0)], [0, 1]);
    }

    #[test]
    fn the_doctor_is_heard_where_three_and_a_quarter_of_the_queries_fail() {
        let with = |wrong: usize, right: usize| {
            let far = (0..wrong).map(|at| row(&format!("wrong {at}"), "fb", Some(99.0)));
            let near = (0..right).map(|at| row(&format!("right {at}"), "fb", Some(0.1)));
            let rows: Vec<QueryResult> = far.chain(near).collect();
            failing_scenes(&rows.iter().collect::<Vec<_>>()).len()
        };
        assert_eq!([with(3, 9), with(3, 10), with(2, 0), with(0, 5)], [1, 0, 0, 0]);
    }
}
