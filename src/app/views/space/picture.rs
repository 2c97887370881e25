//! The cloud as a picture: each point is a small square, and the nearer one hides the other.

use egui::{Color32, ColorImage};
use nalgebra::Point3;

use super::view_camera::{NEAR_M, ViewCamera};

/// Least and greatest side of a point, in egui's points.
const POINT: [f32; 2] = [1.5, 3.0];
/// Side of a point \[m\], where it comes out between the two.
const POINT_M: f32 = 0.06;

/// A point of the cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// Position in the scene \[m\].
    pub(super) at: [f32; 3],
    pub(super) color: Color32,
}

/// What a camera sees of the points, with so many pixels for one of egui's points.
pub(super) fn picture(
    spots: &[Spot],
    camera: &ViewCamera,
    scale: f32,
    background: Color32,
) -> ColorImage {
    let size = camera.size * scale;
    let [width, height] = [size.x, size.y].map(|side| side.round().max(1.0) as usize);
    let mut image = ColorImage::filled([width, height], background);
    let mut depths = vec![f32::INFINITY; width * height];
    let eye_from_scene = camera.scene_from_eye.inverse().cast::<f32>();
    let [focal_x, focal_y] = camera.focal.map(|focal| scale * focal as f32);
    let [centre_x, centre_y] = camera.centre.map(|centre| scale * centre as f32);
    for spot in spots {
        let seen = eye_from_scene * Point3::from(spot.at);
        if seen.z < NEAR_M as f32 {
            continue;
        }
        let half = 0.5 * (POINT_M * focal_x / seen.z).clamp(POINT[0] * scale, POINT[1] * scale);
        // The pixels whose centres the square covers.
        let covered = |at: f32, count: usize| {
            let [from, to] = [at - half, at + half].map(|end| end.round().max(0.0) as usize);
            from..to.min(count)
        };
        for row in covered(focal_y * seen.y / seen.z + centre_y, height) {
            for column in covered(focal_x * seen.x / seen.z + centre_x, width) {
                let pixel = row * width + column;
                if seen.z < depths[pixel] {
                    depths[pixel] = seen.z;
                    image.pixels[pixel] = spot.color;
                }
            }
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Pose;

    proptest! {
        #[test]
        fn points_are_drawn_where_the_camera_sees_them_and_the_nearer_one_wins(
            x in 4.0..316.0_f64, y in 4.0..236.0_f64, depth in 1.0..80.0_f64, behind in 0.05..0.5_f64,
            is_first in prop::bool::ANY, scale in 1.0_f32..2.0,
        ) {
            let eye = Pose::new([1.0, -2.0, -5.0].into(), [-0.2, 0.3, 0.1].into());
            let camera = ViewCamera::centred(eye, 0.9, egui::vec2(320.0, 240.0));
            let place = |depth: f64| -> [f32; 3] {
                let in_eye = Point3::new(
                    (x - camera.centre[0]) / camera.focal[0] * depth,
                    (y - camera.centre[1]) / camera.focal[1] * depth,
                    depth,
                );
                (camera.scene_from_eye * in_eye).coords.cast::<f32>().into()
            };
            let near = Spot { at: place(depth), color: Color32::GREEN };
            let far = Spot { at: place(depth * (1.0 + behind)), color: Color32::RED };
            let spots = if is_first { [near, far] } else { [far, near] };
            let image = picture(&spots, &camera, scale, Color32::BLACK);
            let [column, row] = [x, y].map(|at| (scale * at as f32) as usize);
            prop_assert_eq!(image.pixels[row * image.size[0] + column], Color32::GREEN);
            prop_assert!(image.pixels.iter().filter(|pixel| **pixel != Color32::BLACK).count() < 150);
        }
    }
}
