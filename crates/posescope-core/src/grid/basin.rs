//! From how far a cost leads to the right place, and how clearly it prefers it.

use super::{Offset, ScoredLattice};

/// A place is where a coarse lattice has a minimum if that is within this many steps of it: half a
/// step along either axis, and as much again for a minimum that is drawn aside.
const STEPS_TO_MINIMUM: f64 = 1.5;

/// What a scored lattice of positions says of one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basin {
    /// Up to this distance from the place, at least half of the cells of every ring of one step's
    /// width lead downhill, from cell to cheapest neighbour, to the minimum at the place \[m\]. 0 where
    /// there is no minimum at the place.
    pub radius_m: f64,
    /// What the cheapest local minimum elsewhere costs more than the minimum at the place, in the
    /// cost's unit: negative where the images prefer another place. `None` without a minimum at the
    /// place, or without another.
    pub margin: Option<f64>,
}

impl ScoredLattice {
    /// The basin of a place, such as the true pose; `None` for a lattice of yaws, and where no cell
    /// has a cost.
    ///
    /// Cells that cover too little lead nowhere.
    pub fn basin(&self, place: &Offset) -> Option<Basin> {
        if self.lattice.phase.is_yaw() {
            return None;
        }
        let away = |cell: usize| Some(self.lattice.offset(cell)?.distance_from(place));
        let minima = self.local_minima();
        let reach_m = STEPS_TO_MINIMUM * self.lattice.step;
        let nearest = minima
            .iter()
            .filter_map(|&(cell, cost)| Some((away(cell)?, cell, cost)))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (distance, target, cost) = nearest;
        if distance > reach_m {
            return Some(Basin { radius_m: 0.0, margin: None });
        }
        let elsewhere = minima.iter().find(|(cell, _)| *cell != target);
        Some(Basin {
            radius_m: self.radius_around(place, target),
            margin: elsewhere.map(|(_, other)| other - cost),
        })
    }

    /// The outer radius of the last ring from which at least half of the cells lead to `target`, all
    /// rings within it included.
    fn radius_around(&self, place: &Offset, target: usize) -> f64 {
        // A cell outside the disc was never scored, and is no part of the lattice.
        let scored = self.lattice.hypotheses().filter(|&(cell, _)| self.scores[cell].is_some());
        let cells: Vec<(f64, bool)> = scored
            .map(|(cell, offset)| (offset.distance_from(place), self.foot(cell) == Some(target)))
            .collect();
        let (farthest, step) =
            (cells.iter().map(|cell| cell.0).fold(0.0, f64::max), self.lattice.step);
        let leads = |&ring: &usize| {
            let ring = cells.iter().filter(|(distance, _)| (distance / step) as usize == ring);
            2 * ring.clone().filter(|(_, leads)| *leads).count() >= ring.count()
        };
        let rings = (0..=(farthest / step) as usize).take_while(leads).count();
        (rings as f64 * step).min(farthest)
    }

    /// Where one ends who goes from a cell to its cheapest neighbour as long as that is cheaper.
    fn foot(&self, start: usize) -> Option<usize> {
        let mut at = (start, self.eligible_cost(start)?);
        loop {
            let cheapest = self
                .neighbours(at.0)
                .filter_map(|cell| Some((cell, self.eligible_cost(cell)?)))
                .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            match cheapest {
                // Equal cells lead to the first of them, which is the one that counts as a minimum.
                Some(next) if next.1 < at.1 || (next.1 == at.1 && next.0 < at.0) => at = next,
                _ => return Some(at.0),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{GridParams, Lattice, Phase};
    use crate::render::Score;

    /// A coarse lattice of 10 m with a cost at every position.
    fn scored(cost: impl Fn(f64, f64) -> f64) -> ScoredLattice {
        let params = GridParams::default();
        let lattice = Lattice::new(Phase::PositionCoarse, Offset::default(), 10.0, &params)
            .expect("it is small");
        let mut scores = vec![None; lattice.cells()];
        for (cell, offset) in lattice.hypotheses() {
            scores[cell] =
                Some(Score { cost: Some(cost(offset.right_m, offset.forward_m)), covered: 1000 });
        }
        ScoredLattice { lattice, scores, least_covered: 1 }
    }

    fn at(right_m: f64, forward_m: f64) -> Offset {
        Offset { right_m, forward_m, yaw_rad: 0.0 }
    }

    #[test]
    fn a_bowl_is_a_basin_as_wide_as_the_disc_and_has_no_other_minimum() {
        let surface = scored(|x, z| (x - 2.0).powi(2) + (z + 1.0).powi(2));
        let basin = surface.basin(&at(2.2, -1.1)).expect("positions");
        assert!(basin.radius_m > 11.0, "{basin:?}");
        assert_eq!(basin.margin, None);
    }

    #[test]
    fn of_two_wells_each_has_the_half_up_to_the_ridge_and_the_deeper_one_the_positive_margin() {
        // Wells at (−4, 0) and (4, 0); the ridge is the line x = 0.
        let well = |x: f64, z: f64, centre: f64| (x - centre).powi(2) + z.powi(2);
        let surface = scored(|x, z| (well(x, z, -4.0) + 0.5).min(well(x, z, 4.0)));
        let (shallow, deep) = (surface.basin(&at(-4.0, 0.0)), surface.basin(&at(4.0, 0.0)));
        let (shallow, deep) = (shallow.expect("positions"), deep.expect("positions"));
        assert_eq!(deep.margin, Some(0.5));
        assert_eq!(shallow.margin, Some(-0.5));
        for basin in [shallow, deep] {
            // A ring leaves the well by less than half until about where the disc ends too.
            assert!((4.0..=8.0).contains(&basin.radius_m), "{basin:?}");
        }
    }

    #[test]
    fn a_place_without_a_minimum_has_no_basin() {
        let surface = scored(|x, z| (x - 5.0).powi(2) + z.powi(2));
        let nothing = Basin { radius_m: 0.0, margin: None };
        assert_eq!(surface.basin(&at(-5.0, 0.0)), Some(nothing));
    }

    #[test]
    fn cells_without_a_cost_lead_nowhere() {
        let mut surface = scored(|x, z| x.powi(2) + z.powi(2));
        let cells: Vec<(usize, Offset)> = surface.lattice.hypotheses().collect();
        for (cell, offset) in cells {
            if offset.right_m.hypot(offset.forward_m) > 3.5 {
                surface.scores[cell] = Some(Score { cost: None, covered: 0 });
            }
        }
        let basin = surface.basin(&at(0.0, 0.0)).expect("positions");
        assert!((3.0..=4.0).contains(&basin.radius_m), "{basin:?}");
    }
}
