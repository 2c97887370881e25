//! What lies on the ground: the grid with its metres, the cost map, the way of the search.

use egui::Color32;
use nalgebra::Point3;

use super::gpu::{Line, Spot};
use super::scene_geometry::{SceneGeometry, spot};
use crate::app::views::surface::scale::{BELOW_FLOOR, Scale};
use crate::app::views::surface::search::{Search, Searched};
use crate::grid::{Offset, Phase, ScoredLattice};

/// The layers above the ground \[m\], so that none hides another.
const FINE_ABOVE_M: f64 = 0.02;
const GRID_ABOVE_M: f64 = 0.04;
const PATH_ABOVE_M: f64 = 0.06;

/// A square of the cost map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) offset: Offset,
    /// Side of the square \[m\].
    pub(super) step_m: f64,
    /// `None` below the coverage floor.
    pub(super) cost: Option<f64>,
    /// Height above the ground \[m\].
    above_m: f64,
}

/// The cost map at the cursor: the latest coarse positions and the fine ones on top of them.
pub(super) fn cells(search: &Search<'_>) -> Vec<Cell> {
    let positions: Vec<&Searched> = search.positions().collect();
    let is_coarse = |searched: &&Searched| searched.phase() == Phase::PositionCoarse;
    // A new round covers the one before.
    let first = positions.iter().rposition(is_coarse).unwrap_or(0);
    positions[first..].iter().flat_map(|searched| cells_of(&searched.surface)).collect()
}

fn cells_of(surface: &ScoredLattice) -> impl Iterator<Item = Cell> {
    let lattice = &surface.lattice;
    let is_fine = lattice.phase == Phase::PositionFine;
    let scored = lattice.hypotheses().filter(|(cell, _)| surface.scores[*cell].is_some());
    scored.map(move |(cell, offset)| Cell {
        offset,
        step_m: lattice.step,
        cost: surface.eligible_cost(cell),
        above_m: if is_fine { FINE_ABOVE_M } else { 0.0 },
    })
}

/// The cell at a place of the ground; a fine one before the coarse one below it.
pub(super) fn cell_at(cells: &[Cell], right_m: f64, forward_m: f64) -> Option<&Cell> {
    cells.iter().rev().find(|cell| {
        let right = (right_m - cell.offset.right_m).abs();
        let forward = (forward_m - cell.offset.forward_m).abs();
        right.max(forward) <= 0.5 * cell.step_m
    })
}

/// The squares in the colours of the cost map, as two triangles each.
pub(super) fn faces(geometry: &SceneGeometry, cells: &[Cell], scale: &Scale) -> Vec<Spot> {
    let mut faces = Vec::with_capacity(6 * cells.len());
    for cell in cells {
        let half = 0.5 * cell.step_m;
        let color = cell.cost.map_or(BELOW_FLOOR, |cost| scale.cost(cost));
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
        let corners = corners.map(|(right, forward)| {
            let (x, z) = (cell.offset.right_m + right, cell.offset.forward_m + forward);
            spot(&geometry.on_ground(x, z, cell.above_m))
        });
        let order = [0, 1, 2, 0, 2, 3];
        faces.extend(order.map(|corner| Spot { at: corners[corner], color }));
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

    const SITE: f64 = 5.0;

    fn geometry() -> SceneGeometry {
        SceneGeometry {
            scene_from_world: Pose::identity(),
            scene_from_reference: Pose::identity(),
            radius_m: SITE,
        }
    }

    fn cell(right_m: f64, step_m: f64, cost: Option<f64>) -> Cell {
        Cell { offset: Offset { right_m, ..Offset::default() }, step_m, cost, above_m: 0.0 }
    }

    #[test]
    fn the_pointer_finds_the_fine_cell_above_the_coarse_one() {
        let cells = [
            cell(0.0, 1.0, Some(2.0)),
            cell(1.0, 1.0, Some(4.0)),
            cell(2.0, 1.0, None),
            cell(1.0, 0.2, Some(3.0)),
        ];
        let cost_at = |right| cell_at(&cells, right, 0.0).map(|cell| cell.cost);
        assert_eq!(cost_at(1.05), Some(Some(3.0)));
        assert_eq!(cost_at(1.3), Some(Some(4.0)));
        assert_eq!(cost_at(2.0), Some(None));
        assert_eq!(cost_at(9.0), None);
        assert_eq!(cell_at(&cells, 0.0, 0.6), None);
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
