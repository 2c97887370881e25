//! The coarse-to-fine search grid of the direct methods (paper, appendix B, "coarse-to-fine grid
//! search").
//!
//! The grid is centred on the reference camera and uses its axes: right (x) and forward (z), then
//! yaw about its up axis (−y). Height, pitch and roll stay the reference's.

mod basin;
mod settle;

pub use basin::Basin;

use nalgebra::{Translation3, Vector3};

use crate::describe::parameters;
use crate::geometry::{Pose, yaw};
use crate::memo::{Bits, bits_of_fields};
use crate::render::Score;

parameters! {
    /// Steps and ranges of the search. The range of positions is the problem's uncertainty radius.
    #[derive(Clone, Debug, PartialEq)]
    pub struct GridParams {
        /// Step of the coarse positions.
        pub coarse_step_m: f64 = number("coarse_step", "m", 0.05..=10.0),
        /// Half width of the square of fine positions.
        pub fine_range_m: f64 = number("fine_range", "m", 0.0..=10.0),
        /// Step of the fine positions.
        pub fine_step_m: f64 = number("fine_step", "m", 0.01..=5.0),
        /// Half range of the coarse yaw angles.
        pub yaw_range_deg: f64 = number("yaw_range", "°", 0.0..=180.0),
        /// Step of the coarse yaw angles.
        pub yaw_step_deg: f64 = number("yaw_step", "°", 0.05..=45.0),
        /// Half range of the fine yaw angles.
        pub yaw_fine_range_deg: f64 = number("yaw_fine_range", "°", 0.0..=45.0),
        /// Step of the fine yaw angles.
        pub yaw_fine_step_deg: f64 = number("yaw_fine_step", "°", 0.01..=10.0),
        /// How often position and yaw are searched, one after the other; the paper does it once.
        pub rounds: usize = count("rounds", "", 1..=10),
        /// Least coverage of a hypothesis that has a say, as a share of the pixels covered at the
        /// reference pose.
        ///
        /// Fewer pixels make lower costs: without a floor both costs have their global minimum where
        /// less than 1 % is covered. At 0.15 and above the right basin is cut off when the query is
        /// 8 to 10 m ahead.
        pub coverage_floor: f64 = number("coverage_floor", "", 0.0..=1.0),
    }
}

impl GridParams {
    /// Whether an offset lies where the grid of a search within `radius_m` ends, in position or yaw: its
    /// basin may go on outside.
    pub fn is_on_rim(&self, offset: &Offset, radius_m: f64) -> bool {
        let distance_m = offset.right_m.hypot(offset.forward_m);
        let yaw_deg = offset.yaw_rad.to_degrees().abs();
        distance_m > radius_m - 0.5 * self.coarse_step_m
            || yaw_deg > self.yaw_range_deg - 0.5 * self.yaw_step_deg
    }
}

impl Default for GridParams {
    fn default() -> Self {
        Self {
            coarse_step_m: 1.0,
            fine_range_m: 1.0,
            fine_step_m: 0.2,
            yaw_range_deg: 10.0,
            yaw_step_deg: 1.0,
            yaw_fine_range_deg: 1.0,
            yaw_fine_step_deg: 0.1,
            rounds: 1,
            coverage_floor: 0.05,
        }
    }
}

/// Pixels that a hypothesis must cover to have a say, for a coverage floor as in
/// [`GridParams::coverage_floor`].
pub fn least_covered(coverage_floor: f64, covered_at_reference: u32) -> u32 {
    (coverage_floor * f64::from(covered_at_reference)).ceil() as u32
}

/// Where a camera is, seen from the reference camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Offset {
    /// To the reference camera's right \[m\].
    pub right_m: f64,
    /// To its front \[m\].
    pub forward_m: f64,
    /// About its up axis, positive to the left \[rad\].
    pub yaw_rad: f64,
}

bits_of_fields!(Offset {
    right_m,
    forward_m,
    yaw_rad
});

impl Offset {
    /// The offset of a camera `reference_from_camera`. What no offset has is left out: height, pitch
    /// and roll.
    pub fn of(reference_from_camera: &Pose) -> Self {
        let centre = &reference_from_camera.translation;
        let ahead = reference_from_camera.rotation * Vector3::z();
        Self {
            right_m: centre.x,
            forward_m: centre.z,
            yaw_rad: (-ahead.x).atan2(ahead.z),
        }
    }

