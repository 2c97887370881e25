//! What lies on the ground: the grid with its metres, the cost map, the way of the search.

use egui::Color32;
use nalgebra::Point3;

use super::gpu::{Line, Spot};
use super::scene_geometry::{SceneGeometry, spot};
use crate::app::views::surface::scale::{BELOW_FLOOR, Scale};
use crate::app::views::surface::search::{Search, Searched, cell_of};
use crate::grid::{Offset, Phase, ScoredLattice};

/// The layers above the ground \[m\], so that none hides another.
const FINE_ABOVE_M: f64 = 0.02;
const GRID_ABOVE_M: f64 = 0.04;
const PATH_ABOVE_M: f64 = 0.06;

/// The lattices of the cost map at the cursor: the latest coarse positions and the fine ones on top of them.
pub(super) fn lattices<'a>(search: &'a Search<'_>) -> Vec<&'a ScoredLattice> {
    let positions: Vec<&Searched> = search.positions().collect();
    let is_coarse = |searched: &&Searched| searched.phase() == Phase::PositionCoarse;
    // A new round covers the one before.
    let first = positions.iter().rposition(is_coarse).unwrap_or(0);
    positions[first..].iter().map(|searched| searched.surface.as_ref()).collect()
}

/// The scored cell at a place of the ground, a fine one before the coarse one below it; and its cost, unless it is
/// below the coverage floor.
pub(super) fn cell_at(
    lattices: &[&ScoredLattice],
    right_m: f64,
    forward_m: f64,
) -> Option<(Offset, Option<f64>)> {
    lattices.iter().rev().find_map(|surface| {
        let cell = cell_of(&surface.lattice, right_m, forward_m)?;
        surface.scores[cell]?;
        Some((surface.lattice.offset(cell)?, surface.eligible_cost(cell)))
    })
}

/// The scored cells as squares in the colours of the cost map, as two triangles each.
pub(super) fn faces(
    geometry: &SceneGeometry,
    lattices: &[&ScoredLattice],
    scale: &Scale,
) -> Vec<Spot> {
    let mut faces = Vec::new();
    for surface in lattices {
        let ScoredLattice { lattice, scores, .. } = surface;
        let above_m = if lattice.phase == Phase::PositionFine { FINE_ABOVE_M } else { 0.0 };
        let half = 0.5 * lattice.step;
        for (cell, offset) in lattice.hypotheses().filter(|(cell, _)| scores[*cell].is_some()) {
            let cost = surface.eligible_cost(cell);
            let color = cost.map_or(BELOW_FLOOR, |cost| scale.cost(cost));
            let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
            let corners = corners.map(|(right, forward)| {
                let (x, z) = (offset.right_m + right, offset.forward_m + forward);
                spot(&geometry.on_ground(x, z, above_m))
            });
            faces.extend([0, 1, 2, 0, 2, 3].map(|at: usize| Spot { at: corners[at], color }));
        }
    }
    faces
}

/// A number beside the grid.
pub(super) struct GridLabel {
    pub(super) at: Point3<f64>,
    pub(super) text: String,
}

/// Lines on the ground at round distances, and the circle that is searched.
pub(super) fn grid(
    geometry: &SceneGeometry,
    color: Color32,
    strong: Color32,
) -> (Vec<Line>, Vec<GridLabel>) {
    let step = geometry.grid_m();
    let count = (geometry.radius_m / step).ceil() as i32;
    let reach = f64::from(count) * step;
    let line = |from: (f64, f64), to: (f64, f64), color| Line {
        ends: [from, to].map(|(x, z)| spot(&geometry.on_ground(x, z, GRID_ABOVE_M))),
        color,
        width: 1.0,
    };
    let mut lines = Vec::new();
    let mut marks = Vec::new();
    for index in -count..=count {
        let at = f64::from(index) * step;
        let color = if index == 0 { strong } else { color };
        lines.push(line((at, -reach), (at, reach), color));
        lines.push(line((-reach, at), (reach, at), color));
        if index != 0 {
            let outermost = index.abs() == count;
            let mut mark = |x: f64, z: f64, positive: &str, negative: &str| {
                let side = match (outermost, index > 0) {
                    (false, _) => "",
                    (true, true) => positive,
                    (true, false) => negative,
                };
                marks.push(GridLabel {
                    at: geometry.on_ground(x, z, GRID_ABOVE_M),
                    text: format!("{} m{side}", at.abs()),
                });
            };
            mark(at, 0.0, " right", " left");
            mark(0.0, at, " ahead", " behind");
        }
    }
    const SIDES: i32 = 72;
    let on_circle = |side: i32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
        (geometry.radius_m * sin, geometry.radius_m * cos)
    };
    lines.extend((0..SIDES).map(|side| line(on_circle(side), on_circle(side + 1), strong)));
    (lines, marks)
}

/// The way of the search from one best position to the next.
pub(super) fn path(geometry: &SceneGeometry, offsets: &[Offset], color: Color32) -> Vec<Line> {
    let place =
        |offset: &Offset| spot(&geometry.on_ground(offset.right_m, offset.forward_m, PATH_ABOVE_M));
    offsets
        .windows(2)
        .map(|pair| Line { ends: [place(&pair[0]), place(&pair[1])], color, width: 2.0 })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::grid::{GridParams, Lattice};
    use crate::render::Score;

    const SITE: f64 = 5.0;

    fn geometry() -> SceneGeometry {
        SceneGeometry {
            scene_from_world: Pose::identity(),
            scene_from_reference: Pose::identity(),
            radius_m: SITE,
        }
    }

    #[test]
    fn the_pointer_finds_the_fine_cell_above_the_coarse_one() {
        let surface = |phase, cost| {
            let lattice = Lattice::new(phase, Offset::default(), 3.0, &GridParams::default());
            let lattice = lattice.expect("small");
            let mut scores = vec![None; lattice.cells()];
            for (cell, offset) in lattice.hypotheses() {
                let covered = if offset.right_m < 2.5 { 9 } else { 1 };
                scores[cell] = Some(Score { cost: Some(cost), covered });
            }
            ScoredLattice { lattice, scores, least_covered: 5 }
        };
        let [coarse, fine] =
            [(Phase::PositionCoarse, 4.0), (Phase::PositionFine, 3.0)].map(|(p, c)| surface(p, c));
        let cost_at = |right| {
            cell_at(&[&coarse, &fine], right, 0.0).map(|(offset, cost)| (offset.right_m, cost))
        };
        assert_eq!(cost_at(0.05), Some((0.0, Some(3.0))));
        assert_eq!(cost_at(-2.2), Some((-2.0, Some(4.0))));
        assert_eq!(cost_at(3.2), Some((3.0, None)));
        assert_eq!(cost_at(9.0), None);
    }

    #[test]
    fn the_grid_tells_its_metres() {
        let (lines, marks) = grid(&geometry(), Color32::GRAY, Color32::WHITE);
        let texts: Vec<_> = marks.iter().map(|mark| mark.text.as_str()).collect();
        assert!(texts.contains(&"1 m") && texts.contains(&"5 m ahead"), "{texts:?}");
        let farthest = lines.iter().flat_map(|line| line.ends).map(|[x, ..]| x);
        assert!((farthest.fold(0.0, f32::max) - 5.0).abs() < 1e-6);
    }
}
