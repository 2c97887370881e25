//! The route of the camera, seen from above.

use image::{Rgb, imageops};
use nalgebra::Point2;

use posescope_core::image::MAX_PIXELS;

use super::picture::dot;
use crate::geometry::Pose;
use crate::image::RgbImage;
use crate::palette;
use crate::route::from_above;

/// The margin around the route \[px\].
const MARGIN_PX: f64 = 20.0;
/// The width of a picture without a photo \[px\].
const WIDTH: u32 = 620;

/// Draws the route below a picture, or alone: its start green, its end vermilion.
pub(super) fn below(picture: Option<RgbImage>, poses: &[Pose]) -> Option<RgbImage> {
    let Some(places) = from_above(poses) else {
        return picture;
    };
    let (width, top) = picture.as_ref().map_or((WIDTH, 0), RgbImage::dimensions);
    let height = (width / 2).clamp(1, (MAX_PIXELS / u64::from(width.max(1))) as u32);
    let mut canvas = RgbImage::from_pixel(width, top + height, Rgb([255; 3]));
    if let Some(picture) = &picture {
        imageops::replace(&mut canvas, picture, 0, 0);
    }
    let first = places[0];
    let (least, most) = places
        .iter()
        .fold((first, first), |(least, most), place| (least.inf(place), most.sup(place)));
    let sides = (most - least).map(|side| side.max(1.0));
    let [wide, tall] = [width, height].map(|side| f64::from(side) - 2.0 * MARGIN_PX);
    let scale = (wide / sides.x).min(tall / sides.y);
    let pixel = |place: &Point2<f64>| {
        let at = (place - least) * scale;
        Point2::new(MARGIN_PX + at.x, f64::from(top + height) - MARGIN_PX - at.y)
    };
    let mut mark = |at: Point2<f64>, radius, color| {
        dot(&mut canvas, at.map(|part| part as i64), radius, color);
    };
    for pair in places.windows(2) {
        let (from, to) = (pixel(&pair[0]), pixel(&pair[1]));
        let steps = (to - from).norm().ceil().max(1.0) as usize;
        for step in 0..=steps {
            let share = step as f64 / steps as f64;
            mark(from + (to - from) * share, 1, palette::REFERENCE);
        }
    }
    mark(pixel(&first), 4, palette::TRUTH);
    mark(pixel(&places[places.len() - 1]), 4, palette::ESTIMATE);
    Some(canvas)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// A quarter of a circle to the right with a radius of 100 m, in a world that lies on its side.
    #[test]
    fn a_way_lies_to_the_right_and_ahead_whatever_the_axes_of_the_world() {
        let tilted = UnitQuaternion::from_euler_angles(0.4, -0.2, 1.1);
        let poses = (0..=50).map(|step| {
            let angle = FRAC_PI_2 * f64::from(step) / 50.0;
            let place = Translation3::new(100.0 * (1.0 - angle.cos()), 0.0, 100.0 * angle.sin());
            let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
            Pose::translation(7.0, -3.0, 2.0) * tilted * Pose::from_parts(place, turned)
        });
        let poses: Vec<Pose> = poses.collect();
        let places = from_above(&poses).expect("a way");
        assert!((places[50] - Point2::new(100.0, 100.0)).norm() < 1e-6, "{}", places[50]);
        let map = below(None, &poses).expect("a map");
        assert_eq!(map.dimensions(), (WIDTH, WIDTH / 2));
        let colors: Vec<_> = map.pixels().map(|pixel| pixel.0).collect();
        for color in [palette::REFERENCE, palette::TRUTH, palette::ESTIMATE] {
            assert!(colors.contains(&color));
        }
        assert_eq!(below(None, &poses[..1]), None);
    }
}
