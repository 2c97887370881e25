//! The table of results.

use std::time::Duration;

use posescope::diagnosis::{Grade, confidence};
use posescope::geometry::PoseError;
use posescope::localize::{QueryResult, Status};

use super::columns::Columns;

/// One row per query, reference and method, for lines of at most `width` characters, if they have a limit.
pub fn results(results: &[(QueryResult, Duration)], width: Option<usize>) -> String {
    let header = [
        "query",
        "reference",
        "start",
        "method",
        "grade",
        "error",
        "rotation",
        "max Euler",
        "time",
    ];
    // Of a query against the same references, only the method differs.
    let mut table = Columns::new(header, "verdict, or evidence", 3, &[2, 5, 6, 7, 8]);
    for (result, time) in results {
        let part = |part: fn(&PoseError) -> String| result.error.as_ref().map(part);
        let start = result.initial_error.as_ref().map(PoseError::translation);
        let cells = [
            result.query.clone(),
            result.references.join(" "),
            start.unwrap_or_default(),
            match &result.fusion {
                Some(fusion) => format!("{} {fusion}", result.method),
                None => result.method.to_string(),
            },
            format!("{} {}", result.grade.glyph(), result.grade),
            part(PoseError::translation).unwrap_or_default(),
            part(PoseError::rotation).unwrap_or_default(),
            part(PoseError::max_euler).unwrap_or_default(),
            format!("{:.2} s", time.as_secs_f64()),
        ];
        table.push(cells, evidence(result));
    }
    table.text(width)
}

/// What the result rests on, in a few words; without the truth how likely it is right.
fn evidence(result: &QueryResult) -> String {
    let rests_on = rests_on(result);
    match &result.confidence {
        Some(known) if result.grade == Grade::Unmeasured => format!(
            "{} {}, {} likely within {} m; {rests_on}",
            known.word.glyph(),
            known.word,
            confidence::percent(known.probability),
            confidence::WITHIN_M
        ),
        _ => rests_on,
    }
}

fn rests_on(result: &QueryResult) -> String {
    // That a pose is uncertain says less than what speaks for it, and stands below the table.
    let primary = result.diagnosis.first();
    if let Some(primary) = primary.filter(|primary| primary.code.is_failure()) {
        return format!("{} {}", primary.code, primary.code.title());
    }
    if let Some(reason) = &result.reason {
        return format!("{}: {}", reason.code, reason.text);
    }
    if let Some(cost) = &result.cost {
        let truth = cost
            .truth
            .map(|truth| format!(", at truth {truth:.4}"))
            .unwrap_or_default();
        let shuffled = cost
            .shuffled
            .map(|shuffled| format!(", shuffled {shuffled:.4}"))
            .unwrap_or_default();
        return format!("cost {:.4}{truth}{shuffled}", cost.best);
    }
    if !result.costs_at_pose.is_empty() {
        let costs = result.costs_at_pose.iter().map(|at_pose| {
            let number = |cost: Option<f64>| cost.map_or("none".to_owned(), |c| format!("{c:.4}"));
            let truth = at_pose
                .truth
                .map(|_| format!(" (truth {})", number(at_pose.truth)));
            let (method, cost) = (at_pose.method, number(at_pose.cost));
            format!("{method} {cost}{}", truth.unwrap_or_default())
        });
        return costs.collect::<Vec<_>>().join(", ");
    }
    if let (Some(fusion), Some(alone)) = (&result.fusion, &result.per_reference) {
        let found = alone.iter().filter(|one| one.status == Status::Ok).count();
        return format!("{fusion} of {}, {found} with a pose", alone.len());
    }
    result
        .counts
        .map(|counts| {
            format!(
                "{} inliers of {} matches with depth",
                counts.inliers, counts.with_depth
            )
        })
        .unwrap_or_default()
}
