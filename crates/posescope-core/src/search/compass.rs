//! Descending a cost from a start, without derivatives.

/// Where a descent ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Descended<const N: usize> {
    /// The place.
    pub(crate) at: [f64; N],
    /// The cost there.
    pub(crate) cost: f64,
}

/// Compass search (Kolda, Lewis, Torczon, *Optimization by Direct Search*, SIAM Review 45(3), 2003): goes
/// to the best of the 2 N neighbours at `steps` as long as its cost is lower, then halves the steps,
/// `halvings` times.
///
/// `costs` scores many places at once; places without a cost, or with NaN, are never taken. `None` where
/// the start has no cost.
pub(crate) fn compass_search<const N: usize>(
    start: [f64; N],
    mut steps: [f64; N],
    halvings: usize,
    mut costs: impl FnMut(&[[f64; N]]) -> Vec<Option<f64>>,
) -> Option<Descended<N>> {
    /// A valley that is longer than this many steps is not followed to its end.
    const MAX_STEPS: usize = 24;
    let mut best = Descended { at: start, cost: costs(&[start]).first().copied()?? };
    for _ in 0..=halvings {
        // The way back leads to a higher cost.
        let mut back = None;
        for _ in 0..MAX_STEPS {
            let ways: Vec<(usize, f64)> = (0..N)
                .filter(|&axis| steps[axis] > 0.0)
                .flat_map(|axis| [(axis, steps[axis]), (axis, -steps[axis])])
                .filter(|way| back != Some(*way))
                .collect();
            let neighbours: Vec<[f64; N]> = ways
                .iter()
                .map(|&(axis, step)| {
                    let mut neighbour = best.at;
                    neighbour[axis] += step;
                    neighbour
                })
                .collect();
            let mut cheaper = None;
            for (place, cost) in costs(&neighbours).into_iter().enumerate() {
                if let Some(cost) = cost.filter(|&cost| cost < best.cost) {
                    best.cost = cost;
                    cheaper = Some(place);
                }
            }
            let Some(place) = cheaper else { break };
            best.at = neighbours[place];
            let (axis, step) = ways[place];
            back = Some((axis, -step));
        }
        steps = steps.map(|step| step / 2.0);
    }
    Some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bowl(places: &[[f64; 2]]) -> Vec<Option<f64>> {
        let cost = |[x, y]: &[f64; 2]| (x - 0.7).powi(2) + 3.0 * (y + 0.2).powi(2);
        places.iter().map(|place| Some(cost(place))).collect()
    }

    #[test]
    fn the_bottom_of_a_bowl_is_found_to_the_last_step() {
        let found = compass_search([0.0, 0.0], [0.5, 0.5], 6, bowl).expect("it has costs");
        assert!((found.at[0] - 0.7).abs() < 0.01 && (found.at[1] + 0.2).abs() < 0.01);
    }

    #[test]
    fn nothing_is_asked_where_the_descent_comes_from() {
        let mut asked = Vec::new();
        let costs = |places: &[[f64; 1]]| -> Vec<Option<f64>> {
            asked.extend(places.iter().map(|place| place[0]));
            let costs = places.iter().map(|place| Some((place[0] - 2.2).powi(2)));
            costs.collect()
        };
        compass_search([0.0], [0.5], 1, costs).expect("it has costs");
        assert_eq!(asked, [0.0, 0.5, -0.5, 1.0, 1.5, 2.0, 2.5, 2.25, 1.75, 2.5]);
    }

    #[test]
    fn no_step_goes_where_there_is_no_cost_and_a_frozen_axis_stays() {
        let fenced = |places: &[[f64; 2]]| -> Vec<Option<f64>> {
            let costs = bowl(places);
            let is_inside = |place: &[f64; 2]| place[0] <= 0.4;
            let fence = |(cost, place)| if is_inside(place) { cost } else { None };
            costs.into_iter().zip(places).map(fence).collect()
        };
        let found = compass_search([0.0, 0.0], [0.5, 0.0], 6, fenced).expect("it has costs");
        assert!(found.at[0] <= 0.4 && found.at[0] > 0.38);
        assert_eq!(found.at[1], 0.0);
        assert_eq!(compass_search([0.5, 0.0], [0.1, 0.1], 2, fenced), None);
    }
}