    /// The camera's pose in the reference camera's frame.
    pub fn reference_from_camera(&self) -> Pose {
        Pose::from_parts(
            Translation3::from(Vector3::new(self.right_m, 0.0, self.forward_m)),
            yaw(self.yaw_rad),
        )
    }
}

/// The four parts of one round of the search, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    /// All positions within the uncertainty radius.
    PositionCoarse,
    /// Positions around the coarse minimum.
    PositionFine,
    /// Yaw angles at the fine position.
    YawCoarse,
    /// Yaw angles around the coarse yaw.
    YawFine,
}

impl Bits for Phase {
    fn write(&self, words: &mut Vec<u64>) {
        words.push(*self as u64);
    }
}

impl Phase {
    /// The order of the search.
    pub const ALL: [Self; 4] = [
        Self::PositionCoarse,
        Self::PositionFine,
        Self::YawCoarse,
        Self::YawFine,
    ];

    /// Whether this phase turns the camera rather than moves it.
    pub fn is_yaw(self) -> bool {
        matches!(self, Self::YawCoarse | Self::YawFine)
    }

    /// What makes its lattice smaller.
    fn remedy(self) -> &'static str {
        match self {
            Self::PositionCoarse => "raise grid.coarse_step or lower the radius",
            Self::PositionFine => "raise grid.fine_step or lower grid.fine_range",
            Self::YawCoarse => "raise grid.yaw_step or lower grid.yaw_range",
            Self::YawFine => "raise grid.yaw_fine_step or lower grid.yaw_fine_range",
        }
    }

    /// The name that people read.
    pub fn name(self) -> &'static str {
        match self {
            Self::PositionCoarse => "position, coarse",
            Self::PositionFine => "position, fine",
            Self::YawCoarse => "yaw, coarse",
            Self::YawFine => "yaw, fine",
        }
    }
}

/// Cells of a lattice at most: 1,024 × 1,024, which is a radius of 511 m in steps of 1 m, or of 50 m
/// in steps of 0.1 m.
///
/// Scoring as many hypotheses takes ten minutes on one core, their scores 24 MB, and what a window
/// remembers of them 200 MB. A radius of 500 m in steps of 0.05 m would be 400 million: a week, and
/// tens of gigabytes.
pub const MOST_CELLS: usize = 1 << 20;

/// Costs that differ by less are rounded differently, and no more.
const LEAST_DIFFERENCE: f64 = 1e-9;

/// A phase of the search has more than [`MOST_CELLS`].
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the search grid is too large: {} has {cells:.0} cells, at most {MOST_CELLS} are searched; {}",
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

bits_of_fields!(Lattice {
    phase,
    columns,
    rows,
    step,
    centre,
    reach_m,
});

impl Lattice {
    /// The hypotheses of `phase` around `centre`, for an uncertainty radius \[m\].
    ///
    /// # Errors
    /// [`LatticeTooLarge`]: more than [`MOST_CELLS`].
    pub fn new(
        phase: Phase,
        centre: Offset,
        radius_m: f64,
        params: &GridParams,
    ) -> Result<Self, LatticeTooLarge> {
        let (half_range, step) = match phase {
            Phase::PositionCoarse => (radius_m, params.coarse_step_m),
            Phase::PositionFine => (params.fine_range_m, params.fine_step_m),
            Phase::YawCoarse => (
                params.yaw_range_deg.to_radians(),
                params.yaw_step_deg.to_radians(),
            ),
            Phase::YawFine => (
                params.yaw_fine_range_deg.to_radians(),
                params.yaw_fine_step_deg.to_radians(),
            ),
        };
        // The tolerance keeps 1.0 / 0.2 from becoming 4 steps.
        let steps = (half_range / step + 1e-9).floor().max(0.0);
        let side = 2.0 * steps + 1.0;
        let cells = if phase.is_yaw() { side } else { side * side };
        if cells > MOST_CELLS as f64 {
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
        let (right, forward) = (along(column, self.columns), along(row, self.rows));
        offset.right_m += right;
        offset.forward_m += forward;
        // The disc is the reference's, wherever a later round has its centre.
        let is_inside = offset.right_m.hypot(offset.forward_m) <= self.reach_m + 1e-9;
        is_inside.then_some(offset)
    }

    /// The cells that are hypotheses, with their offsets, in scan order.
    pub fn hypotheses(&self) -> impl Iterator<Item = (usize, Offset)> + '_ {
        (0..self.cells()).filter_map(|cell| Some((cell, self.offset(cell)?)))
    }
}

