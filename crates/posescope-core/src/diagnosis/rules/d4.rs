//! D4: the truth is outside of what is searched.

use serde_json::Value;

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the truth is outside of what is searched",
    advice: "if the reference is wrong, use another; otherwise raise --radius or grid.yaw_range, or lower grid.coverage_floor",
    advice_on,
    applies_to: Family::SEARCHING,
    is_conclusive: true,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Search(Phase::PositionCoarse)),
    proof: Proof::CostMap(MapOverlay::Reach),
    remedies,
    ..Rule::new(Code::D4)
};

/// What was too small decides what to raise.
fn advice_on(evidence: &Value) -> Option<&'static str> {
    let metres = |key: &str| evidence.get(key).and_then(Value::as_f64);
    Some(if evidence.get("is_turned").and_then(Value::as_bool) == Some(true) {
        "use --method robust or another reference, or raise grid.yaw_range"
    } else if metres("distance_m")? > metres("radius_m")? {
        "raise --radius, or use a nearer reference"
    } else {
        return None;
    })
}

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    let radius_m = case.subject.problem.uncertainty_radius_m;
    match case.family {
        Family::MultiStart | Family::Descent => in_six_freedoms(case.free_search()?, radius_m),
        _ => by_grid(case.search?, radius_m),
    }
}

fn by_grid(search: &FinishedSearch<'_>, radius_m: f64) -> Option<Diagnosis> {
    let truth = search.truth_offset();
    let outside = |is_turned: bool| {
        RULE.found(&Outside {
            distance_m: truth.distance_m(),
            radius_m,
            yaw_deg: truth.yaw_rad.to_degrees(),
            yaw_range_deg: search.grid.yaw_range_deg,
            is_turned,
        })
    };
    match search.out_of_reach() {
        (true, _) => Some(outside(false)),
        (false, true) => Some(outside(true)),
        (false, false) => search.near_truth().is_none().then(|| {
            RULE.found(&Uncovered {
                covered: search.covered(&search.nearest_reachable()),
                least_covered: search.least_covered,
            })
        }),
    }
}

/// The truth is farther from the reference than the search goes.
fn too_far(distance_m: f64, radius_m: f64) -> String {
    let (distance, radius) = (metres(distance_m), metres(radius_m));
    format!(
        "The truth is outside of the search: {distance} from the reference, {radius} is searched."
    )
}

evidence!(Outside {
    distance_m: f64,
    radius_m: f64,
    yaw_deg: f64,
    yaw_range_deg: f64,
    is_turned: bool,
} => {
    if *is_turned {
        format!(
            "The query is turned too far: its yaw is {yaw_deg:.1}° against the reference, and \
             ±{yaw_range_deg:.1}° is searched."
        )
    } else {
        too_far(*distance_m, *radius_m)
    }
});

evidence!(Uncovered { covered: usize, least_covered: u32 } =>
    "Too little of the cloud is in view near the truth: {covered} px, grid.coverage_floor needs \
     {least_covered}."
);

fn in_six_freedoms(search: &FreeSearch, radius_m: f64) -> Option<Diagnosis> {
    search
        .near
        .is_none()
        .then(|| RULE.found(&Unreached { distance_m: search.distance_m, radius_m }))
}

evidence!(Unreached { distance_m: f64, radius_m: f64 } => {
    if distance_m > radius_m {
        too_far(*distance_m, *radius_m)
    } else {
        "The search cannot end at the truth: too little of the cloud is visible there, or it leaves the \
         disc."
            .to_owned()
    }
});

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let [farther, nearer] = other_references();
    let wider = [vec![ask.radius(1.5)], farther.clone(), vec![ask.radius(2.0)], nearer];
    let lower_floor = vec![ask.floor(0.2, 0.0)];
    match ask.family {
        Family::Descent => ask.other_searches().into_iter().chain(wider).collect(),
        Family::MultiStart => {
            let coarser = vec![ask.set("mi6.yaw_step", 2.0 * ask.params.mi6.yaw_step_deg)];
            wider.into_iter().chain([coarser, lower_floor]).collect()
        }
        _ => {
            let [robust, mi6] = many_starts();
            let turned = [
                robust,
                farther,
                mi6,
                method("fb2"),
                vec![ask.wide_yaw(), ask.rounds()],
                vec![ask.set("grid.yaw_range", 45.0), ask.rounds()],
            ];
            match ask.evidence.get("is_turned").and_then(Value::as_bool) {
                Some(true) => turned.into(),
                Some(false) => wider.into_iter().chain([lower_floor]).collect(),
                None => [lower_floor].into_iter().chain(wider).chain(turned).collect(),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_advice_names_what_was_too_small() {
        let advice = |evidence: &Value| Code::D4.advice(Some(Family::Grid), evidence);
        let outside = json!({ "distance_m": 20.0, "radius_m": 15.0, "is_turned": false });
        assert!(advice(&outside).starts_with("raise --radius"));
        let turned = json!({ "distance_m": 2.0, "radius_m": 15.0, "is_turned": true });
        assert!(advice(&turned).ends_with("raise grid.yaw_range"));
        assert_eq!(advice(&json!({ "covered": 10, "least_covered": 300 })), RULE.advice);
    }
}
