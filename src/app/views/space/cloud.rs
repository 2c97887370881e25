//! The reference's cloud in the colours of its photo.

use egui::Color32;
use nalgebra::Point3;

use super::picture::Spot;
use super::scene_geometry::SceneGeometry;
use crate::problem::ReferenceTuple;
use crate::render::{self, RenderParams};

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
    let ReferenceTuple { cloud, photo, intrinsics, .. } = reference;
    let visible = render::color_cloud(cloud, &photo.gray, intrinsics, params);
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
    let photo = reference.photo.color.as_ref()?;
    let pixel = reference.intrinsics.project(&point.cast())?;
    let nearest = |value: f64| value.round().max(0.0) as u32;
    let [r, g, b] = photo.get_pixel_checked(nearest(pixel.x), nearest(pixel.y))?.0;
    Some(Color32::from_rgb(r, g, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;
    use crate::cloud::Cloud;
    use crate::geometry::Pose;
    use crate::image::Photo;

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
