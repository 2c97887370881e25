//! D2: the cost prefers another place.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the cost prefers another place",
    advice: "use --method robust or another reference",
    advice_of: |family| match family {
        Family::MultiStart => Some("use another reference or another method"),
        Family::Descent => Some("use search=grid or search=starts, or another reference"),
        _ => None,
    },
    applies_to: Family::SEARCHING,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Search(Phase::PositionCoarse)),
    proof: Proof::CostMap(MapOverlay::Preference),
    remedies,
    ..Rule::new(Code::D2)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    match case.family {
        Family::MultiStart | Family::Descent => in_six_freedoms(case.free_search()?),
        _ => by_grid(case.search?),
    }
}

/// Tried last of all causes, it holds wherever none of the others ended the list.
fn by_grid(search: &FinishedSearch<'_>) -> Option<Diagnosis> {
    let rivals = search.rivals()?;
    Some(RULE.found(&Preferred {
        cost_near_truth: rivals.near.cost,
        cost_at_result: search.result_cost,
        cost_elsewhere: rivals.winner.cost,
        distance_m: search.distance_from_truth(&rivals.winner.offset),
        near_truth: rivals.near.offset,
        elsewhere: rivals.winner.offset,
    }))
}

evidence!(Preferred {
    cost_near_truth: f64,
    cost_at_result: f64,
    cost_elsewhere: f64,
    /// How far elsewhere is from the truth \[m\].
    distance_m: f64,
    near_truth: Offset,
    elsewhere: Offset,
} => {
    let (lowest, near) = pair(*cost_elsewhere, *cost_near_truth);
    // The heights and tilts that are searched may leave no right pose near the truth.
    if cost_near_truth < cost_elsewhere {
        format!(
            "The lowest cost near the truth, {near}, is at a pose that is not right. The result \
             costs {lowest} (lower is better)."
        )
    } else {
        let off = metres(*distance_m);
        format!(
            "The cost prefers a wrong place: {lowest} at {off} from the truth. The lowest near the \
             truth is {near} (lower is better)."
        )
    }
});

fn in_six_freedoms(search: &FreeSearch) -> Option<Diagnosis> {
    let near = search.near.as_ref()?;
    (!search.is_missed()).then(|| {
        RULE.found(&PreferredInSix {
            cost_near_truth: near.refined.cost,
            cost_at_result: search.result_cost,
            penalty_near_truth: near.penalty,
            penalty_at_result: search.result_penalty,
            near_truth_error: near.error,
            leads_away: !near.is_right,
            turned_by_prior: search.is_turned_by_prior(),
            is_descent: search.is_descent,
        })
    })
}

evidence!(PreferredInSix {
    cost_near_truth: f64,
    cost_at_result: f64,
    penalty_near_truth: f64,
    penalty_at_result: f64,
    near_truth_error: PoseError,
    leads_away: bool,
    turned_by_prior: bool,
    #[serde(skip)]
    is_descent: bool,
} => {
    let (result, near) = pair(*cost_at_result, *cost_near_truth);
    if *leads_away {
        let away = metres(near_truth_error.translation_m);
        let moves = if *is_descent { "a descent from there ends" } else { "refined from there, the pose moves" };
        format!("The cost has no minimum at the truth: {moves} {away} away.")
    } else if *turned_by_prior {
        format!(
            "The prior on likely poses decided against the truth: cost {near} near it, {result} at the \
             result (lower is better)."
        )
    } else {
        format!(
            "The cost prefers a wrong place: {result} at the result, {near} near the truth (lower is \
             better)."
        )
    }
});

pub(super) fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    if ask.family == Family::Descent {
        return ask.other_searches();
    }
    let own = [vec![ask.floor(4.0, 0.2)], vec![ask.radius(0.5)], vec![ask.wider_splat()]];
    let more = ask.more_search().map(|more| vec![more]);
    let own = own.into_iter().chain(more);
    if ask.family == Family::MultiStart {
        // Its search is that of other methods, and another view decides.
        return other_references().into_iter().chain(many_starts()).chain(own).collect();
    }
    many_starts().into_iter().chain(other_references()).chain(own).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lower_cost_near_the_truth_is_not_called_preferred_elsewhere() {
        let said = |cost_near_truth| {
            let preferred = Preferred {
                cost_near_truth,
                cost_at_result: 0.8,
                cost_elsewhere: 0.8,
                distance_m: 1.5,
                near_truth: Offset::default(),
                elsewhere: Offset::default(),
            };
            preferred.to_string()
        };
        assert!(said(0.9).starts_with("The cost prefers a wrong place: 0.8"), "{}", said(0.9));
        assert!(said(0.7).contains("is at a pose that is not right"), "{}", said(0.7));
    }
}
