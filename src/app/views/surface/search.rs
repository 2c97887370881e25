//! The grid search of a direct method, as far as the cursor.

use std::sync::Arc;

use crate::app::ViewContext;
use crate::event::{DescentStepped, Event, MinimumAssessed, Moment, PoseScored};
use crate::geometry::Pose;
use crate::grid::{self, Lattice, Offset, Phase, ScoredLattice};
use crate::method::Method;
use crate::problem::Problem;
use crate::session::Span;

/// What a direct method has told about its search.
pub(super) struct Search<'a> {
    pub(super) method: Method,
    pub(super) problem: &'a Problem,
    /// The part of the run that it is read from: the method's own, or the hybrid's.
    pub(super) span: &'a Span,
    /// Pixels covered at the reference pose, which all coverages are shares of.
    pub(super) covered_at_reference: u32,
    /// The lattices, in the order of the search; the last one may be incomplete.
    pub(super) lattices: Vec<Searched>,
    /// The hypothesis of the cursor, while a lattice is being searched.
    pub(super) hypothesis: Option<&'a PoseScored>,
    pub(super) assessed: Option<&'a MinimumAssessed>,
    /// The steps of a descent, where the method goes downhill instead of searching.
    pub(super) steps: Vec<&'a DescentStepped>,
}

/// A lattice with the scores that were told.
pub(super) struct Searched {
    /// Cells without a score are not tried yet, or no hypotheses.
    pub(super) surface: Arc<ScoredLattice>,
    pub(super) tried: usize,
    /// Whether its minimum was told.
    pub(super) is_complete: bool,
}

impl<'a> Search<'a> {
    /// The search of `method` on the reference at the cursor; `None` before its first view.
    pub(super) fn at(context: &ViewContext<'a>, method: Method) -> Option<Self> {
        let (span, cursor) = part(context, method)?;
        let problems = &context.run.loaded.as_deref()?.problems;
        let problem = problems.get(span.part.reference()?)?;
        let end = span.records.end.min(cursor + 1);
        let records = context.run.records().get(span.records.start..end)?;
        let mut events = records.iter().map(|record| &record.event);
        let covered_at_reference = events.find_map(|event| match event {
            Event::ViewRendered(view) if view.moment == Moment::Start => {
                Some(view.comparison.score.covered)
            }
            _ => None,
        })?;
        let mut search = Self {
            method,
            problem,
            span,
            covered_at_reference,
            lattices: Vec::new(),
            hypothesis: None,
            assessed: None,
            steps: Vec::new(),
        };
        let params = &context.run.params.grid;
        let least_covered = grid::least_covered(params.coverage_floor, covered_at_reference);
        let mut centre = Offset::default();
        let mut filling: Option<Filling> = None;
        for event in events {
            match event {
                Event::PoseScored(scored) => {
                    // What is told of a lattice before its end are its hypotheses, one by one; where
                    // they are follows from the parameters.
                    let radius_m = problem.uncertainty_radius_m;
                    if filling.is_none() {
                        let lattice = Lattice::new(scored.phase, centre, radius_m, params);
                        filling = lattice.ok().map(Filling::new);
                    }
                    if let Some(filling) = &mut filling {
                        filling.take(scored);
                    }
                    search.hypothesis = Some(scored);
                }
                Event::PhaseSearched(searched) => {
                    filling = None;
                    search.hypothesis = None;
                    centre = searched.best.unwrap_or(centre);
                    let surface = Arc::clone(&searched.surface);
                    search.lattices.push(Searched {
                        tried: surface.scores.iter().flatten().count(),
                        surface,
                        is_complete: true,
                    });
                }
                Event::MinimumAssessed(assessed) => search.assessed = Some(assessed),
                Event::DescentStepped(step) => search.steps.push(step),
                _ => {}
            }
        }
        if search.lattices.is_empty() && filling.is_none() && search.assessed.is_none() {
            // Where it is going to look follows from the parameters: an empty map, to point at.
            let radius_m = problem.uncertainty_radius_m;
            let coarse = Lattice::new(Phase::PositionCoarse, centre, radius_m, params);
            filling = coarse.ok().map(Filling::new);
        }
        search
            .lattices
            .extend(filling.map(|filling| filling.done(least_covered)));
        Some(search)
    }

    /// The lattices of positions, in the order in which they are drawn.
    pub(super) fn positions(&self) -> impl DoubleEndedIterator<Item = &Searched> {
        self.lattices
            .iter()
            .filter(|searched| !searched.phase().is_yaw())
    }

    /// The last lattice of a phase.
    pub(super) fn last(&self, phase: Phase) -> Option<&Searched> {
        self.lattices
            .iter()
            .rev()
            .find(|searched| searched.phase() == phase)
    }

    /// Pixels that a hypothesis must cover under a floor.
    pub(super) fn least_covered(&self, floor: f64) -> u32 {
        grid::least_covered(floor, self.covered_at_reference)
    }

    /// Covered pixels as a share of those at the reference pose.
    pub(super) fn coverage(&self, covered: u32) -> f64 {
        f64::from(covered) / f64::from(self.covered_at_reference.max(1))
    }

    /// The camera at an offset (`world_from_camera`).
    pub(super) fn pose(&self, offset: &Offset) -> Pose {
        self.problem
            .world_from_query(&offset.reference_from_camera())
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

    /// The cell of least cost under a floor, with its offset and cost.
    pub(super) fn minimum(&self, least_covered: u32) -> Option<Minimum> {
        let cell = self.surface.minimum_with(least_covered)?;
        Some(Minimum {
            cell,
            offset: self.surface.lattice.offset(cell)?,
            cost: self.surface.scores[cell]?.cost?,
        })
    }
}

/// A cell with the least cost of its surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Minimum {
    pub(super) cell: usize,
    pub(super) offset: Offset,
    pub(super) cost: f64,
}

/// The part of the run to read a direct method's search from, and the cursor in it. A hybrid runs
/// others inside itself, one of which is then the one at the cursor.
fn part<'a>(context: &ViewContext<'a>, method: Method) -> Option<(&'a Span, usize)> {
    let is_inside = context.is_inside_hybrid(method) && context.latest::<PoseScored>().is_some();
    if is_inside {
        Some((context.span()?, context.cursor))
    } else {
        context.part_of(method)
    }
}

/// A lattice whose scores come in one by one.
struct Filling {
    lattice: Lattice,
    cells: Vec<(usize, Offset)>,
    told: usize,
    scores: Vec<Option<crate::render::Score>>,
}

impl Filling {
    fn new(lattice: Lattice) -> Self {
        Self {
            cells: lattice.hypotheses().collect(),
            told: 0,
            scores: vec![None; lattice.cells()],
            lattice,
        }
    }

    fn take(&mut self, scored: &PoseScored) {
        if let Some(&(cell, offset)) = self.cells.get(self.told)
            && offset == scored.offset
        {
            self.scores[cell] = Some(scored.score);
        }
        self.told += 1;
    }

    fn done(self, least_covered: u32) -> Searched {
        Searched {
            tried: self.told,
            is_complete: false,
            surface: Arc::new(ScoredLattice {
                lattice: self.lattice,
                scores: self.scores,
                least_covered,
            }),
        }
    }
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
