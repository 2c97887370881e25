//! The cloud in the colours of its photo, as a picture: each point is a small square, and the nearer one hides the other.

use egui::{Color32, ColorImage};
use nalgebra::Point3;

use super::scene_geometry::SceneGeometry;
use super::view_camera::{NEAR_M, ViewCamera};
use crate::problem::ReferenceTuple;
use crate::render::{self, RenderParams};

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

/// The points of a reference's scan.
pub(super) fn points(
    geometry: &SceneGeometry,
    reference: &ReferenceTuple,
    params: &RenderParams,
) -> Vec<Spot> {
    let spots = colored(reference, params).into_iter();
    spots.map(|(point, color)| Spot { at: geometry.spot(&point.cast()), color }).collect()
}

/// All points of the scan: those that the photo shows in its colours, the others grey.
fn colored(reference: &ReferenceTuple, params: &RenderParams) -> Vec<(Point3<f32>, Color32)> {
    const UNSEEN: Color32 = Color32::from_gray(105);
    let (cloud, gray) = (reference.cloud(), &reference.photo().gray);
    let visible = render::color_cloud(cloud, gray, reference.intrinsics(), params);
    // The visible points are in the order of the scan.
    let mut visible = visible.points.iter().peekable();
    let mut color = |point: &Point3<f32>| match visible.next_if(|seen| seen.position == *point) {
        Some(seen) => {
            let gray = seen.intensity.round().clamp(0.0, 255.0) as u8;
            photo_color(reference, point).unwrap_or(Color32::from_gray(gray))
        }
        None => UNSEEN,
    };
    let points = cloud.points.iter();
    points.map(|point| (*point, color(point))).collect()
}

fn photo_color(reference: &ReferenceTuple, point: &Point3<f32>) -> Option<Color32> {
    let photo = reference.photo().color.as_ref()?;
    let pixel = reference.intrinsics().project(&point.cast())?;
    let nearest = |value: f64| value.round().max(0.0) as u32;
    let [r, g, b] = photo.get_pixel_checked(nearest(pixel.x), nearest(pixel.y))?.0;
    Some(Color32::from_rgb(r, g, b))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::camera::Intrinsics;
    use crate::cloud::Cloud;
    use crate::geometry::Pose;
    use crate::image::Photo;

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

    #[test]
    fn a_point_has_the_colour_of_the_photo_there_and_is_grey_where_the_photo_does_not_show_it() {
        let camera = Intrinsics { fx: 2.0, fy: 2.0, cx: 3.5, cy: 3.5, width: 8, height: 8 };
        let photo = image::RgbImage::from_fn(8, 8, |x, _| {
            image::Rgb(if x < 4 { [200, 10, 10] } else { [10, 10, 200] })
        });
        let points = [[-1.0, 0.0, 1.5], [1.0, 0.0, 1.5], [0.0, 0.0, -2.0]];
        let cloud: Cloud = points.into_iter().collect();
        let photo = Photo::from_color(photo);
        let reference = ReferenceTuple::new("r", photo, camera, Pose::identity(), cloud);
        let colored = colored(&reference.expect("sound"), &RenderParams::default());
        let colors: Vec<Color32> = colored.iter().map(|(_, color)| *color).collect();
        let [red, blue] =
            [[200, 10, 10], [10, 10, 200]].map(|[r, g, b]| Color32::from_rgb(r, g, b));
        assert_eq!(colors, [red, blue, Color32::from_gray(105)]);
    }
}
