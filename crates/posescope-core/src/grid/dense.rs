//! Every position with every heading: what the coarse-to-fine search passes by.

use std::sync::Arc;

use super::{GridParams, Lattice, LatticeTooLarge, Offset, Phase, ScoredLattice};
use crate::render::{Objective as _, Score, Scorer};

/// The cost over a dense grid of positions and headings, while it is being filled: of each position the
/// cheapest of the headings that were tried.
///
/// It is filled heading by heading, from straight ahead outwards, so that all positions are seen soon and
/// cameras that look the same way follow each other, which is what makes scoring them fast.
#[derive(Clone, Debug)]
pub struct DenseSurface {
    /// The positions, with the score of the cheapest heading.
    cheapest: Arc<ScoredLattice>,
    /// That heading at each cell \[rad\].
    yaws_rad: Vec<f64>,
    /// The positions in scan order, at the heading of the reference.
    positions: Vec<(usize, Offset)>,
    /// In the order in which they are tried \[rad\].
    headings: Vec<f64>,
    tried: usize,
}

impl DenseSurface {
    /// A surface without scores, of the positions within `radius_m` at `coarse_step` and the headings within
    /// `yaw_range` at `yaw_step`. An eligible hypothesis covers at least `least_covered` pixels.
    ///
    /// # Errors
    /// [`LatticeTooLarge`].
    pub fn new(
        radius_m: f64,
        grid: &GridParams,
        least_covered: u32,
    ) -> Result<Self, LatticeTooLarge> {
        let around = |phase| Lattice::new(phase, Offset::default(), radius_m, grid);
        let lattice = around(Phase::PositionCoarse)?;
        let mut headings: Vec<f64> =
            around(Phase::YawCoarse)?.hypotheses().map(|(_, offset)| offset.yaw_rad).collect();
        headings.sort_by(|a, b| a.abs().total_cmp(&b.abs()).then(a.total_cmp(b)));
        Ok(Self {
            yaws_rad: vec![0.0; lattice.cells()],
            positions: lattice.hypotheses().collect(),
            headings,
            tried: 0,
            cheapest: Arc::new(ScoredLattice {
                scores: vec![None; lattice.cells()],
                lattice,
                least_covered,
            }),
        })
    }

    /// Positions times headings.
    pub fn hypotheses(&self) -> usize {
        self.positions.len() * self.headings.len()
    }

    /// How many of them have a score.
    pub fn tried(&self) -> usize {
        self.tried
    }

    /// Whether all of them have.
    pub fn is_complete(&self) -> bool {
        self.tried >= self.hypotheses()
    }

    /// The hypotheses that come next, `at_most` of them, all with one heading; none where all are tried.
    pub fn next(&self, at_most: usize) -> Vec<Offset> {
        let of_a_heading = self.positions.len().max(1);
        let Some(&yaw_rad) = self.headings.get(self.tried / of_a_heading) else {
            return Vec::new();
        };
        let positions = self.positions.iter().skip(self.tried % of_a_heading);
        let turned = |&(_, offset): &(usize, Offset)| Offset { yaw_rad, ..offset };
        positions.take(at_most).map(turned).collect()
    }

    /// Scores a batch of the hypotheses that come next, as many as the scorer takes at once; what they are
    /// worth, nothing where all are tried.
    pub fn score_next(&mut self, scorer: &Scorer<'_>) -> Vec<Score> {
        let offsets = self.next(scorer.batch(self.positions.len()));
        let poses: Vec<_> = offsets.iter().map(Offset::reference_from_camera).collect();
        let scores = scorer.score(&poses);
        self.take(&scores);
        scores
    }

    /// Takes in what the hypotheses that come next are worth, in their order. Of equal costs the smaller turn
    /// stays; where no heading covers enough, that which covers most.
    pub fn take(&mut self, scores: &[Score]) {
        let cheapest = Arc::make_mut(&mut self.cheapest);
        let of_a_heading = self.positions.len().max(1);
        for score in scores {
            let Some(&yaw_rad) = self.headings.get(self.tried / of_a_heading) else {
                return;
            };
            let (cell, _) = self.positions[self.tried % of_a_heading];
            let before = &mut cheapest.scores[cell];
            if before.is_none_or(|before| is_better(score, &before, cheapest.least_covered)) {
                *before = Some(*score);
                self.yaws_rad[cell] = yaw_rad;
            }
            self.tried += 1;
        }
    }

