//! What lies on the ground: the grid with its metres, the cost surface, the way of the search.

use egui::Color32;
use nalgebra::Point3;

use super::cloud::share;
use super::gpu::{Line, Spot};
use super::progress::SearchProgress;
use super::scene_geometry::{SceneGeometry, spot};
use crate::app::theme;
use crate::grid::{Offset, Phase, ScoredLattice};

/// The layers above the ground \[m\], so that none hides another.
const FINE_ABOVE_M: f64 = 0.02;
const GRID_ABOVE_M: f64 = 0.04;
const PATH_ABOVE_M: f64 = 0.06;
/// Cells without a say.
const SILENT: Color32 = Color32::from_gray(90);

/// One hypothesis of the positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) offset: Offset,
    /// Side of the square \[m\].
    pub(super) step_m: f64,
    /// `None` where the hypothesis has no say.
    pub(super) cost: Option<f64>,
    is_fine: bool,
}

/// The cost surface as it is at the cursor.
#[derive(Default)]
pub(super) struct CostGround {
    cells: Vec<Cell>,
    /// Least and greatest cost: the ends of the colours.
    costs: Option<(f64, f64)>,
    /// How much the greatest cost is raised above the least one \[m\].
    relief_m: f64,
}

impl CostGround {
    /// The latest coarse positions and, where they came later, the fine ones; of a phase that is
    /// not complete, what is scored so far.
    pub(super) fn new(progress: &SearchProgress<'_>, params: &crate::grid::GridParams) -> Self {
        let is_coarse = |surface: &&std::sync::Arc<ScoredLattice>| {
            surface.lattice.phase == Phase::PositionCoarse
        };
        let begin = progress.surfaces.iter().rposition(is_coarse).unwrap_or(0);
        let mut cells = Vec::new();
        let under_way = progress.scored.first().map(|scored| scored.phase);
        // A new round begins with an empty ground.
        if under_way != Some(Phase::PositionCoarse) {
            for surface in &progress.surfaces[begin..] {
                cells.extend(complete(surface));
            }
        }
        cells.extend(progress.scored.iter().filter_map(|scored| {
            let (is_fine, step_m) = match scored.phase {
                Phase::PositionCoarse => (false, params.coarse_step_m),
                Phase::PositionFine => (true, params.fine_step_m),
                Phase::YawCoarse | Phase::YawFine => return None,
            };
            let has_say = scored.coverage >= params.coverage_floor;
            Some(Cell {
                offset: scored.offset,
                step_m,
                cost: scored.score.cost.filter(|_| has_say),
                is_fine,
            })
        }));
        Self {
            cells,
            costs: progress.costs,
            relief_m: 0.0,
        }
    }

    /// The same with costs as heights: the least on the ground, the greatest this far above.
    pub(super) fn with_relief(self, relief_m: f64) -> Self {
        Self { relief_m, ..self }
    }

    pub(super) fn costs(&self) -> Option<(f64, f64)> {
        self.costs.filter(|_| !self.cells.is_empty())
    }

    /// The cell at a place of the ground; a fine one before the coarse one below it.
    pub(super) fn cell_at(&self, right_m: f64, forward_m: f64) -> Option<&Cell> {
        self.cells.iter().rev().find(|cell| {
            let Offset {
                right_m: x,
                forward_m: z,
                ..
            } = cell.offset;
            (right_m - x).abs().max((forward_m - z).abs()) <= 0.5 * cell.step_m
        })
    }

    /// The squares, as two triangles each; raised ones with their walls.
    pub(super) fn faces(&self, geometry: &SceneGeometry) -> Vec<Spot> {
        let mut faces = Vec::with_capacity(6 * self.cells.len());
        for cell in &self.cells {
            let Offset {
                right_m, forward_m, ..
            } = cell.offset;
            let half = 0.5 * cell.step_m;
            let height = self.height(cell);
            let place = |right: f64, forward: f64, above: f64| {
                let (x, z) = (right_m + right * half, forward_m + forward * half);
                spot(&geometry.on_ground(x, z, above))
            };
            let color = self.color(cell);
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let above = if cell.is_fine { FINE_ABOVE_M } else { 0.0 };
            quad(
                &mut faces,
                corners.map(|(x, z)| place(x, z, above + height)),
                color,
            );
            if height > 0.0 {
                let shaded = color.lerp_to_gamma(Color32::BLACK, 0.35);
                for side in 0..4 {
                    let [(ax, az), (bx, bz)] = [corners[side], corners[(side + 1) % 4]];
                    let wall = [
                        place(ax, az, above),
                        place(bx, bz, above),
                        place(bx, bz, above + height),
                        place(ax, az, above + height),
                    ];
                    quad(&mut faces, wall, shaded);
                }
            }
        }
        faces
    }

