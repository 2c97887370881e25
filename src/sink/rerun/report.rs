//! The report of one query, as Markdown.

use std::fmt::Write as _;

use super::Identity;
use super::scene::Origin;
use crate::diagnosis::Grade;
use crate::geometry::PoseError;
use crate::localize::QueryResult;
use crate::params::Params;
use crate::problem::Problem;

/// What the methods made of one query, so far.
pub(super) fn markdown(
    problems: &[Problem],
    results: &[QueryResult],
    identity: &Identity,
    origin: Origin,
) -> String {
    let mut text = String::new();
    if let Some(problem) = problems.first() {
        let references = problems.iter().map(|p| &p.reference.name);
        let names: Vec<String> = references
            .map(|name| identity.reference_label(name))
            .collect();
        text += &format!(
            "# Query {}\n\nAgainst {}, within {} m, seed {}.\n\n",
            identity.query_label(&problem.query.name),
            names.join(", "),
            problem.uncertainty_radius_m,
            problem.seed
        );
    }
    text += &story(results);
    text += &errors(results);
    text += &features(results);
    text += &costs(results);
    text += &costs_at_poses(results);
    let degraded = identity.degraded;
    if !degraded.is_none() {
        text += &format!("The photo of the query was degraded before: `{degraded}`.\n\n");
    }
    text += &changes(&identity.configuration);
    let Origin(origin) = origin;
    text += &format!(
        "\nThe world is drawn relative to the first reference: add ({:.3}, {:.3}, {:.3}) m for \
         world coordinates. Axes: x right, y down, z forward.\n",
        origin.x, origin.y, origin.z
    );
    text
}

/// What went wrong, in sentences: the primary verdict of each method, what it leads to, what helped.
fn story(results: &[QueryResult]) -> String {
    let mut text = String::new();
    for result in results {
        let Some((primary, others)) = result.diagnosis.split_first() else {
            continue;
        };
        let name = result.method.name().to_uppercase();
        let name = match &result.fusion {
            Some(fusion) => format!("{name} {fusion}"),
            None => name,
        };
        let error = result.error.as_ref();
        let error = error.map_or(String::new(), |error| format!(", {}", error.translation()));
        text += &format!("**{name}{error}: {}** {}\n\n", primary.code, primary.text);
        for other in others {
            text += &format!("- also {}: {}\n", other.code, other.text);
        }
        if let Some(explanation) = &result.explanation {
            for helped in &explanation.helped {
                let (args, error) = (helped.args.join(" "), helped.error.translation());
                text += &format!("- helped: `{args}` ({error})\n");
            }
            if explanation.helped.is_empty() {
                text += &format!("- none of {} remedies helped\n", explanation.runs);
            }
            if !explanation.complete {
                text += "- the explanation was stopped before its end\n";
            }
        }
        text += "\n";
    }
    text
}

fn errors(results: &[QueryResult]) -> String {
    let mut text = "| method | error | rotation | max Euler | grade | confidence | reference |\n\
                    |:--|--:|--:|--:|:--|--:|:--|\n"
        .to_owned();
    for result in results {
        let grade = match (result.grade, &result.reason) {
            (Grade::NoPose, Some(reason)) => format!("{}, **{}**", result.grade, reason.code),
            (Grade::Wrong, _) => format!("**{}**", result.grade),
            (grade, _) => grade.to_string(),
        };
        let part = |part: fn(&PoseError) -> String| {
            let error = result.error.as_ref();
            error.map_or("–".to_owned(), part)
        };
        let confidence = result.confidence.as_ref();
        let confidence = confidence.map(|one| format!("{} {:.2}", one.word, one.probability));
        row(
            &mut text,
            &[
                result.method.name(),
                &part(PoseError::translation),
                &part(PoseError::rotation),
                &part(PoseError::max_euler),
                &grade,
                &confidence.unwrap_or("–".to_owned()),
                &result.references.join(", "),
            ],
        );
    }
    let initial = results.iter().find_map(|result| result.initial_error);
    if let Some(error) = initial {
        text += &format!("\nThe first reference itself, from the truth: {error}.\n");
    }
    text + "\n"
}

fn features(results: &[QueryResult]) -> String {
    let mut text = String::new();
    for result in results {
        let Some(counts) = &result.counts else {
            continue;
        };
        if text.is_empty() {
            text += "## Features\n\n| method | query | reference | ratio test | unique | depth | \
                     inliers |\n|:--|--:|--:|--:|--:|--:|--:|\n";
        }
        let numbers = [
            counts.query_keypoints,
            counts.reference_keypoints,
            counts.ratio_passed,
            counts.unique,
            counts.with_depth,
            counts.inliers,
        ]
        .map(|count| count.to_string());
        let mut cells: Vec<&str> = vec![result.method.name()];
        cells.extend(numbers.iter().map(String::as_str));
        row(&mut text, &cells);
    }
    text + "\n"
}

fn costs(results: &[QueryResult]) -> String {
    let mut text = String::new();
    for result in results {
        let Some(cost) = &result.cost else { continue };
        if text.is_empty() {
            text += "## Costs\n\n| method | result | truth | reference | shuffled | runner-up | \
                     coverage | evaluations |\n|:--|--:|--:|--:|--:|--:|--:|--:|\n";
        }
        let number = |value: Option<f64>| value.map_or("–".to_owned(), |v| format!("{v:.4}"));
        row(
            &mut text,
            &[
                result.method.name(),
                &number(Some(cost.best)),
                &number(cost.truth),
                &number(cost.initial),
                &number(cost.shuffled),
                &number(cost.runner_up),
                &format!("{:.2} %", 100.0 * cost.coverage_best),
                &cost.evaluations.to_string(),
            ],
        );
    }
    text + "\n"
}

/// What our costs say of the poses of other systems.
fn costs_at_poses(results: &[QueryResult]) -> String {
    let mut text = String::new();
    for result in results {
        for at_pose in &result.costs_at_pose {
            if text.is_empty() {
                text += "## Costs at the poses of other systems\n\n| pose | cost of | pose | truth | \
                         coverage |\n|:--|:--|--:|--:|--:|\n";
            }
            let number = |value: Option<f64>| value.map_or("–".to_owned(), |v| format!("{v:.4}"));
            row(
                &mut text,
                &[
                    result.method.name(),
                    at_pose.method.name(),
                    &number(at_pose.cost),
                    &number(at_pose.truth),
                    &format!("{:.2} %", 100.0 * at_pose.coverage),
                ],
            );
        }
    }
    text + "\n"
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

/// A bar inside a cell would end it.
fn row(text: &mut String, cells: &[&str]) {
    for cell in cells {
        let cell = cell.replace('|', "\\|");
        // Writing to a string cannot fail.
        let _ = write!(text, "| {cell} ");
    }
    text.push_str("|\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_parameters_that_differ_are_listed() {
        assert!(changes("").contains("All at their defaults."));
        let text = changes("[fb]\nratio = 0.7\n");
        assert!(
            text.contains("- `fb.ratio=0.7`") && !text.contains("depth"),
            "{text}"
        );
    }

    #[test]
    fn a_bar_in_a_reason_does_not_end_its_cell() {
        let mut text = String::new();
        row(&mut text, &["fb", "a|b"]);
        assert_eq!(text, "| fb | a\\|b |\n");
    }
}
