//! Scoring on the processor again what is reported of a lattice that a device has scored.

use super::ScoredLattice;
use crate::render::Scorer;

/// Costs that differ by less than this from the least one are near ties.
const NEAR: f64 = 1e-6;
/// Near ties that are scored again, at most: a surface may be flat.
const MAX_NEAR: usize = 64;

impl ScoredLattice {
    /// Where a [device](crate::render::Device) has scored, has the threads score again whatever is reported:
    /// all local minima, and what is nearly as low as the least. Where those are not what the device said,
    /// the threads score the whole lattice.
    pub fn settle(&mut self, scorer: &Scorer<'_>) {
        if !scorer.is_from_device() {
            return;
        }
        let mut cells: Vec<usize> = self.local_minima().iter().map(|minimum| minimum.0).collect();
        let least = self.eligible().map(|(_, cost)| cost).fold(f64::INFINITY, f64::min);
        let near = self.eligible().filter(|(_, cost)| cost - least < NEAR);
        cells.extend(near.map(|(cell, _)| cell).take(MAX_NEAR));
        cells.sort_unstable();
        cells.dedup();
        if !self.score_again(&cells, scorer) {
            scorer.distrust_device();
            let all: Vec<usize> = (0..self.scores.len()).collect();
            self.score_again(&all, scorer);
        }
    }

    /// Has the threads score cells, and says whether their scores are what they were.
    fn score_again(&mut self, cells: &[usize], scorer: &Scorer<'_>) -> bool {
        let hypothesis =
            |&cell: &usize| Some((cell, self.lattice.offset(cell)?.reference_from_camera()));
        let (cells, poses): (Vec<_>, Vec<_>) = cells.iter().filter_map(hypothesis).unzip();
        let mut are_equal = true;
        for (cell, score) in cells.into_iter().zip(scorer.score_on_threads(&poses)) {
            are_equal &= self.scores[cell] == Some(score);
            self.scores[cell] = Some(score);
        }
        are_equal
    }
}
