//! The frame that the scene is drawn in, and where things are in it.

use egui::Color32;
use nalgebra::{Point2, Point3};

use super::view_camera::Line;
use crate::app::ViewContext;
use crate::geometry::Pose;

/// How far below the reference camera the ground is drawn \[m\]: about where it is for a car's
/// camera.
const GROUND_M: f64 = 1.6;

/// The scene's frame, seen from the world and from the reference at the cursor.
///
/// It is that of the first reference camera, so that it stays while the cursor moves, and so that
/// single precision suffices for the cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SceneGeometry {
    pub(super) scene_from_world: Pose,
    pub(super) scene_from_reference: Pose,
    /// How far from the reference the query may be \[m\].
    pub(super) radius_m: f64,
}

impl SceneGeometry {
    /// The geometry of a run's scene; `None` before its frames are read.
    pub(super) fn of(context: &ViewContext<'_>) -> Option<Self> {
        let first = context.run.problems().first()?;
        let here = context.problem()?;
        let scene_from_world = first.reference().world_from_camera().inverse();
        Some(Self {
            scene_from_world,
            scene_from_reference: scene_from_world * here.reference().world_from_camera(),
            radius_m: here.uncertainty_radius_m(),
        })
    }

    /// A place in the reference camera's frame, as it is drawn.
    pub(super) fn spot(&self, in_reference: &Point3<f64>) -> [f32; 3] {
        (self.scene_from_reference * in_reference).coords.cast::<f32>().into()
    }

    /// A place on the ground.
    pub(super) fn on_ground(&self, right_m: f64, forward_m: f64) -> Point3<f64> {
        self.scene_from_reference * Point3::new(right_m, GROUND_M, forward_m)
    }

    /// The place on the ground straight below another.
    pub(super) fn below(&self, in_scene: &Point3<f64>) -> Point3<f64> {
        let place = self.scene_from_reference.inverse() * in_scene;
        self.on_ground(place.x, place.z)
    }

    /// The circle on the ground that an overview shows: its middle and its radius \[m\]. It contains all
    /// cameras, for a pane of this shape.
    pub(super) fn overview<'a>(
        &self,
        cameras: impl IntoIterator<Item = &'a Point3<f64>>,
        height_over_width: f64,
    ) -> (Point3<f64>, f64) {
        /// A camera on the rim would touch the border.
        const MARGIN: f64 = 1.15;
        let reference_from_scene = self.scene_from_reference.inverse();
        // What the search can reach is ahead of the reference rather than around it.
        let usual = Point2::new(0.0, 0.2 * self.radius_m);
        let places = cameras.into_iter().map(|camera| {
            let place = reference_from_scene * camera;
            Point2::new(place.x, place.z)
        });
        let places: Vec<Point2<f64>> = places.chain([Point2::origin()]).collect();
        let farthest = |middle: &Point2<f64>| {
            let distances = places.iter().map(|place| (place - middle).norm());
            distances.fold(0.0, f64::max)
        };
        let (middle, radius_m) = match farthest(&usual) * MARGIN {
            near if near <= self.radius_m => (usual, self.radius_m),
            _ => {
                let corners = places.iter().fold((places[0], places[0]), |(low, high), place| {
                    (low.inf(place), high.sup(place))
                });
                let middle = nalgebra::center(&corners.0, &corners.1);
                (middle, self.radius_m.max(MARGIN * farthest(&middle)))
            }
        };
        let radius_m = radius_m * height_over_width.max(1.0);
        (self.on_ground(middle.x, middle.y), radius_m)
    }

    /// A camera's pose in the reference camera's frame.
    pub(super) fn reference_from(&self, world_from_camera: &Pose) -> Pose {
        let scene_from_camera = self.scene_from_world * world_from_camera;
        self.scene_from_reference.inverse() * scene_from_camera
    }

    /// How large cameras are drawn \[m\].
    pub(super) fn camera_m(&self) -> f64 {
        (0.1 * self.radius_m).clamp(0.15, 1.5)
    }

    /// Distance of the grid's lines \[m\]: a round number, about six of them within the radius.
    pub(super) fn grid_m(&self) -> f64 {
        let wanted = self.radius_m / 6.0;
        let tens = 10_f64.powf(wanted.max(1e-3).log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * tens);
        steps.into_iter().find(|step| *step >= wanted).unwrap_or(10.0 * tens)
    }
}

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
    use proptest::prelude::*;

    use crate::grid::Offset;

    fn geometry(radius_m: f64) -> SceneGeometry {
        SceneGeometry {
            scene_from_world: Pose::new([3.0, 1.0, -2.0].into(), [0.1, 0.7, 0.0].into()),
            scene_from_reference: Pose::new([1.0, 0.0, 5.0].into(), [0.0, 0.3, 0.02].into()),
            radius_m,
        }
    }

    proptest! {
        #[test]
        fn a_camera_is_where_the_search_would_put_it(
            right_m in -20.0..20.0, forward_m in -20.0..20.0, yaw_rad in -3.0..3.0,
        ) {
            let offset = Offset { right_m, forward_m, yaw_rad };
            let geometry = geometry(15.0);
            let scene_from_camera = geometry.scene_from_reference * offset.reference_from_camera();
            let world_from_camera = geometry.scene_from_world.inverse() * scene_from_camera;
            let found = Offset::of(&geometry.reference_from(&world_from_camera));
            prop_assert!((found.right_m - right_m).abs() < 1e-9);
            prop_assert!((found.forward_m - forward_m).abs() < 1e-9);
            prop_assert!((found.yaw_rad - yaw_rad).abs() < 1e-9);
        }

        #[test]
        fn the_grid_has_a_few_lines_for_any_radius(radius_m in 0.01..2000.0) {
            let lines = radius_m / geometry(radius_m).grid_m();
            prop_assert!((2.0..=6.0 + 1e-9).contains(&lines), "{lines}");
        }
    }

    #[test]
    fn the_grid_is_round() {
        assert_eq!(geometry(15.0).grid_m(), 5.0);
        assert_eq!(geometry(3.0).grid_m(), 0.5);
        assert_eq!(geometry(10.0).grid_m(), 2.0);
    }

    proptest! {
        #[test]
        fn an_overview_has_every_camera_within_its_circle(
            places in proptest::collection::vec((-60.0..60.0, -60.0..60.0), 0..6),
            radius_m in 1.0..20.0, tall in 0.2..3.0,
        ) {
            let geometry = geometry(radius_m);
            let scene_from_reference = geometry.scene_from_reference;
            let in_scene = |&(x, z): &(f64, f64)| scene_from_reference * Point3::new(x, 0.0, z);
            let cameras: Vec<Point3<f64>> = places.iter().map(in_scene).collect();
            let (middle, shown_m) = geometry.overview(&cameras, tall);
            prop_assert!(shown_m >= radius_m);
            let reference = in_scene(&(0.0, 0.0));
            for camera in cameras.iter().chain([&reference]) {
                let off = scene_from_reference.inverse() * (camera - middle);
                let distance = off.x.hypot(off.z);
                prop_assert!(distance * tall.max(1.0) <= shown_m + 1e-9, "{} {}", distance, shown_m);
            }
        }
    }

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
