//! D8: the minimum lies where the grid ends.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the search ended at its edge",
    advice: "use --method robust, or raise --radius",
    advice_of: |family| match family {
        Family::Descent => Some("use search=grid or search=starts; the way down left the disc"),
        _ => None,
    },
    applies_to: &[Family::Grid],
    needs_truth: false,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Search(Phase::PositionCoarse)),
    proof: Proof::CostMap(MapOverlay::Rim),
    remedies,
    ..Rule::new(Code::D8)
};

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    match ask.family {
        Family::Descent => ask.other_searches(),
        _ => many_starts().into_iter().chain(d1::remedies(ask)).collect(),
    }
}

/// With the truth, where the minimum's basin goes on outside; without, of a pose that is more likely wrong
/// than right.
fn test(case: &Case<'_>) -> Option<Diagnosis> {
    match case.subject.truth {
        Some(_) => {
            let search = case.search?;
            let rivals = search.rivals()?;
            let rim = on_rim(case)?;
            (!rivals.is_changed && search.goes_on_outside()).then_some(rim)
        }
        None => on_rim(case).filter(|_| case.subject.is_low()),
    }
}

fn on_rim(case: &Case<'_>) -> Option<Diagnosis> {
    case.subject.outcome.cost?;
    let offset = case.subject.evidence.minimum?.offset;
    let (grid, radius_m) = (&case.subject.params.grid, case.subject.problem.uncertainty_radius_m);
    grid.is_on_rim(&offset, radius_m).then(|| {
        let distance_m = offset.distance_m();
        RULE.found(&Rim {
            distance_m,
            radius_m,
            yaw_deg: offset.yaw_rad.to_degrees().abs(),
            yaw_range_deg: grid.yaw_range_deg,
            is_position: grid.is_on_edge(&offset, radius_m),
        })
    })
}

evidence!(Rim {
    distance_m: f64,
    radius_m: f64,
    yaw_deg: f64,
    yaw_range_deg: f64,
    is_position: bool,
} => {
    let edge = if *is_position {
        let (distance, radius) = (metres(*distance_m), metres(*radius_m));
        format!("{distance} from the reference, where its coarse grid ends at {radius}")
    } else {
        format!("a yaw of {yaw_deg:.1}°, where its coarse grid ends at ±{yaw_range_deg:.1}°")
    };
    format!("The search ended at its edge: {edge}. The minimum may lie outside.")
});
