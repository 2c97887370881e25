//! The eye that goes round the scene.
//!
//! The scene's frame is that of the first reference camera: y points down, so the ground is a plane
//! of constant y, and z is where that camera looks.

use std::f64::consts::FRAC_PI_2;

use egui::{Pos2, Vec2};
use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::view_camera::ViewCamera;
use crate::geometry::Pose;

/// Vertical angle of view \[rad\].
const VIEW_RAD: f64 = 50.0 * std::f64::consts::PI / 180.0;
/// Turn for one point of pointer motion \[rad\].
const TURN_RAD: f64 = 0.006;
/// How near and how far the eye may be \[m\].
const DISTANCE_M: std::ops::RangeInclusive<f64> = 0.1..=5000.0;

/// An eye that looks at a target from somewhere around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Orbit {
    /// What it looks at.
    pub(super) target: Point3<f64>,
    /// Where it looks, to the right of the scene's z axis \[rad\].
    pub(super) heading: f64,
    /// How steeply it looks down \[rad\].
    pub(super) descent: f64,
    /// The distance from eye to target \[m\].
    pub(super) distance: f64,
}

impl Orbit {
    /// From behind and above: all within a radius around a place on the ground.
    pub(super) fn overview(ground: Point3<f64>, radius_m: f64) -> Self {
        Self { target: ground, heading: 0.35, descent: 0.6, distance: 2.4 * radius_m }
    }

    /// The same from straight above, ahead of the first reference upwards.
    pub(super) fn from_above(ground: Point3<f64>, radius_m: f64) -> Self {
        Self { heading: 0.0, descent: FRAC_PI_2, ..Self::overview(ground, radius_m) }
    }

    /// The eye of a camera, as far as an orbit can be: without its roll.
    pub(super) fn leaving(scene_from_camera: &Pose, distance: f64) -> Self {
        let ahead = scene_from_camera.rotation * Vector3::z();
        Self {
            target: Point3::from(scene_from_camera.translation.vector) + distance * ahead,
            heading: ahead.x.atan2(ahead.z),
            descent: ahead.y.clamp(-1.0, 1.0).asin(),
            distance,
        }
    }