    /// The cheapest heading's score at each position; `None` where none was tried yet.
    pub fn cheapest(&self) -> &Arc<ScoredLattice> {
        &self.cheapest
    }

    /// The cheapest hypothesis at a cell, with what it is worth.
    pub fn at(&self, cell: usize) -> Option<(Offset, Score)> {
        let score = (*self.cheapest.scores.get(cell)?)?;
        let yaw_rad = self.yaws_rad[cell];
        let offset = self.cheapest.lattice.offset(cell)?;
        Some((Offset { yaw_rad, ..offset }, score))
    }

    /// The cheapest hypothesis of all that cover enough, so far.
    pub fn minimum(&self) -> Option<(Offset, Score)> {
        self.at(self.cheapest.minimum()?)
    }
}

/// Whether a score is to be kept instead of another one of the same position.
fn is_better(score: &Score, before: &Score, least_covered: u32) -> bool {
    let [now, then] = [score, before].map(|score| score.eligible_cost(least_covered));
    match (now, then) {
        (Some(now), Some(then)) => now < then,
        (Some(_), None) => true,
        (None, Some(_)) => false,
        (None, None) => score.covered > before.covered,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// 13 positions, 5 headings.
    fn surface(least_covered: u32) -> DenseSurface {
        let grid = GridParams { yaw_range_deg: 2.0, ..GridParams::default() };
        DenseSurface::new(2.0, &grid, least_covered).expect("small")
    }

    #[test]
    fn headings_come_from_straight_ahead_outwards_and_every_hypothesis_once() {
        let mut surface = surface(0);
        let mut seen: Vec<Offset> = Vec::new();
        loop {
            let next = surface.next(5);
            if next.is_empty() {
                break;
            }
            assert!(next.iter().all(|one| one.yaw_rad == next[0].yaw_rad));
            let score = Score { cost: Some(1.0), covered: 1 };
            surface.take(&vec![score; next.len()]);
            seen.extend(next);
        }
        assert!(surface.is_complete());
        assert_eq!((seen.len(), surface.hypotheses()), (65, 65));
        let turns: Vec<f64> = seen.iter().map(|one| one.yaw_rad.abs()).collect();
        assert!(turns.is_sorted());
        for (index, one) in seen.iter().enumerate() {
            assert!(!seen[..index].contains(one), "{one:?} twice");
        }
        // All cost the same: nobody turns for nothing.
        let (minimum, _) = surface.minimum().expect("scored");
        assert_eq!(minimum.yaw_rad, 0.0);
    }

    #[test]
    fn a_surface_of_too_many_positions_is_refused() {
        let grid = GridParams { coarse_step_m: 0.05, ..GridParams::default() };
        assert!(DenseSurface::new(500.0, &grid, 0).is_err());
    }

    proptest! {
        #[test]
        fn each_position_keeps_the_cheapest_heading_that_covers_enough(
            scores in prop::collection::vec((prop::option::of(0_u8..9), 0_u32..20), 65),
            least_covered in 0_u32..20,
            at_a_time in 1_usize..30,
        ) {
            let scores: Vec<Score> = scores
                .into_iter()
                .map(|(cost, covered)| Score { cost: cost.map(f64::from), covered })
                .collect();
            let mut surface = surface(least_covered);
            let mut offsets = Vec::new();
            while !surface.is_complete() {
                let next = surface.next(at_a_time);
                let from = offsets.len();
                surface.take(&scores[from..from + next.len()]);
                offsets.extend(next);
            }
            let least = scores
                .iter()
                .filter_map(|score| score.eligible_cost(least_covered))
                .min_by(f64::total_cmp);
            let found = surface.minimum();
            prop_assert_eq!(found.and_then(|(_, score)| score.cost), least);
            for cell in 0..surface.cheapest().scores.len() {
                let Some((offset, score)) = surface.at(cell) else { continue };
                let here = |other: &&(Offset, Score)| {
                    other.0.right_m == offset.right_m && other.0.forward_m == offset.forward_m
                };
                let all: Vec<(Offset, Score)> = offsets.iter().copied().zip(scores.clone()).collect();
                let of_cell: Vec<&(Offset, Score)> = all.iter().filter(here).collect();
                prop_assert_eq!(of_cell.len(), 5);
                prop_assert!(of_cell.contains(&&(offset, score)));
                let least = of_cell
                    .iter()
                    .filter_map(|(_, score)| score.eligible_cost(least_covered))
                    .min_by(f64::total_cmp);
                prop_assert_eq!(score.eligible_cost(least_covered), least);
            }
        }
    }
}
