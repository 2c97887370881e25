//! What the hypotheses of one phase cost, and which is the least of them.

use super::Lattice;
use crate::render::Score;

/// Costs that differ by less are rounded differently, and no more.
const MIN_DIFFERENCE: f64 = 1e-9;

/// A lattice after scoring: the cost surface and the coverage surface.
#[derive(Clone, Debug)]
pub struct ScoredLattice {
    /// Where the scores belong.
    pub lattice: Lattice,
    /// One per cell; `None` where the cell is no hypothesis.
    pub scores: Vec<Option<Score>>,
    /// Pixels that an eligible hypothesis covers at least.
    pub least_covered: u32,
}

impl ScoredLattice {
    /// The cost of a cell, if the cell may win.
    pub fn eligible_cost(&self, cell: usize) -> Option<f64> {
        self.scores[cell]?.eligible_cost(self.least_covered)
    }

    /// The cells that may win, with their costs, in scan order.
    pub(crate) fn eligible(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        (0..self.scores.len()).filter_map(|cell| Some((cell, self.eligible_cost(cell)?)))
    }

    /// The cell of least cost; of equal ones the first in scan order.
    pub fn minimum(&self) -> Option<usize> {
        self.eligible().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(cell, _)| cell)
    }

    /// The cost of all eligible cells and their number, where there are several and nothing tells them
    /// apart: they differ by less than 1e-9.
    pub fn flat_cost(&self) -> Option<(f64, usize)> {
        let (least, most, count) = self
            .eligible()
            .fold((f64::INFINITY, f64::NEG_INFINITY, 0), |(least, most, count), (_, cost)| {
                (cost.min(least), cost.max(most), count + 1)
            });
        (count > 1 && most - least < MIN_DIFFERENCE).then_some((least, count))
    }

    /// The cells that are lower than each of their neighbours, best first.
    ///
    /// A cell at the rim of the lattice counts: it may be the foot of a basin outside.
    pub fn local_minima(&self) -> Vec<(usize, f64)> {
        let is_least = |&(cell, cost): &(usize, f64)| {
            self.neighbours(cell).all(|neighbour| {
                self.eligible_cost(neighbour)
                    .is_none_or(|other| cost < other || (cost == other && cell < neighbour))
            })
        };
        let mut minima: Vec<(usize, f64)> = self.eligible().filter(is_least).collect();
        minima.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        minima
    }

    pub(super) fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        let Lattice { columns, rows, .. } = self.lattice;
        let (row, column) = (cell / columns, cell % columns);
        (row.saturating_sub(1)..(row + 2).min(rows)).flat_map(move |r| {
            (column.saturating_sub(1)..(column + 2).min(columns))
                .map(move |c| r * columns + c)
                .filter(move |&other| other != cell)
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::grid::{GridParams, Offset, Phase};

    fn scored(costs: &[Option<f64>], covered: u32, columns: usize) -> ScoredLattice {
        let (phase, centre) = (Phase::YawCoarse, Offset::default());
        let lattice = Lattice::new(phase, centre, 1.0, &GridParams::default());
        let mut lattice = lattice.expect("small");
        lattice.columns = columns;
        lattice.rows = costs.len() / columns;
        ScoredLattice {
            lattice,
            scores: costs.iter().map(|&cost| Some(Score { cost, covered })).collect(),
            least_covered: 10,
        }
    }

    #[test]
    fn the_first_of_equal_minima_wins_and_nan_never_does() {
        let surface = scored(&[Some(f64::NAN), Some(2.0), Some(1.0), Some(1.0)], 20, 4);
        assert_eq!(surface.minimum(), Some(2));
        let all_nan = scored(&[Some(f64::NAN), None], 20, 2);
        assert_eq!(all_nan.minimum(), None);
    }

    #[test]
    fn a_hypothesis_below_the_coverage_floor_cannot_win() {
        let mut surface = scored(&[Some(1.0), Some(2.0)], 20, 2);
        surface.scores[0] = Some(Score { cost: Some(1.0), covered: 9 });
        assert_eq!(surface.minimum(), Some(1));
    }

    #[test]
    fn a_surface_is_flat_only_if_several_costs_are_all_equal() {
        assert_eq!(scored(&[Some(2.0), None, Some(2.0)], 20, 3).flat_cost(), Some((2.0, 2)));
        assert_eq!(scored(&[Some(2.0), Some(2.0 + 1e-12)], 20, 2).flat_cost(), Some((2.0, 2)));
        assert_eq!(scored(&[Some(2.0), Some(2.1)], 20, 2).flat_cost(), None);
        assert_eq!(scored(&[Some(2.0), None], 20, 2).flat_cost(), None);
    }

    #[test]
    fn local_minima_are_ranked_and_a_plateau_counts_once() {
        let costs = [3.0, 1.0, 3.0, 3.0, 0.5, 0.5, 3.0, 2.0].map(Some);
        let surface = scored(&costs, 20, 8);
        let cells: Vec<_> = surface.local_minima().into_iter().map(|m| m.0).collect();
        assert_eq!(cells, [4, 1, 7]);
    }

    fn any_surface() -> impl Strategy<Value = ScoredLattice> {
        // Few different costs, so that equal ones meet.
        let cost = prop_oneof![
            5 => (0_u8..6).prop_map(|cost| Some(f64::from(cost))),
            1 => Just(Some(f64::NAN)),
            1 => Just(None),
        ];
        let score = (cost, 0_u32..40).prop_map(|(cost, covered)| Score { cost, covered });
        let cell = prop::option::weighted(0.9, score);
        (prop::collection::vec(cell, 12), 0_u32..40).prop_map(|(scores, least_covered)| {
            ScoredLattice { scores, least_covered, ..scored(&[None; 12], 0, 4) }
        })
    }

    proptest! {
        #[test]
        fn the_minimum_under_another_floor_is_the_first_of_the_least_costs_that_may_win(
            surface in any_surface(), floor in 0_u32..45,
        ) {
            let may_win = |score: &Option<Score>| {
                let Score { cost, covered } = (*score)?;
                cost.filter(|cost| covered >= floor && !cost.is_nan())
            };
            let costs = surface.scores.iter().map(may_win);
            let least = costs.clone().flatten().min_by(f64::total_cmp);
            let first = costs.clone().position(|cost| cost.is_some() && cost == least);
            let surface = ScoredLattice { least_covered: floor, ..surface };
            prop_assert_eq!(surface.minimum(), first);
            let ranked = surface.local_minima();
            prop_assert_eq!(ranked.first().map(|minimum| minimum.0), first);
        }

        #[test]
        fn a_higher_floor_never_gives_a_lower_cost(
            surface in any_surface(), floor in 0_u32..45, raised_by in 0_u32..45,
        ) {
            let cost = |floor| {
                let surface = ScoredLattice { least_covered: floor, ..surface.clone() };
                let cell: usize = surface.minimum()?;
                surface.scores[cell]?.cost
            };
            let (low, high) = (cost(floor), cost(floor + raised_by));
            prop_assert!(high.is_none_or(|high| low.is_some_and(|low| low <= high)));
        }
    }
}
