//! Lens distortion, removed when a photo is read: everything else assumes pinhole cameras.

use std::sync::Arc;

use nalgebra::Point2;
use rayon::prelude::*;

use super::file_scene::Develop;
use crate::camera::Intrinsics;
use crate::image::{GrayImage, Photo, RgbImage, cubic_interpolated};

/// The first four coefficients of the Brown–Conrady model, in the order of OpenCV and COLMAP. Zeros are a
/// pinhole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Distortion {
    /// Radial, of r².
    pub k1: f64,
    /// Radial, of r⁴.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
}

impl Distortion {
    /// The distorted image of a direction (x/z, y/z), in the same normalised coordinates.
    fn distorted(&self, at: Point2<f64>) -> Point2<f64> {
        let Self { k1, k2, p1, p2 } = *self;
        let (x, y) = (at.x, at.y);
        let square = x * x + y * y;
        let radial = 1.0 + square * (k1 + square * k2);
        Point2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// Whether the distortion is monotonic up to a radius. Where it is not, the polynomial folds the image.
    fn is_sound_within(&self, radius: f64) -> bool {
        let slope = |r: f64| 1.0 + r * r * (3.0 * self.k1 + 5.0 * r * r * self.k2);
        (0..=64).all(|i| slope(radius * f64::from(i) / 64.0) > 0.0)
    }
}

/// A camera with distortion, and the pinhole camera of its undistorted photos.
#[derive(Clone, Debug)]
pub(super) struct Lens {
    source: Intrinsics,
    distortion: Distortion,
    pinhole: Intrinsics,
}

impl Lens {
    /// The greatest magnification of a photo to avoid a blank border.
    const MAX_ZOOM: f64 = 2.0;

    /// The pinhole camera has the photo's size and principal point. Its focal length is that of the photo, or a greater
    /// one to avoid a blank border, which would be an edge that the world does not have.
    ///
    /// # Errors
    /// Why the coefficients are invalid.
    pub fn new(source: Intrinsics, distortion: Distortion) -> Result<Self, String> {
        let with_zoom = |zoom: f64| Self {
            source,
            distortion,
            pinhole: Intrinsics { fx: source.fx * zoom, fy: source.fy * zoom, ..source },
        };
        let (mut blank, mut full) = (1.0, Self::MAX_ZOOM);
        let widest = with_zoom(full);
        if !widest.has_no_blank() {
            return Err(format!("a distortion that can be removed expected, {distortion:?} found"));
        }
        if with_zoom(blank).has_no_blank() {
            return Ok(with_zoom(blank));
        }
        // Accurate to a hundredth of a pixel at the border.
        while full - blank > 1e-6 {
            let middle = f64::midpoint(blank, full);
            if with_zoom(middle).has_no_blank() {
                full = middle;
            } else {
                blank = middle;
            }
        }
        Ok(with_zoom(full))
    }

    /// The pixel of the original photo for one of the undistorted photo.
    fn source_pixel(&self, pixel: Point2<f64>) -> Point2<f64> {
        let direction = self.pinhole.unproject(&pixel, 1.0);
        let seen = self.distortion.distorted(direction.xy());
        let source = &self.source;
        Point2::new(source.fx * seen.x + source.cx, source.fy * seen.y + source.cy)
    }

    /// Whether every pixel of the undistorted photo is inside the original photo. Testing the border is enough.
    fn has_no_blank(&self) -> bool {
        let Intrinsics { width, height, .. } = self.source;
        let (right, bottom) = (f64::from(width) - 1.0, f64::from(height) - 1.0);
        let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
        let slant = |(x, y)| {
            let ray = self.pinhole.unproject(&Point2::new(x, y), 1.0);
            ray.xy().coords.norm()
        };
        let radius = corners.map(slant).into_iter().fold(0.0, f64::max);
        let steps = |last: f64| (0..=256).map(move |i| last * f64::from(i) / 256.0);
        let horizontal = steps(right).flat_map(|x| [(x, 0.0), (x, bottom)]);
        let vertical = steps(bottom).flat_map(|y| [(0.0, y), (right, y)]);
        self.distortion.is_sound_within(radius)
            && horizontal.chain(vertical).all(|(x, y)| {
                let pixel = self.source_pixel(Point2::new(x, y));
                self.source.contains(&pixel)
            })
    }

    fn resampled(&self, image: &GrayImage) -> GrayImage {
        let (width, height) = image.dimensions();
        let mut values = vec![0; width as usize * height as usize];
        let rows = values.par_chunks_mut(width.max(1) as usize);
        rows.enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let pixel = self.source_pixel(Point2::new(x as f64, y as f64));
                let gray = cubic_interpolated(image, pixel.x as f32, pixel.y as f32);
                *value = gray.round() as u8;
            }
        });
        GrayImage::from_raw(width, height, values).unwrap_or_default()
    }
}