/// A lattice after scoring: the cost surface and the coverage surface.
#[derive(Clone, Debug)]
pub struct ScoredLattice {
    /// Where the scores belong.
    pub lattice: Lattice,
    /// One per cell; `None` where the cell is no hypothesis.
    pub scores: Vec<Option<Score>>,
    /// Pixels that a hypothesis must cover to have a say.
    pub least_covered: u32,
}

impl ScoredLattice {
    /// The cost of a cell, if the cell may win.
    pub fn eligible_cost(&self, cell: usize) -> Option<f64> {
        self.scores[cell]?.eligible_cost(self.least_covered)
    }

    /// The cell of least cost; of equal ones the first in scan order.
    pub fn minimum(&self) -> Option<usize> {
        self.minimum_with(self.least_covered)
    }

    /// What [`Self::minimum`] would be if a hypothesis had to cover `least_covered` pixels.
    pub fn minimum_with(&self, least_covered: u32) -> Option<usize> {
        let mut best: Option<(usize, f64)> = None;
        for (cell, score) in self.scores.iter().enumerate() {
            if let Some(cost) = score.and_then(|score| score.eligible_cost(least_covered))
                && best.is_none_or(|(_, least)| cost < least)
            {
                best = Some((cell, cost));
            }
        }
        best.map(|(cell, _)| cell)
    }

    /// The cost of all eligible cells and their number, where there are several and nothing tells them
    /// apart: they differ by less than 1e-9.
    pub fn flat_cost(&self) -> Option<(f64, usize)> {
        let costs = (0..self.scores.len()).filter_map(|cell| self.eligible_cost(cell));
        let (least, most, count) = costs.fold(
            (f64::INFINITY, f64::NEG_INFINITY, 0),
            |(least, most, count), cost| (cost.min(least), cost.max(most), count + 1),
        );
        (count > 1 && most - least < LEAST_DIFFERENCE).then_some((least, count))
    }

    /// The cells that are lower than each of their neighbours, best first.
    ///
    /// A cell at the rim of the lattice counts: it may be the foot of a basin outside.
    pub fn local_minima(&self) -> Vec<(usize, f64)> {
        self.local_minima_with(self.least_covered)
    }

    /// What [`Self::local_minima`] would be if a hypothesis had to cover `least_covered` pixels.
    pub fn local_minima_with(&self, least_covered: u32) -> Vec<(usize, f64)> {
        let eligible_cost = |cell: usize| self.scores[cell]?.eligible_cost(least_covered);
        let mut minima: Vec<(usize, f64)> = (0..self.scores.len())
            .filter_map(|cell| Some((cell, eligible_cost(cell)?)))
            .filter(|&(cell, cost)| {
                self.neighbours(cell).all(|neighbour| {
                    eligible_cost(neighbour)
                        .is_none_or(|other| cost < other || (cost == other && cell < neighbour))
                })
            })
            .collect();
        minima.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        minima
    }

    fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
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
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn lattice(phase: Phase, centre: Offset, radius_m: f64) -> Lattice {
        Lattice::new(phase, centre, radius_m, &GridParams::default()).expect("small")
    }

    #[test]
    fn a_lattice_beyond_the_limit_is_refused_and_one_at_the_limit_is_not() {
        let coarse = |radius_m, coarse_step_m| {
            let params = GridParams {
                coarse_step_m,
                ..GridParams::default()
            };
            Lattice::new(Phase::PositionCoarse, Offset::default(), radius_m, &params)
                .map(|lattice| lattice.cells())
        };
        assert_eq!(coarse(511.0, 1.0), Ok(1023 * 1023));
        let refused = coarse(500.0, 0.05).expect_err("400 million");
        assert_eq!(refused.cells, 20_001.0 * 20_001.0);
        assert_eq!(
            refused.to_string(),
            "the search grid is too large: position, coarse has 400040001 cells, at most 1048576 \
             are searched; raise grid.coarse_step or lower the radius"
        );
        for radius_m in [1e300, f64::INFINITY] {
            assert!(coarse(radius_m, 0.05).is_err());
        }
        let params = GridParams {
            fine_range_m: 10.0,
            fine_step_m: 0.01,
            ..GridParams::default()
        };
        let refused = Lattice::new(Phase::PositionFine, Offset::default(), 1.0, &params);
        assert_eq!(refused.expect_err("4 million").cells, 2001.0 * 2001.0);
    }

