//! R9: a pose outside the prior.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "a pose is outside the prior",
    advice: "use another reference, nearer to the query, or raise --radius",
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    proof: Proof::PoseMap,
    remedies,
    ..Rule::new(Code::R9)
};

/// A pose was refused for its distance from the reference, or the right one would have been.
fn test(case: &Case<'_>) -> Option<Diagnosis> {
    case.matches()?;
    if let Some(Failure::OutsideRadius { distance_m, allowed_m }) =
        case.subject.outcome.pose.as_ref().err()
    {
        return Some(RULE.found(&Outside {
            distance_m: *distance_m,
            allowed_m: *allowed_m,
            error: Some(case.consensus_error()?),
        }));
    }
    let (distance_m, allowed_m) = case.truth_beyond_prior()?;
    Some(RULE.found(&Outside { distance_m, allowed_m, error: None }))
}

// Of the pose that was found, or without an error of the truth.
evidence!(Outside { distance_m: f64, allowed_m: f64, error: Option<PoseError> } => {
    let (distance, allowed) = (metres(*distance_m), metres(*allowed_m));
    match error {
        Some(error) => format!(
            "The pose was refused for its distance: {distance} from the reference, {allowed} allowed. \
             The refused pose is {} off.",
            metres(error.translation_m)
        ),
        None => format!(
            "The truth is outside the prior: {distance} from the reference, {allowed} allowed."
        ),
    }
});

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let [farther, nearer] = other_references();
    let [wider, wide, widest] = [1.5, 2.0, 3.0].map(|times| vec![ask.radius(times)]);
    vec![farther, wider, wide, widest, nearer]
}
