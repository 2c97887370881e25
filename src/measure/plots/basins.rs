//! From how far around the truth a cost leads to it, and how clearly it prefers it, over a run.

use super::Line;
use crate::measure::metrics::{CostOfRow, Row};
use crate::method::Method;

/// Name, horizontal axis and lines of each curve that there is something to draw for.
pub(super) fn curves(
    methods: &[Method],
    rows: &[&Row],
) -> Vec<(&'static str, &'static str, Vec<Line>)> {
    let of = |value: fn(&CostOfRow) -> Option<f64>| {
        super::lines(methods, |method| {
            let measured = rows
                .iter()
                .filter(|row| row.method == method)
                .filter_map(|row| row.cost.as_ref());
            // A truth without a minimum has no margin, and counts as the least of all.
            let values: Vec<f64> = measured
                .filter(|basin| basin.basin_m.is_some())
                .map(|basin| value(basin).unwrap_or(f64::NEG_INFINITY))
                .collect();
            at_least(values)
        })
    };
    let curves = [
        (
            "basin",
            "radius of the truth's basin, at least (m)",
            of(|basin| basin.basin_m),
        ),
        (
            "margin",
            "best minimum elsewhere over that at the truth, at least (% of the cost at the result)",
            of(|basin| Some(100.0 * basin.basin_margin? / basin.best)),
        ),
    ];
    let has_lines = |(.., lines): &(_, _, Vec<Line>)| !lines.is_empty();
    curves.into_iter().filter(has_lines).collect()
}

/// The share of the values that are at least x, in steps from the least to the greatest.
fn at_least(mut values: Vec<f64>) -> Vec<(f64, f64)> {
    let all = values.len() as f64;
    values.retain(|value| value.is_finite());
    values.sort_unstable_by(f64::total_cmp);
    let count = values.len();
    let share = |rank: usize| 100.0 * (count - rank) as f64 / all;
    let steps = values.iter().enumerate();
    steps
        .flat_map(|(rank, &value)| [(value, share(rank)), (value, share(rank + 1))])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_falls_from_all_that_have_a_value_to_none() {
        let steps = at_least(vec![3.0, 1.0, f64::NEG_INFINITY, 2.0]);
        assert_eq!(
            steps,
            [
                (1.0, 75.0),
                (1.0, 50.0),
                (2.0, 50.0),
                (2.0, 25.0),
                (3.0, 25.0),
                (3.0, 0.0)
            ]
        );
        assert!(at_least(Vec::new()).is_empty());
    }
}
