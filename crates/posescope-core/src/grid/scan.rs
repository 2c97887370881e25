//! Scoring all hypotheses of a lattice.

use super::{Lattice, Offset, ScoredLattice};
use crate::geometry::Pose;
use crate::render::Score;

/// A hypothesis with its score.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// The hypothesis.
    pub offset: Offset,
    /// Its score.
    pub score: Score,
    /// Whether its cost is the lowest of the lattice so far.
    pub is_best: bool,
}

/// Scores the hypotheses of a lattice in scan order, `batch` at a time, and passes each batch to `tell`. A
/// hypothesis is eligible from `least_covered` pixels.
///
/// # Errors
/// The errors of `tell`, which end the scan.
pub fn scan<E>(
    lattice: Lattice,
    least_covered: u32,
    batch: usize,
    mut score: impl FnMut(&[Pose]) -> Vec<Score>,
    mut tell: impl FnMut(&[Scored]) -> Result<(), E>,
) -> Result<ScoredLattice, E> {
    let mut scores = vec![None; lattice.cells()];
    let mut least: Option<f64> = None;
    let hypotheses: Vec<(usize, Offset)> = lattice.hypotheses().collect();
    for some in hypotheses.chunks(batch.max(1)) {
        let poses: Vec<Pose> =
            some.iter().map(|(_, offset)| offset.reference_from_camera()).collect();
        let scored = some.iter().zip(score(&poses)).map(|(&(cell, offset), score)| {
            scores[cell] = Some(score);
            let cost = score.eligible_cost(least_covered);
            let is_best = cost.is_some_and(|cost| least.is_none_or(|least| cost < least));
            if is_best {
                least = cost;
            }
            Scored { offset, score, is_best }
        });
        tell(&scored.collect::<Vec<_>>())?;
    }
    Ok(ScoredLattice { lattice, scores, least_covered })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{GridParams, Phase};

    /// A quarter of the disc costs nothing, but covers too little.
    fn score(pose: &Pose) -> Score {
        let at = pose.translation.vector;
        let covered = if at.x < 0.0 && at.z < 0.0 { 4 } else { 5 };
        Score { cost: Some((at.x - 1.0).abs() + at.z.abs()), covered }
    }

    #[test]
    fn each_hypothesis_is_scored_once_in_order_and_the_best_are_ever_lower() {
        let lattice = || {
            let grid = GridParams::default();
            Lattice::new(Phase::PositionCoarse, Offset::default(), 3.0, &grid).expect("small")
        };
        for batch in [1, 7, 1000] {
            let (mut told, mut most) = (Vec::new(), 0);
            let score = |poses: &[Pose]| {
                most = most.max(poses.len());
                poses.iter().map(score).collect()
            };
            let surface = scan(lattice(), 5, batch, score, |some| {
                told.extend_from_slice(some);
                Ok::<_, ()>(())
            });
            let surface = surface.expect("nobody stops it");
            assert!(most <= batch);
            let offsets: Vec<Offset> = told.iter().map(|one| one.offset).collect();
            assert_eq!(offsets, lattice().hypotheses().map(|(_, o)| o).collect::<Vec<_>>());
            let best: Vec<&Scored> = told.iter().filter(|one| one.is_best).collect();
            assert!(best.iter().all(|one| one.score.covered == 5));
            assert!(best.is_sorted_by(|a, b| a.score.cost > b.score.cost));
            let minimum = surface.minimum().and_then(|cell| surface.lattice.offset(cell));
            assert_eq!(best.last().map(|one| one.offset), minimum);
        }
    }

    #[test]
    fn whoever_hears_of_the_hypotheses_can_stop_it() {
        let grid = GridParams::default();
        let lattice = Lattice::new(Phase::YawCoarse, Offset::default(), 3.0, &grid).expect("small");
        let mut scored = 0;
        let score = |poses: &[Pose]| {
            scored += poses.len();
            poses.iter().map(score).collect()
        };
        assert_eq!(scan(lattice, 5, 4, score, |_| Err("stop")).err(), Some("stop"));
        assert_eq!(scored, 4);
    }
}
