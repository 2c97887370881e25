//! D3: the search missed a lower cost near the truth.

use super::*;
use crate::diagnosis::search::PoseCost;
use crate::grid::ScoredLattice;

pub(super) const RULE: Rule = Rule {
    title: "the search missed a lower cost near the truth",
    advice: "use --method robust or search=starts, or another reference; with search=descent, use search=grid",
    advice_of: |family| match family {
        Family::Grid => Some("use --method robust or search=starts, or another reference"),
        Family::Descent => {
            Some("use search=grid or search=starts; a descent stops in the first minimum")
        }
        Family::MultiStart => {
            Some("use another reference, lower grid.coarse_step or raise mi6.starts")
        }
        _ => None,
    },
    advice_on: |found| {
        found
            .get("fine_range_m")
            .map(|_| "raise grid.fine_range to half of grid.coarse_step at least")
    },
    applies_to: Family::SEARCHING,
    is_conclusive: true,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Search(Phase::PositionCoarse)),
    proof: Proof::CostMap(MapOverlay::Ranks),
    remedies,
    ..Rule::new(Code::D3)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    match case.family {
        Family::MultiStart | Family::Descent => in_six_freedoms(case.free_search()?),
        _ => by_grid(case.search?),
    }
}

fn by_grid(search: &FinishedSearch<'_>) -> Option<Diagnosis> {
    let rivals = search.rivals().filter(|rivals| rivals.is_missed)?;
    let lost = lost_in(search, &rivals.near);
    // Then places between coarse cells are in no fine grid.
    let is_narrow = 2.0 * search.grid.fine_range_m < search.grid.coarse_step_m;
    Some(RULE.found(&Missed {
        cost_near_truth: rivals.near.cost,
        cost_at_result: search.result_cost,
        distance_m: search.distance_from_truth(&rivals.near.offset),
        near_truth: rivals.near.offset,
        lost_in: lost.phase.map(Phase::name),
        rank: lost.rank,
        margin: lost.margin,
        fine_range_m: is_narrow.then_some(search.grid.fine_range_m),
        coarse_step_m: is_narrow.then_some(search.grid.coarse_step_m),
    }))
}

evidence!(Missed {
    cost_near_truth: f64,
    cost_at_result: f64,
    /// How far the pose near the truth is from it \[m\].
    distance_m: f64,
    near_truth: Offset,
    lost_in: Option<&'static str>,
    /// The rank of the coarse cell nearest to the pose near the truth.
    rank: Option<usize>,
    /// What that cell costs more than the lowest.
    margin: Option<f64>,
    /// Half the width of the fine grid, where it does not reach the places between coarse cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    fine_range_m: Option<f64>,
    /// The step between coarse cells then.
    #[serde(skip_serializing_if = "Option::is_none")]
    coarse_step_m: Option<f64>,
} => {
    let (near, result) = pair(*cost_near_truth, *cost_at_result);
    let narrow = fine_range_m.zip(*coarse_step_m);
    let why = match (narrow, rank, lost_in) {
        (Some((range, step)), ..) => {
            format!(" The fine grid reaches {range} m, less than half a coarse step of {step} m.")
        }
        (None, Some(rank), _) => {
            let rank = ordinal(*rank);
            format!(" The coarse grid ranked the right cell {rank}, and only the 1st is refined.")
        }
        (None, None, Some(phase)) => format!(" It went wrong in the phase “{phase}”."),
        (None, None, None) => String::new(),
    };
    format!(
        "The search missed it: cost {near} near the truth, {result} at the result (lower is better).{why}"
    )
});

fn in_six_freedoms(search: &FreeSearch) -> Option<Diagnosis> {
    let near = search.near.as_ref().filter(|_| search.is_missed())?;
    Some(RULE.found(&MissedInSix {
        cost_near_truth: near.refined.cost,
        cost_at_result: search.result_cost,
        penalty_near_truth: near.penalty,
        penalty_at_result: search.result_penalty,
        near_truth_error: near.error,
        turned_by_prior: search.is_turned_by_prior(),
        is_descent: search.is_descent,
    }))
}

evidence!(MissedInSix {
    cost_near_truth: f64,
    cost_at_result: f64,
    penalty_near_truth: f64,
    penalty_at_result: f64,
    near_truth_error: PoseError,
    turned_by_prior: bool,
    #[serde(skip)]
    is_descent: bool,
} => {
    let (near, result) = pair(*cost_near_truth, *cost_at_result);
    let why = if *is_descent {
        "The way down from the reference led elsewhere."
    } else if *turned_by_prior {
        "With the prior on likely poses the truth wins."
    } else {
        "No start led there."
    };
    format!(
        "The search missed it: cost {near} near the truth, {result} at the result (lower is better). {why}"
    )
});

