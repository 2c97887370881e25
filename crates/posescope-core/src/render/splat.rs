//! Splatting the coloured cloud with a depth test.

use super::ColoredPoint;
use super::projection::Projection;
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// A pixel of a synthetic view on which a point was splatted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplattedPixel {
    /// Row-major position in the image.
    pub index: u32,
    /// Depth of the visible point \[m\].
    pub depth: f32,
    /// Grey value of the visible point, 0 … 255.
    pub intensity: f32,
}

/// A synthetic view: it exists only where a point was splatted.
#[derive(Clone, Debug)]
pub struct SyntheticView {
    /// Image width \[px\].
    pub width: u32,
    /// Image height \[px\].
    pub height: u32,
    /// The covered pixels, each once.
    pub pixels: Vec<SplattedPixel>,
}

const EMPTY: u32 = u32::MAX;

/// Draws synthetic views of one camera, one after the other, reusing its buffers, in the plain way
/// that [`ZBuffer`](super::ZBuffer) is measured by.
///
/// A view covers a few per cent of the image, so the cost of a view must not depend on the size of
/// the image: only the pixels that the last view touched are cleared.
pub struct Rasterizer {
    intrinsics: Intrinsics,
    reach: i32,
    /// For each image pixel its place in `pixels`, or [`EMPTY`].
    slots: Vec<u32>,
    pixels: Vec<SplattedPixel>,
}

impl Rasterizer {
    /// A rasterizer for a camera; each point covers a square of `splat_px` (odd) pixels.
    pub fn new(intrinsics: &Intrinsics, splat_px: usize) -> Self {
        Self {
            intrinsics: *intrinsics,
            reach: (splat_px / 2) as i32,
            slots: vec![EMPTY; (intrinsics.width * intrinsics.height) as usize],
            pixels: Vec::new(),
        }
    }

    /// The pixels that the points cover in a camera at `camera_from_points`.
    ///
    /// The nearest point wins a pixel; of two at the same depth, the one that comes first.
    pub fn splat(
        &mut self,
        points: &[ColoredPoint],
        camera_from_points: &Pose,
    ) -> &[SplattedPixel] {
        for pixel in self.pixels.drain(..) {
            self.slots[pixel.index as usize] = EMPTY;
        }
        let projection = Projection::new(&self.intrinsics, self.reach, camera_from_points);
        let (width, height) = (self.intrinsics.width as i32, self.intrinsics.height as i32);
        for point in points {
            let Some((u, v, depth)) = projection.pixel_and_depth(point) else {
                continue;
            };
            if self.reach == 0 {
                if u >= 0 && v >= 0 && u < width && v < height {
                    self.put((v * width + u) as u32, depth, point.intensity);
                }
                continue;
            }
            let rows = (v - self.reach).max(0)..(v + self.reach + 1).min(height);
            for row in rows {
                let columns = (u - self.reach).max(0)..(u + self.reach + 1).min(width);
                for column in columns {
                    self.put((row * width + column) as u32, depth, point.intensity);
                }
            }
        }
        &self.pixels
    }

    /// As [`Self::splat`], as a view of its own.
    pub fn view(&mut self, points: &[ColoredPoint], camera_from_points: &Pose) -> SyntheticView {
        SyntheticView {
            width: self.intrinsics.width,
            height: self.intrinsics.height,
            pixels: self.splat(points, camera_from_points).to_vec(),
        }
    }

    #[inline]
    fn put(&mut self, index: u32, depth: f32, intensity: f32) {
        let splat = SplattedPixel { index, depth, intensity };
        let slot = &mut self.slots[index as usize];
        if *slot == EMPTY {
            *slot = self.pixels.len() as u32;
            self.pixels.push(splat);
        } else {
            let visible = &mut self.pixels[*slot as usize];
            if depth < visible.depth {
                *visible = splat;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::small_camera;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn point(x: f32, y: f32, z: f32, intensity: f32) -> ColoredPoint {
        ColoredPoint { position: Point3::new(x, y, z), intensity }
    }

    #[test]
    fn the_nearest_point_wins_and_the_first_of_two_equals() {
        let points = [
            point(0.0, 0.0, 5.0, 1.0),
            point(0.0, 0.0, 2.0, 2.0),
            point(0.0, 0.0, 2.0, 3.0),
            point(0.0, 0.0, 9.0, 4.0),
        ];
        let mut rasterizer = Rasterizer::new(&small_camera(), 1);
        let pixels = rasterizer.splat(&points, &Pose::identity());
        let expected = SplattedPixel { index: 3 * 9 + 4, depth: 2.0, intensity: 2.0 };
        assert_eq!(pixels, [expected]);
    }

    #[test]
    fn half_a_pixel_belongs_to_the_next_pixel_centre() {
        let mut rasterizer = Rasterizer::new(&small_camera(), 1);
        let at = |x: f32| point(x, 0.0, 1.0, 9.0);
        let pixels = rasterizer.splat(&[at(0.0499), at(0.0501)], &Pose::identity());
        let columns: Vec<_> = pixels.iter().map(|p| p.index % 9).collect();
        assert_eq!(columns, [4, 5]);
    }

    #[test]
    fn a_point_without_a_depth_holds_no_pixel() {
        let mut rasterizer = Rasterizer::new(&small_camera(), 1);
        let points = [point(f32::NAN, f32::NAN, f32::NAN, 1.0), point(-0.8, -0.6, 2.0, 2.0)];
        let pixels = rasterizer.splat(&points, &Pose::identity());
        assert_eq!(pixels.len(), 1);
        assert_eq!(pixels[0].intensity, 2.0);
    }

    #[test]
    fn squares_are_cut_at_the_border() {
        let mut rasterizer = Rasterizer::new(&small_camera(), 3);
        let corner = point(-0.4, -0.3, 1.0, 7.0);
        assert_eq!(rasterizer.splat(&[corner], &Pose::identity()).len(), 4);
        let just_outside = point(-0.5, 0.0, 1.0, 7.0);
        assert_eq!(rasterizer.splat(&[just_outside], &Pose::identity()).len(), 3);
    }

    #[test]
    fn moving_the_camera_forward_and_looking_back_sees_nothing() {
        let mut rasterizer = Rasterizer::new(&small_camera(), 1);
        let points = [point(0.0, 0.0, 2.0, 1.0)];
        let beyond = Pose::translation(0.0, 0.0, 3.0).inverse();
        assert!(rasterizer.splat(&points, &beyond).is_empty());
        assert_eq!(rasterizer.splat(&points, &Pose::identity()).len(), 1);
    }

    proptest! {
        #[test]
        fn a_reused_rasterizer_draws_as_a_new_one(
            xs in prop::collection::vec((-2.0_f32..2.0, -2.0_f32..2.0, -1.0_f32..6.0), 0..60),
            shift in -1.0_f64..1.0,
        ) {
            let points: Vec<_> = xs.iter().map(|&(x, y, z)| point(x, y, z, x + y)).collect();
            let moved = Pose::translation(shift, 0.0, 0.0);
            let mut used = Rasterizer::new(&small_camera(), 3);
            used.splat(&points, &Pose::identity());
            let again = used.splat(&points, &moved).to_vec();
            let fresh = Rasterizer::new(&small_camera(), 3).splat(&points, &moved).to_vec();
            prop_assert_eq!(again, fresh);
        }
    }
}
