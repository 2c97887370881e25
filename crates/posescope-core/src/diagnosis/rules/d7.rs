//! D7: height, pitch or roll, which are not searched, are off.

use super::*;
use crate::diagnosis::search::PoseCost;

/// How far the truth must be off the plane of the search for that to be a cause, at the paper's scale.
const OFF_PLANE_M: f64 = 0.1;
const OFF_PLANE_DEG: f64 = 0.5;

pub(super) const RULE: Rule = Rule {
    title: "height, pitch or roll are off, which are not searched",
    advice: "use --method robust or mi6, which search all six freedoms",
    applies_to: &[Family::Grid],
    test: Test::Method(test),
    proof: Proof::FreedViews,
    remedies: d2::remedies,
    ..Rule::new(Code::D7)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    let search = case.search?;
    let rivals = search.rivals()?;
    let frozen = search.off_the_plane();
    if !search.subject.tolerance.contains(&frozen) {
        return Some(found(search, frozen, &rivals.near, None));
    }
    // Where photos share nothing, a pose off the plane could win by chance alone. What is on the plane has
    // nothing to win by leaving it.
    let is_on_plane =
        frozen.translation_m < case.length(OFF_PLANE_M) && frozen.rotation_deg < OFF_PLANE_DEG;
    if rivals.is_changed || is_on_plane {
        return None;
    }
    let best = search.best_in_six_freedoms(&rivals.near)?;
    (best < rivals.winner.cost)
        .then(|| found(search, frozen, &rivals.near, Some((best, rivals.winner.cost))))
}

fn found(
    search: &FinishedSearch<'_>,
    frozen_error: PoseError,
    near: &PoseCost,
    won: Option<(f64, f64)>,
) -> Diagnosis {
    RULE.found(&Frozen {
        height_m: -search.truth.translation.y,
        frozen_error,
        cost_in_six_freedoms: won.map(|(best, _)| best),
        cost_elsewhere: won.map(|(_, elsewhere)| elsewhere),
        cost_near_truth: near.cost,
    })
}

evidence!(Frozen {
    height_m: f64,
    /// How far the truth is from the searched pose at its place with its heading.
    frozen_error: PoseError,
    cost_in_six_freedoms: Option<f64>,
    cost_elsewhere: Option<f64>,
    cost_near_truth: f64,
} => {
    match (cost_in_six_freedoms, cost_elsewhere) {
        (Some(best), Some(elsewhere)) => {
            let (best, elsewhere) = pair(*best, *elsewhere);
            format!(
                "Height, pitch or roll are off, and the search keeps them fixed. With them free the \
                 truth would win: cost {best} near it, {elsewhere} elsewhere (lower is better)."
            )
        }
        _ => format!(
            "No searched pose is right: height, pitch and roll are not searched. The truth is {}, \
             {:.1}° off in them.",
            metres(frozen_error.translation_m), frozen_error.rotation_deg
        ),
    }
});
