//! Mistakes of a whole file of another system's poses, as findings of a run.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::finding::Finding;
use super::groups::grouped;
use super::metrics::Group;
use crate::diagnosis::{Code, Tolerance};
use crate::doctor::Subject;
use crate::estimator;
use crate::localize::{PoseReport, QueryResult};
use crate::opinion::{BetterPose, Standing};
use posescope_core::systematic::{Answered, FEWEST, Mistake, Systematic, systematic};

/// From this share of the poses on, and this number, copies are a mistake of the whole file.
const COPIED: (f64, usize) = (0.2, 3);

/// What the poses of each other system have in common, by what posescope itself finds for the queries.
pub(super) fn of_given_poses(results: &[&QueryResult]) -> Vec<Finding> {
    let mut found: Vec<Finding> = Vec::new();
    for (of, results) in files(results) {
        // Other radii and fusions compare the same poses.
        if !found.iter().any(|one| one.of == of) {
            found.extend(of_file(&of, &results));
            found.extend(copied(&of, &results));
        }
    }
    found
}

/// A sentence about each file of another system of which no common mistake is found.
pub(super) fn nothing_in_common(results: &[&QueryResult], findings: &[Finding]) -> Vec<String> {
    let mut compared: BTreeMap<String, usize> = BTreeMap::new();
    for (of, results) in files(results) {
        if results.iter().any(|result| result.opinion.is_some()) {
            let count = answered(&results).iter().filter(|one| one.is_comparable()).count();
            let most = compared.entry(of).or_default();
            *most = count.max(*most);
        }
    }
    compared.retain(|of, _| !findings.iter().any(|one| one.of == *of));
    let sentences = compared.iter().map(|(of, count)| match count {
        count if *count >= FEWEST => format!(
            "No mistake is common to the poses of {of}: {count} were compared with trusted poses of posescope's own."
        ),
        count => format!(
            "Whether the poses of {of} have a mistake in common cannot be known: {count} can be compared with trusted \
             poses of posescope's own, {FEWEST} are needed."
        ),
    });
    sentences.collect()
}

/// The results of each other system, those of one setting together.
fn files<'a>(results: &[&'a QueryResult]) -> Vec<(String, Vec<&'a QueryResult>)> {
    let given = results.iter().filter(|result| estimator::find(result.method).is_none());
    let files = grouped(given.map(|result| ((result.method, Group::of(result)), *result)));
    files.into_iter().map(|((method, _), results)| (method.to_string(), results)).collect()
}

/// What the file and posescope answer to each query.
fn answered(results: &[&QueryResult]) -> Vec<Answered> {
    let answered = results.iter().map(|result| Answered {
        given: result.pose.as_ref().and_then(PoseReport::to_pose),
        own: result
            .opinion
            .as_ref()
            .and_then(|opinion| opinion.own.as_ref().and_then(BetterPose::to_pose)),
    });
    answered.collect()
}

fn of_file(of: &str, results: &[&QueryResult]) -> Option<Finding> {
    let within = results.iter().find_map(|result| Some(result.opinion.as_ref()?.within))?;
    let right = Tolerance { translation_m: within.m, rotation_deg: within.deg };
    let found = systematic(&answered(results), right)?;
    let unit = results.first()?.unit;
    Some(Finding {
        code: Code::E5,
        of: of.to_owned(),
        about: about(&found.mistake),
        queries: found.right_if_mended,
        doctor: false,
        text: unit.words(&words(of, &found, right)),
        evidence: evidence(&found),
    })
}

fn words(of: &str, found: &Systematic, right: Tolerance) -> String {
    let Systematic { mistake, or, compared, right_as_given, right_if_mended, medians_m } = found;
    let [given_m, mended_m] = medians_m;
    let or = or.as_ref().map(|or| format!(" Or they {}.", or.words())).unwrap_or_default();
    format!(
        "The poses of {of} {}: {}. Mended, {right_if_mended} of {compared} are within {} m and {}° of posescope's own \
         trusted poses, as given {right_as_given}; the median distance falls from {given_m:.2} m to {mended_m:.2} m.{or}",
        mistake.words(),
        mistake.remedy(),
        right.translation_m,
        right.rotation_deg,
    )
}

fn about(mistake: &Mistake) -> Subject {
    match mistake {
        Mistake::Reading(reading) if reading.ends_with("metres") => Subject::Units,
        _ => Subject::Poses,
    }
}

fn evidence(found: &Systematic) -> Value {
    let of_mistake = |mistake: &Mistake| match mistake {
        Mistake::Reading(reading) => json!({ "reading": reading }),
        Mistake::Lines(by) => json!({ "lines": by }),
        Mistake::Mounting { shift_m, turn_deg, varies } => {
            json!({ "camera": { "shift_m": shift_m, "turn_deg": turn_deg, "varies": varies } })
        }
        Mistake::World { scale, turn_deg, shift_m } => {
            json!({ "world": { "scale": scale, "turn_deg": turn_deg, "shift_m": shift_m } })
        }
        Mistake::Delay(queries) => json!({ "delay_queries": queries }),
        Mistake::Drift { at_end_m, share } => {
            json!({ "drift": { "at_end_m": at_end_m, "share": share } })
        }
    };
    json!({
        "mistake": of_mistake(&found.mistake),
        "or": found.or.as_ref().map(of_mistake),
        "compared": found.compared,
        "right_as_given": found.right_as_given,
        "right_if_mended": found.right_if_mended,
        "median_m": found.medians_m[0],
        "median_if_mended_m": found.medians_m[1],
    })
}

/// Poses that are those of frames of the map.
fn copied(of: &str, results: &[&QueryResult]) -> Option<Finding> {
    let is_copied = |result: &&&QueryResult| {
        let opinion = result.opinion.as_ref();
        opinion.is_some_and(|one| one.copied_from.is_some() && one.standing != Standing::Confirmed)
    };
    let given = results.iter().filter(|result| result.pose.is_some()).count();
    let queries = results.iter().filter(is_copied).count();
    let is_common = queries as f64 >= COPIED.0 * given as f64 && queries >= COPIED.1;
    is_common.then(|| Finding {
        code: Code::E2,
        of: of.to_owned(),
        about: Subject::Poses,
        queries,
        doctor: false,
        text: format!(
            "{queries} of {given} poses of {of} are those of frames of the map, and not confirmed: {}.",
            Code::E2.rule().advice
        ),
        evidence: json!({ "copied": queries, "of": given }),
    })
}