impl Develop for Lens {
    /// The undistorted photo, by cubic convolution.
    fn developed(&self, image: Photo) -> Photo {
        match &image.color {
            Some(color) => {
                let channel = |c: usize| {
                    let values = color.pixels().map(|pixel| pixel.0[c]).collect();
                    GrayImage::from_raw(color.width(), color.height(), values)
                };
                let channels =
                    [0, 1, 2].map(|c| self.resampled(&channel(c).unwrap_or_default()).into_raw());
                let [red, green, blue] = &channels;
                let values = red.iter().zip(green).zip(blue);
                let values = values.flat_map(|((r, g), b)| [*r, *g, *b]).collect();
                let color = RgbImage::from_raw(color.width(), color.height(), values);
                Photo::from_color(color.unwrap_or_default())
            }
            None => Photo::from_gray(self.resampled(&image.gray)),
        }
    }
}

/// The camera `fx fy cx cy` \[px\] of photos of a size, with pixel centres at integers.
pub(super) fn pinhole(
    [fx, fy, cx, cy]: [f64; 4],
    (width, height): (u32, u32),
) -> Result<Intrinsics, String> {
    let is_length = |length: f64| length.is_finite() && length > 0.0;
    if !is_length(fx) || !is_length(fy) || !(cx + cy).is_finite() {
        return Err(format!(
            "positive focal lengths fx, fy and a centre cx, cy expected, {fx} {fy} {cx} {cy} found"
        ));
    }
    Ok(Intrinsics { fx, fy, cx, cy, width, height })
}

/// The camera of undistorted photos, and what undistorts them; `None` without distortion.
pub(super) fn developed_camera(
    taken: Intrinsics,
    distortion: Distortion,
) -> Result<(Intrinsics, Option<Arc<dyn Develop>>), String> {
    if distortion == Distortion::default() {
        return Ok((taken, None));
    }
    let lens = Lens::new(taken, distortion)?;
    Ok((lens.pinhole, Some(Arc::new(lens))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Luma, Rgb};
    use nalgebra::Point3;

    const CAMERA: Intrinsics =
        Intrinsics { fx: 200.0, fy: 210.0, cx: 158.0, cy: 121.5, width: 320, height: 240 };

    fn distortion(k1: f64, k2: f64, p1: f64, p2: f64) -> Distortion {
        Distortion { k1, k2, p1, p2 }
    }

    /// A photo with distortion of a plane at depth 1 whose grey value is a smooth function.
    fn taken(lens: &Lens, value: impl Fn(Point2<f64>) -> f64) -> GrayImage {
        GrayImage::from_fn(CAMERA.width, CAMERA.height, |x, y| {
            let seen = CAMERA.unproject(&Point2::new(f64::from(x), f64::from(y)), 1.0).xy();
            // The direction that is seen there, by fixed-point iteration.
            let mut at = seen;
            for _ in 0..50 {
                at += seen - lens.distortion.distorted(at);
            }
            Luma([value(at).round() as u8])
        })
    }

    #[test]
    fn an_undistorted_photo_is_what_the_pinhole_sees() {
        let value = |at: Point2<f64>| 128.0 + 60.0 * (9.0 * at.x).sin() + 50.0 * (7.0 * at.y).cos();
        for coefficients in
            [distortion(-0.2, 0.03, 0.0, 0.0), distortion(0.15, 0.02, 0.001, -0.002)]
        {
            let lens = Lens::new(CAMERA, coefficients).expect("can be undistorted");
            let photo = lens.developed(Photo::from_gray(taken(&lens, value)));
            let pinhole = lens.pinhole;
            for (x, y, gray) in photo.gray.enumerate_pixels() {
                let at = pinhole.unproject(&Point2::new(f64::from(x), f64::from(y)), 1.0);
                let expected = value(at.xy());
                let found = f64::from(gray.0[0]);
                assert!((found - expected).abs() < 3.0, "{x} {y}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_pincushion_is_magnified_until_nothing_is_blank_and_a_barrel_is_not() {
        let barrel = Lens::new(CAMERA, distortion(-0.1, 0.0, 0.0, 0.0)).expect("sound");
        assert_eq!(barrel.pinhole, CAMERA);
        let cushion = Lens::new(CAMERA, distortion(0.1, 0.0, 0.0, 0.0)).expect("sound");
        assert!(cushion.pinhole.fx > 1.02 * CAMERA.fx);
        let corner = cushion.source_pixel(Point2::new(319.0, 239.0));
        assert!(CAMERA.contains(&corner), "{corner}");
        let ratio = cushion.pinhole.fy / cushion.pinhole.fx;
        assert!((ratio - CAMERA.fy / CAMERA.fx).abs() < 1e-12);
        // A point of the world is seen in the middle of what was magnified about the centre.
        let ahead = cushion.pinhole.project(&Point3::new(0.0, 0.0, 5.0));
        assert_eq!(ahead, Some(Point2::new(CAMERA.cx, CAMERA.cy)));
    }

    #[test]
    fn a_lens_that_folds_its_image_is_refused() {
        let folding = Lens::new(CAMERA, distortion(-30.0, 0.0, 0.0, 0.0));
        assert!(folding.is_err());
        assert!(Lens::new(CAMERA, distortion(f64::NAN, 0.0, 0.0, 0.0)).is_err());
    }

    #[test]
    fn colours_stay_together() {
        let lens = Lens::new(CAMERA, Distortion::default()).expect("a pinhole");
        let color = RgbImage::from_fn(320, 240, |x, y| Rgb([x as u8, y as u8, 77]));
        let photo = lens.developed(Photo::from_color(color.clone()));
        assert_eq!(photo.color, Some(color));
    }
}
