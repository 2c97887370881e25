//! The hypotheses of one phase of the search.

use super::{GridParams, Offset, Phase};

/// Cells of a lattice at most: 1,024 × 1,024, which is a radius of 511 m in steps of 1 m, or of 50 m
/// in steps of 0.1 m.
///
/// Scoring as many hypotheses takes ten minutes on one core, their scores 24 MB, and what a window
/// remembers of them 200 MB. A radius of 500 m in steps of 0.05 m would be 400 million: a week, and
/// tens of gigabytes.
pub const MAX_CELLS: usize = 1 << 20;

/// A phase of the search has more than [`MAX_CELLS`].
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "The search grid is too large: {} has {cells:.0} cells, at most {MAX_CELLS} are searched. {}.",
    phase.name(),
    phase.remedy()
)]
pub struct LatticeTooLarge {
    /// The phase.
    pub phase: Phase,
    /// The cells that its lattice would have, those left out included; they may be more than there
    /// are numbers for.
    pub cells: f64,
}

/// The hypotheses of one phase: a regular lattice of offsets around a centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    /// The phase it belongs to.
    pub phase: Phase,
    /// Hypotheses along right, or along yaw.
    pub columns: usize,
    /// Hypotheses along forward; 1 for yaw.
    pub rows: usize,
    /// Distance of neighbours \[m, or rad for yaw\].
    pub step: f64,
    /// The offset in the middle.
    pub centre: Offset,
    /// Positions farther from the reference than this are left out \[m\].
    reach_m: f64,
}

impl Lattice {
    /// The hypotheses of `phase` around `centre`, for an uncertainty radius \[m\].
    ///
    /// # Errors
    /// [`LatticeTooLarge`]: more than [`MAX_CELLS`].
    pub fn new(
        phase: Phase,
        centre: Offset,
        radius_m: f64,
        params: &GridParams,
    ) -> Result<Self, LatticeTooLarge> {
        let (half_range, step) = match phase {
            Phase::PositionCoarse => (radius_m, params.coarse_step_m),
            Phase::PositionFine => (params.fine_range_m, params.fine_step_m),
            Phase::YawCoarse => {
                (params.yaw_range_deg.to_radians(), params.yaw_step_deg.to_radians())
            }
            Phase::YawFine => {
                (params.yaw_fine_range_deg.to_radians(), params.yaw_fine_step_deg.to_radians())
            }
        };
        // The tolerance keeps 1.0 / 0.2 from becoming 4 steps.
        let steps = (half_range / step + 1e-9).floor().max(0.0);
        let side = 2.0 * steps + 1.0;
        let cells = if phase.is_yaw() { side } else { side * side };
        if cells > MAX_CELLS as f64 {
            return Err(LatticeTooLarge { phase, cells });
        }
        let side = side as usize;
        Ok(Self {
            phase,
            columns: side,
            rows: if phase.is_yaw() { 1 } else { side },
            step,
            centre,
            reach_m: match phase {
                Phase::PositionCoarse => radius_m,
                _ => f64::INFINITY,
            },
        })
    }

    /// Number of cells, those left out included.
    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// The offset of a cell, in scan order (left to right, then forward); `None` where it lies
    /// outside the uncertainty radius.
    pub fn offset(&self, cell: usize) -> Option<Offset> {
        let along = |index: usize, count: usize| (index as f64 - (count / 2) as f64) * self.step;
        let (row, column) = (cell / self.columns, cell % self.columns);
        let mut offset = self.centre;
        if self.phase.is_yaw() {
            offset.yaw_rad += along(column, self.columns);
            return Some(offset);
        }
        offset.right_m += along(column, self.columns);
        offset.forward_m += along(row, self.rows);
        // The disc is the reference's, wherever a later round has its centre.
        (offset.distance_m() <= self.reach_m + 1e-9).then_some(offset)
    }

    /// The cells that are hypotheses, with their offsets, in scan order.
    pub fn hypotheses(&self) -> impl Iterator<Item = (usize, Offset)> + '_ {
        (0..self.cells()).filter_map(|cell| Some((cell, self.offset(cell)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(phase: Phase, centre: Offset, radius_m: f64) -> Lattice {
        Lattice::new(phase, centre, radius_m, &GridParams::default()).expect("small")
    }

    #[test]
    fn a_lattice_beyond_the_limit_is_refused_and_one_at_the_limit_is_not() {
        let coarse = |radius_m, coarse_step_m| {
            let params = GridParams { coarse_step_m, ..GridParams::default() };
            Lattice::new(Phase::PositionCoarse, Offset::default(), radius_m, &params)
                .map(|lattice| lattice.cells())
        };
        assert_eq!(coarse(511.0, 1.0), Ok(1023 * 1023));
        let refused = coarse(500.0, 0.05).expect_err("400 million");
        assert_eq!(refused.cells, 20_001.0 * 20_001.0);
        assert_eq!(
            refused.to_string(),
            "The search grid is too large: position, coarse has 400040001 cells, at most 1048576 \
             are searched. Raise grid.coarse_step or lower the radius."
        );
        for radius_m in [1e300, f64::INFINITY] {
            assert!(coarse(radius_m, 0.05).is_err());
        }
        let params = GridParams { fine_range_m: 10.0, fine_step_m: 0.01, ..GridParams::default() };
        let refused = Lattice::new(Phase::PositionFine, Offset::default(), 1.0, &params);
        assert_eq!(refused.expect_err("4 million").cells, 2001.0 * 2001.0);
    }

    #[test]
    fn a_later_round_stays_within_the_disc_of_the_reference() {
        let centre = Offset { right_m: 8.0, forward_m: -1.0, yaw_rad: 0.1 };
        let lattice = lattice(Phase::PositionCoarse, centre, 10.0);
        let distances: Vec<f64> = lattice
            .hypotheses()
            .map(|(_, offset)| offset.right_m.hypot(offset.forward_m))
            .collect();
        assert!(distances.len() > 50);
        assert!(distances.iter().all(|&distance| distance <= 10.0 + 1e-9));
    }

    #[test]
    fn the_fine_lattice_reaches_both_ends_and_contains_its_centre() {
        let centre = Offset { right_m: 3.0, forward_m: -2.0, yaw_rad: 0.0 };
        let lattice = lattice(Phase::PositionFine, centre, 10.0);
        assert_eq!((lattice.columns, lattice.rows), (11, 11));
        assert_eq!(lattice.offset(60), Some(centre));
        let first = lattice.offset(0).expect("inside");
        assert!((first.right_m - 2.0).abs() < 1e-9 && (first.forward_m + 3.0).abs() < 1e-9);
    }

    #[test]
    fn coarse_positions_fill_the_disc_and_no_more() {
        let lattice = lattice(Phase::PositionCoarse, Offset::default(), 2.0);
        assert_eq!(lattice.cells(), 25);
        assert_eq!(lattice.hypotheses().count(), 13);
    }

    #[test]
    fn yaw_angles_are_centred_and_symmetric() {
        let lattice = lattice(Phase::YawCoarse, Offset::default(), 5.0);
        let yaws: Vec<_> = lattice.hypotheses().map(|(_, o)| o.yaw_rad).collect();
        assert_eq!(yaws.len(), 21);
        assert!((yaws[0] + 10_f64.to_radians()).abs() < 1e-12);
        assert_eq!(yaws[10], 0.0);
    }
}
