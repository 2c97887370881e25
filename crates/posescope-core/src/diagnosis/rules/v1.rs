//! V1: the right place was ranked too low.

use super::*;
use crate::retrieval::RankedReference;

pub(super) const RULE: Rule = Rule {
    title: "the right place was ranked too low",
    advice: "take more references: retrieve:K with a larger K",
    test: Test::Ranking(test),
    decided_at: DecidedAt::Stage(Stage::Retrieve),
    proof: Proof::Ranking,
    remedies: |_| [3, 5].map(|count| vec![Change::Ranked(count)]).into(),
    ..Rule::new(Code::V1)
};

/// None of the references that were taken is of the right place.
fn test(case: &RankingCase<'_>) -> Option<Diagnosis> {
    let ranking = case.ranking;
    let distance = |frame: &RankedReference| {
        let pose = frame.world_from_camera.as_ref()?;
        Some((pose.translation.vector - case.truth.translation.vector).norm())
    };
    let is_right_place =
        |frame: &RankedReference| distance(frame).is_some_and(|distance| distance <= case.radius_m);
    let first_right = ranking.frames.iter().position(is_right_place);
    if first_right.is_some_and(|rank| rank < ranking.chosen) {
        return None;
    }
    let best = ranking.frames.first()?;
    Some(RULE.found(&Ranked {
        first: best.name.clone(),
        first_distance_m: distance(best),
        rank_of_right_place: first_right.map(|rank| rank + 1),
        taken: ranking.chosen,
        ranked: ranking.frames.len(),
        radius_m: case.radius_m,
    }))
}

evidence!(Ranked {
    first: String,
    first_distance_m: Option<f64>,
    rank_of_right_place: Option<usize>,
    taken: usize,
    ranked: usize,
    radius_m: f64,
} => {
    let place = match (rank_of_right_place, taken) {
        (Some(rank), 0) => {
            format!("ranked the right place {}, and accepted no frame", ordinal(*rank))
        }
        (Some(rank), 1) => {
            format!("ranked the right place {}, and only the first is used", ordinal(*rank))
        }
        (Some(rank), _) => {
            format!("ranked the right place {}, and only the first {taken} are used", ordinal(*rank))
        }
        (None, _) => format!(
            "missed the right place: none of {ranked} ranked frames is within {} of the truth",
            metres(*radius_m)
        ),
    };
    let distance = first_distance_m.map(|m| format!(", {} from the query", metres(m)));
    let distance = distance.unwrap_or_default();
    format!("Retrieval {place}. Ranked 1st is {first}{distance}.")
});