/// Where the search turned away from the truth.
#[derive(Default)]
struct TurnedAway {
    phase: Option<Phase>,
    rank: Option<usize>,
    margin: Option<f64>,
}

/// The phase that turned away from the truth.
fn lost_in(search: &FinishedSearch<'_>, near: &PoseCost) -> TurnedAway {
    let at = |phase: Phase| {
        let surface = search.subject.evidence.surface(phase)?;
        Some((surface, surface.lattice.offset(surface.minimum()?)?))
    };
    let Some((coarse, chosen)) = at(Phase::PositionCoarse) else {
        return TurnedAway::default();
    };
    let away = |offset: &Offset| offset.distance_from(&near.offset);
    let fine_reach = search.grid.fine_range_m.hypot(search.grid.fine_range_m);
    if away(&chosen) > fine_reach + search.grid.fine_step_m {
        return lost_among_coarse(coarse, &away);
    }
    let tolerance_m = search.subject.tolerance.translation_m;
    let phase = match at(Phase::PositionFine) {
        Some((_, chosen)) if away(&chosen) > tolerance_m => Some(Phase::PositionFine),
        _ => search.subject.evidence.surface(Phase::YawCoarse).map(|_| Phase::YawCoarse),
    };
    TurnedAway { phase, ..TurnedAway::default() }
}

/// The rank of the coarse cell nearest to the target, and what it costs more than the one chosen.
fn lost_among_coarse(coarse: &ScoredLattice, away: &dyn Fn(&Offset) -> f64) -> TurnedAway {
    let lost = TurnedAway { phase: Some(coarse.lattice.phase), ..TurnedAway::default() };
    let nearest = coarse
        .lattice
        .hypotheses()
        .filter_map(|(cell, offset)| Some((away(&offset), coarse.eligible_cost(cell)?)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let least = coarse.minimum().and_then(|cell| coarse.eligible_cost(cell));
    let (Some((_, cost)), Some(least)) = (nearest, least) else {
        return lost;
    };
    let lower = (0..coarse.scores.len())
        .filter_map(|cell| coarse.eligible_cost(cell))
        .filter(|other| *other < cost)
        .count();
    TurnedAway { rank: Some(lower + 1), margin: Some(cost - least), ..lost }
}

fn remedies(ask: &Ask<'_>) -> Vec<Remedy> {
    let ([robust, mi6], [farther, nearer]) = (many_starts(), other_references());
    match ask.family {
        Family::Descent => ask.other_searches(),
        Family::MultiStart => {
            let mi6 = &ask.params.mi6;
            let starts = ask.set("mi6.starts", (2 * mi6.starts).min(200) as f64);
            let finalists = ask.set("mi6.finalists", (2 * mi6.finalists).min(100) as f64);
            let yaws = ask.set("mi6.coarse_yaws", (2 * mi6.coarse_yaws).min(61) as f64);
            vec![
                farther,
                nearer,
                vec![ask.dense()],
                robust,
                vec![ask.dense(), starts.clone(), finalists.clone()],
                vec![starts, finalists],
                vec![yaws],
                vec![ask.wider_splat()],
            ]
        }
        _ => {
            let (rounds, dense) = (ask.rounds(), ask.dense());
            let grid = &ask.params.grid;
            let is_narrow = 2.0 * grid.fine_range_m < grid.coarse_step_m;
            let wide = is_narrow.then(|| vec![ask.set("grid.fine_range", grid.coarse_step_m)]);
            // Many starts follow many minima where the grid follows one, and `robust` those of features too.
            let starts = ask.other_searches();
            let grids = [vec![rounds.clone()], vec![dense.clone()], vec![dense, rounds]];
            let others = [farther, mi6].into_iter().chain(grids);
            wide.into_iter().chain([robust]).chain(starts).chain(others).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sentence_is_plain_and_its_numbers_have_three_digits() {
        let missed = Missed {
            cost_near_truth: 0.914_63,
            cost_at_result: 0.927_01,
            distance_m: 0.05,
            near_truth: Offset::default(),
            lost_in: Some(Phase::PositionCoarse.name()),
            rank: Some(5),
            margin: Some(0.0039),
            fine_range_m: None,
            coarse_step_m: None,
        };
        assert_eq!(
            missed.to_string(),
            "The search missed it: cost 0.915 near the truth, 0.927 at the result (lower is better). \
             The coarse grid ranked the right cell 5th, and only the 1st is refined."
        );
        let narrow = Missed { fine_range_m: Some(0.2), coarse_step_m: Some(1.0), ..missed };
        assert_eq!(
            narrow.to_string(),
            "The search missed it: cost 0.915 near the truth, 0.927 at the result (lower is better). \
             The fine grid reaches 0.2 m, less than half a coarse step of 1 m."
        );
    }
}
