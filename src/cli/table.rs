//! The table of results.

use std::time::Duration;

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use posescope::localize::{QueryResult, Status};

/// One row per query, reference and method.
pub fn results(results: &[(QueryResult, Duration)]) -> Table {
    let mut table = Table::new();
    table
        .load_preset(presets::UTF8_HORIZONTAL_ONLY)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_header([
            "query",
            "reference",
            "start",
            "method",
            "error",
            "rotation",
            "evidence",
            "time",
        ]);
    for index in [2, 4, 5, 7] {
        if let Some(column) = table.column_mut(index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for (result, time) in results {
        let (error, rotation) = match (&result.pose, &result.error) {
            (None, _) => ("failed".to_owned(), String::new()),
            (Some(_), None) => ("unknown".to_owned(), String::new()),
            (Some(_), Some(error)) => (
                format!("{:.2} m", error.translation_m),
                format!("{:.2}°", error.max_euler_deg),
            ),
        };
        let start = result
            .initial_error
            .map(|error| format!("{:.1} m", error.translation_m))
            .unwrap_or_default();
        table.add_row([
            result.query.clone(),
            result.references.join(" "),
            start,
            match &result.fusion {
                Some(fusion) => format!("{} {fusion}", result.method),
                None => result.method.to_string(),
            },
            error,
            rotation,
            evidence(result),
            format!("{:.2} s", time.as_secs_f64()),
        ]);
    }
    table
}

/// What the result rests on, in a few words.
fn evidence(result: &QueryResult) -> String {
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
