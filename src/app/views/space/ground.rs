//! What lies on the ground: a grid, and the circle that is searched.

use egui::Color32;

use super::scene_geometry::SceneGeometry;
use super::view_camera::Line;

/// Lines on the ground at round distances, and the circle around the reference that is searched.
pub(super) fn grid(geometry: &SceneGeometry, color: Color32, strong: Color32) -> Vec<Line> {
    const SIDES: i32 = 72;
    let step = geometry.grid_m();
    let count = (geometry.radius_m / step).ceil() as i32;
    let reach = f64::from(count) * step;
    let line = |from: (f64, f64), to: (f64, f64), color| Line {
        ends: [from, to].map(|(x, z)| geometry.on_ground(x, z)),
        color,
        width: 1.0,
    };
    let mut lines = Vec::new();
    for index in -count..=count {
        let at = f64::from(index) * step;
        let color = if index == 0 { strong } else { color };
        lines.push(line((at, -reach), (at, reach), color));
        lines.push(line((-reach, at), (reach, at), color));
    }
    let on_circle = |side: i32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
        (geometry.radius_m * sin, geometry.radius_m * cos)
    };
    lines.extend((0..SIDES).map(|side| line(on_circle(side), on_circle(side + 1), strong)));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;

    #[test]
    fn the_grid_reaches_as_far_as_the_search() {
        let geometry = SceneGeometry {
            scene_from_world: Pose::identity(),
            scene_from_reference: Pose::identity(),
            radius_m: 5.0,
        };
        let lines = grid(&geometry, Color32::GRAY, Color32::WHITE);
        let farthest = lines.iter().flat_map(|line| line.ends).map(|end| end.x);
        assert!((farthest.fold(0.0, f64::max) - 5.0).abs() < 1e-6);
    }
}
