//! The grid search of a direct method, as far as the cursor.

use std::sync::Arc;

use crate::app::ViewContext;
use crate::app::views::part_with;
use crate::event::{DescentStepped, Event, MinimumAssessed, Moment, PoseScored};
use crate::geometry::Pose;
use crate::grid::{self, Lattice, Offset, Phase, ScoredLattice};
use crate::method::Method;
use crate::problem::Problem;
use crate::session::Span;

/// What a direct method has recorded of its search.
pub(super) struct Search<'a> {
    pub(super) method: Method,
    pub(super) problem: &'a Problem,
    /// The part of the run that it is read from: the method's own, or the hybrid's.
    pub(super) span: &'a Span,
    /// Pixels covered at the reference pose, which all coverages are shares of.
    pub(super) covered_at_reference: u32,
    /// Pixels that a hypothesis must cover to be eligible: the coverage floor.
    pub(super) least_covered: u32,
    /// The lattices, in the order of the search; the last one may be incomplete.
    pub(super) lattices: Vec<Searched>,
    /// The hypothesis of the cursor, while a lattice is being searched.
    pub(super) hypothesis: Option<&'a PoseScored>,
    pub(super) assessed: Option<&'a MinimumAssessed>,
    /// The steps of a descent, where the method goes downhill instead of searching.
    pub(super) steps: Vec<&'a DescentStepped>,
}

/// A lattice with the scores so far.
pub(super) struct Searched {
    /// Cells without a score are not tried yet, or no hypotheses.
    pub(super) surface: Arc<ScoredLattice>,
    pub(super) tried: usize,
    /// Whether its minimum is known.
    pub(super) is_complete: bool,
}

impl<'a> Search<'a> {
    /// The search of `method` on the reference at the cursor; `None` before its first view.
    pub(super) fn at(context: &ViewContext<'a>, method: Method) -> Option<Self> {
        let (span, cursor) = part_with::<PoseScored>(context, method)?;
        let problem = context.run.problems().get(span.part.reference()?)?;
        let mut events = context.run.until(span, cursor).iter().map(|record| &record.event);
        let start = events.find_map(|event| match event {
            Event::ViewRendered(view) if view.moment == Moment::Start => Some(view),
            _ => None,
        })?;
        let covered_at_reference = start.comparison.score.covered;
        let params = &context.run.params.grid;
        let least_covered = grid::least_covered(params.coverage_floor, covered_at_reference);
        let mut search = Self {
            method,
            problem,
            span,
            covered_at_reference,
            least_covered,
            lattices: Vec::new(),
            hypothesis: None,
            assessed: None,
            steps: Vec::new(),
        };
        let mut centre = Offset::default();
        // An unfinished lattice reports single hypotheses; their cells follow from the parameters.
        let mut single: Vec<&PoseScored> = Vec::new();
        for event in events {
            match event {
                Event::PoseScored(scored) => single.push(scored),
                Event::PhaseSearched(searched) => {
                    single.clear();
                    centre = searched.best.unwrap_or(centre);
                    let surface = Arc::clone(&searched.surface);
                    let tried = surface.scores.iter().flatten().count();
                    search.lattices.push(Searched { surface, tried, is_complete: true });
                }
                Event::MinimumAssessed(assessed) => search.assessed = Some(assessed),
                Event::DescentStepped(step) => search.steps.push(step),
                _ => {}
            }
        }
        search.hypothesis = single.last().copied();
        // Before the first hypothesis the parameters say where it will search: an empty map, to point at.
        let is_new = search.lattices.is_empty() && search.assessed.is_none();
        let first = single.first().map(|scored| scored.phase);
        let phase = first.or(is_new.then_some(Phase::PositionCoarse));
        let radius_m = problem.uncertainty_radius_m();
        let lattice = phase.and_then(|phase| Lattice::new(phase, centre, radius_m, params).ok());
        search.lattices.extend(lattice.map(|lattice| {
            let mut scores = vec![None; lattice.cells()];
            for ((cell, offset), scored) in lattice.hypotheses().zip(&single) {
                scores[cell] = (offset == scored.offset).then_some(scored.score);
            }
            let surface = Arc::new(ScoredLattice { lattice, scores, least_covered });
            Searched { surface, tried: single.len(), is_complete: false }
        }));
        Some(search)
    }

    /// The lattices of positions, in the order in which they are drawn.
    pub(super) fn positions(&self) -> impl DoubleEndedIterator<Item = &Searched> {
        self.lattices.iter().filter(|searched| !searched.phase().is_yaw())
    }

    /// The last lattice of a phase.
    pub(super) fn last(&self, phase: Phase) -> Option<&Searched> {
        self.lattices.iter().rev().find(|searched| searched.phase() == phase)
    }

    /// Covered pixels as a share of those at the reference pose.
    pub(super) fn coverage(&self, covered: u32) -> f64 {
        f64::from(covered) / f64::from(self.covered_at_reference.max(1))
    }

    /// The camera at an offset (`world_from_camera`).
    pub(super) fn pose(&self, offset: &Offset) -> Pose {
        self.problem.world_from_query(&offset.reference_from_camera())
    }

    /// The cost of the finest cell that an offset lies in; of a cell that was tried.
    pub(super) fn cost_near(&self, offset: &Offset) -> Option<f64> {
        self.positions().rev().find_map(|searched| {
            let surface = &searched.surface;
            let cell = cell_of(&surface.lattice, offset.right_m, offset.forward_m)?;
            surface.scores[cell]?.cost
        })
    }

    /// The offset of a camera `world_from_camera`.
    pub(super) fn offset(&self, pose: &Pose) -> Offset {
        Offset::of(&self.problem.reference_from_query(pose))
    }
}

impl Searched {
    pub(super) fn phase(&self) -> Phase {
        self.surface.lattice.phase
    }

    /// The eligible cell of lowest cost.
    pub(super) fn minimum(&self) -> Option<Minimum> {
        let cell = self.surface.minimum()?;
        Some(Minimum {
            cell,
            offset: self.surface.lattice.offset(cell)?,
            cost: self.surface.scores[cell]?.cost?,
        })
    }
}

/// A cell with the lowest cost around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Minimum {
    pub(super) cell: usize,
    pub(super) offset: Offset,
    pub(super) cost: f64,
}

/// The cell that a position lies in.
pub(super) fn cell_of(lattice: &Lattice, right_m: f64, forward_m: f64) -> Option<usize> {
    let index = |value: f64, count: usize| {
        let index = (value / lattice.step).round() + (count / 2) as f64;
        (0.0 <= index && index < count as f64).then_some(index as usize)
    };
    let column = index(right_m - lattice.centre.right_m, lattice.columns)?;
    let row = index(forward_m - lattice.centre.forward_m, lattice.rows)?;
    Some(row * lattice.columns + column)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridParams;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_point_of_a_cell_finds_the_cell(
            right in -0.49..0.49, forward in -0.49..0.49, x in -3.0..3.0, y in -9.0..9.0,
        ) {
            let centre = Offset { right_m: x, forward_m: y, yaw_rad: 0.0 };
            let params = GridParams::default();
            for phase in [Phase::PositionCoarse, Phase::PositionFine] {
                let lattice = Lattice::new(phase, centre, 4.0, &params).expect("small");
                for (cell, offset) in lattice.hypotheses() {
                    let right_m = offset.right_m + right * lattice.step;
                    let forward_m = offset.forward_m + forward * lattice.step;
                    prop_assert_eq!(cell_of(&lattice, right_m, forward_m), Some(cell));
                }
                prop_assert_eq!(cell_of(&lattice, x + 4.6, y), None);
            }
        }
    }
}
