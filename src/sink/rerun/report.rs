//! The report of one query, as Markdown.

use super::Identity;
use super::scene::Origin;
use crate::diagnosis::{Grade, PoseConfidence};
use crate::geometry::PoseError;
use crate::localize::QueryResult;
use crate::params::Params;
use crate::problem::Problem;
use crate::scale::LengthUnit;
use crate::table::{Align, Table};
use posescope_core::text::first_sentence;

/// The report on one query so far.
pub(super) fn markdown(
    problems: &[Problem],
    results: &[QueryResult],
    identity: &Identity,
    origin: Origin,
    unit: LengthUnit,
) -> String {
    let mut text = String::new();
    if let Some(problem) = problems.first() {
        let references = problems.iter().map(|p| p.reference().name());
        let names: Vec<String> = references.map(|name| identity.reference_label(name)).collect();
        let words = format!(
            "# Query {}\n\nReference: {}. Search radius: {} m. Seed: {}.\n\n",
            identity.query_label(problem.query().name()),
            names.join(", "),
            problem.uncertainty_radius_m(),
            problem.seed()
        );
        text += &unit.words(&words);
    }
    text += &story(results);
    text += &errors(results);
    text += &features(results);
    text += &costs(results);
    text += &costs_at_poses(results);
    let degraded = identity.degraded;
    if !degraded.is_none() {
        text += &format!("The query photo was degraded first: `{degraded}`.\n\n");
    }
    text += &changes(&identity.configuration);
    let Origin(origin) = origin;
    let words = format!(
        "\nPositions are relative to the first reference. Add ({:.3}, {:.3}, {:.3}) m to get \
         world coordinates. Axes: x right, y down, z forward.\n",
        origin.x, origin.y, origin.z
    );
    text + &unit.words(&words)
}

/// The failures in sentences: primary verdict, other verdicts and remedies of each method.
fn story(results: &[QueryResult]) -> String {
    let mut text = String::new();
    for result in results {
        let Some(primary) = result.diagnosis.first() else {
            continue;
        };
        let off = result.off().map(|off| format!("{off} off"));
        let score = off.unwrap_or_else(|| result.grade.to_string());
        let (first, rest) = first_sentence(&primary.text);
        let rest = [rest, primary.code.name()].join(" ");
        let name = result.method_name();
        text += &format!("### {name}: {score}\n\n**{first}** {}\n\n", rest.trim());
        for paragraph in result.paragraphs() {
            text += &format!("- {paragraph}\n");
        }
        text += "\n";
    }
    text
}

fn errors(results: &[QueryResult]) -> String {
    let header =
        ["method", "error", "rotation", "max Euler", "grade", "confidence", "95 %", "reference"];
    let mut table = Table::with_notes(header, &[1, 2, 3, 5, 6], 0);
    for result in results {
        let grade = match (result.grade, &result.reason) {
            (Grade::NoPose, Some(reason)) => format!("{}, **{}**", result.grade, reason.code),
            (Grade::Wrong, _) => format!("**{}**", result.grade),
            (grade, _) => grade.to_string(),
        };
        let part = |part: fn(&PoseError) -> String| {
            let error = result.error.as_ref();
            error.map_or("–".to_owned(), |error| result.unit.words(&part(error)))
        };
        let known = result.confidence.as_ref();
        let opinion = result.opinion.as_ref().map(|opinion| result.unit.words(&opinion.words()));
        let confidence = known.map(PoseConfidence::likely).or(opinion);
        let within = known.and_then(|known| known.within_95);
        let within = within.map(|within| result.unit.words(&within.to_string()));
        table.push([
            result.method_name(),
            part(PoseError::translation),
            part(PoseError::rotation),
            part(PoseError::max_euler),
            grade,
            confidence.unwrap_or("–".to_owned()),
            within.unwrap_or("–".to_owned()),
            result.references.join(", "),
        ]);
    }
    let mut text = table.to_markdown();
    let initial = results.iter().find_map(|result| result.initial_error);
    if let Some(error) = initial {
        let unit = results.first().map(|result| result.unit).unwrap_or_default();
        let error = unit.words(&error.to_string());
        text += &format!("\nDistance of the first reference from the truth: {error}.\n");
    }
    text + "\n"
}

