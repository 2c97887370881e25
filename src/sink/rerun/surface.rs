//! Records the grid search in the world: cost and coverage on the ground, the path of the search, and the cost
//! over the yaw angle.

use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};
use rerun::components::{DrawOrder, ImageFormat, Opacity};
use rerun::{
    BarChart, ChannelDatatype, ColorModel, GridMap, LineStrips3D, Quaternion, Radius, TensorBuffer,
    TensorData,
};

use super::entities;
use super::scene::EventContext;
use super::stream::Stream;
use crate::grid::{Lattice, Offset, Phase, ScoredLattice};
use crate::palette::{self, Rgb};

/// The drawn depth of the ground below the camera \[m\], typical for a car's camera.
const GROUND_M: f64 = 1.6;
/// The heights of layers above the ground \[m\], so none hides another.
const FINE_ABOVE_M: f64 = 0.02;
const PATH_ABOVE_M: f64 = 0.05;

/// The range of costs on the colour map.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CostRange {
    least: f64,
    greatest: f64,
}

impl CostRange {
    /// The range of the eligible hypotheses; `None` if there are none.
    pub(super) fn of(surface: &ScoredLattice) -> Option<Self> {
        let costs = || (0..surface.scores.len()).filter_map(|cell| surface.eligible_cost(cell));
        Some(Self { least: costs().reduce(f64::min)?, greatest: costs().reduce(f64::max)? })
    }

    /// 1 for the least cost, 0 for the greatest.
    fn merit(&self, cost: f64) -> f64 {
        let width = self.greatest - self.least;
        if width > 0.0 { (self.greatest - cost) / width } else { 1.0 }
    }
}

/// Records cost and coverage as maps on the ground. Low costs and high coverages are bright, ineligible cells
/// grey; cells without a hypothesis are left out.
pub(super) fn log_maps(
    stream: &mut Stream,
    surface: &ScoredLattice,
    range: CostRange,
    context: &EventContext<'_>,
) {
    let most = surface.scores.iter().flatten().map(|score| score.covered).max();
    let most = f64::from(most.unwrap_or(1).max(1));
    let cost = |cell: usize| {
        surface.scores[cell]?;
        let eligible = surface.eligible_cost(cell);
        Some(eligible.map_or([70; 3], |cost| palette::viridis(range.merit(cost))))
    };
    let coverage =
        |cell: usize| Some(palette::viridis(f64::from(surface.scores[cell]?.covered) / most));
    let fine = surface.lattice.phase == Phase::PositionFine;
    let part = |name: &str| {
        if fine { format!("{name}/fine") } else { name.to_owned() }
    };
    let path = |name: &str| entities::search(context.method, &part(name));
    stream.log(&path("cost"), &grid_map(&surface.lattice, context, cost));
    stream.log(&path("coverage"), &grid_map(&surface.lattice, context, coverage));
}

/// A lattice of positions as a map; `color` returns `None` for cells to leave out.
fn grid_map(
    lattice: &Lattice,
    context: &EventContext<'_>,
    color: impl Fn(usize) -> Option<Rgb>,
) -> GridMap {
    let (columns, rows) = (lattice.columns, lattice.rows);
    // The first row of the image is farthest ahead.
    let cells =
        (0..rows).rev().flat_map(|row| (0..columns).map(move |column| row * columns + column));
    let data: Vec<u8> = cells
        .flat_map(|cell| match color(cell) {
            Some([r, g, b]) => [r, g, b, 255],
            None => [0; 4],
        })
        .collect();
    let format = ImageFormat::from_color_model(
        [columns as u32, rows as u32],
        ColorModel::RGBA,
        ChannelDatatype::U8,
    );
    let is_fine = lattice.phase == Phase::PositionFine;
    let corner = Offset {
        right_m: lattice.centre.right_m - columns as f64 / 2.0 * lattice.step,
        forward_m: lattice.centre.forward_m - rows as f64 / 2.0 * lattice.step,
        yaw_rad: 0.0,
    };
    GridMap::new(data, format, lattice.step as f32)
        .with_translation(on_ground(&corner, if is_fine { FINE_ABOVE_M } else { 0.0 }, context))
        .with_quaternion(Quaternion::from_xyzw(map_rotation(context)))
        .with_opacity(Opacity::from(0.9))
        .with_draw_order(DrawOrder::from(if is_fine { 1.0 } else { 0.0 }))
}

/// A map's x axis is the reference camera's right, its y axis the camera's forward.
fn map_rotation(context: &EventContext<'_>) -> [f32; 4] {
    let axes = [Vector3::x(), Vector3::z(), -Vector3::y()];
    let camera_from_map =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_basis_unchecked(&axes));
    let world_from_map = context.problem.reference().world_from_camera().rotation * camera_from_map;
    world_from_map.coords.cast::<f32>().into()
}

fn on_ground(offset: &Offset, above_m: f64, context: &EventContext<'_>) -> [f32; 3] {
    let point = Point3::new(offset.right_m, GROUND_M - above_m, offset.forward_m);
    let world = context.problem.reference().world_from_camera() * point;
    context.origin.place(&world.coords)
}

/// Records the path of the best hypothesis so far.
pub(super) fn log_path(stream: &mut Stream, path: &[Offset], context: &EventContext<'_>) {
    let places = path.iter().map(|offset| on_ground(offset, PATH_ABOVE_M, context));
    let strip = LineStrips3D::new([places.collect::<Vec<_>>()])
        .with_colors([super::color(palette::ESTIMATE)])
        .with_radii([Radius::new_ui_points(2.0)]);
    stream.log(&entities::search(context.method, "path"), &strip);
}

/// Records how much lower each yaw angle's cost is than the highest: the best is the tallest bar. Bars of the
/// costs themselves would look alike, because neighbours differ by a few per cent.
pub(super) fn log_yaw(stream: &mut Stream, surface: &ScoredLattice, context: &EventContext<'_>) {
    let Some(range) = CostRange::of(surface) else {
        return;
    };
    let (angles, gains): (Vec<f64>, Vec<f64>) = surface
        .lattice
        .hypotheses()
        .map(|(cell, offset)| {
            let gain = surface.eligible_cost(cell).map_or(0.0, |cost| range.greatest - cost);
            (offset.yaw_rad.to_degrees(), gain)
        })
        .unzip();
    let is_fine = surface.lattice.phase == Phase::YawFine;
    let color = if is_fine { palette::ESTIMATE } else { palette::REFERENCE };
    let chart =
        BarChart::new(vector(gains)).with_abscissa(vector(angles)).with_color(super::color(color));
    let part = if is_fine { "/fine" } else { "" };
    stream.log(&(entities::yaw_curve(context.method) + part), &chart);
}

fn vector(values: Vec<f64>) -> TensorData {
    TensorData::new(vec![values.len() as u64], TensorBuffer::F64(values.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_cost_has_the_greatest_merit_and_a_flat_surface_is_all_best() {
        let range = CostRange { least: 2.0, greatest: 6.0 };
        assert_eq!([2.0, 4.0, 6.0].map(|cost| range.merit(cost)), [1.0, 0.5, 0.0]);
        assert_eq!(CostRange::default().merit(0.0), 1.0);
    }
}
