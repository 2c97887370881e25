//! The camera that the pane shows the scene through: an eye in the scene, and its projection.

use egui::{Color32, Pos2, Vec2, pos2};
use nalgebra::{Point3, Unit, Vector3};

use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// What is nearer to the eye than this is not drawn \[m\].
pub(super) const NEAR_M: f64 = 0.05;

/// A pinhole camera that looks at the scene, with the pane as its image.
///
/// Positions in the pane are in egui's points from its upper left corner; a pixel of a photo covers
/// an area there, so that its centre lies half a pixel inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ViewCamera {
    /// Where the eye is: x right, y down, z ahead, like every camera.
    pub(super) scene_from_eye: Pose,
    /// Focal lengths \[points\].
    pub(super) focal: [f64; 2],
    /// Where the optical axis meets the pane \[points\].
    pub(super) centre: [f64; 2],
    /// Size of the pane \[points\].
    pub(super) size: Vec2,
}

impl ViewCamera {
    /// A camera with the optical axis in the middle, for a vertical angle of view.
    pub(super) fn centred(scene_from_eye: Pose, vertical_rad: f64, size: Vec2) -> Self {
        let focal = 0.5 * f64::from(size.y) / (0.5 * vertical_rad).tan();
        Self {
            scene_from_eye,
            focal: [focal; 2],
            centre: [0.5 * f64::from(size.x), 0.5 * f64::from(size.y)],
            size,
        }
    }

    /// A camera that shows the whole image of another in the middle of the pane, as large as fits.
    pub(super) fn of_camera(scene_from_eye: Pose, intrinsics: &Intrinsics, size: Vec2) -> Self {
        let (width, height) = (f64::from(intrinsics.width), f64::from(intrinsics.height));
        let (across, down) = (f64::from(size.x), f64::from(size.y));
        let scale = (across / width).min(down / height);
        Self {
            scene_from_eye,
            focal: [scale * intrinsics.fx, scale * intrinsics.fy],
            centre: [
                scale * (intrinsics.cx + 0.5 - 0.5 * width) + 0.5 * across,
                scale * (intrinsics.cy + 0.5 - 0.5 * height) + 0.5 * down,
            ],
            size,
        }
    }

    /// Where a point of the scene is seen; `None` where it is not in front of the eye.
    pub(super) fn project(&self, point: &Point3<f64>) -> Option<Pos2> {
        let seen = self.scene_from_eye.inverse_transform_point(point);
        (seen.z >= NEAR_M).then(|| self.in_pane(&seen))
    }

    /// Where a line is seen: the part of it that is in front of the eye.
    pub(super) fn segment(&self, line: &Line) -> Option<[Pos2; 2]> {
        let [a, b] = line.ends.map(|end| self.scene_from_eye.inverse_transform_point(&end));
        // What is behind the eye has no place in the pane.
        let cut = |end: Point3<f64>, other: Point3<f64>| {
            let share = (NEAR_M - end.z) / (other.z - end.z);
            if end.z < NEAR_M { end + share * (other - end) } else { end }
        };
        let is_seen = a.z.max(b.z) >= NEAR_M;
        is_seen.then(|| [cut(a, b), cut(b, a)].map(|end| self.in_pane(&end)))
    }

    /// The place in the pane of a point in the frame of the eye.
    fn in_pane(&self, seen: &Point3<f64>) -> Pos2 {
        pos2(
            (self.focal[0] * seen.x / seen.z + self.centre[0]) as f32,
            (self.focal[1] * seen.y / seen.z + self.centre[1]) as f32,
        )
    }

    /// The direction in which a place of the pane looks, in the scene.
    pub(super) fn ray(&self, at: Pos2) -> Ray {
        let in_eye = Vector3::new(
            (f64::from(at.x) - self.centre[0]) / self.focal[0],
            (f64::from(at.y) - self.centre[1]) / self.focal[1],
            1.0,
        );
        Ray {
            origin: self.scene_from_eye.translation.vector.into(),
            direction: self.scene_from_eye.rotation * Unit::new_normalize(in_eye),
        }
    }
}

/// A stroke from one place of the scene to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// Both ends \[m\].
    pub(super) ends: [Point3<f64>; 2],
    pub(super) color: Color32,
    /// Width in egui's points.
    pub(super) width: f32,
}