fn features(results: &[QueryResult]) -> String {
    let header = ["method", "query", "reference", "ratio test", "unique", "depth", "inliers"];
    let mut table = Table::new("", "", header);
    for result in results {
        let Some(counts) = &result.counts else {
            continue;
        };
        let numbers = [
            counts.query_keypoints,
            counts.reference_keypoints,
            counts.ratio_passed,
            counts.unique,
            counts.with_depth,
            counts.inliers,
        ];
        let numbers = numbers.map(|count| count.to_string());
        table.push([result.method_name()].into_iter().chain(numbers));
    }
    section("Features", &table)
}

fn number(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| format!("{value:.4}"))
}

fn costs(results: &[QueryResult]) -> String {
    let header = [
        "method",
        "result",
        "truth",
        "reference",
        "shuffled",
        "runner-up",
        "coverage",
        "evaluations",
    ];
    let mut table = Table::new("", "", header);
    for result in results {
        let Some(cost) = &result.cost else { continue };
        table.push([
            result.method_name(),
            number(Some(cost.best)),
            number(cost.truth),
            number(cost.initial),
            number(cost.shuffled),
            number(cost.runner_up),
            format!("{:.2} %", 100.0 * cost.coverage_best),
            cost.evaluations.to_string(),
        ]);
    }
    section("Costs", &table)
}

/// Our costs at the poses of other systems.
fn costs_at_poses(results: &[QueryResult]) -> String {
    let mut table = Table::new("", "", ["pose", "cost of", "pose", "truth", "coverage"]);
    table.align[1] = Align::Left;
    for result in results {
        for at_pose in &result.costs_at_pose {
            table.push([
                result.method.to_string(),
                at_pose.method.to_string(),
                number(at_pose.cost),
                number(at_pose.truth),
                format!("{:.2} %", 100.0 * at_pose.coverage),
            ]);
        }
    }
    section("Costs at the poses of other systems", &table)
}

/// A table with a title; empty without rows.
fn section(title: &str, table: &Table) -> String {
    if table.rows.is_empty() {
        "\n".to_owned()
    } else {
        format!("## {title}\n\n{}\n", table.to_markdown())
    }
}

fn changes(configuration: &str) -> String {
    let mut params = Params::default();
    let changes = match params.merge_toml(configuration) {
        Ok(()) => params.changes(),
        Err(error) => return format!("## Parameters\n\nUnreadable: {error}\n"),
    };
    if changes.is_empty() {
        return "## Parameters\n\nAll at their defaults.\n".to_owned();
    }
    let mut text = "## Parameters\n\nAll at their defaults but these:\n\n".to_owned();
    for change in changes {
        text += &format!("- `{change}`\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::{Code, Diagnosis};

    #[test]
    fn a_failure_begins_with_its_error_and_first_sentence_and_ends_with_its_code() {
        let result = serde_json::json!({
            "schema": crate::localize::SCHEMA, "scene": "street", "query": "1", "references": ["2"],
            "method": "mi", "seed": 0, "status": "ok", "grade": "wrong", "diagnosis": [],
            "error": {"translation_m": 12.5, "rotation_deg": 1.0, "max_euler_deg": 1.0}
        });
        let mut result: QueryResult = serde_json::from_value(result).expect("a result");
        assert_eq!(story(std::slice::from_ref(&result)), "");
        result.diagnosis = vec![Diagnosis {
            code: Code::D3,
            text: "The search missed it: cost 0.9. The right cell is 5th.".to_owned(),
            evidence: Default::default(),
        }];
        let text = story(&[result]);
        let (failure, advice) = text.split_once("- try: ").expect("advice");
        assert_eq!(
            failure,
            "### mi: 12.500 m off\n\n**The search missed it: cost 0.9.** The right cell is 5th. D3\n\n"
        );
        assert!(advice.ends_with("\n\n"));
    }

    #[test]
    fn only_the_parameters_that_differ_are_listed() {
        assert!(changes("").contains("All at their defaults."));
        let text = changes("[fb]\nratio = 0.7\n");
        assert!(text.contains("- `fb.ratio=0.7`") && !text.contains("depth"), "{text}");
    }
}
