//! Moving the camera in hand with the pointer.

use egui::{CursorIcon, Pos2, Rect, Role, Sense, Ui, Vec2, WidgetInfo};
use nalgebra::{Point3, Vector3};

use super::cameras::SceneCamera;
use super::scene_geometry::SceneGeometry;
use super::view_camera::ViewCamera;
use crate::geometry::{Pose, yaw};

/// Turn for one point of pointer motion \[rad\].
const TURN_RAD: f64 = 0.005;
/// Half the side of what can be grabbed, at least and at most \[points\].
const REACH: std::ops::RangeInclusive<f32> = 14.0..=60.0;

/// How the pointer holds the camera.
#[derive(Debug, Default)]
pub(super) struct CameraDrag {
    /// From where the pointer meets the camera's level to the camera's centre \[m\].
    grip: Option<Vector3<f64>>,
}

impl CameraDrag {
    /// Lets the pointer drag the camera; answers with its new pose (`world_from_camera`).
    pub(super) fn ui(
        &mut self,
        ui: &Ui,
        pane: Rect,
        view_camera: &ViewCamera,
        geometry: &SceneGeometry,
        camera: &SceneCamera,
    ) -> Option<Pose> {
        let handle = handle(pane, view_camera, camera)?;
        let response = ui.interact(handle, ui.scope_id().with("camera in hand"), Sense::drag());
        response.widget_info(|| {
            let what = "Camera in hand: drag to move it, with Alt or Ctrl to turn it";
            WidgetInfo::labeled(Role::Button, true, what)
        });
        let is_held = response.dragged();
        let response = response.on_hover_and_drag_cursor(if is_held {
            CursorIcon::Grabbing
        } else {
            CursorIcon::Grab
        });
        let Some(pointer) = response.interact_pointer_pos().filter(|_| is_held) else {
            self.grip = None;
            return None;
        };
        // Many desktops keep Alt and a drag for moving windows.
        if ui.input(|input| input.modifiers.alt || input.modifiers.ctrl) {
            self.grip = None;
            return Some(turned(camera, response.drag_delta()));
        }
        let delta = response.drag_delta();
        let before = pointer - pane.min.to_vec2() - delta;
        let grip = match self.grip {
            Some(grip) => grip,
            None => *self
                .grip
                .insert(grip(view_camera, geometry, camera, before)?),
        };
        if delta == Vec2::ZERO {
            return None;
        }
        moved(
            view_camera,
            geometry,
            camera,
            grip,
            pointer - pane.min.to_vec2(),
        )
    }
}

/// Where the camera can be grabbed.
fn handle(pane: Rect, view_camera: &ViewCamera, camera: &SceneCamera) -> Option<Rect> {
    let centre = view_camera.project(&camera.centre())?;
    let mut around = Rect::from_pos(centre);
    for corner in camera.corners() {
        around.extend_with(view_camera.project(&corner).unwrap_or(centre));
    }
    let half = (0.5 * around.size()).clamp(Vec2::splat(*REACH.start()), Vec2::splat(*REACH.end()));
    let place = Rect::from_center_size(around.center(), 2.0 * half).translate(pane.min.to_vec2());
    let visible = place.intersect(pane);
    visible.is_positive().then_some(visible)
}

/// The level on which the camera is moved.
fn level(
    view_camera: &ViewCamera,
    geometry: &SceneGeometry,
    camera: &SceneCamera,
    at: Pos2,
) -> Option<Point3<f64>> {
    view_camera.ray(at).meets(&camera.centre(), &geometry.up())
}

fn grip(
    view_camera: &ViewCamera,
    geometry: &SceneGeometry,
    camera: &SceneCamera,
    at: Pos2,
) -> Option<Vector3<f64>> {
    Some(camera.centre() - level(view_camera, geometry, camera, at)?)
}

/// The camera's pose when the pointer has come to `at`.
fn moved(
    view_camera: &ViewCamera,
    geometry: &SceneGeometry,
    camera: &SceneCamera,
    grip: Vector3<f64>,
    at: Pos2,
) -> Option<Pose> {
    let centre = level(view_camera, geometry, camera, at)? + grip;
    let scene_from_camera =
        Pose::from_parts(centre.coords.into(), camera.scene_from_camera.rotation);
    Some(geometry.scene_from_world.inverse() * scene_from_camera)
}

/// A pointer that moves to the right turns the camera to the right.
fn turned(camera: &SceneCamera, by: Vec2) -> Pose {
    camera.world * yaw(-TURN_RAD * f64::from(by.x))
}

#[cfg(test)]
mod tests {
    use super::super::cameras::CameraKind;
    use super::super::orbit::Orbit;
    use super::*;
    use crate::camera::Intrinsics;
    use proptest::prelude::*;

    fn geometry() -> SceneGeometry {
        SceneGeometry {
            scene_from_world: Pose::new([30.0, 1.0, -2.0].into(), [0.0, 0.7, 0.0].into()),
            scene_from_reference: Pose::new([1.0, 0.0, 5.0].into(), [0.02, 0.3, 0.01].into()),
            radius_m: 10.0,
        }
    }

    fn camera(geometry: &SceneGeometry, right: f64, ahead: f64) -> SceneCamera {
        let scene_from_camera =
            geometry.scene_from_reference * Pose::translation(right, -0.4, ahead);
        SceneCamera {
            kind: CameraKind::Hand,
            world: geometry.scene_from_world.inverse() * scene_from_camera,
            scene_from_camera,
            intrinsics: Intrinsics {
                fx: 700.0,
                fy: 700.0,
                cx: 600.0,
                cy: 180.0,
                width: 1240,
                height: 370,
            },
            depth_m: 1.0,
            about: String::new(),
            color: egui::Color32::WHITE,
        }
    }

    proptest! {
        #[test]
        fn the_camera_stays_on_its_level_and_under_the_pointer(
            right in -5.0..5.0, ahead in -5.0..5.0, to in (200.0_f32..440.0, 200.0_f32..400.0),
        ) {
            let (geometry, size) = (geometry(), Vec2::new(640.0, 480.0));
            let view_camera = Orbit::overview(Point3::new(0.0, 1.6, 0.0), 10.0).view_camera(size);
            let camera = camera(&geometry, right, ahead);
            let begin = view_camera.project(&camera.centre()).expect("in front") + Vec2::new(3.0, -2.0);
            let held = grip(&view_camera, &geometry, &camera, begin).expect("seen from above");
            let world = moved(&view_camera, &geometry, &camera, held, Pos2::from(to)).expect("seen from above");
            let scene = geometry.scene_from_world * world;
            let shift = scene.translation.vector - camera.centre().coords;
            prop_assert!(shift.dot(&geometry.up()).abs() < 1e-9);
            prop_assert!(scene.rotation.angle_to(&camera.scene_from_camera.rotation) < 1e-7);
            // What was under the pointer on the camera's level has gone along with it.
            let gripped = Point3::from(scene.translation.vector - held);
            let now = view_camera.project(&gripped).expect("in front");
            prop_assert!((now - Pos2::from(to)).length() < 1e-2);
        }
    }

    #[test]
    fn a_pointer_to_the_right_turns_to_the_right_and_moves_nothing() {
        let geometry = geometry();
        let camera = camera(&geometry, 0.0, 0.0);
        let pose = turned(&camera, Vec2::new(10.0, 0.0));
        let ahead = camera.world.inverse() * pose * Point3::new(0.0, 0.0, 1.0);
        assert!(ahead.x > 0.04 && ahead.y.abs() < 1e-9);
        assert!((pose.translation.vector - camera.world.translation.vector).norm() < 1e-12);
    }
}