/// A half line in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ray {
    pub(super) origin: Point3<f64>,
    pub(super) direction: Unit<Vector3<f64>>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KITTI: Intrinsics =
        Intrinsics { fx: 718.856, fy: 690.0, cx: 607.1928, cy: 185.2157, width: 1241, height: 376 };

    fn pose(shift: [f64; 3], turn: [f64; 3]) -> Pose {
        Pose::new(shift.into(), turn.into())
    }

    proptest! {
        /// What a camera sees at a pixel, the view that looks through it shows there.
        #[test]
        fn looking_through_a_camera_shows_what_its_intrinsics_project(
            x in -20.0..20.0, y in -5.0..5.0, z in 0.5..80.0,
            shift in prop::array::uniform3(-50.0..50.0),
            turn in prop::array::uniform3(-3.0..3.0),
            size in (50.0_f32..2000.0, 50.0_f32..1500.0),
        ) {
            let scene_from_camera = pose(shift, turn);
            let size = Vec2::from(size);
            let view_camera = ViewCamera::of_camera(scene_from_camera, &KITTI, size);
            let in_camera = Point3::new(x, y, z);
            let pixel = KITTI.project(&in_camera).expect("in front");
            let scale = (size.x / 1241.0).min(size.y / 376.0);
            // The image is centred; pixel centres lie half a pixel inside.
            let expected = pos2(
                0.5 * size.x + scale * (pixel.x as f32 + 0.5 - 620.5),
                0.5 * size.y + scale * (pixel.y as f32 + 0.5 - 188.0),
            );
            let seen = view_camera.project(&(scene_from_camera * in_camera)).expect("in front");
            // Half a pixel of the photo; far outside of the pane single precision is coarser.
            let near = 0.5 * scale * (1.0 + 1e-3 * (expected - size.to_pos2()).length() / scale);
            prop_assert!((seen - expected).length() < near, "{seen:?} {expected:?}");
        }

        /// A ray goes through all that is seen where it begins.
        #[test]
        fn a_ray_goes_through_what_is_seen_there(
            x in -20.0..20.0, y in -5.0..5.0, z in -20.0..20.0,
            turn in -3.0..3.0_f64, down in 0.2..1.4_f64, height in 2.0..30.0_f64,
        ) {
            let eye = Pose::translation(1.0, -height, -3.0)
                * crate::geometry::yaw(turn)
                * nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -down);
            let view_camera = ViewCamera::centred(eye, 0.9, Vec2::new(640.0, 480.0));
            let seen = Point3::new(x, y, z);
            if let Some(at) = view_camera.project(&seen)
                && egui::Rect::from_min_size(Pos2::ZERO, view_camera.size).contains(at)
            {
                let Ray { origin, direction } = view_camera.ray(at);
                let along = direction.dot(&(seen - origin));
                let off = (origin + along * direction.into_inner() - seen).norm();
                prop_assert!(off < 1e-3 * along, "{off} {along}");
            }
        }
    }

    #[test]
    fn a_line_from_behind_the_eye_is_seen_as_far_as_it_is_in_front() {
        let eye = pose([1.0, -2.0, -5.0], [-0.2, 0.3, 0.1]);
        let view_camera = ViewCamera::centred(eye, 0.9, Vec2::new(320.0, 240.0));
        let line = |a: [f64; 3], b: [f64; 3]| Line {
            ends: [a, b].map(|end| eye * Point3::from(end)),
            color: Color32::WHITE,
            width: 1.0,
        };
        let [from, to] =
            view_camera.segment(&line([-1.0, 0.5, -3.0], [1.0, 0.2, 4.0])).expect("is seen");
        let end = view_camera.project(&(eye * Point3::new(1.0, 0.2, 4.0))).expect("in front");
        assert!((to - end).length() < 1e-3);
        // A place on it that is in front lies between.
        let middle = view_camera.project(&(eye * Point3::new(0.5, 0.275, 2.25))).expect("in front");
        let off = (middle - to).normalized().dot((from - to).normalized());
        assert!(off > 0.999 && (from - to).length() > (middle - to).length());
        assert_eq!(view_camera.segment(&line([-1.0, 0.5, -3.0], [1.0, 0.2, -4.0])), None);
    }
}