    #[test]
    fn a_later_round_stays_within_the_disc_of_the_reference() {
        let centre = Offset {
            right_m: 8.0,
            forward_m: -1.0,
            yaw_rad: 0.1,
        };
        let lattice = lattice(Phase::PositionCoarse, centre, 10.0);
        let distances: Vec<f64> = lattice
            .hypotheses()
            .map(|(_, offset)| offset.right_m.hypot(offset.forward_m))
            .collect();
        assert!(distances.len() > 50);
        assert!(distances.iter().all(|&distance| distance <= 10.0 + 1e-9));
    }

    #[test]
    fn the_rim_is_the_last_step_of_positions_and_of_yaws() {
        let params = GridParams::default();
        let is_on_rim = |right_m, yaw_deg: f64| {
            let offset = Offset {
                right_m,
                forward_m: 0.0,
                yaw_rad: yaw_deg.to_radians(),
            };
            params.is_on_rim(&offset, 10.0)
        };
        assert!(is_on_rim(-9.6, 0.0) && is_on_rim(0.0, 9.8));
        assert!(!is_on_rim(9.4, 0.0) && !is_on_rim(0.0, -9.4));
    }

    #[test]
    fn the_fine_lattice_reaches_both_ends_and_contains_its_centre() {
        let centre = Offset {
            right_m: 3.0,
            forward_m: -2.0,
            yaw_rad: 0.0,
        };
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

    #[test]
    fn a_camera_ahead_sees_a_point_nearer_and_one_turned_left_sees_it_to_the_right() {
        let point = Point3::new(0.0, 0.0, 10.0);
        let camera = |offset: Offset| offset.reference_from_camera().inverse() * point;
        let ahead = camera(Offset {
            forward_m: 4.0,
            ..Default::default()
        });
        assert!((ahead.z - 6.0).abs() < 1e-12);
        let left = camera(Offset {
            yaw_rad: 0.1,
            ..Default::default()
        });
        assert!(left.x > 0.0);
    }

    fn scored(costs: &[Option<f64>], covered: u32, columns: usize) -> ScoredLattice {
        let mut lattice = lattice(Phase::YawCoarse, Offset::default(), 1.0);
        lattice.columns = columns;
        lattice.rows = costs.len() / columns;
        ScoredLattice {
            lattice,
            scores: costs
                .iter()
                .map(|&cost| Some(Score { cost, covered }))
                .collect(),
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
        surface.scores[0] = Some(Score {
            cost: Some(1.0),
            covered: 9,
        });
        assert_eq!(surface.minimum(), Some(1));
    }

    #[test]
    fn a_surface_is_flat_only_if_several_costs_are_all_equal() {
        assert_eq!(
            scored(&[Some(2.0), None, Some(2.0)], 20, 3).flat_cost(),
            Some((2.0, 2))
        );
        assert_eq!(
            scored(&[Some(2.0), Some(2.0 + 1e-12)], 20, 2).flat_cost(),
            Some((2.0, 2))
        );
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
            ScoredLattice {
                scores,
                least_covered,
                ..scored(&[None; 12], 0, 4)
            }
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
            prop_assert_eq!(surface.minimum_with(floor), first);
            let ranked = surface.local_minima_with(floor);
            prop_assert_eq!(ranked.first().map(|minimum| minimum.0), first);
        }

        #[test]
        fn the_own_floor_gives_the_own_minimum_and_a_higher_one_never_a_lower_cost(
            surface in any_surface(), floor in 0_u32..45, raised_by in 0_u32..45,
        ) {
            prop_assert_eq!(surface.minimum_with(surface.least_covered), surface.minimum());
            let cost = |floor| {
                let cell: usize = surface.minimum_with(floor)?;
                surface.scores[cell]?.cost
            };
            let (low, high) = (cost(floor), cost(floor + raised_by));
            prop_assert!(high.is_none_or(|high| low.is_some_and(|low| low <= high)));
        }

        #[test]
        fn an_offset_is_read_back_from_its_pose(
            right_m in -50.0..50.0, forward_m in -50.0..50.0, yaw_rad in -3.0..3.0,
        ) {
            let offset = Offset { right_m, forward_m, yaw_rad };
            let read = Offset::of(&offset.reference_from_camera());
            prop_assert!((read.right_m - right_m).abs() < 1e-9);
            prop_assert!((read.forward_m - forward_m).abs() < 1e-9);
            prop_assert!((read.yaw_rad - yaw_rad).abs() < 1e-9);
        }
    }
}