    /// Where the eye is.
    pub(super) fn scene_from_eye(&self) -> Pose {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.heading)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -self.descent);
        let eye = self.target - self.distance * (rotation * Vector3::z());
        Pose::from_parts(eye.coords.into(), rotation)
    }

    /// The camera that fills a pane with what the eye sees.
    pub(super) fn view_camera(&self, size: Vec2) -> ViewCamera {
        ViewCamera::centred(self.scene_from_eye(), VIEW_RAD, size)
    }

    /// Turns about the target, as if the pointer held the scene.
    pub(super) fn turn(&mut self, by: Vec2) {
        self.heading -= TURN_RAD * f64::from(by.x);
        self.descent += TURN_RAD * f64::from(by.y);
        self.descent = self.descent.clamp(-FRAC_PI_2, FRAC_PI_2);
    }

    /// Moves the target across the pane, so that it stays under the pointer.
    pub(super) fn pan(&mut self, by: Vec2, size: Vec2) {
        let view_camera = self.view_camera(size);
        let in_eye = Vector3::new(
            f64::from(by.x) * self.distance / view_camera.focal[0],
            f64::from(by.y) * self.distance / view_camera.focal[1],
            0.0,
        );
        self.target -= view_camera.scene_from_eye.rotation * in_eye;
    }

    /// Goes nearer (below 1) or farther, towards what is seen at `at`.
    pub(super) fn zoom(&mut self, factor: f64, at: Pos2, size: Vec2) {
        let distance = (factor * self.distance).clamp(*DISTANCE_M.start(), *DISTANCE_M.end());
        let factor = distance / self.distance;
        let view_camera = self.view_camera(size);
        let ray = view_camera.ray(at);
        // The place at the target's depth; any other on the ray would stay where it is as well.
        let ahead = view_camera.scene_from_eye.rotation * Vector3::z();
        let reach = self.distance / ahead.dot(&ray.direction);
        let fixed = ray.origin + reach * ray.direction.into_inner();
        self.target = fixed + factor * (self.target - fixed);
        self.distance = distance;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: Vec2 = Vec2::new(640.0, 480.0);

    fn orbit() -> impl Strategy<Value = Orbit> {
        let numbers = (prop::array::uniform3(-30.0..30.0), -3.0..3.0, -1.5..1.5, 1.0..80.0);
        numbers.prop_map(|(target, heading, descent, distance)| Orbit {
            target: target.into(),
            heading,
            descent,
            distance,
        })
    }

    proptest! {
        #[test]
        fn the_target_is_in_the_middle_and_the_horizon_level(orbit in orbit(), by in (-500.0_f32..500.0, -500.0_f32..500.0)) {
            let mut orbit = orbit;
            orbit.turn(by.into());
            let view_camera = orbit.view_camera(SIZE);
            let at = view_camera.project(&orbit.target).expect("in front");
            prop_assert!((at - (0.5 * SIZE).to_pos2()).length() < 1e-3);
            let right = view_camera.scene_from_eye.rotation * Vector3::x();
            prop_assert!(right.y.abs() < 1e-12);
            let down = view_camera.scene_from_eye.rotation * Vector3::y();
            prop_assert!(down.y > -1e-9, "it never stands on its head");
        }

        #[test]
        fn what_is_at_the_targets_depth_goes_with_the_pointer(orbit in orbit(), by in (-200.0_f32..200.0, -200.0_f32..200.0)) {
            let by = Vec2::from(by);
            let before = orbit.view_camera(SIZE).project(&orbit.target).expect("in front");
            let mut moved = orbit;
            moved.pan(by, SIZE);
            let after = moved.view_camera(SIZE).project(&orbit.target).expect("in front");
            prop_assert!((after - before - by).length() < 1e-2);
        }

        #[test]
        fn zooming_keeps_what_is_under_the_pointer(
            orbit in orbit(), at in (0.0_f32..640.0, 0.0_f32..480.0), factor in 0.2..5.0, far in 5.0..200.0,
        ) {
            let at = Pos2::from(at);
            let ray = orbit.view_camera(SIZE).ray(at);
            // Beyond the place that the eye comes to.
            let seen = ray.origin + (orbit.distance * 2.0 + far) * ray.direction.into_inner();
            let mut zoomed = orbit;
            zoomed.zoom(factor, at, SIZE);
            let now = zoomed.view_camera(SIZE).project(&seen).expect("in front");
            prop_assert!((now - at).length() < 0.1, "{now:?} {at:?}");
        }

        #[test]
        fn leaving_a_level_camera_changes_nothing(
            place in prop::array::uniform3(-50.0..50.0), turn in -3.0..3.0_f64,
        ) {
            let camera = Pose::translation(place[0], place[1], place[2]) * crate::geometry::yaw(turn);
            let eye = Orbit::leaving(&camera, 7.0).scene_from_eye();
            prop_assert!((eye.translation.vector - camera.translation.vector).norm() < 1e-9);
            prop_assert!(eye.rotation.angle_to(&camera.rotation) < 1e-7);
        }
    }

    #[test]
    fn from_above_ahead_is_up_and_right_is_right() {
        let view_camera = Orbit::from_above(Point3::new(0.0, 1.6, 0.0), 10.0).view_camera(SIZE);
        let at = |x, z| view_camera.project(&Point3::new(x, 1.6, z)).expect("in front");
        assert!(at(0.0, 5.0).y < at(0.0, 0.0).y);
        assert!(at(5.0, 0.0).x > at(0.0, 0.0).x);
    }

    #[test]
    fn zooming_ends_where_the_eye_would_be_inside_the_target() {
        let mut orbit = Orbit::overview(Point3::origin(), 10.0);
        for _ in 0..200 {
            orbit.zoom(0.5, (0.5 * SIZE).to_pos2(), SIZE);
        }
        assert_eq!(orbit.distance, *DISTANCE_M.start());
        assert!(orbit.target.coords.norm() < 1e-6);
    }
}