    fn color(&self, cell: &Cell) -> Color32 {
        match (cell.cost, self.costs) {
            (Some(cost), Some(costs)) => theme::viridis(merit(cost, costs)),
            _ => SILENT,
        }
    }

    fn height(&self, cell: &Cell) -> f64 {
        match (cell.cost, self.costs) {
            (Some(cost), Some(costs)) => self.relief_m * (1.0 - merit(cost, costs)).clamp(0.0, 1.0),
            _ => 0.0,
        }
    }
}

fn complete(surface: &ScoredLattice) -> Vec<Cell> {
    let lattice = &surface.lattice;
    if lattice.phase.is_yaw() {
        return Vec::new();
    }
    lattice
        .hypotheses()
        .filter(|(cell, _)| surface.scores[*cell].is_some())
        .map(|(cell, offset)| Cell {
            offset,
            step_m: lattice.step,
            cost: surface.eligible_cost(cell),
            is_fine: lattice.phase == Phase::PositionFine,
        })
        .collect()
}

/// 1 for the least cost, 0 for the greatest; where all are equal, all are best.
fn merit(cost: f64, costs: (f64, f64)) -> f64 {
    1.0 - share(cost, costs)
}

fn quad(faces: &mut Vec<Spot>, corners: [[f32; 3]; 4], color: Color32) {
    let order = [0, 1, 2, 0, 2, 3];
    faces.extend(order.map(|corner| Spot {
        at: corners[corner],
        color,
    }));
}

/// A number to be written beside the grid.
pub(super) struct GridLabel {
    pub(super) at: Point3<f64>,
    pub(super) text: String,
}

/// Lines on the ground in round distances, and the circle within which the query is sought.
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

/// The way of the search from best to best.
pub(super) fn path(geometry: &SceneGeometry, offsets: &[Offset], color: Color32) -> Vec<Line> {
    let place =
        |offset: &Offset| spot(&geometry.on_ground(offset.right_m, offset.forward_m, PATH_ABOVE_M));
    offsets
        .windows(2)
        .map(|pair| Line {
            ends: [place(&pair[0]), place(&pair[1])],
            color,
            width: 2.5,
        })
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
        Cell {
            offset: Offset {
                right_m,
                ..Offset::default()
            },
            step_m,
            cost,
            is_fine: step_m < 1.0,
        }
    }

    fn ground() -> CostGround {
        CostGround {
            cells: vec![
                cell(0.0, 1.0, Some(2.0)),
                cell(1.0, 1.0, Some(4.0)),
                cell(2.0, 1.0, None),
                cell(1.0, 0.2, Some(3.0)),
            ],
            costs: Some((2.0, 4.0)),
            relief_m: 0.0,
        }
    }

    #[test]
    fn the_pointer_finds_the_fine_cell_above_the_coarse_one() {
        let ground = ground();
        let cost_at = |right| ground.cell_at(right, 0.0).map(|cell| cell.cost);
        assert_eq!(cost_at(1.05), Some(Some(3.0)));
        assert_eq!(cost_at(1.3), Some(Some(4.0)));
        assert_eq!(cost_at(2.0), Some(None));
        assert_eq!(cost_at(9.0), None);
        assert_eq!(ground.cell_at(0.0, 0.6), None);
    }

    #[test]
    fn low_costs_are_bright_and_on_the_ground_and_silent_cells_grey() {
        let flat = ground().faces(&geometry());
        assert_eq!(flat.len(), 4 * 6);
        assert_eq!(flat[0].color, theme::viridis(1.0));
        assert_eq!(flat[6].color, theme::viridis(0.0));
        assert_eq!(flat[12].color, SILENT);
        let ground = ground().with_relief(3.0);
        let highest = |faces: &[Spot]| faces.iter().map(|f| -f.at[1]).fold(f32::MIN, f32::max);
        // The cell of the greatest cost stands 3 m above the ground, 1.6 m below the camera.
        assert!((highest(&ground.faces(&geometry())) - (3.0 - 1.6)).abs() < 1e-6);
        assert!((highest(&flat) - (0.02 - 1.6)).abs() < 1e-6);
        // Two cells have walls: the greatest and the middle cost.
        assert_eq!(ground.faces(&geometry()).len(), 4 * 6 + 2 * 4 * 6);
    }

    #[test]
    fn the_grid_tells_its_metres() {
        let (lines, marks) = grid(&geometry(), Color32::GRAY, Color32::WHITE);
        let texts: Vec<_> = marks.iter().map(|mark| mark.text.as_str()).collect();
        assert!(
            texts.contains(&"1 m") && texts.contains(&"5 m ahead"),
            "{texts:?}"
        );
        let farthest = lines.iter().flat_map(|line| line.ends).map(|[x, ..]| x);
        assert!((farthest.fold(0.0, f32::max) - 5.0).abs() < 1e-6);
    }
}
