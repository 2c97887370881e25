//! D6: the images look too different.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the photos look too different",
    advice: "use --method robust or mi6, or a reference of similar light",
    applies_to: &[Family::Grid],
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Assess),
    proof: Proof::CostMap(MapOverlay::Light),
    remedies: d2::remedies,
    ..Rule::new(Code::D6)
};

/// The images share nothing, even at the truth.
fn test(case: &Case<'_>) -> Option<Diagnosis> {
    let search = case.search?;
    let rivals = search.rivals().filter(|rivals| rivals.is_changed)?;
    let against = search.against_chance(&rivals.near.offset)?;
    Some(RULE.found(&Changed {
        cost_near_truth: rivals.near.cost,
        chance_level: against.mean,
        chance_deviation: against.deviation,
        deviations: against.deviations(),
    }))
}

evidence!(Changed {
    cost_near_truth: f64,
    chance_level: f64,
    chance_deviation: f64,
    deviations: f64,
} => {
    let (near, chance) = pair(*cost_near_truth, *chance_level);
    format!(
        "The photos look too different: near the truth the cost is {near}, no better than {chance} for \
         shuffled pixels (lower is better)."
    )
});
